"""Modes that no cluster shows are found in what a fit leaves, and nothing is found in noise."""

from __future__ import annotations

import numpy as np
import pytest
import scipy

from identify.modal.analysis import analyse
from identify.modal.bands import _whole
from identify.modal.growth import _by_chance, _gains, _is_better, missing
from identify.modal.layout import arrange
from identify.modal.refine import FULL, Equations, Fit, fit, minimise
from identify.modal.selection import Candidate
from identify.modal.settings import ModalSettings
from identify.modal.state import State
from identify.modal.weights import CHANCE, reweighted
from tests.benchmarks.modal_exam import examine
from tests.benchmarks.modal_structures import draw
from tests.modal.systems import System, chain, measure

LINES = np.arange(5.0, 80.0, 0.1)
PAIR = chain([12.0, 30.0, 30.3, 50.0, 64.0], [0.02, 0.015, 0.015, 0.01, 0.02], seed=3)
"""The second and the third mode are a third of a half-power bandwidth apart."""
FEW = ModalSettings(max_order=9)
NOBODY = np.zeros(0, dtype=complex)
CANDIDATE = Candidate(PAIR.poles[0], np.ones(1), np.ones(5), 0.0, 0.0, 1.0, 1.0, 1.0, 0.0)


def fitted(system: System, without: list[int], barred: bool = False) -> Fit:
    """The true modes but some, fitted to FRFs with one reference and a hundredth of noise."""
    layout = arrange(measure(system, LINES, [0], noise=0.01), ModalSettings())
    poles = np.delete(system.poles, without)
    one = np.ones((len(poles), 1), dtype=complex)
    start = fit(Equations.of(layout, ("lower", "upper")), poles, one, np.full(len(poles), not barred))
    for _ in range(2):
        start = fit(reweighted(start), start.poles, start.participation, start.free)
        start = minimise(start, *FULL)
    return start


@pytest.mark.parametrize("gone", [1, 3], ids=["beside another", "alone"])
def test_a_mode_that_a_fit_lacks_is_seen(gone: int) -> None:
    found = missing(fitted(PAIR, [gone]), NOBODY, 4)
    truth = PAIR.poles[gone]
    assert len(found.poles) >= 1
    assert abs(found.poles[0] - truth) < -2 * truth.real


def test_a_fit_that_lacks_nothing_is_left() -> None:
    assert len(missing(fitted(PAIR, []), NOBODY, 4).poles) == 0


def test_chance_is_what_noise_alone_explains() -> None:
    """Of noise a pole explains a sum of squares over its residues: chi-squared, two for each response."""
    start = fitted(PAIR, [])
    band = 2 * np.pi * np.linspace(15, 75, 300)
    places = -2.0 + 1j * band[np.min(np.abs(band[:, None] - PAIR.poles.imag), axis=1) > 20]
    gain = _gains(start, places)[0]
    freedom = 2 * start.residual.shape[1]
    share = scipy.special.chdtri(freedom, CHANCE) / freedom
    assert np.mean(_by_chance(start, places) / np.mean(gain)) == pytest.approx(share, rel=0.15)
    # What noise explains at one place in ten, it does at one in ten of these.
    often = _by_chance(start, places) * scipy.special.chdtri(freedom, 0.1) / (share * freedom)
    assert 0.05 < np.mean(gain > often) < 0.16


def test_a_place_that_is_barred_is_left() -> None:
    start = fitted(PAIR, [3])
    barred = missing(start, PAIR.poles[3:4], 4).poles
    assert np.all(np.abs(barred - PAIR.poles[3]) > -PAIR.poles[3].real)


def test_modes_that_low_orders_merge_are_found_apart() -> None:
    data = measure(PAIR, LINES, [0], noise=0.003)
    truth = np.abs(PAIR.poles) / (2 * np.pi)
    assert len(_whole(arrange(data, FEW), FEW.model_copy(update={"refine": False})).verified.modes) < 5
    found = analyse(data, FEW).table
    assert found.frequency_hz == pytest.approx(truth, rel=3e-3)
    assert found.frequency_std_hz is not None
    assert np.all(np.abs(found.frequency_hz - truth) < 3.5 * found.frequency_std_hz)


def test_what_was_dropped_by_hand_does_not_come_back() -> None:
    data = measure(PAIR, LINES, [0], noise=0.003)
    found = analyse(data, ModalSettings(drop_hz=(50.0,))).table.frequency_hz
    assert np.min(np.abs(found - 50.0)) > 0.5
    assert np.min(np.abs(analyse(data).table.frequency_hz - 50.0)) < 0.05


def test_a_round_that_loses_a_mode_for_two_others_is_not_taken() -> None:
    """One more than before, and most of the FRFs is no longer explained."""
    whole = fitted(PAIR, [])
    poles = np.append(np.delete(PAIR.poles, 3), 2j * np.pi * np.array([20.0, 70.0]) - 1.0)
    one = np.ones((len(poles), 1), dtype=complex)
    exchanged = fit(whole.equations, poles, one, np.ones(len(poles), dtype=bool))
    before, after = (State(one, [CANDIDATE] * len(one.poles), []) for one in (whole, exchanged))
    assert len(after.modes) > len(before.modes)
    assert not _is_better(after, before)
    lacking = fitted(PAIR, [3])
    assert _is_better(before, State(lacking, [CANDIDATE] * len(lacking.poles), []))


def test_places_wider_than_asked_are_left() -> None:
    start = fitted(PAIR, [3])
    half = -PAIR.poles[3].real
    assert len(missing(start, NOBODY, 4, widest=3 * half).poles) >= 1
    assert np.all(-missing(start, NOBODY, 4, widest=half / 2).poles.real < half / 2)
    assert np.any(-missing(start, NOBODY, 4).poles.real > half / 2)


@pytest.mark.parametrize("number", [5, 8], ids=["overlapping", "three at one frequency"])
def test_every_mode_of_a_crowded_band_is_found(number: int) -> None:
    structure = draw(np.random.default_rng([4711, number]))
    run = examine(structure, number, 0.001, seed=4711000 + number)
    assert len(run.modes) >= 35
    assert all(mode.found for mode in run.modes)
    assert len(run.spurious_hz) == 0
    clusters = ModalSettings(refine=False)
    assert len(analyse(structure.measured(0.001, 4711000 + number), clusters).table) < len(run.modes) - 2


def test_a_flank_of_a_mode_beyond_the_band_is_no_mode() -> None:
    structure = draw(np.random.default_rng([4712, 19]))
    found = analyse(structure.measured(0.01, 4712019))
    flanks = [c.frequency_hz for c in found.rejected if c.reason.startswith("only a flank")]
    assert len(flanks) >= 1
    assert np.max(np.abs(np.array(flanks) - found.layout.frequency_hz[0])) < 1
    assert found.table.frequency_hz[0] == pytest.approx(6.464, abs=0.01)

"""Intervals, what the data do not determine, warnings, profile likelihood: against known answers and many
noise seeds.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from identify.core.parameters import Parameter, Scale
from identify.fitting.optimizers.base import Search, parse_optimizer
from identify.fitting.uncertainty import inseparable
from identify.measured.modal_tables import ModalTable
from identify.vibration.costs.base import parse_cost
from identify.vibration.costs.make_target import Targets
from identify.vibration.evaluate import _open
from identify.vibration.uncertainty import gap, score_variance, uncertainty
from tests.arms import initial
from tests.benchmarks.coverage import Repeated, covered, study
from tests.targets import targets


def _fitted(data: Targets, parameters: list[Parameter]) -> tuple[Scale, np.ndarray]:
    scale = Scale(tuple(parameters))
    search = Search(parse_cost("frf-least-squares").objective(data), scale, 200)
    parse_optimizer("gauss-newton").minimize(
        search, scale.to_x(initial(parameters) * 1.02), np.random.default_rng(0)
    )
    assert search.best_x is not None
    return scale, scale.to_values(search.best_x)


def test_independent_noise_gives_the_textbook_standard_deviation(tmp_path: Path) -> None:
    """White noise alone: what is stated agrees with the inverse of J'J, and with the scatter over noise
    seeds.
    """
    found, stated = [], []
    for seed in range(12):
        data, parameters = targets(tmp_path, noise=0.02)
        frf = data.frf[0]
        assert frf.noise is not None
        rng = np.random.default_rng([seed, 1])
        clean = frf.predict(initial(parameters))
        noisy = clean + frf.noise * (rng.normal(size=clean.shape) + 1j * rng.normal(size=clean.shape))
        data = Targets(frf=(replace(frf, data=replace(frf.data, frf=noisy)),))
        scale, values = _fitted(data, parameters)
        trusted = uncertainty(data, scale, values)
        found.append(np.log(values / initial(parameters)))
        stated.append(trusted.std)
        assert trusted.std == pytest.approx(trusted.independent_std, rel=0.35)
    scatter = np.sqrt(np.mean(np.square(found), axis=0)) / np.mean(stated, axis=0)
    assert scatter.mean() == pytest.approx(1.0, abs=0.2)


def test_noise_common_to_all_responses_widens_the_intervals(tmp_path: Path) -> None:
    """A force that reads wrong by a little at every line moves all responses together: independence would be
    far too sure.
    """
    data, parameters = targets(tmp_path, noise=0.02)
    frf = data.frf[0]
    rng = np.random.default_rng(3)
    common = 1 + 0.03 * (rng.normal(size=(60, 1, 3)) + 1j * rng.normal(size=(60, 1, 3)))
    shaken = Targets(frf=(replace(frf, data=replace(frf.data, frf=frf.data.frf * common)),))
    scale, values = _fitted(shaken, parameters)
    trusted = uncertainty(shaken, scale, values)
    assert np.median(trusted.std / trusted.independent_std) > 1.5


@pytest.mark.parametrize("askew", [True, False])
def test_a_hammer_held_askew_widens_the_intervals(tmp_path: Path, askew: bool) -> None:
    """Two postures struck along three axes; what a force leaks into the others is the same at every line, so
    that residuals of neighbouring lines say nothing of it, but the forces disagree.
    """
    found, stated, without = list[np.ndarray](), list[np.ndarray](), list[np.ndarray]()
    _, parameters = targets(tmp_path)
    for seed in range(10):
        rng, struck = np.random.default_rng([seed, 2]), []
        for posture in (1, 2):
            frf = targets(tmp_path, noise=0.02, seed=posture)[0].frf[0]
            assert frf.noise is not None
            leaks = np.eye(3) + 0.01 * askew * rng.normal(size=(3, 3))
            noise = frf.noise * (rng.normal(size=frf.noise.shape) + 1j * rng.normal(size=frf.noise.shape))
            h = frf.predict(initial(parameters)) @ leaks + noise
            struck.append(replace(frf, data=replace(frf.data, frf=h)))
        together = Targets(frf=tuple(struck))
        scale, values = _fitted(together, parameters)
        found.append(np.log(values / initial(parameters)))
        stated.append(uncertainty(together, scale, values).std)
        without.append(uncertainty(together, scale, values, disagreement=False).std)
    off = np.abs(found)
    assert 0.9 < np.mean(off < 1.96 * np.array(stated)) <= 1.0
    assert (np.mean(off < 1.96 * np.array(without)) < 0.85) == askew, "neighbouring lines do not show it"
    assert np.mean(np.array(stated) / np.array(without)) < (4.0 if askew else 2.0)


def test_score_variance_of_white_noise_is_the_information() -> None:
    rng = np.random.default_rng(0)

    def draw(*shape: int) -> np.ndarray:
        return rng.normal(size=shape) + 1j * rng.normal(size=shape)

    j, h = draw(400, 5, 3), draw(400, 5)
    information = np.einsum("lof,log->fg", np.conj(j), j).real
    assert score_variance(draw(400, 5), j, h) == pytest.approx(
        information, rel=0.25, abs=0.1 * information.max()
    )
    assert score_variance(3 * draw(400, 5), j, h) == pytest.approx(
        9 * information, rel=0.25, abs=0.9 * information.max()
    )


def test_what_the_data_cannot_tell_apart_is_named(tmp_path: Path) -> None:
    """Two modes are four numbers for twelve parameters: none of them is known on its own; all modes and FRFs
    determine every one.
    """
    data, parameters = targets(tmp_path)
    modal = data.modal[0]
    table = ModalTable(modal.data.frequency_hz[:2], modal.data.damping_ratio[:2])
    two = Targets(modal=(replace(modal, data=table),))
    scale = Scale(tuple(parameters))
    trusted = uncertainty(two, scale, initial(parameters))
    names = [parameter.name for parameter in parameters]
    assert trusted.count == 4
    lost = {name for group in inseparable(trusted, names) for name in group}
    unknown = {name for name, status in zip(names, trusted.status, strict=True) if status == "not determined"}
    assert unknown == lost == set(names)
    everything = uncertainty(data, scale, initial(parameters))
    assert everything.status == ("determined",) * 12
    assert inseparable(everything, names) == []


def test_intervals_stay_within_bounds(tmp_path: Path) -> None:
    data, parameters = targets(tmp_path)
    narrow = [replace(p, lower=p.initial * 0.9999, upper=p.initial * 1.0001) for p in parameters]
    trusted = uncertainty(Targets(modal=data.modal[:1]), Scale(tuple(narrow)), initial(parameters))
    assert np.all(trusted.low >= initial(parameters) * 0.99989)
    assert np.all(trusted.high <= initial(parameters) * 1.00011)


def test_gap_is_nan_where_noise_is_not_known(tmp_path: Path) -> None:
    data, parameters = targets(tmp_path)
    assert np.isnan(gap(Targets(frf=(replace(data.frf[0], noise=None),)), initial(parameters)))
    assert np.isnan(gap(Targets(), initial(parameters)))
    assert gap(Targets(frf=data.frf), initial(parameters)) == pytest.approx(0.0, abs=1e-6)


def test_a_wrong_model_is_said_to_be_structured_and_noise_is_not(tmp_path: Path) -> None:
    data, parameters = targets(tmp_path, noise=0.01)
    frf = data.frf[0]
    late = frf.data.frf * np.exp(-2j * np.pi * frf.data.frequency_hz * 1e-3)[:, None, None]
    delayed = Targets(frf=(replace(frf, data=replace(frf.data, frf=late)),))
    scale, values = _fitted(delayed, parameters)
    assert any("structured" in note for note in uncertainty(delayed, scale, values).notes)
    scale, values = _fitted(Targets(frf=data.frf), parameters)
    assert uncertainty(Targets(frf=data.frf), scale, values).notes == ()
    assert frf.noise is not None
    optimistic = Targets(frf=(replace(frf, noise=frf.noise / 3),))
    notes = uncertainty(optimistic, scale, values).notes
    assert any("without structure" in note for note in notes)


@pytest.mark.parametrize("seeds", [6, pytest.param(24, marks=pytest.mark.exam)])
def test_coverage_on_independent_hammer_tests(seeds: int, tmp_path: Path) -> None:
    """A short version of tests/benchmarks/coverage.py, whose 200 seeds are in the README."""
    test = Repeated(seed=3, postures=1, oversampling=8)
    found = covered(test, study(test, tmp_path), seeds)
    assert 0.88 <= found.hits.mean() <= 1.0
    scatter = np.log(found.ratios).std(axis=0)
    assert 0.7 < np.median(found.stated.mean(axis=0) / scatter) < 1.5


def test_a_sentence_names_few_open_directions_and_counts_many() -> None:
    groups = ["a, b", "b, c", "d", "e, a"]
    assert _open([]) == ""
    assert _open(groups[:3]) == " Not determined, alone or in combination: a, b; b, c; d."
    many = _open(groups)
    assert (
        many.startswith(" 4 combinations of 5 parameters are not determined")
        and "the least determined last" in many
    )

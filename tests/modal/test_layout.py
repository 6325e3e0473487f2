"""Which side the references are, what is dropped, and what is refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pydantic import ValidationError

from identify.core.errors import InputError
from identify.measured.channel import Channel
from identify.measured.frf_set import FrfSet
from identify.modal.layout import arrange
from identify.modal.settings import ModalSettings
from tests.modal.systems import chain, measure

FREQUENCY = np.arange(0, 81) * 0.5
DATA = measure(chain([10.0, 20.0, 30.0], [0.02] * 3), FREQUENCY, [0, 1])


def test_a_roving_hammer_is_transposed_and_fixed_inputs_are_not() -> None:
    fixed = arrange(DATA, ModalSettings())
    roving = FrfSet(FREQUENCY, DATA.frf.transpose(0, 2, 1), DATA.inputs, DATA.outputs, "accelerance")
    other = arrange(roving, ModalSettings())
    assert (fixed.transposed, other.transposed) == (False, True)
    np.testing.assert_array_equal(fixed.frf, other.frf)
    assert fixed.responses == other.responses
    assert fixed.references == other.references


def test_zero_hertz_and_lines_out_of_the_band_are_left_out() -> None:
    assert arrange(DATA, ModalSettings()).frequency_hz[0] == 0.5
    band = arrange(DATA, ModalSettings(band_hz=(5, 20))).frequency_hz
    assert (band[0], band[-1]) == (5, 20)


def test_named_references_on_either_side() -> None:
    assert arrange(DATA, ModalSettings(references=("2:+Z",))).frf.shape[1:] == (3, 1)
    assert arrange(DATA, ModalSettings(references=("3:+Z",))).frf.shape[1:] == (2, 1)
    with pytest.raises(InputError, match="neither all inputs nor all outputs"):
        arrange(DATA, ModalSettings(references=("9:+Z",)))


def test_one_direction_of_the_responses() -> None:
    turned = replace(DATA, outputs=(Channel(1, 1), Channel(1, -2), Channel(2, 2)))
    assert arrange(turned, ModalSettings(direction="Y")).responses == (Channel(1, -2), Channel(2, 2))
    with pytest.raises(InputError, match="no response channel"):
        arrange(turned, ModalSettings(direction="Z"))


def test_pairs_that_were_not_measured() -> None:
    frf = DATA.frf.copy()
    frf[:, 1, 0] = np.nan
    frf[:, 2, :] = np.nan
    frf[1, 0, 0] = np.nan
    layout = arrange(replace(DATA, frf=frf), ModalSettings(band_hz=(0.6, 40)))
    assert layout.responses == DATA.outputs[:2]
    assert layout.complete.tolist() == [True, False]
    frf[:, 0, 1] = np.nan
    with pytest.raises(InputError, match="no response was measured against every reference"):
        arrange(replace(DATA, frf=frf), ModalSettings())


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"frequency_hz": np.where(FREQUENCY > 20, FREQUENCY + 5, FREQUENCY)}, "not evenly spaced near 20"),
        (
            {"frequency_hz": np.linspace(2, 7, len(FREQUENCY)) ** 2},
            "lines that are not evenly spaced: .* Hz apart; .* a fit of a robot takes any lines",
        ),
        ({"frf": np.zeros_like(DATA.frf)}, "every FRF is zero"),
        ({"frf": np.full_like(DATA.frf, np.nan)}, "finite frequency lines|no response"),
    ],
)
def test_sets_that_cannot_be_analysed(change: dict[str, np.ndarray], message: str) -> None:
    with pytest.raises(InputError, match=message):
        arrange(replace(DATA, **change), ModalSettings())


@pytest.mark.parametrize(("band", "message"), [((50.0, 60.0), "no line of"), ((5.0, 6.0), "at least 16")])
def test_bands_without_enough_lines(band: tuple[float, float], message: str) -> None:
    with pytest.raises(InputError, match=message):
        arrange(DATA, ModalSettings(band_hz=band))


@pytest.mark.parametrize(
    "wrong",
    [
        {"colour": 1},
        {"band_hz": (20, 10)},
        {"max_order": 3, "min_order": 4},
        {"estimator": "best"},
        {"min_mpc": 2},
    ],
)
def test_settings_refuse_what_they_do_not_know(wrong: dict[str, object]) -> None:
    with pytest.raises(ValidationError):
        ModalSettings(**wrong)

"""Normalised responses from a rotating force: against closed forms of a system whose motion is integrated in
time.
"""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError
from scipy.signal import lsim

from identify.core.arrays import Complex
from identify.core.errors import InputError
from identify.measured.channel import Channel
from identify.measured.chirp import Chirp, frf_from_chirp
from identify.measured.frf_set import FrfSet
from identify.measured.source import Estimation
from identify.measured.time_history import TimeHistory

RATE, SECONDS = 1024.0, 8.0
MASS = np.array([[20.0, 2.0], [2.0, 15.0]])
STIFFNESS = np.array([[20.0, 4.0], [4.0, 40.0]]) * 1e4
DAMPING = 0.001 * STIFFNESS
SPINDLE = 6.0
SETTINGS: dict[str, Any] = {
    "angle": "14:+RZ",
    "acts_at": ["14:+X", "14:+Y"],
    "offset_kg": 0.2,
    "radius_m": 0.02,
    "load_cell": ["13:+X", "13:+Y"],
    "accelerometer": ["12:+X", "12:+Y"],
    "spindle_kg": SPINDLE,
}
CHANNELS = tuple(Channel.parse(text) for text in ("14:+RZ", "13:+X", "13:+Y", "12:+X", "12:+Y"))


def _record(error: float = 0.0) -> TimeHistory:
    """A sweep to 40 Hz in 4 s and down again; error is what the load cell adds to its readings, relative."""
    time = np.arange(0, SECONDS, 1 / RATE)
    speed = 2 * np.pi * 40.0 * np.interp(time, [0, 4, 6, SECONDS], [0, 1, 0, 0])
    angle = np.concatenate([[0.0], np.cumsum((speed[1:] + speed[:-1]) / 2 / RATE)])
    force = 0.2 * 0.02 * speed[:, None] ** 2 * np.column_stack([np.sin(angle), -np.cos(angle)])
    inverse = np.linalg.inv(MASS)
    a = np.block([[np.zeros((2, 2)), np.eye(2)], [-inverse @ STIFFNESS, -inverse @ DAMPING]])
    b = np.vstack([np.zeros((2, 2)), inverse])
    c, d = a[2:], inverse
    _, acceleration, _ = lsim((a, b, c, d), force, time)
    felt = (1 + error) * (force - SPINDLE * acceleration)
    data = np.column_stack([angle, felt, acceleration])[None]
    return TimeHistory(RATE, data, CHANNELS, ("rad", "N", "N", "m/s^2", "m/s^2"), "made")


def _expected(frequency_hz: np.ndarray) -> Complex:
    """X/A = H_xx - j H_xy and Y/A = H_yx - j H_yy, receptances."""
    s = 2j * np.pi * frequency_hz[:, None, None]
    return np.asarray(np.linalg.inv(STIFFNESS + s * DAMPING + s**2 * MASS) @ np.array([1.0, -1.0j]))


def _band(found: FrfSet) -> FrfSet:
    return found.band(6.0, 37.0)


def _worst(found: FrfSet) -> float:
    band = _band(found)
    expected = _expected(band.frequency_hz)
    return float(np.abs(band.frf[:, :, 0] - expected).max() / np.abs(expected).max())


@pytest.mark.parametrize("force", ["formula", "load-cell", "blend"])
def test_the_normalised_response_is_the_combination_of_direct_and_cross_frfs(force: str) -> None:
    found = frf_from_chirp(_record(), Chirp(**SETTINGS, force=force))
    assert found.quantity == "receptance"
    assert found.simultaneous_inputs == (1, -1j)
    assert [str(channel) for channel in found.outputs + found.inputs] == ["12:+X", "12:+Y", "14:+X", "14:+Y"]
    assert np.isnan(found.frf[:, :, 1]).all() and list(found.measured[0]) == [True, False]
    assert _worst(found) < 0.02


def test_it_is_not_the_direct_frf_alone() -> None:
    """The printed Eq. 2 has H_yy where H_xy belongs: that would not do."""
    band = _band(frf_from_chirp(_record(), Chirp(**SETTINGS)))
    s = 2j * np.pi * band.frequency_hz[:, None, None]
    h = np.linalg.inv(STIFFNESS + s * DAMPING + s**2 * MASS)
    printed = h[:, 0, 0] - 1j * h[:, 1, 1]
    assert np.abs(band.frf[:, 0, 0] - printed).max() > 0.2 * np.abs(printed).max()


def test_a_wrong_load_cell_shows_only_above_the_seam() -> None:
    right, wrong = (
        _band(frf_from_chirp(_record(error), Chirp(**SETTINGS, force="blend", blend_hz=20.0)))
        for error in (0.0, 0.1)
    )
    change = np.abs(wrong.frf[:, 0, 0] / right.frf[:, 0, 0] - 1)
    below = right.frequency_hz < 20.0
    assert change[below].max() < 1e-12
    assert change[~below].max() > 0.02


def _remounted(turn_deg: float, mirrored: bool = False) -> TimeHistory:
    """The same sweep with the load cell mounted otherwise."""
    record, turn = _record(), np.radians(turn_deg)
    x, y = record.data[0, :, 1], record.data[0, :, 2]
    own = np.cos(turn) * x + np.sin(turn) * y, np.cos(turn) * y - np.sin(turn) * x
    data = record.data.copy()
    data[0, :, 1], data[0, :, 2] = own[0], -own[1] if mirrored else own[1]
    return TimeHistory(RATE, data, record.channels, record.units, "made")


@pytest.mark.parametrize("turn_deg", [90.0, 180.0, -120.0])
def test_a_load_cell_with_a_frame_or_a_sign_of_its_own_is_noticed_and_turned(turn_deg: float) -> None:
    history = _remounted(turn_deg)
    with pytest.raises(InputError, match=r"against those of the formula") as caught:
        frf_from_chirp(history, Chirp(**SETTINGS, force="load-cell"))
    advised = re.search(r"add (-?\d+) to `load_cell_turn_deg`", str(caught.value))
    assert advised is not None
    assert abs((float(advised[1]) - turn_deg + 180) % 360 - 180) < 2
    told = Chirp(**SETTINGS, force="load-cell", load_cell_turn_deg=turn_deg)
    found = frf_from_chirp(history, told)
    assert _worst(found) < 0.02
    [note] = found.notes
    gain = re.search(r"feels ([\d.]+) times what the formula tells, with axes turned by (-?[\d.]+)°", note)
    assert gain is not None
    assert float(gain[1]) == pytest.approx(1, abs=0.02)
    assert float(gain[2]) == pytest.approx(0, abs=1)


def test_a_mirrored_load_cell_is_noticed_and_a_negative_channel_mends_it() -> None:
    history = _remounted(0.0, mirrored=True)
    with pytest.raises(InputError, match="turns against the offset mass"):
        frf_from_chirp(history, Chirp(**SETTINGS, force="load-cell"))
    mended = {**SETTINGS, "load_cell": ["13:+X", "13:-Y"]}
    assert _worst(frf_from_chirp(history, Chirp(**mended, force="load-cell"))) < 0.02


def test_blocks_are_averaged() -> None:
    one = _record()
    noise = (
        0.05
        * np.random.default_rng(1).normal(size=(8, *one.data.shape[1:]))
        * (np.array(one.units) == "m/s^2")
    )
    several = TimeHistory(RATE, one.data + noise, one.channels, one.units, "made")
    single = TimeHistory(RATE, one.data + noise[:1], one.channels, one.units, "made")
    errors = [np.linalg.norm(_band(frf_from_chirp(h, Chirp(**SETTINGS))).frf[:, :, 0] - _expected(_band(frf_from_chirp(h, Chirp(**SETTINGS))).frequency_hz)) for h in (several, single)]  # fmt: skip  # noqa: E501
    assert errors[0] < 0.8 * errors[1]


def test_what_it_cannot_read_is_refused() -> None:
    record = _record()
    still = TimeHistory(RATE, record.data * (np.arange(5) > 0), record.channels, record.units, "still")
    back = TimeHistory(RATE, record.data * np.array([-1, 1, 1, 1, 1]), record.channels, record.units, "back")
    for history in (still, back):
        with pytest.raises(InputError, match="stands still or turns backwards"):
            frf_from_chirp(history, Chirp(**SETTINGS))
    with pytest.raises(InputError, match=r"no signal 15:\+RZ in rad; expected one of 14:\+RZ \(rad\)"):
        frf_from_chirp(record, Chirp(**{**SETTINGS, "angle": "15:+RZ"}))


@pytest.mark.parametrize(
    ("settings", "sentence"),
    [
        ({"excitation": "chirp"}, "go together"),
        ({"excitation": "impacts", "chirp": SETTINGS}, "go together"),
        (
            {"excitation": "chirp", "chirp": {**SETTINGS, "force": "blend", "load_cell": None}},
            "needs `load_cell`",
        ),
    ],
)
def test_settings_that_contradict_each_other_are_refused(settings: dict[str, Any], sentence: str) -> None:
    with pytest.raises(ValidationError, match=sentence):
        Estimation.model_validate(settings)

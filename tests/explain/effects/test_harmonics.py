"""Waves over an angle: which orders a residual shows, and what an eccentric disc really reads."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from identify.explain.effects.harmonics import EncoderEccentricity, late, strongest_orders
from identify.explain.regression import solve
from identify.explain.run import run_explain
from tests.explain.moved import moved, problem
from tests.motion.hidden_drive import Hidden, Motion, only, study


def test_both_of_two_waves_are_found_the_stronger_first() -> None:
    angle = moved(24.0).position[:, 0]
    noise = np.random.default_rng(0).normal(scale=0.2, size=len(angle))
    residual = 0.6 * np.cos(131 * angle + 0.4) + 1.0 * np.cos(55 * angle - 1.0) + noise
    found = strongest_orders(angle, residual, 20.0, 300.0)
    assert found == pytest.approx([55, 131], abs=np.pi / np.ptp(angle))


def test_a_joint_that_stood_has_no_order() -> None:
    assert strongest_orders(np.full(100, 0.3), np.ones(100), 20.0, 300.0) == []


def test_a_lag_reads_the_angle_of_a_moment_ago() -> None:
    scene = moved()
    before = np.interp(scene.time_s - 0.004, scene.time_s, scene.position[:, 0])
    assert late(scene, 0, 0.004)[10:] == pytest.approx(before[10:], abs=2e-3)
    assert np.abs(scene.position[10:, 0] - before[10:]).max() > 5e-3


@pytest.mark.parametrize(("turns", "left"), [(1, 0.01), (2, 0.9)])
def test_an_eccentric_disc_is_one_wave_per_turn(turns: int, left: float) -> None:
    """A grating of radius 1 that turns about a point 0.001 off its centre, read at one place: the angle of
    the line under the reader by geometry.  A negative control: an ovality, two waves per turn, is not
    explained.
    """
    scene = moved(24.0)
    angle, off = turns * scene.position[:, 0] + 0.7, 1e-3
    reading = np.arctan2(np.sin(angle), np.cos(angle) + off)
    error = np.angle(np.exp(1j * (reading - angle)))
    made = problem(scene, error, "constant")
    fit = solve(made, (EncoderEccentricity(1),), (np.zeros(0),), np.ones(1))
    share = fit.residual(made).std() / error.std()
    assert (share < left) == (turns == 1), share


def _named(folder: Path, bend: Callable[[Motion], np.ndarray]) -> set[str]:
    """What is named of a difference of the encoders of joint 2, over an eighth of a turn."""
    folder.mkdir()
    hidden = Hidden(deflection=lambda m: only(3, 2, bend(m)), seeds=(1200, 1201))
    kinds = ["encoder-eccentricity", "joint-compliance", "sensor-latency"]
    result = run_explain(study(folder, 3, hidden, effects=kinds), folder / "out.h5")[0]
    return set(result.targets["deflection"].effects.name)


def test_an_eccentric_disc_is_told_from_a_wrong_scale(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Over a small part of a turn one wave per turn is little but a slope; without that rival it is named."""

    def scale(m: Motion) -> np.ndarray:
        return np.asarray(1e-3 * m.q[:, 1])

    name = "joint2.encoder-eccentricity"
    assert _named(tmp_path / "disc", lambda m: 2e-4 * np.sin(m.q[:, 1] + 0.7)) == {name}
    assert not _named(tmp_path / "scale", scale)
    monkeypatch.setattr(EncoderEccentricity, "humbler", lambda *_: ())
    assert name in _named(tmp_path / "control", scale)

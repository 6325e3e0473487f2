"""The regression's derivatives in closed form, and how wide its intervals are: as wide as the values
scatter.
"""

from __future__ import annotations

import numpy as np
import pytest

from identify.explain.effects.friction import CoulombFriction, StribeckFriction, ViscousFriction
from identify.explain.effects.harmonics import AngularTransmissionError
from identify.explain.evaluate import intervals
from identify.explain.gain import record_gain
from identify.explain.regression import jacobian, solve
from identify.explain.screen import refine
from tests.explain.moved import RATIO, moved, problem

SPEED, EXCESS = 0.4, 1.5
FRICTION = (CoulombFriction(1), StribeckFriction(1), ViscousFriction(1))
NONLINEAR = (np.zeros(0), np.array([SPEED]), np.zeros(0))


def _friction() -> np.ndarray:
    """Coulomb 2, Stribeck 1.5 with 0.4 rad/s, viscous 0.7, of a joint that never stands long."""
    v = moved().velocity[:, 0]
    return np.sign(v) * (2.0 + EXCESS * np.exp(-((v / SPEED) ** 2))) + 0.7 * v


def test_derivatives_are_those_of_the_law() -> None:
    """d/dv_s of exp(-(v/v_s)^2) = 2 v^2 / v_s^3 exp(-(v/v_s)^2), times the excess."""
    scene = moved()
    made = problem(scene, _friction())
    fit = solve(made, FRICTION, NONLINEAR, np.ones(1))
    v = scene.velocity[:, 0]
    bell, away = np.exp(-((v / SPEED) ** 2)), np.abs(v) > 0.05
    found = jacobian(made, fit)[away, 0]
    value = fit.of(FRICTION[1])[0]
    assert value == pytest.approx(EXCESS, rel=0.02)
    side = np.sign(v)
    expected = [side, side * bell, side * value * 2 * v**2 / SPEED**3 * bell, v]
    assert found == pytest.approx(np.column_stack(expected)[away], abs=1e-4)


def test_intervals_are_as_wide_as_values_scatter() -> None:
    """White noise, many seeds: half an interval is two standard deviations of what is found, for coefficients
    and for the speed inside the law.
    """
    scene, clean, found, half = moved(), _friction(), [], []
    for seed in range(80):
        noisy = problem(scene, clean + np.random.default_rng(seed).normal(scale=0.3, size=len(clean)))
        fit = refine(noisy, solve(noisy, FRICTION, NONLINEAR, np.ones(1)))
        values, reach = intervals(noisy, fit)
        found.append(values)
        half.append(reach)
    scatter, stated = np.std(found, axis=0), np.median(half, axis=0)
    assert np.mean(found, axis=0)[[0, 1, 3]] == pytest.approx([2.0, EXCESS, 0.7], rel=0.1)
    assert stated / scatter == pytest.approx(np.full(4, 2.05), rel=0.25)


def test_an_interval_shrinks_with_the_root_of_the_length() -> None:
    """Four times as long a record: half as wide, and as wide again with twice the noise."""
    reach = []
    for seconds, level in ((12.0, 0.3), (48.0, 0.3), (48.0, 0.6)):
        scene = moved(seconds)
        noise = np.random.default_rng(1).normal(scale=level, size=len(scene.time_s))
        made = problem(scene, 2.0 * np.sign(scene.velocity[:, 0]) + noise)
        reach.append(intervals(made, solve(made, FRICTION[:1], NONLINEAR[:1], np.ones(1)))[1][0])
    assert reach[0] / reach[1] == pytest.approx(2.0, rel=0.25)
    assert reach[2] / reach[1] == pytest.approx(2.0, rel=0.05)


def test_a_phase_that_is_turned_to_a_record_has_the_price_of_a_parameter() -> None:
    """Half ln of the number of samples (Schwarz 1978), for each harmonic, but for what little turning it
    gains.
    """
    evidence = []
    for relative in (False, True):
        scene = moved(relative=relative)
        angle, noise = (
            scene.position[:, 0],
            np.random.default_rng(3).normal(scale=1e-5, size=len(scene.time_s)),
        )
        made = problem(scene, 4e-5 * np.cos(2 * RATIO * angle + 0.3) + noise, "constant")
        harmonic, parameters = AngularTransmissionError(1), np.array([2 * RATIO, 0.0])
        without, with_it = (
            solve(made, (), (), np.ones(1)),
            solve(made, (harmonic,), (parameters,), np.ones(1)),
        )
        evidence.append(record_gain(made, without, with_it).log_odds)
    assert evidence[0] > 100
    assert evidence[0] - evidence[1] == pytest.approx(np.log(len(scene.time_s)) / 2, abs=0.9)

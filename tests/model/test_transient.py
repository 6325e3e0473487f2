"""Nonlinear torques after an impact: against closed forms, and against an integrator that knows nothing of
modes and time steps.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.special import ellipk

from identify.model.effects.nonlinear import CubicSpring, StickingFriction
from identify.model.effects.torque_law import TorqueLaw
from identify.model.transient import AttachedTorque, Impact, Models, Response, simulate

Array = NDArray[np.float64]
MASS, STIFFNESS, SPEED = 2.0, 2.0 * (2 * np.pi * 10) ** 2, 0.3
"""One mass on a spring, 10 Hz, and the speed (m/s) that the impact gives it."""
RIGID = (1e9, 1e-9)


def _struck(
    law: TorqueLaw, own: Sequence[float], record: float, steps: int, damping: float = 0.0
) -> Response:
    """The mass from rest, struck by what is nearly a pulse."""
    width = 1e-5
    impact = Impact(MASS * SPEED * np.pi / (2 * width), width, record)
    models = Models(*(np.array([[[x]]]) for x in (MASS, damping, STIFFNESS, 1.0)), (impact,))
    return simulate(models, [AttachedTorque(law, np.ones((1, 1)), np.array([own]))], record, steps)


def _peak(cycle: int, friction: float) -> tuple[float, float]:
    """When the mass stops for the first time and `cycle` cycles later, and how far out, by energy: 4 F / k
    less every cycle.
    """
    offset, omega = friction / STIFFNESS, np.sqrt(STIFFNESS / MASS)
    radius = np.hypot(SPEED / omega, offset)
    time = (np.pi / 2 - np.arctan2(offset, SPEED / omega)) / omega
    return time + cycle * 2 * np.pi / omega, radius - offset - 4 * cycle * offset


@pytest.mark.parametrize("cycle", [0, 1, 3])
def test_dry_friction_takes_four_times_its_deflection_every_cycle(cycle: int) -> None:
    friction = 0.04 * SPEED * np.sqrt(STIFFNESS * MASS)
    time, expected = _peak(cycle, friction)
    end = _struck(StickingFriction(), (friction, *RIGID), time, 400 * (cycle + 1))
    assert end.x[0, 0, 0] == pytest.approx(expected, rel=1e-3)
    assert abs(end.v[0, 0, 0]) < 5e-3 * SPEED
    assert np.abs(end.torque).max() == pytest.approx(friction)
    assert _peak(cycle, 1.1 * friction)[1] != pytest.approx(expected, rel=2e-3), "the check can fail"


def test_friction_that_holds_the_spring_stops_the_mass_for_good() -> None:
    friction = 0.4 * SPEED * np.sqrt(STIFFNESS * MASS)
    end = _struck(StickingFriction(), (friction, *RIGID), 2.0, 4000)
    assert abs(end.v[0, 0, 0]) < 1e-6 * SPEED
    assert STIFFNESS * abs(end.x[0, 0, 0]) < friction
    assert end.torque[-1, 0, 0, 0] == pytest.approx(-STIFFNESS * end.x[0, 0, 0], rel=1e-4)


@pytest.mark.parametrize("stiffer", [0.1, 0.5])
def test_a_cubic_spring_follows_its_backbone(stiffer: float) -> None:
    """After one period of the Duffing oscillator, 4 K(m) / sqrt((k + k3 a^2) / M), everything is as after the
    impact.
    """
    linear_amplitude = SPEED * np.sqrt(MASS / STIFFNESS)
    cubic = stiffer * STIFFNESS / linear_amplitude**2
    square = (np.sqrt(1 + 2 * cubic * MASS * SPEED**2 / STIFFNESS**2) - 1) * STIFFNESS / cubic
    modulus = cubic * square / (2 * (STIFFNESS + cubic * square))
    period = 4 * ellipk(modulus) / np.sqrt((STIFFNESS + cubic * square) / MASS)
    end = _struck(CubicSpring(), (cubic,), 3 * period, 3000)
    assert abs(end.x[0, 0, 0]) < 5e-3 * linear_amplitude
    assert end.v[0, 0, 0] == pytest.approx(SPEED, rel=2e-3)


def test_two_laws_on_coupled_coordinates_agree_with_an_ordinary_integrator() -> None:
    """Friction with a soft stick on one coordinate, a cubic spring on the other, their inertias strongly
    coupled.
    """
    mass = np.array([[3.0, 1.8], [1.8, 1.5]])
    stiffness, damping = np.diag([9e3, 5e3]), np.diag([2.0, 1.0])
    impact = Impact(100.0, 6e-3, 0.5)
    friction, cubic = np.array([1.2, 900.0, 4e-3]), np.array([3e7])
    models = Models(mass[None], damping[None], stiffness[None], np.array([[[0.0], [1.0]]]), (impact,))
    attached = [
        AttachedTorque(StickingFriction(), np.array([[1.0, 0.0]]), friction[None]),
        AttachedTorque(CubicSpring(), np.array([[0.0, 1.0]]), cubic[None]),
    ]
    end = simulate(models, attached, impact.record, 4000)
    inverse = np.linalg.inv(mass)

    def rates(time: float, state: Array) -> Array:
        x, v = state[:2], state[2:]
        load = np.array(
            [0.0, impact.peak * np.sin(np.pi * time / impact.width) if time < impact.width else 0.0]
        )
        free = load - damping @ v - stiffness @ x - np.array([0.0, cubic[0] * x[1] ** 3])
        slip = (v[0] + friction[2] * (inverse @ free)[0]) / (1 / friction[1] + friction[2] * inverse[0, 0])
        free[0] -= np.clip(slip, -friction[0], friction[0])
        return np.concatenate([v, inverse @ free])

    reference = solve_ivp(rates, (0.0, impact.record), np.zeros(4), rtol=1e-9, atol=1e-12, max_step=1e-3)
    moved = np.abs(reference.y).max(axis=1)
    apart = np.concatenate([end.x, end.v], axis=1)[0, :, 0] - reference.y[:, -1]
    assert np.all(np.abs(apart) < 1e-3 * moved)
    assert np.ptp(end.torque[:, 0]) == pytest.approx(2 * friction[0])
    assert np.abs(end.torque[:, 1]).max() > 0.1 * stiffness[1, 1] * moved[1], "the cubic spring is felt"


def test_models_side_by_side_move_as_each_alone() -> None:
    impacts = (Impact(50.0, 6e-3, 0.4), Impact(200.0, 5e-3, 0.4))
    mass, damping = np.array([[[2.0]], [[3.0]]]), np.array([[[4.0]], [[200.0]]])
    models = Models(
        mass, damping, np.array([[[5e3]], [[2e3]]]), np.array([[[1.0, 0.5]], [[-1.0, 2.0]]]), impacts
    )
    own = np.array([[0.5, 1e3, 1e-3], [2.0, 1e2, 1e-4]])
    both = simulate(models, [AttachedTorque(StickingFriction(), np.ones((2, 1)), own)], 0.4, 600)
    for number, impact in enumerate(impacts):
        part = slice(number, number + 1)
        single = Models(
            *(a[part] for a in (models.mass, models.damping, models.stiffness, models.force)), (impact,)
        )
        alone = simulate(single, [AttachedTorque(StickingFriction(), np.ones((1, 1)), own[part])], 0.4, 600)
        assert both.of(part).torque == pytest.approx(alone.torque, abs=1e-9)
        assert both.x[part] == pytest.approx(alone.x, rel=1e-9)


def test_transforms_of_torque_and_impact_are_those_of_quadrature() -> None:
    impact = Impact(120.0, 6.5e-3, 0.3)
    s = 0.7 + 2j * np.pi * np.array([3.0, 40.0, 79.0])
    step = 1e-6
    time = (np.arange(round(impact.width / step)) + 0.5) * step
    force = impact.peak * np.sin(np.pi * time / impact.width)
    assert impact.transform(s) == pytest.approx(np.exp(-np.outer(s, time)) @ force * step, rel=1e-6)
    assert impact.means(1e-3, 300).sum() * 1e-3 == pytest.approx(2 / np.pi * impact.peak * impact.width)
    torque = np.random.default_rng(0).normal(size=(150, 1, 1, 1))
    fine = np.repeat(torque[:, 0, 0, 0], 200)
    inner = (np.arange(len(fine)) + 0.5) * 1e-5
    got = Response(2e-3, torque, np.zeros((1, 1, 1)), np.zeros((1, 1, 1))).transform(s)[:, 0, 0, 0]
    assert got == pytest.approx(np.exp(-np.outer(s, inner)) @ fine * 1e-5, rel=1e-5, abs=1e-8)

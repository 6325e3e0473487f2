"""Laws of drives: the values and derivatives that the papers give."""

from __future__ import annotations

import numpy as np
import pytest

from identify.model.laws.friction import BELL, EXPONENTIAL, friction_torque, stribeck_decay
from identify.model.laws.gear import GearSpring, harmonic, per_joint_turn, ripple


def test_the_two_stribeck_laws_agree_at_their_own_speed_only() -> None:
    speed = np.array([-0.2, -0.1, 0.0, 0.1, 0.2])
    exponential, bell = stribeck_decay(speed, 0.1, EXPONENTIAL), stribeck_decay(speed, 0.1, BELL)
    assert exponential == pytest.approx(np.exp([-2.0, -1.0, 0.0, -1.0, -2.0]))
    assert bell == pytest.approx(np.exp([-4.0, -1.0, 0.0, -1.0, -4.0]))


def test_friction_is_equation_11_and_odd() -> None:
    one = np.ones(3)
    speed = np.array([0.05, 0.1, 1.0])
    torque = friction_torque(speed, 30 * one, 200 * one, 250 * one, 0.05 * one)
    assert torque == pytest.approx(30 + 250 * np.exp(-speed / 0.05) + 200 * speed)
    assert friction_torque(-speed, 30 * one, 200 * one, 250 * one, 0.05 * one) == pytest.approx(-torque)


def test_an_order_counts_per_turn_of_the_motor_and_times_the_ratio_per_turn_of_the_joint() -> None:
    turn, ratio = np.linspace(0, 2 * np.pi, 50), np.full(50, 171.0)
    error, slope = ripple(turn, ratio, 2, np.full(50, 6e-5), np.full(50, 0.4))
    cosine, sine = harmonic(turn, per_joint_turn(2, 171.0))
    assert error == pytest.approx(6e-5 * (np.cos(0.4) * cosine - np.sin(0.4) * sine))
    step = 1e-7
    ahead, behind = (
        ripple(turn + way, ratio, 2, np.full(50, 6e-5), np.full(50, 0.4))[0] for way in (step, -step)
    )
    assert slope == pytest.approx((ahead - behind) / (2 * step), abs=1e-6 * np.abs(slope).max())


def test_windup_is_the_inverse_of_the_torque_of_a_hardening_spring() -> None:
    one = np.ones(5)
    spring = GearSpring(100 * one, 2e4 * one, 3e9 * one, 1e-4 * one, ())
    torque = np.array([-90.0, -1.0, 2.0, 40.0, 300.0])
    assert spring.torque(spring.windup(torque)) == pytest.approx(torque)
    linear = GearSpring(100 * one, 2e4 * one, 0 * one, 1e-4 * one, ())
    assert (np.abs(linear.torque(spring.windup(torque)) - torque) > 1e-3 * np.abs(torque))[[0, 3, 4]].all()

"""Controllers of the Nagoya two-link study's reference records, sampled every 500 us; nothing here comes from
identify.

`conventional`: position P, velocity PI, feed-forward of velocity and of the rigid arm's torque.  `flexible`:
two degrees of freedom, the drives ahead of the links by the windup that the motion takes.  `notched`: that
behind a notch at the first mode of the posture.  `shaped`: the conventional one behind that notch.
`inertia`: the drives ahead by the windup of each joint taken by itself.
"""

from __future__ import annotations

import numpy as np

from tests.generator.nagoya_arm import RATIO, ROTOR, Arm, Array

PERIOD_S = 5e-4
POSITION_GAIN, VELOCITY_GAIN, INTEGRAL = 12.0, np.array([12000.0, 4000.0]), 4.0
NOTCH_WIDTH, NOTCH_DEPTH = 0.3, 0.3


class Servo:
    """A controller of both joints on its way along a command, positions (ticks, 2)."""

    def __init__(self, plant: Arm, kind: str, position: Array, gain: float) -> None:
        speed = np.gradient(position, PERIOD_S, axis=0)
        acceleration = np.gradient(speed, PERIOD_S, axis=0)
        rigid = np.array([plant.rigid(*row) for row in zip(position, speed, acceleration, strict=True)])
        self.mode_hz = first_mode(plant, position) if kind in ("notched", "shaped") else None
        if kind == "inertia":
            rigid = np.array([alone(plant, *row) for row in zip(position, acceleration, strict=True)])
        if kind not in ("conventional", "shaped"):
            position = position + np.array([plant.windup(row) for row in rigid])
            speed = np.gradient(position, PERIOD_S, axis=0)
            acceleration = np.gradient(speed, PERIOD_S, axis=0)
        self.position, self.speed, self.feed = position, speed, rigid + RATIO**2 * ROTOR * acceleration
        self.gain, self.before = gain * VELOCITY_GAIN, position[0]
        self.integral, self.holding = np.zeros(2), np.zeros(2)
        self.memory = np.zeros((4, 2))

    def holds(self, torque: Array) -> None:
        """It has long stood still with the motors at these torques."""
        self.holding = RATIO * torque
        self.integral = self.holding - self.feed[0]

    def torque(self, tick: int, turn: Array) -> Array:
        """Motor torques until the next tick, from the measured turn of the drives."""
        error = (
            POSITION_GAIN * (self.position[tick] - turn) + self.speed[tick] - (turn - self.before) / PERIOD_S
        )
        self.before, self.integral = turn, self.integral + self.gain * INTEGRAL * PERIOD_S * error
        wanted = self.gain * error + self.integral + self.feed[tick]
        if self.mode_hz is not None:
            wanted = self.holding + self.notch(wanted - self.holding, self.mode_hz[tick])
        return np.asarray(wanted / RATIO)

    def notch(self, given: Array, hz: float) -> Array:
        """(s^2 + 2 d w f s + f^2) / (s^2 + 2 w f s + f^2) by the bilinear transform, exact at f."""
        c = 1 / np.tan(np.pi * hz * PERIOD_S)  # s / f becomes c (z - 1) / (z + 1)
        (b0, b1, b2), (a0, a1, a2) = (
            (c * c + 2 * z * c + 1, 2 - 2 * c * c, c * c - 2 * z * c + 1)
            for z in (NOTCH_DEPTH * NOTCH_WIDTH, NOTCH_WIDTH)
        )
        x1, x2, y1, y2 = self.memory
        passed = (b0 * given + b1 * x1 + b2 * x2 - a1 * y1 - a2 * y2) / a0
        self.memory = np.array([given, x1, passed, y1])
        return np.asarray(passed)


def alone(plant: Arm, q: Array, a: Array) -> Array:
    """Torque that each joint takes by itself, the other at rest."""
    weight = plant.rigid(q, np.zeros(2), np.zeros(2))
    return np.asarray(weight + np.diag(plant.mass(q)) * a)


def first_mode(plant: Arm, position: Array) -> Array:
    """Hz at all ticks: the arm's first mode with linear springs and free drives, at every twentieth posture,
    and straight lines between.
    """
    rows = np.unique(np.append(np.arange(0, len(position), 20), len(position) - 1))
    k = np.diag(plant.n["stiffness_n_m_rad"])
    stiffness, found = np.block([[k, -k], [-k, k]]), []
    for q in position[rows]:
        mass = np.zeros((4, 4))
        mass[:2, :2], mass[2:, 2:] = np.diag(RATIO**2 * ROTOR), plant.mass(q)
        squares = np.sort(np.linalg.eigvals(np.linalg.solve(mass, stiffness)).real)
        found.append(np.sqrt(squares[2]) / 2 / np.pi)
    return np.interp(np.arange(len(position)), rows, found)

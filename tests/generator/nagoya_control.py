"""Controllers of the Nagoya two-link study's reference records, sampled every 500 us; nothing here comes from
identify.

`conventional`: position P, velocity PI, feed-forward of velocity and of the rigid arm's torque.  `flexible`:
two degrees of freedom, the drives ahead of the links by the windup that the motion takes.  `notched`: that
behind a notch at the first mode of the posture.  `shaped`: the conventional one behind that notch.
`inertia`: the drives ahead by the windup of each joint taken by itself.  `feedback`: that with a feedback of
the twist of each joint and of its rate.
"""

from __future__ import annotations

import numpy as np

from tests.generator.nagoya_arm import RATIO, ROTOR, Arm, Array

PERIOD_S = 5e-4
POSITION_GAIN, VELOCITY_GAIN, INTEGRAL = 12.0, np.array([12000.0, 4000.0]), 4.0
NOTCH_WIDTH, NOTCH_DEPTH = 0.3, 0.3
POLE_DAMPING = 0.5
"""Of the pair of poles that the feedback of twist places, at each link's frequency with its drive held."""


class Servo:
    """A controller of both joints on its way along a command, positions (ticks, 2)."""

    def __init__(self, plant: Arm, kind: str, position: Array, gain: float) -> None:
        speed = np.gradient(position, PERIOD_S, axis=0)
        acceleration = np.gradient(speed, PERIOD_S, axis=0)
        rigid = np.array([plant.rigid(*row) for row in zip(position, speed, acceleration, strict=True)])
        self.mode_hz = first_mode(plant, position) if kind in ("notched", "shaped") else None
        if kind == "feedback":
            self.twist_gain = twist_gains(plant, position, gain)
        if kind in ("inertia", "feedback"):
            rigid = np.array([alone(plant, *row) for row in zip(position, acceleration, strict=True)])
        if kind not in ("conventional", "shaped"):
            self.windup = np.array([plant.windup(row) for row in rigid])
            position = position + self.windup
            speed = np.gradient(position, PERIOD_S, axis=0)
            acceleration = np.gradient(speed, PERIOD_S, axis=0)
        self.position, self.speed, self.feed = position, speed, rigid + RATIO**2 * ROTOR * acceleration
        self.gain, self.before = gain * VELOCITY_GAIN, position[0]
        self.integral, self.holding = np.zeros(2), np.zeros(2)
        self.memory = np.zeros((4, 2))
        self.kind, self.twist = kind, np.zeros(2)

    def holds(self, torque: Array, turn: Array, link: Array) -> None:
        """It has long stood still with the motors at these torques, drives and links there."""
        self.holding = RATIO * torque
        self.integral = self.holding - self.feed[0]
        if self.kind == "feedback":
            self.integral = self.integral + self.of_twist(0, turn - link - self.windup[0])

    def torque(self, tick: int, turn: Array, link: Array) -> Array:
        """Motor torques until the next tick, from the measured turn of the drives, and for `feedback` from
        that of the links.
        """
        error = (
            POSITION_GAIN * (self.position[tick] - turn) + self.speed[tick] - (turn - self.before) / PERIOD_S
        )
        self.before, self.integral = turn, self.integral + self.gain * INTEGRAL * PERIOD_S * error
        wanted = self.gain * error + self.integral + self.feed[tick]
        if self.mode_hz is not None:
            wanted = self.holding + self.notch(wanted - self.holding, self.mode_hz[tick])
        if self.kind == "feedback":
            wanted = wanted - self.of_twist(tick, turn - link - self.windup[tick])
        return np.asarray(wanted / RATIO)

    def of_twist(self, tick: int, twist: Array) -> Array:
        """Torque of the twist beyond that of the command, and of its rate since the last tick."""
        rate = (twist - self.twist) / PERIOD_S if tick else np.zeros(2)
        self.twist = twist
        stiff, damping = self.twist_gain[tick]
        return np.asarray(stiff * twist + damping * rate)

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


def twist_gains(plant: Arm, position: Array, gain: float) -> Array:
    """Gains of twist and of its rate, (ticks, 2, 2), so that s = w (-d + j sqrt(1 - d^2)) is a pole of drive,
    spring, link and cascade: 1 + (k + r s) G(s) = 0 with G from torque to twist by the loop's state matrix.
    """
    rows = np.unique(np.append(np.arange(0, len(position), 20), len(position) - 1))
    found = np.zeros((len(rows), 2, 2))
    for number, q in enumerate(position[rows]):
        for joint, link in enumerate(np.diag(plant.mass(q))):
            drive = RATIO[joint] ** 2 * ROTOR[joint]
            k, d = plant.n["stiffness_n_m_rad"][joint], plant.n["damping_n_m_s_rad"][joint]
            v = gain * VELOCITY_GAIN[joint]
            # Turn and velocity of the drive, of the link, and the integral of the velocity loop's error.
            spring = np.array([k, d, -k, -d, 0])
            servo = np.array([-v * POSITION_GAIN, -v, 0, 0, v * INTEGRAL])
            a = np.array([[0, 1, 0, 0, 0], (servo - spring) / drive, [0, 0, 0, 1, 0], spring / link, [0] * 5])
            a[4, :2] = -POSITION_GAIN, -1
            s = np.sqrt(k / link) * (-POLE_DAMPING + 1j * np.sqrt(1 - POLE_DAMPING**2))
            moved = np.linalg.solve(s * np.eye(5) - a, np.array([0, 1 / drive, 0, 0, 0]))
            needed = -1 / (moved[0] - moved[2])
            rate = needed.imag / s.imag
            found[number, :, joint] = needed.real - rate * s.real, rate
    return np.array([[np.interp(np.arange(len(position)), rows, part) for part in row] for row in found.T]).T


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

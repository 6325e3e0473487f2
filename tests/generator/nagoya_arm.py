"""The two-link arm of the Nagoya study with elastic joints: links by Pinocchio, rotors, gears and friction by
the paper's equations.

Nothing here comes from identify.  The paper's figures carry no numbers (units are normalised), so the arm is
ours in the size of axes 2 and 3 of a robot for 165 kg.
"""

from __future__ import annotations

import numpy as np
import pinocchio
from numpy.typing import NDArray

Array = NDArray[np.float64]

TRUTH = {
    "stiffness_n_m_rad": [3.0e6, 1.2e6],
    "damping_n_m_s_rad": [2500.0, 800.0],
    "cubic_n_m_rad3": [8.0e10, 4.0e10],
    "te_amplitude_rad": [8.0e-5, 6.0e-5],
    "te_phase_rad": [0.6, 1.9],
    "coulomb_n_m": [400.0, 200.0],
    "viscous_n_m_s_rad": [300.0, 150.0],
    "stribeck_n_m": [250.0, 120.0],
}
STRIBECK_VELOCITY, RATIO, ROTOR = 0.05, np.array([160.0, 140.0]), np.array([0.012, 0.008])


def arm() -> pinocchio.Model:
    """Two links in a vertical plane; angles from the horizontal, gravity along -y."""
    model, parent, place = pinocchio.Model(), 0, pinocchio.SE3.Identity()
    for mass, middle, moment, length in ((250.0, 0.5, 30.0, 1.1), (420.0, 0.6, 70.0, 1.2)):
        parent = model.addJoint(parent, pinocchio.JointModelRZ(), place, f"q{parent + 1}")
        inertia = pinocchio.Inertia(mass, np.array([middle, 0, 0]), np.diag([1.0, moment, moment]))
        model.appendBodyToJoint(parent, inertia, pinocchio.SE3.Identity())
        place = pinocchio.SE3(np.eye(3), np.array([length, 0.0, 0.0]))
    model.gravity.linear = np.array([0.0, -9.81, 0.0])
    return model


class Arm:
    """The equations of motion: link torque by Eq. 8 of the windup less the transmission error of Eq. 9;
    friction by Eq. 11.

    The sign in Eq. 11 is taken as it is written: a drive at rest stays exactly at rest while less than F_c +
    F_s pushes it. A state is (4, 2): drive angles and velocities at the gear output, link angles and
    velocities.  `slip` (2,) holds the sign of each drive's motion, 0 where it sticks.
    """

    def __init__(self) -> None:
        self.model = arm()
        self.data = self.model.createData()
        self.n = {key: np.array(value) for key, value in TRUTH.items()}
        self.slip = np.zeros(2)

    def error(self, turn: Array) -> tuple[Array, Array]:
        """Transmission error and its slope: one period a turn of the motor."""
        angle = RATIO * turn + self.n["te_phase_rad"]
        return self.n["te_amplitude_rad"] * np.cos(angle), -self.n["te_amplitude_rad"] * RATIO * np.sin(angle)

    def spring(self, windup: Array) -> Array:
        """Torque of the gears, N m."""
        return self.n["stiffness_n_m_rad"] * windup + self.n["cubic_n_m_rad3"] * windup**3

    def windup(self, torque: Array) -> Array:
        """The inverse, by Newton's method."""
        e = torque / self.n["stiffness_n_m_rad"]
        for _ in range(20):
            e = e - (self.spring(e) - torque) / (
                self.n["stiffness_n_m_rad"] + 3 * self.n["cubic_n_m_rad3"] * e**2
            )
        return e

    def rigid(self, q: Array, v: Array, a: Array) -> Array:
        """Torque that a motion of the rigid links takes."""
        return np.array(pinocchio.rnea(self.model, self.data, q, v, a))

    def mass(self, q: Array) -> Array:
        """Of the links, (2, 2)."""
        upper = np.triu(pinocchio.crba(self.model, self.data, q))
        return np.asarray(upper + np.triu(upper, 1).T)

    def push(self, state: Array, torque: Array) -> tuple[Array, Array]:
        """Torque on each drive before friction, and on each link."""
        turn, spin, q, v = state
        error, error_slope = self.error(turn)
        spring, damper = self.spring(q - turn - error), self.n["damping_n_m_s_rad"] * (v - spin)
        return RATIO * torque + spring * (1 + error_slope) + damper, -spring - damper

    def slope(self, state: Array, torque: Array) -> Array:
        """Derivative of the state under motor torques (2,)."""
        _, spin, q, v = state
        on_drive, on_link = self.push(state, torque)
        dry = self.n["coulomb_n_m"] + self.n["stribeck_n_m"] * np.exp(-np.abs(spin) / STRIBECK_VELOCITY)
        net = on_drive - self.slip * dry - self.n["viscous_n_m_s_rad"] * spin
        return np.array(
            [
                spin,
                np.where(self.slip == 0, 0.0, net / (RATIO**2 * ROTOR)),
                v,
                pinocchio.aba(self.model, self.data, q, v, on_link),
            ]
        )

    def advance(self, state: Array, torque: Array, h: float) -> Array:
        """A step of Runge-Kutta of fourth order, cut where a drive comes to rest; there it sticks, or is
        pushed back at once.
        """
        self.slip = np.where(
            (self.slip == 0) & self._loose(state, torque), np.sign(self.push(state, torque)[0]), self.slip
        )
        while True:
            after = self._runge_kutta(state, torque, h)
            crossed = (self.slip != 0) & (after[1] * self.slip < 0)
            if not crossed.any():
                return after
            share = np.where(crossed, state[1] / np.where(crossed, state[1] - after[1], 1.0), 2.0)
            first = int(np.argmin(share))
            state, h = self._runge_kutta(state, torque, share[first] * h), (1 - share[first]) * h
            state[1, first] = 0.0
            back = (
                self._loose(state, torque)[first]
                and self.push(state, torque)[0][first] * self.slip[first] < 0
            )
            self.slip[first] = -self.slip[first] if back else 0.0

    def _loose(self, state: Array, torque: Array) -> Array:
        return np.asarray(
            np.abs(self.push(state, torque)[0]) > self.n["coulomb_n_m"] + self.n["stribeck_n_m"]
        )

    def _runge_kutta(self, state: Array, torque: Array, h: float) -> Array:
        k1 = self.slope(state, torque)
        k2 = self.slope(state + h / 2 * k1, torque)
        k3 = self.slope(state + h / 2 * k2, torque)
        return np.asarray(state + h / 6 * (k1 + 2 * k2 + 2 * k3 + self.slope(state + h * k3, torque)))

    def at_rest(self, turn: Array) -> tuple[Array, Array]:
        """State with the drives at `turn`, and motor torques that hold it."""
        self.slip, q = np.zeros(2), turn.copy()
        for _ in range(30):
            weight = self.rigid(q, np.zeros(2), np.zeros(2))
            q = turn - self.windup(weight) + self.error(turn)[0]
        return np.array([turn, np.zeros(2), q, np.zeros(2)]), weight * (1 + self.error(turn)[1]) / RATIO

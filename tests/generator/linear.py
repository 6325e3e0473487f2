"""The linear model of a plant at rest by central differences of its forward dynamics: poles, exact FRFs and
exact small motions, at any step.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import ceil

import mujoco
import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from tests.generator.plant import Plant
from tests.generator.rigid import Array

Complex = NDArray[np.complex128]
_STEPS = (1e-6, 1e-5, 1e-2)
"""Displacement (rad, m), velocity (rad/s, m/s) and force (N): small against what is nonlinear, large against
rounding.
"""
_FINER = 16


@dataclass(frozen=True)
class Linear:
    """x' = a x + b f and y = c x + d f with x the displacements, then the velocities, f the force (3) and y
    the accelerations.
    """

    a: Array
    b: Array
    c: Array
    d: Array

    @property
    def poles(self) -> Complex:
        """Complex poles with positive imaginary part, rad/s, by rising modulus."""
        poles = np.linalg.eigvals(self.a)
        return np.asarray(sorted(poles[poles.imag > 0], key=abs))

    @property
    def fastest(self) -> float:
        """Largest modulus of all poles, real ones of overdamped motions too, 1/s."""
        return float(np.abs(np.linalg.eigvals(self.a)).max())

    def respond(self, force: Callable[[Array], Array], until: float, step: float, steps: int) -> Array:
        """Accelerations (steps, sensors, 3), m/s^2, row n at time n * step (s), of a force (times, 3), N,
        which is zero after `until`: exact but for the force, a straight line over each sixteenth of a
        step.  The motion begins at rest.
        """
        size, driven = len(self.a), min(steps - 1, ceil(until / step) + 1)
        fine = step / _FINER
        loads = force(fine * np.arange(driven * _FINER + 1))
        block = np.zeros((size + 6, size + 6))
        block[:size, :size], block[:size, size : size + 3] = fine * self.a, fine * self.b
        block[size : size + 3, size + 3 :] = np.eye(3)
        block = scipy.linalg.expm(block)
        held, rising = block[:size, size : size + 3], block[:size, size + 3 :]
        kicks = loads[:-1] @ held.T + np.diff(loads, axis=0) @ rising.T
        states = np.zeros((steps, size))
        here = states[0]
        for row in range(driven):
            for kick in kicks[row * _FINER : (row + 1) * _FINER]:
                here = block[:size, :size] @ here + kick
            states[row + 1] = here
        free = scipy.linalg.expm(step * self.a)
        for row in range(driven, steps - 1):
            states[row + 1] = free @ states[row]
        read = states @ self.c.T
        read[: driven + 1] += loads[::_FINER] @ self.d.T
        return np.asarray(read.reshape(steps, -1, 3))

    def accelerance(self, s: Complex) -> Complex:
        """H (len(s), outputs, 3), m/s^2/N, outputs being x, y, z of each sensor in turn."""
        states = np.linalg.solve(s[:, None, None] * np.eye(len(self.a)) - self.a, self.b.astype(complex))
        return np.asarray(self.c @ states + self.d)


def linearise(plant: Plant, struck: str, torques: bool = False) -> Linear:
    """The plant about rest, struck at a sensor along the sensor's axes; with its nonlinear torques, if
    wanted, at their slope at rest.
    """
    size = plant.model.nv
    columns = []
    for index in range(2 * size + 3):
        step = _STEPS[0] if index < size else _STEPS[1] if index < 2 * size else _STEPS[2]
        up, down = (_derivative(plant, struck, (index, sign * step), torques) for sign in (1, -1))
        columns.append((up - down) / (2 * step))
    table = np.array(columns).T
    lower, outputs = table[:size], table[size:]
    top = np.hstack([np.zeros((size, size)), np.eye(size)])
    a = np.vstack([top, lower[:, : 2 * size]])
    b = np.vstack([np.zeros((size, 3)), lower[:, 2 * size :]])
    return Linear(a, b, outputs[:, : 2 * size], outputs[:, 2 * size :])


def _derivative(plant: Plant, struck: str, change: tuple[int, float], torques: bool) -> Array:
    """Generalised accelerations, then sensor readings, with one displacement, velocity or force component off
    zero.
    """
    data, size, (index, value) = plant.data, plant.model.nv, change
    plant.rest()
    force = np.zeros(3)
    if index < size:
        data.qpos[index] = value
    elif index < 2 * size:
        data.qvel[index - size] = value
    else:
        force[index - 2 * size] = value
    mujoco.mj_fwdPosition(plant.model, data)
    plant.load(struck, force, torques)
    mujoco.mj_forward(plant.model, data)
    return np.concatenate([data.qacc, data.sensordata])

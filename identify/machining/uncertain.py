"""What is uncertain of the tip of a fitted model, as changes of its receptance.

Four causes, independent of each other:

- what the fit's data leave open of parameters, and of what was told of the robot (masses, lengths, joint
  angles), where that was said to be uncertain: exact sensitivities times a root of their joint covariance;
- joint angles that the tool's file says are uncertain: differences over postures;
- what the model does not explain (`identify.vibration.misfit`): relative errors of the stiffnesses, complex
  and independent from line to line.  The real part of c xi, xi circular with E|xi|^2 = tau^2, has the
  variance |c|^2 tau^2 / 2;
- cutting coefficients, which do not change the receptance but the depth, in inverse proportion.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identify.core.arrays import Array, Complex
from identify.machining.exact_limit import ExactLimit
from identify.machining.structure import Structure
from identify.model.frf import frf_and_gradient
from identify.model.system import Factors
from identify.robot.points import Point
from identify.vibration.fitted_model import FittedModel

_TURN = 1e-4
"""Turn of a joint for differences, rad."""


@dataclass(frozen=True)
class UncertainTip:
    """matrices M, C, K and out (3, n), along the tool's axes, with factors and a root (o, v) of the
    covariance of their owners; errors (p,): RMS relative errors of the first owners, the parameters, as
    misfit; values (p,); turned: the structure with each joint turned forth and back, and angle_std, rad, of
    each.
    """

    matrices: tuple[Array, Array, Array]
    factors: Factors
    out: Array
    root: Array
    values: Array
    errors: Array
    turned: tuple[tuple[Structure, Structure], ...]
    angle_std: float

    def changes(self, line_hz: Array) -> tuple[Complex, Complex]:
        """Of the receptance at lines (l,), Hz, of any sign: per unit of each independent standard normal
        number c, (l, 3, 3, c), and RMS by the misfit of each stiffness (l, 3, 3, m).
        """
        s = np.asarray(2j * np.pi * np.abs(line_hz), dtype=complex)
        owners = np.arange(len(self.root))
        _, by = frf_and_gradient(self.matrices, self.factors, s, self.out, self.out.T, 0, owners)
        wrong = np.flatnonzero(self.errors)
        own = by[..., wrong] * (self.values * self.errors)[wrong]
        columns = np.concatenate([by @ self.root, self._by_angles(line_hz)], axis=-1)
        back = (line_hz < 0)[:, None, None, None]
        return np.where(back, np.conj(columns), columns), np.where(back, np.conj(own), own)

    def _by_angles(self, line_hz: Array) -> Complex:
        scale = self.angle_std / (2 * _TURN)
        hz = np.abs(line_hz)
        found = [scale * (up.receptance(hz) - down.receptance(hz)) for up, down in self.turned]
        return np.stack(found, axis=-1) if found else np.zeros((len(hz), 3, 3, 0), dtype=complex)

    def half_band(self, line_hz: Array) -> Array:
        """(l, 3, 3): half the 95 % band of the receptance, of the size of its error."""
        columns, own = self.changes(line_hz)
        return np.asarray(1.96 * np.linalg.norm(np.concatenate([columns, own], axis=-1), axis=-1))

    def relative(self, limit: ExactLimit) -> tuple[Array, float]:
        """What a limit changes, relative to it: per unit of each number (c,), and RMS by the misfit."""
        columns, own = self.changes(limit.lines_hz)
        change = np.einsum("lij,lijc->c", limit.slope, columns).real
        misfit = np.einsum("lij,lijm->lm", limit.slope, own)
        return change / limit.depth, float(np.linalg.norm(misfit) / np.sqrt(2) / limit.depth)


def uncertain_tip(
    model: FittedModel, point: Point, axes: Array, posture: Array, errors: Array, angle_std: float
) -> UncertainTip:
    """The tip at a posture (joints,), rad; axes (3, 3): of the tool, as rows; errors (p,): `misfit`."""
    system = model.system(posture)
    factors, root = model.sensitivity(system, posture)

    def at(other: Array) -> Structure:
        there = model.system(other)
        out = axes @ there.base_jacobian(point.link, point.position)
        return Structure(*there.matrices(model.values), out)

    steps = _TURN * np.eye(len(posture)) if angle_std > 0 else np.zeros((0, len(posture)))
    return UncertainTip(
        system.matrices(model.values),
        factors,
        axes @ system.base_jacobian(point.link, point.position),
        root,
        model.values,
        errors,
        tuple((at(posture + step), at(posture - step)) for step in steps),
        angle_std,
    )

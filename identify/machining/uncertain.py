"""What is uncertain of the tip of a fitted model, as changes of its receptance.

Four causes, independent of each other:

- what the fit's data leave open of parameters, and of what was stated of the robot (masses, lengths, joint
  angles), where that was said to be uncertain: exact sensitivities times a root of their joint covariance;
- joint angles that the tool's file says are uncertain, by what they change of the mass matrix and of the
  tip's motion; what they change of the gravity stiffness, itself a thousandth of the joints', is left out;
- what the model does not explain (`identify.vibration.misfit`): relative errors of the stiffnesses, complex
  and independent from line to line.  The real part of c xi, xi circular with E|xi|^2 = tau^2, has the
  variance |c|^2 tau^2 / 2;
- cutting coefficients, which do not change the receptance but the depth, in inverse proportion.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from identify.core.arrays import Array, Complex, Index
from identify.core.thresholds import SIGMAS_95
from identify.machining.exact_limit import ExactLimit
from identify.machining.structure import on_both_sides
from identify.model.frf import dynamic_stiffness, frf_and_gradient
from identify.model.system import Factors, System
from identify.robot.points import Point
from identify.vibration.fitted_model import FittedModel


class Carried(Protocol):
    """A tool that is coupled to the arm, so that a change dR (l, k, k) of the arm's receptance changes that
    of the tip by left dR right.
    """

    @property
    def degrees(self) -> int:
        """k: 3 displacements, or 6 with rotations."""

    def lines(self, line_hz: Array) -> Array:
        """(l,), Hz, of any sign: where it is looked at for lines (l,)."""

    def sides(self, line_hz: Array) -> tuple[Complex, Complex]:
        """Left (l, 3, k) and right (l, k, 3) at such lines."""


@dataclass(frozen=True)
class UncertainTip:
    """matrices M, C, K and out (3, n), along the tool's axes, with factors and a root (o, v) of the
    covariance of their owners; errors (p,): RMS relative errors of the first owners, the parameters, as
    misfit; values (p,); turned_mass (j, n, n), turned_out (j, 3, n): changes of M and out per standard
    deviation of each joint's angle.  carried: what is coupled to the arm, whose out is then (k, n).
    """

    matrices: tuple[Array, Array, Array]
    factors: Factors
    out: Array
    root: Array
    values: Array
    errors: Array
    turned_mass: Array
    turned_out: Array
    carried: Carried | None = None

    def changes(self, line_hz: Array) -> tuple[Complex, Complex]:
        """Of the receptance at lines (l,), Hz, of any sign: per unit of each independent standard normal
        number c, (l, 3, 3, c), and RMS by the misfit of each stiffness (l, 3, 3, m).
        """
        owners = np.arange(len(self.root))

        def at(s: Complex) -> Complex:
            return np.concatenate([self._by_owners(s, owners), self._by_angles(s)], axis=-1)

        by, angles = np.split(self._at_tip(at, line_hz), [len(owners)], axis=-1)
        wrong = np.flatnonzero(self.errors)
        own = by[..., wrong] * (self.values * self.errors)[wrong]
        return np.concatenate([by @ self.root, angles], axis=-1), own

    def slopes(self, line_hz: Array, owners: Index) -> Complex:
        """(l, 3, 3, o): derivatives of the receptance, m/N, at lines of any sign, Hz."""
        return self._at_tip(lambda s: self._by_owners(s, owners), line_hz)

    def _by_owners(self, s: Complex, owners: Index) -> Complex:
        """(l, k, k, o), of the arm alone."""
        return frf_and_gradient(self.matrices, self.factors, s, self.out, self.out.T, 0, owners)[1]

    def _at_tip(self, at: Callable[[Complex], Complex], line_hz: Array) -> Complex:
        """(l, 3, 3, c) of changes of the arm at s."""
        if self.carried is None:
            return on_both_sides(at, line_hz)
        line_hz = self.carried.lines(line_hz)
        left, right = self.carried.sides(line_hz)
        return np.asarray(np.einsum("lak,lkmc,lmb->labc", left, on_both_sides(at, line_hz), right))

    def _by_angles(self, s: Complex) -> Complex:
        """(l, k, k, j), per standard deviation of each joint's angle, of the arm alone."""
        z = dynamic_stiffness(*self.matrices, s)
        moved = np.linalg.solve(z, np.broadcast_to(self.out.T.astype(complex), (len(s), *self.out.T.shape)))
        turned = np.einsum("jan,lnb->labj", self.turned_out, moved)
        inside = np.einsum("lna,jnm,lmb->labj", moved, self.turned_mass, moved)
        return np.asarray(turned + np.swapaxes(turned, 1, 2) - s[:, None, None, None] ** 2 * inside)

    def half_band(self, line_hz: Array) -> Array:
        """(l, 3, 3): half the 95 % band of the receptance, of the size of its error."""
        columns, own = self.changes(line_hz)
        return np.asarray(SIGMAS_95 * np.linalg.norm(np.concatenate([columns, own], axis=-1), axis=-1))

    def relative(self, limit: ExactLimit) -> tuple[Array, float]:
        """What a limit changes, relative to it: per unit of each number (c,), and RMS by the misfit."""
        columns, own = self.changes(limit.lines_hz)
        change = np.einsum("lij,lijc->c", limit.slope, columns).real
        misfit = np.einsum("lij,lijm->lm", limit.slope, own)
        return change / limit.depth, float(np.linalg.norm(misfit) / np.sqrt(2) / limit.depth)


def uncertain_tip(
    model: FittedModel,
    system: System,
    point: Point,
    axes: Array,
    posture: Array,
    errors: Array,
    angle_std: float = 0.0,
    carried: Carried | None = None,
) -> UncertainTip:
    """The tip of a system at a posture (joints,), rad; axes (3, 3): of the tool, as rows; errors (p,):
    `misfit`; carried: what is coupled to the arm.
    """
    degrees = 3 if carried is None else carried.degrees
    factors, root = model.sensitivity(system, posture)
    shapes = system.site.shapes[:, system.free]
    engine, joints = system.site.engine, range(1, 1 + len(posture) * (angle_std > 0))
    turning = [engine.turning(joint, point.link, point.position) for joint in joints]
    size = shapes.shape[1]
    return UncertainTip(
        system.matrices(model.values),
        factors,
        motion_of(system, point, axes, degrees),
        root,
        model.values,
        errors,
        angle_std * np.array([shapes.T @ mass @ shapes for mass, _ in turning]).reshape(-1, size, size),
        _padded(angle_std * np.array([axes @ motion @ shapes for _, motion in turning]), degrees, size),
        carried,
    )


def _padded(turned: Array, degrees: int, size: int) -> Array:
    """(j, degrees, n): what angles do to the displacements; what they do to rotations is left out."""
    whole = np.zeros((len(turned), degrees, size))
    whole[:, :3] = turned.reshape(-1, 3, size)
    return whole


def motion_of(system: System, point: Point, axes: Array, degrees: int = 3) -> Array:
    """(degrees, n): displacement of a point along the rows of axes (3, 3), and its rotation about them where
    degrees is 6.
    """
    moved = axes @ system.base_jacobian(point.link, point.position)
    if degrees == 3:
        return np.asarray(moved)
    turned = axes @ system.site.engine.axes(point.link) @ system.jacobian(point.link, point.position)[3:]
    return np.concatenate([moved, turned])

"""Copies of a moving arm beside one that the engine moves, to first order in how far they are from it.

What an effect changes of a motion is small beside the motion, so that the arm need not be moved anew for
each: at each step the equations of motion are those of the first copy, of which a difference of state needs
only three matrices, the mass matrix and what inverse dynamics changes with position and with velocity.  A
hundred copies of forty coordinates take a quarter of the engine's time.  Springs, dampers, rotors and forces
of each copy are its own, of any size and as nonlinear as they are.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from identify.core.arrays import Array, Index, Mask
from identify.robot.engine_motion import Lanes, MovingArm, Passive, Tangent

_EVERY_S = 4e-3
"""Time between two linearisations, s: an arm turns by a quarter of a degree at 1 rad/s."""


class NearLanes(Lanes):
    """Lanes of which the engine moves the first `leading`, all with the same passive elements and bodies;
    lane n stays beside lane n modulo `leading`.
    """

    def __init__(
        self, arm: MovingArm, passive: Passive, position: Array, step_s: float, more: Array, leading: int
    ) -> None:
        first = Passive(*(rows[:leading] for rows in (passive.armature, passive.stiffness, passive.damping)))
        super().__init__(arm, first, position[:leading], step_s, more[:leading])
        self._passive, self._leading = passive, leading
        self.position, self.velocity = position.copy(), np.zeros_like(position)
        self.force = np.zeros_like(position)
        self._tangent = Tangent(arm, more[0], np.flatnonzero((more != more[0]).any(axis=0)))
        self._heavier = self._by_leader((more - more[0])[:, self._tangent.heavier])
        others = _different(arm, passive)[::leading]
        self._own = np.flatnonzero(others.any(axis=0))
        self._few = _listed(others[:, self._own])
        self._unit = np.eye(self._few.shape[1])
        self._every, self._steps = max(1, round(_EVERY_S / step_s)), 0
        self._first: _Pass | None = None

    def advance(self, dampers: Callable[[Array], Array] | None = None) -> None:
        """One step of all lanes."""
        if self._steps % self._every == 0:
            self._linearise()
        self._steps += 1
        self._first = None
        super().advance(dampers)

    def _linearise(self) -> None:
        """The matrices of each leading lane, (leading, n, n), where it is now."""
        lead, h = self._leading, self.step_s
        before = self.velocity if self._before is None else self._before
        rate = (self.velocity - before) / h
        motion = zip(self.position[:lead], self.velocity[:lead], rate[:lead], strict=True)
        parts = [self._tangent.at(*row) for row in motion]
        self._mass, self._by_position, self._by_velocity, self._masses, self._weights = (
            np.array(part) for part in zip(*parts, strict=True)
        )
        self._diagonal = self._passive.armature[0] + h * self._passive.damping[0]
        self._inverse = np.linalg.inv(self._mass + np.diag(self._diagonal))
        self._soft = self._inverse[:, self._own]
        own = self._own[self._few]
        self._softest = self._inverse[
            np.arange(lead)[:, None, None], own[:, None, :, None], own[:, None, None]
        ]

    def _stepped(self, position: Array, velocity: Array, force: Array, damping: Array) -> tuple[Array, Array]:
        lead, h = self._leading, self.step_s
        led = super()._stepped(position[:lead], velocity[:lead], force[:lead], damping[:lead])
        rate = (led[1] - velocity[:lead]) / h
        faster = velocity + h * self._beside(position, velocity, force, damping, rate)
        reached = position + h * faster
        reached[:lead], faster[:lead] = led
        return reached, faster

    def _rest(self) -> Array:
        """All that stand still do so in equilibrium, whichever dampers they have."""
        lead, damping = self._leading, np.zeros_like(self.position)
        position, force = self.position, self.force
        self.position, self.force = position[:lead], force[:lead]
        super()._rest()
        self.position, self.force = position, force
        rate = -2 / self.step_s * self.velocity
        away = self._beside(position, np.zeros_like(position), force, damping, rate)
        self.velocity, self._first = -self.step_s / 2 * away, None
        return np.asarray(3 * self.velocity)

    def _beside(self, position: Array, velocity: Array, force: Array, damping: Array, rate: Array) -> Array:
        """Acceleration (m, n) of all lanes under dampers (m, n) that act on the velocity after the step, from
        that of those that lead (leading, n).

        (M + A + h D) da = d(force - D (v + h a) - A a - K q) - R_q dq - R_v dv, with rotors A, a of the
        leading lane, d what is different from it, and R what inverse dynamics changes; what is a lane's own
        in A + h D is of low rank (Woodbury), at few coordinates.  A further pass has other dampers in the
        drives, and no more.
        """
        own, armature = self._own, self._passive.armature
        if self._first is None:
            springs = _beyond(self._by_leader(-self._passive.stiffness * position))
            pull = _product(_beyond(self._by_leader(position)), self._by_position)
            pull += _product(_beyond(self._by_leader(velocity)), self._by_velocity)
            springs -= pull
            push = force - damping * velocity
            left = springs + self._pushed(push, armature + self.step_s * damping, rate)
            self._first = _Pass(springs[..., own], left[..., own], _product(left, self._inverse), rate)
            if self._tangent.heavier.size:
                load = np.einsum("ri,rjik->rjk", rate, self._masses) + self._weights
                self._first.faster -= self._loaded(load)
            faster = self._first.faster.copy()
        else:
            first = self._first
            push = force[:, own] - damping[:, own] * velocity[:, own]
            held = armature[:, own] + self.step_s * damping[:, own]
            left = first.springs + self._pushed(push, held, rate[:, own])
            faster = first.faster + _product(left - first.left, self._soft)
            if self._tangent.heavier.size:
                faster -= self._loaded(np.einsum("ri,rjik->rjk", rate - first.rate, self._masses))
        extra = armature[:, own] + self.step_s * damping[:, own] - self._diagonal[own]
        extra, few = self._by_leader(extra), self._few[:, None]
        system = self._unit + self._softest * np.take_along_axis(extra, few, axis=2)[..., None, :]
        moved = np.take_along_axis(faster[..., own], few, axis=2)
        solved = np.zeros_like(extra)
        np.put_along_axis(solved, few, np.linalg.solve(system, moved[..., None])[..., 0], axis=2)
        faster -= _product(extra * solved, self._soft)
        return np.asarray(faster + rate).reshape(position.shape)

    def _pushed(self, push: Array, inertia: Array, rate: Array) -> Array:
        """Forces (m, k) less inertia (m, k) times the acceleration (leading, k) of those that lead, beyond
        theirs.
        """
        return _beyond(self._by_leader(push) - self._by_leader(inertia) * rate)

    def _loaded(self, load: Array) -> Array:
        """What loads (leading, heavier, n) of a share of one take of the acceleration of each lane."""
        return _product(_product(self._heavier, load), self._inverse)

    def _by_leader(self, rows: Array) -> Array:
        """(m / leading, leading, k) of rows (m, k)."""
        return rows.reshape(len(rows) // self._leading, self._leading, rows.shape[1])


@dataclass
class _Pass:
    """Of the first pass of a step: what springs and inertia push at a lane's own coordinates (c, leading, k),
    that with dampers and forces, and the acceleration (c, leading, n) before what is its own in inertia; and
    that of those that lead (leading, n).
    """

    springs: Array
    left: Array
    faster: Array
    rate: Array


def _beyond(rows: Array) -> Array:
    """Rows (c, leading, n) less those of the first."""
    return np.asarray(rows - rows[:1])


def _product(rows: Array, matrices: Array) -> Array:
    """Rows (c, leading, n) times a matrix (leading, n, k) each."""
    return np.asarray(np.matmul(rows.swapaxes(0, 1), matrices).swapaxes(0, 1))


def _different(arm: MovingArm, passive: Passive) -> Mask:
    """Which coordinates of each lane (m, n) have another inertia or damper than the first's, or may have:
    those of the drives, which rub.
    """
    other = np.any([rows != rows[0] for rows in (passive.armature, passive.damping)], axis=0)
    other[:, arm.drive] = True
    return np.asarray(other)


def _listed(rows: Mask) -> Index:
    """The columns that each row (c, n) has, (c, most), and after them others that it has not."""
    most = int(rows.sum(axis=1).max())
    return np.asarray(np.argsort(~rows, axis=1, kind="stable")[:, :most])

"""Copies of a moving arm beside one that the engine moves, to first order in how far they are from it.

What an effect changes of a motion is small beside the motion, so that the arm need not be moved anew for each:
at each step the equations of motion are those of the first copy, of which a difference of state needs only
three matrices, the mass matrix and what inverse dynamics changes with position and with velocity.  A step of a
hundred copies with forty coordinates so takes a tenth of the engine's time.  Springs, dampers, rotors and
forces of each copy are its own, of any size and as nonlinear as they are.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from identify.core.arrays import Array, Index
from identify.robot.engine_motion import Lanes, MovingArm, Passive

_EVERY_S = 4e-3
"""Time between two linearisations, s: an arm turns by a quarter of a degree at 1 rad/s."""


class NearLanes(Lanes):
    """Lanes of which the engine moves the first `leading`, all with the same passive elements and bodies; lane
    n stays beside lane n modulo `leading`.
    """

    def __init__(
        self, arm: MovingArm, passive: Passive, position: Array, step_s: float, more: Array, leading: int
    ) -> None:
        first = Passive(*(rows[:leading] for rows in (passive.armature, passive.stiffness, passive.damping)))
        super().__init__(arm, first, position[:leading], step_s, more[:leading])
        self._passive, self._leading = passive, leading
        self.position, self.velocity = position.copy(), np.zeros_like(position)
        self.force = np.zeros_like(position)
        self._tangent = arm.tangent(more[0], np.flatnonzero((more != more[0]).any(axis=0)))
        self._heavier = self._by_leader((more - more[0])[:, self._tangent.heavier])
        self._own = _different(arm, passive)
        self._rotors = passive.armature - passive.armature[0]
        self._every, self._steps = max(1, round(_EVERY_S / step_s)), 0

    def advance(self, dampers: Callable[[Array], Array] | None = None) -> None:
        """One step of all lanes."""
        if self._steps % self._every == 0:
            self._linearise()
        self._steps += 1
        super().advance(dampers)

    def _linearise(self) -> None:
        """The matrices of each leading lane, (leading, n, n), where it is now."""
        lead, h = self._leading, self.step_s
        before = self.velocity[:lead] if self._before is None else self._before[:lead]
        rate = (self.velocity[:lead] - before) / h
        parts = [
            self._tangent.at(*row)
            for row in zip(self.position[:lead], self.velocity[:lead], rate, strict=True)
        ]
        self._mass, self._by_position, self._by_velocity, self._masses, self._weights = (
            np.array(part) for part in zip(*parts, strict=True)
        )
        own = np.diag(self._passive.armature[0] + h * self._passive.damping[0])
        self._inverse = np.linalg.inv(self._mass + own)
        self._soft = self._inverse[:, self._own]
        self._softest = self._soft[:, :, self._own]

    def _stepped(self, position: Array, velocity: Array, force: Array, damping: Array) -> tuple[Array, Array]:
        lead, h = self._leading, self.step_s
        led = super()._stepped(position[:lead], velocity[:lead], force[:lead], damping[:lead])
        rate = (led[1] - velocity[:lead]) / h
        faster = velocity + h * (self._alike(rate) + self._beside(position, velocity, force, damping, rate, h))
        reached = position + h * faster
        reached[:lead], faster[:lead] = led
        return reached, faster

    def _rest(self) -> Array:
        lead = self._leading
        position, force, still = self.position, self.force, np.zeros_like(self.position)
        self.position, self.force = position[:lead], force[:lead]
        super()._rest()
        self.position, self.force = position, force
        rate = -2 / self.step_s * self.velocity
        self.velocity = -self.step_s / 2 * (
            self._alike(rate) + self._beside(position, still, force, still, rate, 0.0)
        )
        return np.asarray(3 * self.velocity)

    def _beside(
        self, position: Array, velocity: Array, force: Array, damping: Array, rate: Array, h: float
    ) -> Array:
        """Acceleration (m, n) of all lanes beyond that of those that lead (leading, n), where dampers (m, n)
        act on the velocity a time h later.

        M da = d(force - D v - K q - (A + h D) a) - R_q dq - R_v dv, with rotors A, d what is different from
        the leading lane, and R what inverse dynamics changes; A + h D are a lane's own on the diagonal of M
        (Woodbury).
        """
        push = force - damping * velocity - self._passive.stiffness * position
        push -= (self._passive.armature + h * damping) * self._alike(rate)
        moved, speed, left = (_beyond(self._by_leader(rows)) for rows in (position, velocity, push))
        left -= moved @ self._by_position + speed @ self._by_velocity
        if self._tangent.heavier.size:
            left -= self._heavier @ (np.einsum("ri,rjik->rjk", rate, self._masses) + self._weights)
        faster = left @ self._inverse
        extra = (self._rotors + h * (damping - self._passive.damping[0]))[:, self._own]
        extra = self._by_leader(extra)
        system = np.eye(len(self._own)) + self._softest[:, None] * extra[..., None, :]
        held = np.linalg.solve(system, faster[..., self._own, None])[..., 0]
        faster -= (extra * held) @ self._soft
        return np.asarray(faster.swapaxes(0, 1)).reshape(position.shape)

    def _by_leader(self, rows: Array) -> Array:
        """(leading, m / leading, k) of rows (m, k)."""
        return np.asarray(rows.reshape(-1, self._leading, rows.shape[1]).swapaxes(0, 1))

    def _alike(self, rows: Array) -> Array:
        """(m, n) of rows (leading, n) of those that lead."""
        return np.tile(rows, (len(self.position) // self._leading, 1))


def _beyond(rows: Array) -> Array:
    """Rows (leading, k, n) less the first of each."""
    return np.asarray(rows - rows[:, :1])


def _different(arm: MovingArm, passive: Passive) -> Index:
    """The coordinates whose inertia or damper may be different in different lanes: those of the drives, which
    rub, among them.
    """
    rows = (passive.armature, passive.damping)
    other = np.any([(row != row[0]).any(axis=0) for row in rows], axis=0)
    other[arm.drive] = True
    return np.flatnonzero(other)

"""Friction of a drive in simulated motion: Nagoya Eq. 11 (`identify.model.laws.friction`) as a damper."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from pydantic import Field

from identify.core.arrays import Array
from identify.core.config import Settings
from identify.model.laws.friction import EXPONENTIAL, Smoothing, smooth_sign, stribeck_decay
from identify.motion.numbers import Number, quantity

_ITERATIONS = 8
"""Of Newton's method for the velocity at which a drive creeps, at most."""
_ROUNDING = 4 * float(np.finfo(float).eps)
"""Of its last step: most drives slip, and their velocity is known before the first."""


class FrictionSettings(Settings):
    """Coefficients of Eq. 11 per joint."""

    coulomb: Number = quantity("N m", "F_c, at any speed", 0.0)
    viscous: Number = quantity("N m s/rad", "F_v, in proportion to speed", 0.0)
    stribeck: Number = quantity("N m", "F_s, what is added near standstill", 0.0)
    stribeck_velocity: Number = quantity("rad/s", "v_s, over which F_s dies out", 0.05, least=1e-9)
    creep_velocity: Number = quantity(
        "rad/s", "below this, sgn(v) is a slope: what a joint that sticks still creeps", 1e-4, least=1e-9
    )
    smoothing: Smoothing = Field(
        "root",
        description="how sgn(v) passes through zero over the creep velocity v_c: `root`,"
        " v / sqrt(v^2 + v_c^2), or `tanh`, tanh(v / v_c)",
    )


@dataclass
class FrictionDamper:
    """Eq. 11 as a damper for a step that takes dampers implicitly, found by passes, each called with the
    velocities that the last gave; `begin` before each step.

    numbers: coefficients by name, (lanes, joints); viscous: further viscous friction, N m s/rad; inertia:
    what a drive's own push must accelerate, kg m^2; step_s.  A drive's own step, a v + h F(v) = p with p as
    the last pass shows it, is solved, because friction over the last velocity takes many passes where a drive
    sticks or breaks loose: in closed form for true dry friction, whose root is then smoothed; for a
    hyperbolic tangent, which is steep where a root creeps, from there by Newton's method.
    """

    numbers: dict[str, Array]
    viscous: Array
    inertia: Array
    step_s: float
    smoothing: Smoothing = "root"
    _last: Array | None = field(default=None, init=False)

    def __post_init__(self) -> None:
        self._viscous = self.numbers["friction.viscous"] + self.viscous
        self._slipping = self.inertia + self.step_s * self._viscous
        self._creep = self.numbers["friction.creep_velocity"]
        self._stribeck = bool(np.any(self.numbers["friction.stribeck"]))

    def begin(self) -> None:
        """A new step, which knows nothing of the last."""
        self._last = None

    def __call__(self, velocity: Array) -> Array:
        """N m s/rad at velocities (lanes, joints), rad/s."""
        if self._last is not None:
            pushed = (self.inertia + self.step_s * self._last) * velocity
            size = np.abs(pushed)
            speed = np.maximum(size - self.step_s * self._dry(velocity), 0.0) / self._slipping
            if self.smoothing == "tanh":
                speed = self._creeping(size, speed)
            velocity = np.copysign(speed, pushed)
        self._last = np.asarray(self._dry(velocity) / self._over_sign(velocity) + self._viscous)
        return self._last

    def _creeping(self, pushed: Array, slipping: Array) -> Array:
        """The speed at which a drive pushed by `pushed` moves a step later; slipping: that of true dry
        friction.

        The step's equation rises with speed and bends down, so that Newton's method from below never passes
        its root: from where it slips, or from rest, whichever is faster.
        """
        creep, mass = self._creep, self._slipping
        lost = self.step_s * self._dry(slipping)
        steepest = lost / creep
        speed = np.maximum(slipping, pushed / (mass + steepest))
        for _ in range(_ITERATIONS):
            sign = np.tanh(speed / creep)
            change = (mass * speed + lost * sign - pushed) / (mass + steepest * (1 - sign * sign))
            moves = np.abs(change) > _ROUNDING * speed  # each by itself: lanes know nothing of each other
            if not moves.any():
                break
            speed = np.where(moves, speed - change, speed)
        return np.asarray(np.maximum(speed, 0.0))

    def _over_sign(self, velocity: Array) -> Array:
        """The velocity over its smooth sign, rad/s."""
        creep = self._creep
        if self.smoothing == "root":
            return np.asarray(np.sqrt(velocity**2 + creep**2))
        speed = np.maximum(np.abs(velocity), 1e-6 * creep)
        return np.asarray(speed / smooth_sign(speed, creep, self.smoothing))

    def _dry(self, velocity: Array) -> Array:
        if not self._stribeck:
            return self.numbers["friction.coulomb"]
        decay = stribeck_decay(velocity, self.numbers["friction.stribeck_velocity"], EXPONENTIAL)
        return np.asarray(self.numbers["friction.coulomb"] + self.numbers["friction.stribeck"] * decay)

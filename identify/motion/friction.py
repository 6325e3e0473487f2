"""Friction of a drive in simulated motion: Nagoya Eq. 11 (`identify.model.laws.friction`) as a damper."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from identify.core.arrays import Array
from identify.core.config import Settings
from identify.model.laws.friction import EXPONENTIAL, stribeck_decay
from identify.motion.numbers import Number, quantity


class FrictionSettings(Settings):
    """Coefficients of Eq. 11 per joint."""

    coulomb: Number = quantity("N m", "F_c, at any speed", 0.0)
    viscous: Number = quantity("N m s/rad", "F_v, in proportion to speed", 0.0)
    stribeck: Number = quantity("N m", "F_s, what is added near standstill", 0.0)
    stribeck_velocity: Number = quantity("rad/s", "v_s, over which F_s dies out", 0.05, least=1e-9)
    creep_velocity: Number = quantity(
        "rad/s", "below this, sgn(v) is a slope: what a joint that sticks still creeps", 1e-4, least=1e-9
    )


@dataclass
class FrictionDamper:
    """Eq. 11 as a damper for a step that takes dampers implicitly, found by passes, each called with the
    velocities that the last gave.

    numbers: coefficients by name, (lanes, joints); viscous: further viscous friction, N m s/rad; inertia:
    what a drive's own push must accelerate, kg m^2; step_s.  A drive's own step, a v + h F(v) = p with p as
    the last pass shows it, is solved in closed form, because friction over the last velocity takes many
    passes where a drive sticks or breaks loose.
    """

    numbers: dict[str, Array]
    viscous: Array
    inertia: Array
    step_s: float
    _last: Array | None = field(default=None, init=False)

    def __call__(self, velocity: Array) -> Array:
        """N m s/rad at velocities (lanes, joints), rad/s."""
        viscous = self.numbers["friction.viscous"] + self.viscous
        if self._last is not None:
            pushed = (self.inertia + self.step_s * self._last) * velocity
            free = np.maximum(np.abs(pushed) - self.step_s * self._dry(velocity), 0.0)
            velocity = np.sign(pushed) * free / (self.inertia + self.step_s * viscous)
        speed = np.sqrt(velocity**2 + self.numbers["friction.creep_velocity"] ** 2)
        self._last = np.asarray(self._dry(velocity) / speed + viscous)
        return self._last

    def _dry(self, velocity: Array) -> Array:
        decay = stribeck_decay(velocity, self.numbers["friction.stribeck_velocity"], EXPONENTIAL)
        return np.asarray(self.numbers["friction.coulomb"] + self.numbers["friction.stribeck"] * decay)

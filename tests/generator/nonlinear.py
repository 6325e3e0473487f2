"""Hidden effects whose share in the motion changes with its amplitude."""

from __future__ import annotations

from dataclasses import dataclass
from math import tanh

import numpy as np

from tests.generator.effect import TorqueEffect
from tests.generator.rigid import Array


@dataclass(frozen=True)
class JointFriction(TorqueEffect):
    """Coulomb friction parallel to the joint spring: torque_nm against the motion.

    The step at standstill is a tanh of width `transition_rad_per_s`, below which it is a strong viscous
    damper.
    """

    joint: int
    torque_nm: float
    transition_rad_per_s: float
    kind = "joint-friction"

    @property
    def sentence(self) -> str:
        """The joint."""
        return f"Coulomb friction joint {self.joint} ({self.torque_nm:.3g} N m, amplitude dependent)"

    def torque(self, angle: float, rate: float, memory: Array) -> float:
        """Against the motion, whatever its speed."""
        return -self.torque_nm * tanh(rate / self.transition_rad_per_s)


@dataclass(frozen=True)
class HardeningStiffness(TorqueEffect):
    """A cubic spring parallel to the joint spring: cubic_nm_per_rad3 times the third power of the deflection
    from rest.
    """

    joint: int
    cubic_nm_per_rad3: float
    kind = "hardening-stiffness"

    @property
    def sentence(self) -> str:
        """The joint."""
        return (
            f"hardening stiffness joint {self.joint} ({self.cubic_nm_per_rad3:.3g} N m/rad^3, amplitude"
            " dependent)"
        )

    def torque(self, angle: float, rate: float, memory: Array) -> float:
        """Back to rest."""
        return -self.cubic_nm_per_rad3 * angle**3


@dataclass(frozen=True)
class FrictionSprings(TorqueEffect):
    """A chain of springs, each held by a slider (Jenkins elements in parallel: Iwan, Journal of Applied
    Mechanics 33-4, 1966), beside the joint spring: stiff for small motion, softer and damped for large.

    stiffness (n,), N m/rad, of the springs; torque_nm (n,) at which their sliders give way.
    """

    joint: int
    stiffness: tuple[float, ...]
    torque_nm: tuple[float, ...]
    kind = "friction-springs"

    @property
    def sentence(self) -> str:
        """The joint."""
        return (
            f"{len(self.stiffness)} springs on sliders at joint {self.joint} (up to"
            f" {sum(self.torque_nm):.3g} N m, amplitude dependent)"
        )

    def start(self) -> Array:
        """Where the sliders are, rad."""
        return np.zeros(len(self.stiffness))

    def torque(self, angle: float, rate: float, memory: Array) -> float:
        """As far as the sliders hold; exact while the motion does not turn back within a time step."""
        return -float(np.array(self.stiffness) @ self._wound(angle, memory))

    def after(self, angle: float, memory: Array) -> Array:
        """The sliders that gave way have followed."""
        return angle - self._wound(angle, memory)

    def _wound(self, angle: float, memory: Array) -> Array:
        most = np.array(self.torque_nm) / np.array(self.stiffness)
        return np.asarray(np.minimum(np.maximum(angle - memory, -most), most))

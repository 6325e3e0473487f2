"""Hidden effects whose share in the motion changes with its amplitude."""

from __future__ import annotations

from dataclasses import dataclass
from math import tanh

from tests.generator.effect import TorqueEffect


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

    def torque(self, angle: float, rate: float) -> float:
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

    def torque(self, angle: float, rate: float) -> float:
        """Back to rest."""
        return -self.cubic_nm_per_rad3 * angle**3

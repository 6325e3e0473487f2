"""FRFs of a system with nonlinear joint torques as a hammer impact measures them, and their
sensitivities.

The torques T(t) of the simulated impact (`identify.model.transient`) are forces like others, so with F the
transform of the impact

    Z(s) X = B F - E T(s) - e^(-s R) ((s M + C) x(R) + M v(R)),   H_k = (s^k X + e^(-s R) (s^(k-1) x(R) +
    s^(k-2) v(R))) / F

where R is the length of the record, the terms with x(R) and v(R) as in `identify.model.truncation`.  All but
T, x(R) and v(R) is linear and exact; how these three change with the parameters comes from further
simulations with parameters moved a little.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identify.core.arrays import Array, Complex
from identify.model.frf import dynamic_stiffness
from identify.model.truncation import EndOfRecord

Matrices = tuple[Array, Array, Array]


@dataclass(frozen=True)
class ImpactedFrf:
    """What nonlinear torques and the end of the record take off a unit force: used like an `EndOfRecord`.

    end: of the whole impact; impulse (lines,): its transform F, N s; coordinates (n, J): what the torques
    turn; torque (lines, J, inputs): T(s) / F(s); slopes (lines, J, inputs, p): its derivatives by parameters.
    """

    end: EndOfRecord
    impulse: Complex
    coordinates: Array
    torque: Complex
    slopes: Complex

    def load(self, mass: Array, damping: Array, s: Complex) -> Complex:
        """(lines, n, inputs): what is taken off the force."""
        return np.asarray(
            self.coordinates @ self.torque + self.end.load(mass, damping, s) / self.impulse[:, None, None]
        )

    def motion(self, s: Complex, power: int) -> Complex | float:
        """(lines, n, inputs): what is added to s^power X."""
        return self.end.motion(s, power) / self.impulse[:, None, None]

    def gradient(self, matrices: Matrices, s: Complex, to_out: Complex, power: int) -> Complex:
        """(lines, outputs, inputs, p): what H changes by as the torques and the end of the record do; to_out
        is S Z^-1.
        """
        seen = to_out @ self.coordinates
        moved = (seen @ self.slopes.reshape(*self.slopes.shape[:2], -1)).reshape(
            *seen.shape[:2], *self.slopes.shape[2:]
        )
        end = self.end.gradient(matrices, s, to_out, power)
        return np.asarray(end / self.impulse[:, None, None, None] - (s**power)[:, None, None, None] * moved)


def impacted_frf(
    matrices: Matrices, s: Complex, out: Array, force: Array, power: int, impacted: ImpactedFrf
) -> Complex:
    """H (lines, outputs, inputs) at s (lines,); out (outputs, n), force (n, inputs)."""
    mass, damping, _ = matrices
    moved = np.linalg.solve(dynamic_stiffness(*matrices, s), force - impacted.load(mass, damping, s))
    return np.asarray(out @ ((s**power)[:, None, None] * moved + impacted.motion(s, power)))

"""Springs that a model has by compliance, which is zero where a joint is rigid
(`identify.model.compliant`).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from identify.core.arrays import Array, Index

_RIGID = 2e4 * np.pi
"""rad/s: as fast as numbers allow beside modes of a robot."""


@dataclass(frozen=True)
class Compliances:
    """Springs given by compliance: columns (n, r) of motions q per root of compliance, each owned by one
    spring; compliance, retardation (springs,): numbers of their parameters.
    """

    columns: Array
    owner: Index
    compliance: Index
    retardation: Index

    @cached_property
    def others(self) -> Index:
        """Numbers of the coordinates that no such spring holds."""
        return np.flatnonzero(~np.any(self.columns, axis=1))

    def at(self, values: Array) -> tuple[Array, Array]:
        """Compliance and retardation time (r,) of each column at values (parameters,)."""
        return values[self.compliance][self.owner], values[self.retardation][self.owner]

    def stiff(self, values: Array, mass: Array) -> tuple[Array, Array]:
        """Stiffness and damping (n, n) that springs make, for modes; rigid ones are of ten kilohertz, so
        damped that they do not oscillate.
        """
        c, tau = self.at(values)
        back = np.linalg.pinv(self.columns)
        held = np.einsum("nr,nm,mr->r", self.columns, mass, self.columns)
        least = 1.0 / (np.maximum(held, 1e-12) * _RIGID**2)
        k, tau = 1.0 / np.maximum(c, least), np.where(c > least, tau, np.maximum(tau, 10 / _RIGID))
        return back.T @ (k[:, None] * back), back.T @ ((k * tau)[:, None] * back)

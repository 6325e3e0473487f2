"""What more effects would gain beside a dense fit, by the quadratic about where they begin."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from identify.core.arrays import Array, Mask
from identify.core.bounded import bounded_step
from identify.discovery.sparse.dictionary import damping, gain_of
from identify.discovery.sparse.fit import Found, begun
from identify.discovery.sparse.objective import Local, Penalised
from identify.discovery.sparse.unknowns import Unit
from identify.model.effects.base import Effect


@dataclass(frozen=True)
class Quadratic:
    """A fit with more effects about where these begin: curvature and slope of its objective without prices,
    bounds of a step; present: unknowns of the fit that move; squares and count as there.
    """

    fit: Penalised
    x: Array
    local: Local
    present: Mask

    @classmethod
    def about(cls, found: Found, effects: tuple[Effect, ...], values: Mapping[str, float]) -> Quadratic:
        """Where the new ones begin."""
        unknowns, x = begun(found, effects, values)
        fit = Penalised(unknowns, price=0.0)
        present = unknowns.present(x) & np.isin(unknowns.names, found.unknowns.names)
        return cls(fit, x, fit.local(x), present)

    @property
    def units(self) -> list[Unit]:
        """All that may be missing."""
        return self.fit.unknowns.units

    def gain(self, units: Sequence[Unit]) -> float:
        """What some units would gain beside what is present, in units of log likelihood with a free scale."""
        return self._step(self._moving(units))[1] - self._by_itself

    @cached_property
    def _by_itself(self) -> float:
        """What the fit gains without anything new."""
        return self._step(self.present)[1]

    @cached_property
    def _objective(self) -> tuple[Array, Array]:
        """Curvature (f, f) and slope (f,)."""
        return self.fit.quadratic(self.x, self.local)

    def there(self, units: Sequence[Unit]) -> dict[str, float]:
        """Values of the unknowns that move where some units are, by name."""
        moving = self._moving(units)
        values = self.fit.unknowns.to_values(self.x + self._step(moving)[0])[self.fit.unknowns.free]
        names = self.fit.unknowns.names
        return {names[n]: float(values[n]) for n in np.flatnonzero(moving)}

    def _moving(self, units: Sequence[Unit]) -> Mask:
        moving = self.present.copy()
        moving[[n for unit in units for n in unit.all]] = True
        return moving

    def _step(self, moving: Mask) -> tuple[Array, float]:
        """(f,) of those that move, and what it gains."""
        curvature, slope = self._objective
        lower, upper = (side - self.x for side in self.fit.unknowns.limits)
        own, change = np.ix_(moving, moving), np.zeros(len(self.x))
        size = np.diag(curvature)[moving]
        damped = curvature[own] + np.diag(np.where(size > 0, damping(self.local.gap) * size, 1.0))
        change[moving] = bounded_step(damped, slope[moving], lower[moving], upper[moving])
        fall = float(slope @ change - 0.5 * change @ curvature @ change) * self.local.gap**2
        return change, gain_of(2 * fall, self.local.product[-1, -1], self.fit.count)

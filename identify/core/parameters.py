"""Parameters: numbers to identify, how a config gives them, and the scale on which they are searched."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from identify.core.arrays import Array
from identify.core.config import Settings
from identify.core.errors import InputError


@dataclass(frozen=True)
class Parameter:
    """One number to identify: value = initial unless fitted; searched on a log scale where `log`; not at all
    where not `free`.  nuisance: a nuisance parameter, about zero in units of its standard deviation.
    prior_std: before any data: standard deviation about zero, or, where `log`, of the logarithm about the
    start, in discovery; 0 where nothing is known.
    """

    name: str
    unit: str
    initial: float
    lower: float
    upper: float
    log: bool = True
    free: bool = True
    nuisance: bool = False
    prior_std: float = 0.0

    @property
    def std(self) -> float:
        """Standard deviation about zero before any data, in its unit; 0 where none is known."""
        return 1.0 if self.nuisance else 0.0 if self.log else self.prior_std

    def at(self, value: float, *, free: bool | None = None) -> Parameter:
        """The same with another initial value, and free or not as it is unless said; in half the time of
        `dataclasses.replace`, and at once where nothing changes: models have hundreds of parameters.
        """
        free = self.free if free is None else free
        if value == self.initial and free == self.free:
            return self
        rest = self.log, free, self.nuisance, self.prior_std
        return Parameter(self.name, self.unit, value, self.lower, self.upper, *rest)


class Values(Settings):
    """Start, bounds and freedom of a group of parameters; a list gives one number per place, a number serves
    all.
    """

    initial: float | list[float] | None = Field(
        None, description="start value, or one per place; default: from the robot's inertia"
    )
    bounds: tuple[float, float] | None = Field(
        None, description="smallest and largest value; default: a factor of 1000 either side"
    )
    fixed: bool = Field(False, description="true: kept at `initial`, not fitted")


class DampingValues(Values):
    """Values of viscous dampers, which may be given as a damping ratio of the coordinate on its own."""

    damping_ratio: float = Field(
        0.03,
        gt=0,
        lt=1,
        description="start value as c = 2 zeta sqrt(k m), m the inertia the coordinate moves",
    )


_SPAN = 1e3


def spread(values: Values, default: np.ndarray, where: str) -> np.ndarray:
    """One start value per place, from a number, a list or the default; a list of another length is an
    InputError.
    """
    if values.initial is None:
        return default
    given = np.atleast_1d(np.asarray(values.initial, dtype=float))
    if given.size not in (1, default.size):
        raise InputError(
            f"{where}.initial", f"{given.size} values", f"one, or {default.size}: one per coordinate"
        )
    return np.broadcast_to(given, default.shape).copy()


def parameter(
    name: str,
    unit: str,
    initial: float,
    values: Values,
    where: str,
    *,
    log: bool = True,
    span: float = _SPAN,
) -> Parameter:
    """A parameter whose start and bounds agree; crossed bounds or a start outside them are an InputError.

    span: the factor either side of the start where `values` gives no bounds.
    """
    lower, upper = values.bounds or (initial / span, initial * span)
    if not lower < upper:
        raise InputError(f"{where}.bounds", f"[{lower:g}, {upper:g}]", "the smaller bound first")
    if log and lower <= 0:
        raise InputError(
            f"{where}.bounds", f"lower bound {lower:g}", "a positive number, because the scale is logarithmic"
        )
    if not lower <= initial <= upper:
        expected = f"a value within its bounds [{lower:g}, {upper:g}]"
        raise InputError(where, f"start value {initial:g} of {name}", expected, "set `bounds` or `initial`")
    return Parameter(name, unit, float(initial), lower, upper, log, not values.fixed)


def single_parameter(
    name: str, unit: str, values: Values, where: str, *, default: float = 0.0, log: bool = False
) -> Parameter:
    """The parameter of a group that has only one; `default` is its start value where none is given."""
    return parameter(name, unit, float(spread(values, np.array([default]), where)[0]), values, where, log=log)


@dataclass(frozen=True)
class Scale:
    """Free parameters as the optimizers see them: ln(value) on a log scale; value / step on a linear one,
    step a tenth of its range, or one for a nuisance, which has no bounds.
    """

    parameters: tuple[Parameter, ...]

    @property
    def free(self) -> NDArray[np.intp]:
        """Numbers of the free parameters."""
        return np.array([number for number, p in enumerate(self.parameters) if p.free], dtype=int)

    @property
    def errors(self) -> bool:
        """Whether nuisances are among the free ones."""
        return any(p.nuisance and p.free for p in self.parameters)

    @property
    def _log(self) -> NDArray[np.bool_]:
        return np.array([p.log for p in self.parameters if p.free], dtype=bool)

    @property
    def _step(self) -> Array:
        return np.array(
            [1.0 if p.log or p.nuisance else (p.upper - p.lower) / 10 for p in self.parameters if p.free]
        )

    def to_x(self, values: Array) -> Array:
        """(..., free) from values of all parameters (..., parameters)."""
        free = values[..., self.free]
        return np.where(self._log, np.log(np.where(self._log, free, 1.0)), free / self._step)

    def to_values(self, x: Array) -> Array:
        """(..., parameters) from x (..., free); fixed parameters keep their initial value."""
        values = np.broadcast_to(
            np.array([p.initial for p in self.parameters]), (*x.shape[:-1], len(self.parameters))
        ).copy()
        values[..., self.free] = np.where(self._log, np.exp(np.where(self._log, x, 0.0)), x * self._step)
        return values

    def slope(self, x: Array) -> Array:
        """d value / d x, (free,)."""
        return np.where(self._log, np.exp(np.where(self._log, x, 0.0)), self._step)

    def bounds(self) -> tuple[Array, Array]:
        """Lower and upper bounds of x, each (free,)."""
        lower, upper = (np.array([getattr(p, side) for p in self.parameters]) for side in ("lower", "upper"))
        return self.to_x(lower), self.to_x(upper)

    def prior_information(self) -> Array:
        """(free,): what is known of x before any data, per its unit squared: bounds are a 95 % interval, but
        for what has a standard deviation, as nuisances have, of one.
        """
        lower, upper = self.bounds()
        std = np.array([p.std for p in self.parameters if p.free])
        known = std > 0
        return np.where(known, self._step / np.where(known, std, 1.0), 4 / (upper - lower)) ** 2

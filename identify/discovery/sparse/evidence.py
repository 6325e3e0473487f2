"""What the data say for each unit of a fitted model, from the curvature at the optimum alone."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from identify.core.arrays import Array, Index
from identify.core.parameters import Scale
from identify.discovery.sparse.names import of_sensor
from identify.discovery.sparse.unknowns import Unit, Unknowns
from identify.model.effects.base import Effect
from identify.model.effects.measurement import MeasurementEffect
from identify.model.effects.sensor_matrix import SensorMatrix
from identify.vibration.problem import Problem
from identify.vibration.uncertainty import uncertainty

_MISREAD = 0.005
"""Share of how much a fault of the measurement is off, where there is one, that nobody calls a fault: gains
by a half per cent.
"""


def inflation(problem: Problem, values: Array) -> float:
    """How many times the variance of the parameters is that of independent residuals: for those that the
    data determine, on average (`identify.fitting.uncertainty`).
    """
    found = uncertainty(problem.targets(), Scale(problem.parameters), values, disagreement=False)
    ratio = (found.std / found.independent_std) ** 2
    known = np.isfinite(ratio) & (found.std < np.inf)
    return max(float(np.median(ratio[known])) if known.any() else 1.0, 1.0)


PAYS = 3
"""Parameters that whatever enters must pay for at least."""


def believable(problem: Problem, values: Mapping[str, float]) -> bool:
    """Whether no nuisance parameter, in its standard deviations, is so far out that parameters of its own
    would be likelier; the forms of links, which nobody states, may be.
    """
    errors = [abs(values[one.name]) for one in problem.nuisances.entries if one.group != "form"]
    count = sum(2 * target.sigma.size for target in problem.targets().frf)
    return 0.5 * max(errors, default=0.0) ** 2 < PAYS * price(count)


class Weighed(NamedTuple):
    """What the data and priors say at a point of a fit: information (f, f), the product (f + 1, f + 1) of [J
    r] behind it, the variance that is one unit of noise, and the price of a parameter.
    """

    information: Array
    product: Array
    scale: float
    price: float


def weighed(unknowns: Unknowns, x: Array, product: Array, inflated: float) -> Weighed:
    """All of that at x (f,), where correlated residuals inflate variances so many times."""
    scale = max(product[-1, -1] / unknowns.count, 1.0) * inflated
    information = product[:-1, :-1] / scale + np.diag(unknowns.precision_at(x))
    return Weighed(information, product, scale, price(unknowns.count, inflated))


def price(count: int, inflated: float = 1.0) -> float:
    """Half ln N: what each parameter costs in units of log likelihood (Schwarz, Ann. Statist. 6 (1978)
    461-464), N real numbers measured, less by how much correlated residuals inflate variances.
    """
    return 0.5 * float(np.log(max(count / inflated, 2.0)))


def supports(unknowns: Unknowns, x: Array, known: Weighed) -> dict[str, float]:
    """Natural logarithm of the odds that each unit is there at x (f,), all others staying (Laplace, unit
    information).

    Half of a' S a less half ln(N / c) for each unknown, S the information about the amplitudes a with all
    else eliminated, c the inflation of the variance; without the unit, the squares are larger by a' S a.
    A free sensor counts as the simplest fault that says the same: its matrix is how it is looked for.
    """
    away, counted, found = unknowns.away(x), unknowns.counted(x), dict[str, float]()
    for unit in unknowns.units:
        if isinstance(unit.effect, SensorMatrix):
            _, form, squares = fault_of(unit, unknowns, away, known)
            count = float(len(form))
        else:
            own = away[unit.amplitudes]
            squares = float(own @ _weight(unit, unknowns, known) @ own)
            count = float(counted[unit.all].sum())
        found[unit.name] = 0.5 * squares - known.price * max(count, 1.0)
    return found


def fault_of(
    unit: Unit, unknowns: Unknowns, away: Array, known: Weighed
) -> tuple[Effect, dict[str, float], float]:
    """The simplest fault that says what a free sensor's matrix does, away (f,) from none; its values, and how
    much larger squares are without it.
    """
    error, weight = away[unit.amplitudes], _weight(unit, unknowns, known)
    effect, values, said = of_sensor(int(unit.name), error.reshape(3, 3), weight, known.price)
    off = error - said.ravel()
    return effect, values, float(error @ weight @ error - off @ weight @ off)


def _weight(unit: Unit, unknowns: Unknowns, known: Weighed) -> Array:
    """Information about a unit's amplitudes with all else eliminated."""
    return eliminated(known.information, unit.amplitudes, _floor_of(unit, unknowns))


def _floor_of(unit: Unit, unknowns: Unknowns) -> float:
    """What an instrument is off by without anybody calling it a fault, on the search scale."""
    return _MISREAD * unknowns.usual(unit) if isinstance(unit.effect, MeasurementEffect) else 0.0


def eliminated(information: Array, own: Index, floor: float = 0.0) -> Array:
    """Information about some unknowns with all others free: the inverse of their block of the covariance,
    in which `floor` is the standard deviation of what does not count.
    """
    return np.asarray(np.linalg.inv(covariance(information, own) + floor**2 * np.eye(len(own))))


def covariance(information: Array, own: Index) -> Array:
    """Of some unknowns among others of very different sizes."""
    size = np.sqrt(np.maximum(np.diag(information), 1e-300))
    scaled = information / np.outer(size, size) + 1e-12 * np.eye(len(size))
    return np.asarray(np.linalg.inv(scaled)[np.ix_(own, own)] / np.outer(size[own], size[own]))


def solved(information: Array, right: Array) -> Array:
    """(f, k): the inverse of information (f, f) about unknowns of very different sizes times right (f, k)."""
    size = np.sqrt(np.maximum(np.diag(information), 1e-300))[:, None]
    scaled = information / (size * size.T) + 1e-9 * np.eye(len(size))
    return np.asarray(np.linalg.solve(scaled, right / size) / size)

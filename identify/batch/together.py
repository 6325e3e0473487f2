"""All fits of a batch together (`identify.batch.population`): what each says, with which covariance, and what
is in common.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase

import numpy as np
from numpy.typing import NDArray

from identify.batch.population import Estimate, Population, holm, homogeneity, population, scatter_interval
from identify.core.arrays import Array, Index
from identify.core.errors import InputError
from identify.fitting.tables import scale_of
from identify.results.batch import ParametersByPosture, PopulationTable
from identify.results.fit import FitResult, StatedUncertainty
from identify.results.tables import ParameterTable

_LEVEL = 0.01
"""Probability below which differences between fits are not put down to chance."""
_OF_THE_ROBOT = ("masses", "centres of mass", "inertias", "places of joints")
"""Errors that fits with the same description of the robot have in common."""
Flags = NDArray[np.bool_]
Key = tuple[str, str, str, float]


@dataclass(frozen=True)
class Said:
    """What is taken from the result of a fit: its parameters with their correlation, what was stated
    uncertain, and the text that describes its robot.
    """

    parameters: ParameterTable
    correlation: Array
    stated: StatedUncertainty | None
    described: str

    @classmethod
    def of(cls, fit: FitResult) -> Said:
        """Of one result."""
        described = "" if fit.description is None else fit.description.robot
        return cls(fit.parameters, fit.correlation, fit.uncertainty, described)


@dataclass(frozen=True)
class _Fitted:
    """What one fit says of parameters, columns (k,) among all: value (k,), covariance (k, k), and of errors
    of the robot, by key, what a standard deviation of each adds to them.
    """

    columns: Index
    value: Array
    covariance: Array
    errors: Mapping[Key, Array]
    described: str


def together(
    fits: Sequence[Said | None], p: ParametersByPosture, shared: Sequence[str]
) -> PopulationTable | None:
    """Mean and scatter of every parameter, and what becomes of each fit with all others; None of fewer than
    two fits.  shared: patterns of the names of parameters that are the same in all.

    InputError for a pattern that no parameter has.
    """
    same = _shared(p.name, shared)
    fitted = [None if fit is None else _fitted(fit, p, p.usable[row]) for row, fit in enumerate(fits)]
    rows = [row for row, one in enumerate(fitted) if one is not None and len(one.columns)]
    known = [one for one in fitted if one is not None and len(one.columns)]
    if len(known) < 2:
        return None
    common = _common(known)
    estimates = [_estimate(one, common) for one in known]
    found = population(estimates, ~same)
    given = [replace(one, value=one.value - one.common @ found.errors) for one in estimates]
    return _table(found, given, rows, p, same)


def _shared(names: Sequence[str], patterns: Sequence[str]) -> Flags:
    for pattern in patterns:
        if not any(fnmatchcase(name, pattern) for name in names):
            expected = "names such as " + ", ".join(names[:3])
            fix = "correct it and run again with `--resume`"
            raise InputError("joint.shared", f"no parameter is called {pattern!r}", expected, fix)
    return np.array([any(fnmatchcase(name, one) for one in patterns) for name in names], dtype=bool)


def _fitted(fit: Said, p: ParametersByPosture, usable: Flags) -> _Fitted:
    table, stated = fit.parameters, fit.stated
    scale = scale_of(table)
    free, column = scale.free, {name: k for k, name in enumerate(p.name)}
    own = [n for n, row in enumerate(free) if usable[column[table.name[row]]]]
    slope = np.where(table.log[free], 1.0, scale.slope(scale.to_x(table.value)))
    value = np.where(table.log[free], np.log(np.where(table.log[free], table.value[free], 1.0)), 0.0)
    value = np.where(table.log[free], value, table.value[free])
    std, errors = slope * table.std[free], dict[Key, Array]()
    if stated is not None and stated.root is not None:
        cross = -slope[:, None] * (stated.root @ stated.root.T)[: len(free), len(free) :]
        keys = zip(stated.kind, stated.place, stated.change, stated.stated.tolist(), strict=True)
        errors = {key: cross[own, n] for n, key in enumerate(keys) if key[0] in _OF_THE_ROBOT}
    return _Fitted(
        np.array([column[table.name[free[n]]] for n in own], dtype=int),
        value[own],
        (std[:, None] * fit.correlation * std)[np.ix_(own, own)],
        errors,
        fit.described,
    )


def _common(fitted: Sequence[_Fitted]) -> list[Key]:
    """The errors that all fits have in common: none where robots are described differently."""
    if len({one.described for one in fitted}) > 1:
        return []
    return [key for key in fitted[0].errors if all(key in one.errors for one in fitted)]


def _estimate(one: _Fitted, common: Sequence[Key]) -> Estimate:
    slopes = np.array([one.errors[key] for key in common]).reshape(len(common), len(one.columns)).T
    return Estimate(one.columns, one.value, one.covariance - slopes @ slopes.T, slopes)


def _table(
    found: Population, given: Sequence[Estimate], rows: Sequence[int], p: ParametersByPosture, same: Flags
) -> PopulationTable:
    count = len(p.name)
    values, std = np.full((2, len(given), count), np.nan)
    for row, one in enumerate(given):
        values[row, one.numbers] = one.value
        std[row, one.numbers] = np.sqrt(np.diag(one.covariance))
    tests = [homogeneity(values[:, k], std[:, k], np.zeros((len(given), 0))) for k in range(count)]
    p_value = holm(np.array([np.nan if test is None else test.p_value for test in tests]))
    known = np.isfinite(values)
    limits = np.array([scatter_interval(values[own, k], std[own, k]) for k, own in enumerate(known.T)])
    several = known.sum(axis=0) > 1

    def fitted(x: Array) -> Array:
        """In the units of the parameters."""
        return np.where(p.log, np.exp(np.where(p.log, x, 0.0)), x)

    def of_all(x: Array) -> Array:
        """(fits, p), NaN for fits that failed."""
        table = np.full((len(p.value), count), np.nan)
        table[list(rows)] = fitted(x)
        return table

    mean, half = found.mean, found.mean_half
    own, own_half = found.value, found.half
    return PopulationTable(
        parameter=p.name,
        log=p.log,
        shared=same,
        count=known.sum(axis=0),
        mean=fitted(mean),
        mean_low_95=fitted(mean - half),
        mean_high_95=fitted(mean + half),
        scatter=np.where(several & ~same, found.scatter, np.nan),
        scatter_low_95=np.where(same, np.nan, limits[:, 0]),
        scatter_high_95=np.where(same, np.nan, limits[:, 1]),
        p_value=p_value,
        differs=p_value < _LEVEL,
        value=of_all(own),
        low_95=of_all(own - own_half),
        high_95=of_all(own + own_half),
        common=len(found.errors),
    )

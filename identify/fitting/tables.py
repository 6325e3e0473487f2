"""The tables of a fit that every result of one keeps."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from identify.core.arrays import Array
from identify.core.parameters import Parameter, Scale
from identify.fitting.fit import Fit
from identify.fitting.uncertainty import Uncertainty
from identify.results import tables
from identify.results.tables import ParameterTable


def parameter_table(
    p: Sequence[Parameter], fitted: Array, trusted: Uncertainty, scale: Scale
) -> tables.ParameterTable:
    """All parameters with the identifiability of the free ones; fitted (parameters,)."""
    free = scale.free

    def spread(values: Array) -> Array:
        full = np.full(len(p), np.nan)
        full[free] = values
        return full

    status = np.full(len(p), "fixed", dtype=object)
    status[free] = trusted.status
    return tables.ParameterTable(
        name=tuple(x.name for x in p),
        unit=tuple(x.unit for x in p),
        initial=np.array([x.initial for x in p]),
        value=fitted,
        lower=np.array([x.lower for x in p]),
        upper=np.array([x.upper for x in p]),
        log=np.array([x.log for x in p]),
        free=np.array([x.free for x in p]),
        std=spread(trusted.std),
        low_95=spread(trusted.low),
        high_95=spread(trusted.high),
        status=tuple(status),
    )


def start_table(fit: Fit, size: int | None = None) -> tables.StartTable:
    """One row per start of a fit; size: of so many parameters, by default of all."""
    return tables.StartTable(
        initial=np.array([s.initial[:size] for s in fit.starts]),
        final=np.array([s.final[:size] for s in fit.starts]),
        cost=np.array([s.cost for s in fit.starts]),
        evaluations=np.array([s.evaluations for s in fit.starts]),
        seconds=np.array([s.seconds for s in fit.starts]),
        converged=np.array([s.converged for s in fit.starts]),
        sentence=tuple(s.sentence for s in fit.starts),
    )


def scale_of(table: ParameterTable) -> Scale:
    """The search scale that the standard deviations of a table are on."""
    rows = zip(
        table.name,
        table.unit,
        table.initial.tolist(),
        table.lower.tolist(),
        table.upper.tolist(),
        table.log.tolist(),
        table.free.tolist(),
        strict=True,
    )
    return Scale(tuple(Parameter(*row) for row in rows))

"""Several results side by side: cost and gap, parameters, modes and errors, as tables of texts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from identify.results.fit import FitResult, MeasurementResult


@dataclass(frozen=True)
class SideBySide:
    """A table: title, column names (the first one names the rows) and rows of texts; `-` where a result has
    no such thing.
    """

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


def compare(results: Sequence[FitResult], labels: Sequence[str]) -> list[SideBySide]:
    """The tables of a comparison; parameters, modes and measurements are matched by name."""
    header = [
        ("cost kind", [r.cost_kind for r in results]),
        ("cost", [f"{r.cost:.4g}" for r in results]),
        ("gap", [_number(r.gap) for r in results]),
        ("gap on validation", [_number(r.gap_validation) for r in results]),
        ("converged", ["yes" if r.converged else "no" for r in results]),
        ("seconds", [f"{r.seconds:.1f}" for r in results]),
    ]
    return [
        SideBySide("runs", ("", *labels), tuple((name, *texts) for name, texts in header)),
        SideBySide("parameters", ("parameter", *labels), tuple(_parameters(results))),
        SideBySide("modes, Hz (damping %)", ("mode", *labels), tuple(_modes(results))),
        SideBySide("errors: gap, relative FRF error", ("measurement", *labels), tuple(_errors(results))),
    ]


def _parameters(results: Sequence[FitResult]) -> list[tuple[str, ...]]:
    names = dict.fromkeys(name for r in results for name in r.parameters.name)
    return [(name, *(_parameter(r, name) for r in results)) for name in names]


def _parameter(result: FitResult, name: str) -> str:
    p = result.parameters
    if name not in p.name:
        return "-"
    row = p.name.index(name)
    if not p.free[row]:
        return f"{p.value[row]:.4g} (fixed)"
    return f"{p.value[row]:.4g} [{p.low_95[row]:.4g}, {p.high_95[row]:.4g}]"


def _modes(results: Sequence[FitResult]) -> list[tuple[str, ...]]:
    rows = []
    for name in _measurements(results):
        found = [r.measurements.get(name) for r in results]
        count = max(len(m.modes.frequency_hz) for m in found if m is not None)
        rows += [(f"{name}, mode {mode + 1}", *(_mode(m, mode) for m in found)) for mode in range(count)]
    return rows


def _mode(measurement: MeasurementResult | None, mode: int) -> str:
    if measurement is None or mode >= len(measurement.modes.frequency_hz):
        return "-"
    return f"{measurement.modes.frequency_hz[mode]:.3f} ({100 * measurement.modes.damping_ratio[mode]:.2f})"


def _errors(results: Sequence[FitResult]) -> list[tuple[str, ...]]:
    return [(name, *(_error(r.measurements.get(name)) for r in results)) for name in _measurements(results)]


def _error(measurement: MeasurementResult | None) -> str:
    if measurement is None:
        return "-"
    relative = (
        ""
        if measurement.frf is None
        else f", {100 * float(np.median(measurement.frf.relative_error)):.2g} % (median)"
    )
    return f"{_number(measurement.gap)}{relative}"


def _measurements(results: Sequence[FitResult]) -> list[str]:
    return list(dict.fromkeys(name for r in results for name in r.measurements))


def _number(value: float) -> str:
    return "-" if np.isnan(value) else f"{value:.3f}"

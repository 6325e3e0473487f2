"""The fits of a batch side by side, from their result files: parameters, modes and errors by posture, and
what depends on posture.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from identify.batch.loop import BatchIndex
from identify.batch.population import Homogeneity, holm, homogeneity
from identify.batch.together import Said, together
from identify.batch.verdict import (
    dependence_notes,
    dependence_verdict,
    notes,
    population_notes,
    population_verdict,
    verdict,
)
from identify.core.arrays import Array
from identify.core.thresholds import SIGMAS_95
from identify.fitting.tables import scale_of
from identify.results import file as result_file
from identify.results import fit as results
from identify.results import tables
from identify.results.batch import BatchResult, DependenceTable, JobTable, ModesByPosture, ParametersByPosture
from identify.results.fit import FitResult

_BELIEVED = ("determined", "weak")
_AT_BOUND = 1e-6
_LEVEL = 0.01
"""Probability below which a difference between postures is not put down to chance."""


@dataclass(frozen=True)
class Row:
    """What is taken from one result."""

    parameters: tables.ParameterTable
    posture_deg: Array
    tool_m: Array
    modes: Array
    gap: float
    cost: float
    relative_error: float
    converged: bool
    said: Said | None


def summarise(
    name: str,
    index: BatchIndex,
    files: dict[str, Path],
    joint: Path | None,
    workers: str,
    seconds: float,
    came_from: tables.Provenance,
    shared: Sequence[str] | None = None,
) -> BatchResult:
    """The result of a batch; files: where each fit is or would be; joint: the result of the joint fit, if
    there is one; shared: patterns of parameters that all fits share, where they are taken together.
    """
    done = [path if index.jobs[job].state == "done" else None for job, path in files.items()]
    rows = [None if path is None else _row(result_file.read(path, FitResult), shared) for path in done]
    at_once = result_file.read(joint, FitResult) if joint is not None else None
    jobs = _jobs(index, files, rows)
    parameters = _parameters(rows, at_once)
    dependence = _dependence(parameters, np.deg2rad(jobs.posture_deg))
    said = [None if row is None else row.said for row in rows]
    of_all = None if shared is None else together(said, parameters, shared)
    of_one = of_all is None or joint is not None  # else of several robots, which may differ
    kept = sum(index.jobs[job].kept for job in files)
    return BatchResult(
        name=name,
        verdict=(
            *verdict(jobs, kept, seconds, workers),
            *([dependence_verdict(dependence)] if of_one else []),
            *population_verdict(of_all),
        ),
        notes=(
            *(dependence_notes(parameters, dependence) if of_one else ()),
            *notes(jobs, dependence, at_once),
            *population_notes(of_all),
        ),
        workers=workers,
        seconds=seconds,
        joint_file="" if joint is None else joint.name,
        joint_gap=float("nan") if at_once is None else at_once.gap,
        jobs=jobs,
        parameters=parameters,
        modes=_modes(rows),
        dependence=dependence,
        provenance=came_from,
        population=of_all,
    )


def _row(result: results.FitResult, shared: Sequence[str] | None) -> Row:
    m = next(iter(result.measurements.values()))
    nothing = np.full(3, np.nan)
    tool = m.geometry.points[-1] if len(m.geometry.points) else m.geometry.skeleton[-1]
    return Row(
        parameters=result.parameters,
        posture_deg=m.posture_deg,
        tool_m=tool if len(tool) == 3 else nothing,
        modes=_row_modes(m),
        gap=result.gap,
        cost=result.cost,
        relative_error=_relative_error(result),
        converged=result.converged,
        said=None if shared is None else Said.of(result),
    )


def _row_modes(m: results.MeasurementResult) -> Array:
    """(4, modes): frequency and damping ratio, of the model and of the measured mode paired with it."""
    rows = np.full((4, len(m.modes.frequency_hz)), np.nan)
    rows[:2] = m.modes.frequency_hz, m.modes.damping_ratio
    if m.pairs is not None:
        rows[2:, m.pairs.model] = (
            m.pairs.measured_frequency_hz[m.pairs.measured],
            m.pairs.measured_damping_ratio[m.pairs.measured],
        )
    return rows


def _relative_error(result: results.FitResult) -> float:
    found = [m.frf for m in result.measurements.values() if m.frf is not None and m.use == "fit"]
    measured = sum(float(np.sum(np.abs(frf.measured) ** 2)) for frf in found)
    left = sum(float(np.sum(np.abs(frf.fitted - frf.measured) ** 2)) for frf in found)
    return float(np.sqrt(left / measured)) if measured else float("nan")


def _jobs(index: BatchIndex, files: dict[str, Path], rows: Sequence[Row | None]) -> JobTable:
    entries = [index.jobs[name] for name in files]
    numbers = {key: _numbers(rows, key) for key in ("gap", "cost", "relative_error")}
    return JobTable(
        name=tuple(files),
        state=tuple(entry.state for entry in entries),
        error=tuple(entry.error for entry in entries),
        file=tuple(f"{path.parent.name}/{path.name}" for path in files.values()),
        attempts=np.array([entry.attempts for entry in entries], dtype=int),
        seconds=np.array([entry.seconds for entry in entries]),
        converged=np.array([row is not None and row.converged for row in rows], dtype=bool),
        posture_deg=_padded([None if row is None else row.posture_deg for row in rows]),
        tool_m=_padded([None if row is None else row.tool_m for row in rows], 3),
        **numbers,
    )


def _numbers(rows: Sequence[Row | None], key: str) -> Array:
    return np.array([np.nan if row is None else getattr(row, key) for row in rows])


def _padded(values: Sequence[Array | None], least: int = 0) -> Array:
    """Rows of different lengths as one array (n, longest), NaN where there is nothing."""
    wide = max((len(row) for row in values if row is not None), default=0)
    table = np.full((len(values), max(wide, least)), np.nan)
    for number, row in enumerate(values):
        if row is not None:
            table[number, : len(row)] = row
    return table


def _modes(rows: Sequence[Row | None]) -> ModesByPosture:
    return ModesByPosture(
        *(_padded([None if row is None else row.modes[part] for row in rows]) for part in range(4))
    )


def _parameters(rows: Sequence[Row | None], together: results.FitResult | None) -> ParametersByPosture:
    tables = [None if row is None else row.parameters for row in rows]
    first = {
        name: (table, k)
        for table in reversed(tables)
        if table is not None
        for k, name in enumerate(table.name)
    }
    names = tuple(dict.fromkeys(name for table in tables if table is not None for name in table.name))
    place = {name: column for column, name in enumerate(names)}
    values = {key: np.full((len(rows), len(names)), np.nan) for key in ("value", "std", "low_95", "high_95")}
    usable = np.zeros((len(rows), len(names)), dtype=bool)
    for number, table in enumerate(tables):
        if table is None:
            continue
        columns = [place[name] for name in table.name]
        for key, array in values.items():
            array[number, columns] = _std(table) if key == "std" else getattr(table, key)
        usable[number, columns] = _usable(table)
    joint = None if together is None else together.parameters
    return ParametersByPosture(
        name=names,
        unit=tuple(first[name][0].unit[first[name][1]] for name in names),
        log=np.array([bool(first[name][0].log[first[name][1]]) for name in names], dtype=bool),
        usable=usable,
        joint_value=_of_joint(names, joint, "value"),
        joint_low_95=_of_joint(names, joint, "low_95"),
        joint_high_95=_of_joint(names, joint, "high_95"),
        **values,
    )


def _std(table: tables.ParameterTable) -> Array:
    """Standard deviations of ln value where the scale is logarithmic, of the value itself where it is not;
    NaN where fixed.
    """
    scale, std = scale_of(table), table.std.copy()
    std[scale.free] *= np.where(table.log[scale.free], 1.0, scale.slope(scale.to_x(table.value)))
    return std


def _of_joint(names: Sequence[str], joint: tables.ParameterTable | None, key: str) -> Array | None:
    if joint is None:
        return None
    known = dict(zip(joint.name, getattr(joint, key), strict=True))
    return np.array([known.get(name, np.nan) for name in names])


def _usable(table: tables.ParameterTable) -> NDArray[np.bool_]:
    """Free, determined at least weakly, and not at a bound, where an interval means nothing."""
    believed = np.array([status in _BELIEVED for status in table.status], dtype=bool)
    inside = ~np.isclose(table.value, table.lower, _AT_BOUND, 0) & ~np.isclose(
        table.value, table.upper, _AT_BOUND, 0
    )
    return np.asarray(table.free & believed & inside)


def _dependence(p: ParametersByPosture, angles: Array) -> DependenceTable:
    """The test of every parameter over the postures where it can be believed."""
    found = []
    for column, log in enumerate(p.log):
        rows = p.usable[:, column]
        x = np.log(p.value[rows, column]) if log else p.value[rows, column]
        found.append(homogeneity(x, p.std[rows, column], angles[rows]))
    adjusted = holm(_column(found, "p_value"))
    limits = np.array([_mean(one, bool(log)) for one, log in zip(found, p.log, strict=True)]).reshape(-1, 3)
    trends = [None if one is None else one.trend for one in found]
    return DependenceTable(
        parameter=p.name,
        count=_column(found, "count", 0).astype(int),
        mean=limits[:, 0],
        mean_low_95=limits[:, 1],
        mean_high_95=limits[:, 2],
        chi_square=_column(found, "chi_square"),
        freedom=_column(found, "freedom", 0).astype(int),
        p_value=adjusted,
        scatter=_column(found, "scatter"),
        trend_joint=_column(trends, "joint", 0).astype(int),
        slope_per_rad=_column(trends, "slope"),
        slope_std=_column(trends, "std"),
        slope_p_value=_column(trends, "p_value"),
        depends=adjusted < _LEVEL,
    )


def _column(found: Sequence[object], name: str, missing: float = float("nan")) -> Array:
    """One attribute of all that was found; `missing` where nothing was."""
    return np.array([missing if one is None else getattr(one, name) for one in found])


def _mean(found: Homogeneity | None, log: bool) -> tuple[float, float, float]:
    """The mean of the postures and its 95 % limits, in the unit of the parameter."""
    if found is None:
        return float("nan"), float("nan"), float("nan")
    ends = found.mean + SIGMAS_95 * found.mean_std * np.array([0.0, -1.0, 1.0])
    low = np.exp(ends) if log else ends
    return float(low[0]), float(low[1]), float(low[2])

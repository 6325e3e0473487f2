"""The tables of a batch."""

from __future__ import annotations

import numpy as np

from identify.core.arrays import Array, Mask
from identify.core.thresholds import SIGMAS_95
from identify.reports.kit.cells import (
    NONE,
    Column,
    Table,
    angles,
    digits,
    number,
    percent,
    unit,
    whole,
    words,
)
from identify.reports.kit.report import Tiles
from identify.results.batch import BatchResult, PopulationTable

_TOLD = {"done": "done", "failed": "failed", "waiting": "not begun", "running": "under way"}
_DEPENDENCE = (
    "Chi-square of the estimates about their weighted mean: about as large as its degrees of freedom if the"
    " parameter is the same at all postures. p: probability of a larger one by chance, for all parameters"
    " together (Holm); below 1 % the parameter depends on posture. Scatter: what is left of the differences"
    " beyond the intervals (DerSimonian and Laird's tau)."
)
_POPULATION = (
    "Scatter: standard deviation between fits, beyond what their intervals explain; its interval from"
    " Cochran's Q. p: probability of differences as large by chance, for all parameters together (Holm). The"
    " interval of the mean is for the mean of all such robots, not of one."
)


def tiles(result: BatchResult) -> Tiles:
    """The few numbers that are read first."""
    jobs, d = result.jobs, result.dependence
    done = np.array(jobs.state) == "done"
    known = jobs.gap[np.isfinite(jobs.gap)]
    ended = f"completed; {result.failed} failed" if result.failed else "completed"
    median = number(np.median(known) if len(known) else np.nan)
    depend = f"{int(d.depends.sum())} of {int(np.isfinite(d.p_value).sum())}"
    each, rate = number(float(np.mean(jobs.seconds[done])), 3), number(done.sum() / result.seconds, 3)
    return (
        ("Fits", f"{done.sum()} of {len(done)}", ended),
        ("Gap, median", median, "residual over noise; 1 is perfect"),
        ("Depend on posture", depend, "parameters, more than the intervals allow"),
        ("Time per fit", f"{each} s", f"of one worker; {rate} fits per second on {result.workers}"),
    )


def dependence_table(result: BatchResult) -> Table:
    """Whether each parameter is the same at all postures."""
    d, p = result.dependence, result.parameters
    known = np.isfinite(d.p_value)
    columns = [
        words("Parameter", d.parameter),
        Column("Mean", "", d.mean),
        words("Unit", map(unit, p.unit)),
        Column("±", "%", _half(d.mean, d.mean_low_95, d.mean_high_95), digits(2)),
        Column(
            "Fitted together", "", np.full(len(known), np.nan) if p.joint_value is None else p.joint_value
        ),
        Column("Postures", "", d.count, whole),
        Column("Chi-square", "", d.chi_square),
        Column("Freedom", "", np.where(known, d.freedom, np.nan), whole),
        Column("p", "", d.p_value, _probability),
        Column("Scatter", "%", 100 * d.scatter * _over(p.log, d.mean), digits(3)),
        words("Verdict", _verdicts(known, d.depends, "depends")),
    ]
    return Table("Does it depend on posture?", columns, _DEPENDENCE)


def population_table(result: BatchResult, p: PopulationTable) -> Table:
    """Mean and scatter of each parameter over all fits."""
    over, known = 100 * _over(p.log, p.mean), np.isfinite(p.p_value)
    columns = [
        words("Parameter", p.parameter),
        words("Of each fit", ("shared" if shared else "own" for shared in p.shared)),
        Column("Mean", "", p.mean),
        words("Unit", map(unit, result.parameters.unit)),
        Column("±", "%", _half(p.mean, p.mean_low_95, p.mean_high_95), digits(2)),
        Column("Scatter", "%", over * p.scatter, digits(3)),
        Column("Scatter, 95 % low", "%", over * p.scatter_low_95, digits(3)),
        Column("Scatter, 95 % high", "%", over * p.scatter_high_95, digits(3)),
        Column("Fits", "", p.count, whole),
        Column("p", "", p.p_value, _probability),
        words("Verdict", _verdicts(known, p.differs, "differ")),
    ]
    return Table("Mean and scatter over all fits", columns, _POPULATION)


def _half(value: Array, low: Array, high: Array) -> Array:
    """Half an interval over the value, per cent; NaN of a value that is 0."""
    return np.asarray(50 * (high - low) / np.where(value == 0, np.nan, np.abs(value)))


def _over(log: Mask, mean: Array) -> Array:
    """By which a scatter becomes a part of the value: that of a logarithm is one."""
    return np.where(log, 1.0, 1 / np.abs(mean))


def _verdicts(known: Mask, differs: Mask, said: str) -> list[str]:
    return [
        (said if other else "the same") if sure else "cannot be determined"
        for sure, other in zip(known, differs, strict=True)
    ]


def _probability(p: float) -> str:
    return NONE if np.isnan(p) else "< 1e-9" if p < 1e-9 else number(p, 2)


def own_table(result: BatchResult, p: PopulationTable) -> Table:
    """What each fit says of each parameter with all others, with half the 95 % interval in per cent."""
    return _by_fit(result, "Each fit combined with the others", p.value, p.low_95, p.high_95)


def value_table(result: BatchResult) -> Table:
    """All parameters at all postures, with half their 95 % intervals in per cent."""
    p = result.parameters
    return _by_fit(result, "Parameters by posture", p.value, p.low_95, p.high_95)


def _by_fit(result: BatchResult, title: str, value: Array, low: Array, high: Array) -> Table:
    """Values (fits, parameters) of the fits that are done, and half their intervals."""
    done = [row for row, state in enumerate(result.jobs.state) if state == "done"]
    value, half, p = value[done], _half(value, low, high)[done], result.parameters
    columns = [words("Fit", [result.jobs.name[row] for row in done])]
    for k, (name, of) in enumerate(zip(p.name, p.unit, strict=True)):
        columns += [Column(name, unit(of), value[:, k]), Column("±", "%", half[:, k], digits(2))]
    return Table(title, columns)


def trend_table(result: BatchResult) -> Table:
    """The joint angle with which each parameter changes most."""
    d, log = result.dependence, result.parameters.log
    slope, std = (np.deg2rad(10) * value for value in (d.slope_per_rad, d.slope_std))
    change = np.where(log, np.expm1(slope), slope / d.mean)
    half = SIGMAS_95 * std * np.where(log, 1.0, 1 / d.mean)
    rows = np.flatnonzero(d.trend_joint)
    columns = [
        words("Parameter", [d.parameter[k] for k in rows]),
        words("Changes with", [f"joint {d.trend_joint[k]}" for k in rows]),
        Column("per 10°", "%", change[rows], percent),
        Column("±", "%", 100 * np.abs(half[rows]), digits(2)),
        Column("p", "", d.slope_p_value[rows], _probability),
    ]
    note = (
        "The joint whose weighted line explains most; p: probability of a steeper one by chance, for all"
        " joints together."
    )
    return Table("Trends", columns, note)


def job_table(result: BatchResult) -> Table:
    """One row per fit, the failed ones first, then by falling gap."""
    jobs = result.jobs
    done = np.array(jobs.state) == "done"
    order = sorted(range(len(done)), key=lambda row: (done[row], -np.nan_to_num(jobs.gap[row], nan=-1.0)))
    postures = [angles(jobs.posture_deg[k][np.isfinite(jobs.posture_deg[k])]) or NONE for k in order]
    ended = ["not converged" if done[k] and not jobs.converged[k] else _TOLD[jobs.state[k]] for k in order]
    columns = [
        words("Fit", [jobs.name[k] for k in order]),
        words("Posture", postures, "°"),
        Column("Gap", "", jobs.gap[order]),
        Column("FRF error", "%", jobs.relative_error[order], percent),
        Column("Cost", "", jobs.cost[order]),
        Column("Time", "s", jobs.seconds[order], digits(3)),
        Column("Attempts", "", jobs.attempts[order], whole),
        words("Ended", ended),
    ]
    return Table("Fits", columns)


def failure_table(result: BatchResult) -> Table | None:
    """Why fits failed; None where none did."""
    jobs = result.jobs
    rows = [(jobs.name[k], jobs.error[k]) for k, state in enumerate(jobs.state) if state == "failed"]
    return Table.of("Failed fits", (words("Fit"), words("Why")), rows) if rows else None

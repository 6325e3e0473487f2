"""The tables of a batch, as finished text; HTML and PDF print the same ones."""

from __future__ import annotations

import numpy as np

from identify.core.arrays import Array
from identify.core.thresholds import SIGMAS_95
from identify.reports.kit.cells import NONE, Column, Number, Table, number, percent, unit, words
from identify.results.batch import BatchResult, PopulationTable

_TOLD = {"done": "done", "failed": "failed", "waiting": "not begun", "running": "under way"}


def tiles(result: BatchResult) -> tuple[tuple[str, str, str], ...]:
    """The few numbers that are read first."""
    jobs, d = result.jobs, result.dependence
    done = sum(state == "done" for state in jobs.state)
    known = jobs.gap[np.isfinite(jobs.gap)]
    tested = int(np.isfinite(d.p_value).sum())
    each = number(float(np.mean(jobs.seconds[np.array(jobs.state) == "done"])), 3)
    return (
        (
            "Fits",
            f"{done} of {len(jobs.state)}",
            f"completed; {result.failed} failed" if result.failed else "completed",
        ),
        (
            "Gap, median",
            number(np.median(known) if len(known) else np.nan),
            "residual over noise; 1 is perfect",
        ),
        (
            "Depend on posture",
            f"{int(d.depends.sum())} of {tested}",
            "parameters, more than the intervals allow",
        ),
        (
            "Time per fit",
            f"{each} s",
            f"of one worker; {number(done / result.seconds, 3)} fits per second on {result.workers}",
        ),
    )


def dependence_table(result: BatchResult) -> Table:
    """Whether each parameter is the same at all postures."""
    d, p, rows = result.dependence, result.parameters, []
    for k, name in enumerate(d.parameter):
        half = 50 * (d.mean_high_95[k] - d.mean_low_95[k]) / abs(d.mean[k]) if d.mean[k] else np.nan
        joint = NONE if p.joint_value is None else number(p.joint_value[k])
        known = bool(np.isfinite(d.p_value[k]))
        test = (
            number(d.chi_square[k]),
            str(int(d.freedom[k])) if known else NONE,
            _probability(d.p_value[k]),
        )
        verdict = ("depends" if d.depends[k] else "the same") if known else "cannot be told"
        mean = (number(d.mean[k]), unit(p.unit[k]), number(half, 2), joint)
        rows.append((name, *mean, str(int(d.count[k])), *test, number(_scatter(result, k), 3), verdict))
    columns = (
        words("Parameter"),
        Column("Mean"),
        words("Unit"),
        Column("±", "%"),
        Column("Fitted together"),
        Column("Postures"),
        Column("Chi-square"),
        Column("Freedom"),
        Column("p"),
        Column("Scatter", "%"),
        words("Verdict"),
    )
    return Table("Does it depend on posture?", columns, tuple(rows), NOTE)


NOTE = (
    "Chi-square of the estimates about their weighted mean: about as large as its degrees of freedom if the"
    " parameter is the same at all postures. p: probability of a larger one by chance, for all parameters"
    " together (Holm); below 1 % the parameter depends on posture. Scatter: what is left of the differences"
    " beyond the intervals (DerSimonian and Laird's tau)."
)


def population_table(result: BatchResult, p: PopulationTable) -> Table:
    """Mean and scatter of each parameter over all fits."""
    rows, over = [], np.where(p.log, 1.0, 1 / np.abs(p.mean))
    for k, name in enumerate(p.parameter):
        half = 50 * (p.mean_high_95[k] - p.mean_low_95[k]) / abs(p.mean[k]) if p.mean[k] else np.nan
        scatter = [number(100 * over[k] * x[k], 3) for x in (p.scatter, p.scatter_low_95, p.scatter_high_95)]
        known = bool(np.isfinite(p.p_value[k]))
        verdict = ("differ" if p.differs[k] else "the same") if known else "cannot be told"
        mean = (number(p.mean[k]), unit(result.parameters.unit[k]), number(half, 2))
        kind = "shared" if p.shared[k] else "own"
        rows.append((name, kind, *mean, *scatter, str(int(p.count[k])), _probability(p.p_value[k]), verdict))
    columns = (
        words("Parameter"),
        words("Of each fit"),
        Column("Mean"),
        words("Unit"),
        Column("±", "%"),
        Column("Scatter", "%"),
        Column("Scatter, 95 % low", "%"),
        Column("Scatter, 95 % high", "%"),
        Column("Fits"),
        Column("p"),
        words("Verdict"),
    )
    return Table("Mean and scatter over all fits", columns, tuple(rows), _POPULATION)


_POPULATION = (
    "Scatter: standard deviation between fits, beyond what their intervals explain; its interval from"
    " Cochran's Q. p: probability of differences as large by chance, for all parameters together (Holm). The"
    " interval of the mean is for the mean of all such robots, not of one."
)


def own_table(result: BatchResult, p: PopulationTable) -> Table:
    """What each fit says of each parameter with all others, with half the 95 % interval in per cent."""
    rows = []
    for row, name in enumerate(result.jobs.name):
        if result.jobs.state[row] == "done":
            rows.append((name, *_paired(p.value[row], p.low_95[row], p.high_95[row])))
    heads = _heads(result)
    return Table("Each fit with what all others say", (words("Fit"), *heads), tuple(rows))


def _paired(value: Array, low: Array, high: Array) -> list[Number]:
    """Values (p,) and half their intervals, per cent, in turn."""
    cells = []
    for v, below, above in zip(value, low, high, strict=True):
        cells += [number(v), number(50 * (above - below) / abs(v) if v else np.nan, 2)]
    return cells


def _heads(result: BatchResult) -> list[Column]:
    p = result.parameters
    pairs = zip(p.name, p.unit, strict=True)
    return [column for name, of in pairs for column in (Column(name, unit(of)), Column("±", "%"))]


def trend_table(result: BatchResult) -> Table:
    """The joint angle with which each parameter changes most."""
    d, rows = result.dependence, []
    for k, name in enumerate(d.parameter):
        if d.trend_joint[k]:
            turn = np.deg2rad(10)
            slope, std = (turn * value for value in (d.slope_per_rad[k], d.slope_std[k]))
            change, half = (
                (np.expm1(slope), SIGMAS_95 * std)
                if result.parameters.log[k]
                else (slope / d.mean[k], SIGMAS_95 * std / d.mean[k])
            )
            rows.append(
                (
                    name,
                    f"joint {d.trend_joint[k]}",
                    percent(change),
                    number(100 * abs(half), 2),
                    _probability(d.slope_p_value[k]),
                )
            )
    columns = (
        words("Parameter"),
        words("Changes with"),
        Column("per 10°", "%"),
        Column("±", "%"),
        Column("p"),
    )
    note = (
        "The joint whose weighted line explains most; p: probability of a steeper one by chance, for all"
        " joints together."
    )
    return Table("Trends", columns, tuple(rows), note)


def _scatter(result: BatchResult, k: int) -> float:
    """The scatter beyond the intervals, per cent of the value."""
    d = result.dependence
    return float(100 * d.scatter[k] if result.parameters.log[k] else 100 * d.scatter[k] / abs(d.mean[k]))


def _probability(p: float) -> str:
    return NONE if np.isnan(p) else "< 1e-9" if p < 1e-9 else number(p, 2)


def job_table(result: BatchResult) -> Table:
    """One row per fit, the failed ones first, then by falling gap."""
    jobs = result.jobs
    order = sorted(
        range(len(jobs.name)),
        key=lambda row: (jobs.state[row] == "done", -np.nan_to_num(jobs.gap[row], nan=-1.0)),
    )
    rows = []
    for k in order:
        posture = ", ".join(f"{angle:.4g}" for angle in jobs.posture_deg[k] if np.isfinite(angle)) or NONE
        ended = _TOLD[jobs.state[k]] if jobs.state[k] != "done" or jobs.converged[k] else "not converged"
        numbers = (
            number(jobs.gap[k]),
            percent(jobs.relative_error[k]),
            number(jobs.cost[k]),
            number(jobs.seconds[k], 3),
        )
        rows.append((jobs.name[k], posture, *numbers, str(int(jobs.attempts[k])), ended))
    columns = (
        words("Fit"),
        words("Posture", "°"),
        Column("Gap"),
        Column("FRF error", "%"),
        Column("Cost"),
        Column("Time", "s"),
        Column("Attempts"),
        words("Ended"),
    )
    return Table("Fits", columns, tuple(rows))


def failure_table(result: BatchResult) -> Table | None:
    """Why fits failed; None where none did."""
    jobs = result.jobs
    rows = tuple((jobs.name[k], jobs.error[k]) for k, state in enumerate(jobs.state) if state == "failed")
    return Table("Failed fits", (words("Fit"), words("Why")), rows) if rows else None


def value_table(result: BatchResult) -> Table:
    """All parameters at all postures, with half their 95 % intervals in per cent."""
    p, rows = result.parameters, []
    for k, name in enumerate(result.jobs.name):
        if result.jobs.state[k] == "done":
            rows.append((name, *_paired(p.value[k], p.low_95[k], p.high_95[k])))
    return Table("Parameters by posture", (words("Fit"), *_heads(result)), tuple(rows))

"""The tables of a run, as finished text: parameters, starts, identifiability, provenance; HTML and PDF print
the same ones.
"""

from __future__ import annotations

import numpy as np

from identify.reports.fit.pick import half_interval, interval_limits
from identify.reports.kit.cells import NONE, Column, Table, number, percent, signed, unit, words
from identify.results.fit import FitResult
from identify.results.tables import ParameterTable

PARAMETERS_TERMINAL = ("Parameter", "Fitted", "Unit", "95 % from", "to", "±", "Identifiability")
"""The columns of the table of parameters that a terminal has room for."""


def tiles(result: FitResult) -> tuple[tuple[str, str, str], ...]:
    """The few numbers that are read first: (what, value, what it means)."""
    status = [s for s, free in zip(result.parameters.status, result.parameters.free, strict=True) if free]
    determined = sum(s == "determined" for s in status)
    ended = "the best start ended as it should" if result.converged else "the best start did not converge"
    return (
        ("Gap, fitted data", number(result.gap), "residual over noise; 1 is perfect"),
        ("Gap, validation", number(result.gap_validation), "the same on data that were not fitted"),
        ("Parameters", f"{determined} of {len(status)}", "determined by the data"),
        (f"Cost, {result.cost_kind}", number(result.cost), ended),
    )


def parameter_rows(p: ParameterTable) -> Table:
    """Fitted values with intervals, start values and bounds."""
    rows = []
    half, (low, high) = 100 * half_interval(p), interval_limits(p)
    for i, name in enumerate(p.name):
        free = bool(p.free[i])
        interval = (number(low[i]), number(high[i]), number(half[i], 2)) if free else (NONE,) * 3
        limits = (number(p.lower[i]), number(p.upper[i]))
        rows.append(
            (
                name,
                number(p.value[i]),
                unit(p.unit[i]),
                *interval,
                number(p.initial[i]),
                *limits,
                p.status[i],
            )
        )
    columns = (
        words("Parameter"),
        Column("Fitted"),
        words("Unit"),
        Column("95 % from"),
        Column("to"),
        Column("±", "%"),
        Column("Start"),
        Column("Lower bound"),
        Column("Upper bound"),
        words("Identifiability"),
    )
    note = (
        "± is half the 95 % interval over the value. Determined: the interval stays within a factor of two;"
        " not determined: it reaches beyond a factor of seven. At a bound: the fit would take the value"
        " further than it may, and the interval has one side."
    )
    return Table("Parameters", columns, tuple(rows), note)


def published_table(result: FitResult) -> Table | None:
    """Published values beside the fitted ones; None where nothing was published."""
    published, p = result.published, result.parameters
    if published is None or not np.isfinite(published.value).any():
        return None
    rows = [
        (
            name,
            number(p.value[i]),
            number(published.value[i]),
            number(p.value[i] / published.value[i]),
            unit(p.unit[i]),
        )
        for i, name in enumerate(p.name)
        if np.isfinite(published.value[i])
    ]
    columns = (words("Parameter"), Column("Fitted"), Column("Published"), Column("Ratio"), words("Unit"))
    return Table("Published parameters", columns, tuple(rows), f"Published: {published.source}.")


def published_modes_table(result: FitResult) -> Table | None:
    """Published modes beside the model's at the first posture, both in order of frequency; None where none
    were published.
    """
    published = result.published
    if published is None or not len(published.frequency_hz):
        return None
    first = next(iter(result.measurements.values()))
    count = min(len(published.frequency_hz), len(first.modes.frequency_hz))
    order = np.argsort(published.frequency_hz)[:count]
    rows = []
    for i, (hz, ratio) in enumerate(
        zip(published.frequency_hz[order], published.damping_ratio[order], strict=True)
    ):
        model_hz, model_ratio = first.modes.frequency_hz[i], first.modes.damping_ratio[i]
        errors = signed(100 * (model_hz / hz - 1), 3), signed(100 * (model_ratio - ratio), 3)
        rows.append(
            (
                str(i + 1),
                number(model_hz),
                number(hz),
                errors[0],
                percent(model_ratio),
                percent(ratio),
                errors[1],
            )
        )
    columns = (
        words("Mode"),
        Column("Model", "Hz"),
        Column("Published", "Hz"),
        Column("Error", "%"),
        Column("Model damping", "%"),
        Column("Published damping", "%"),
        Column("Difference", "points"),
    )
    return Table(
        f"Published modes, {first.name}",
        columns,
        tuple(rows),
        f"Published: {published.source}. In order of frequency.",
    )


def profile_table(result: FitResult) -> Table | None:
    """95 % limits from profile likelihoods beside those of the linear intervals; None where none were asked
    for.
    """
    if not result.profiles:
        return None
    p, rows = result.parameters, []
    for name, profile in result.profiles.items():
        i = p.name.index(name)
        rows.append(
            (
                name,
                number(p.value[i]),
                *map(number, (profile.low, profile.high, p.low_95[i], p.high_95[i])),
                unit(p.unit[i]),
            )
        )
    columns = (
        words("Parameter"),
        Column("Fitted"),
        Column("Profile from"),
        Column("to"),
        Column("Linear from"),
        Column("to"),
        words("Unit"),
    )
    note = f"Where chi-square rises by 3.84, all others fitted again; {NONE}: it does not rise so far."
    return Table("Profile likelihood, 95 %", columns, tuple(rows), note)


def start_table(result: FitResult) -> Table:
    """One row per start: cost, effort, how it ended."""
    columns = (
        words("Start"),
        Column("Cost"),
        Column("Evaluations"),
        Column("Time", "s"),
        words("Ended as it should"),
        words("Why it ended"),
    )
    s = result.starts
    ended = ["yes" if converged else "no" for converged in s.converged]
    rows = [
        (
            str(i + 1),
            number(s.cost[i]),
            str(int(s.evaluations[i])),
            number(s.seconds[i], 3),
            ended[i],
            s.sentence[i],
        )
        for i in range(len(s.cost))
    ]
    return Table("Starts", columns, tuple(rows))


def direction_table(result: FitResult) -> Table:
    """Directions in parameter space, best determined first, with the parameters that make them."""
    names = [name for name, free in zip(result.parameters.name, result.parameters.free, strict=True) if free]
    rows = []
    for i, (singular, direction) in enumerate(zip(result.singular_values, result.directions, strict=True)):
        size = np.abs(direction)
        members = [int(j) for j in np.argsort(-size) if size[j] > 0.3 * size.max()]
        text = ", ".join(f"{names[j]} ({direction[j]:+.2f})" for j in members)
        rows.append((str(i + 1), number(singular), number(1 / singular if singular > 0 else np.inf), text))
    columns = (words("Direction"), Column("Singular value"), Column("Std of ln value"), words("Mostly"))
    note = (
        "Singular values of the residuals' derivatives, in units of noise per unit of ln value (of the value"
        " itself where the scale is linear): above 1 the data determine the direction, below they do not."
    )
    return Table("Directions", columns, tuple(rows), note)

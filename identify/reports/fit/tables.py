"""The tables of a fit: what was published, starts, profiles, identifiability, stated uncertainty."""

from __future__ import annotations

import numpy as np

from identify.reports.kit.cells import (
    NONE,
    Column,
    Table,
    digits,
    number,
    percent,
    several,
    unit,
    whole,
    words,
)
from identify.reports.kit.report import Tiles
from identify.reports.shared.measurement_tables import DIFFERENCE
from identify.reports.shared.parameters import free_names
from identify.results.fit import FitResult, StatedUncertainty

_UNITS = {"m": ("mm", 1e3), "rad": ("°", 180 / np.pi), "1": ("%", 100.0), "s": ("µs", 1e6)}
"""Unit and factor in which errors of each SI unit are printed."""


def tiles(result: FitResult) -> Tiles:
    """The few numbers that are read first."""
    status = [s for s, free in zip(result.parameters.status, result.parameters.free, strict=True) if free]
    ended = "the best start converged" if result.converged else "the best start did not converge"
    return (
        ("Gap, fitted data", number(result.gap), "residual over noise; 1 is perfect"),
        ("Gap, validation", number(result.gap_validation), "the same on data that were not fitted"),
        ("Parameters", f"{status.count('determined')} of {len(status)}", "determined by the data"),
        (f"Cost, {result.cost_kind}", number(result.cost), ended),
    )


def published_table(result: FitResult) -> Table | None:
    """Published values beside the fitted ones; None where nothing was published."""
    published, p = result.published, result.parameters
    if published is None or not np.isfinite(published.value).any():
        return None
    rows = np.flatnonzero(np.isfinite(published.value))
    columns = [
        words("Parameter", [p.name[i] for i in rows]),
        Column("Fitted", "", p.value[rows]),
        Column("Published", "", published.value[rows]),
        Column("Ratio", "", p.value[rows] / published.value[rows]),
        words("Unit", [unit(p.unit[i]) for i in rows]),
    ]
    return Table("Published parameters", columns, f"Published: {published.source}.")


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
    hz, ratio = published.frequency_hz[order], published.damping_ratio[order]
    own, damping = first.modes.frequency_hz[:count], first.modes.damping_ratio[:count]
    columns = [
        words("Mode", range(1, count + 1)),
        Column("Model", "Hz", own),
        Column("Published", "Hz", hz),
        Column("Error", "%", 100 * (own / hz - 1), DIFFERENCE),
        Column("Model damping", "%", damping, percent),
        Column("Published damping", "%", ratio, percent),
        Column("Difference", "points", 100 * (damping - ratio), DIFFERENCE),
    ]
    note = f"Published: {published.source}. In order of frequency."
    return Table(f"Published modes, {first.name}", columns, note)


def profile_table(result: FitResult) -> Table | None:
    """95 % limits from profile likelihoods beside those of the linear intervals; None where none were asked
    for.
    """
    if not result.profiles:
        return None
    p, found = result.parameters, list(result.profiles.values())
    rows = [p.name.index(name) for name in result.profiles]
    columns = [
        words("Parameter", result.profiles),
        Column("Fitted", "", p.value[rows]),
        Column("Profile from", "", [one.low for one in found]),
        Column("to", "", [one.high for one in found]),
        Column("Linear from", "", p.low_95[rows]),
        Column("to", "", p.high_95[rows]),
        words("Unit", [unit(p.unit[row]) for row in rows]),
    ]
    note = f"Where chi-square rises by 3.84, all others fitted again; {NONE}: it does not rise so far."
    return Table("Profile likelihood, 95 %", columns, note)


def start_table(result: FitResult) -> Table:
    """One row per start: cost, effort, how it ended."""
    s = result.starts
    columns = [
        words("Start", range(1, len(s.cost) + 1)),
        Column("Cost", "", s.cost),
        Column("Evaluations", "", s.evaluations, whole),
        Column("Time", "s", s.seconds, digits(3)),
        words("Ended as it should", ["yes" if converged else "no" for converged in s.converged]),
        words("Why it ended", s.sentence),
    ]
    return Table("Starts", columns)


def direction_table(result: FitResult) -> Table:
    """Directions in parameter space, best determined first, with the parameters that make them."""
    names, singular = free_names(result.parameters), result.singular_values
    mostly = []
    for direction in result.directions:
        size = np.abs(direction)
        members = [int(j) for j in np.argsort(-size) if size[j] > 0.3 * size.max()]
        mostly.append(", ".join(f"{names[j]} ({direction[j]:+.2f})" for j in members))
    columns = [
        words("Direction", range(1, len(singular) + 1)),
        Column("Singular value", "", singular),
        Column("Std of ln value", "", [1 / one if one > 0 else np.inf for one in singular]),
        words("Mostly", mostly),
    ]
    note = (
        "Singular values of the residuals' derivatives, in units of noise per unit of ln value (of the value"
        " itself where the scale is linear): above 1 the data determine the direction, below they do not."
    )
    return Table("Directions", columns, note)


def stated_table(stated: StatedUncertainty) -> Table:
    """A row for each nuisance parameter, the largest first in units of what was stated."""
    order = np.argsort(-np.abs(stated.shift))
    units, factors = zip(*(_UNITS[stated.unit[n]] for n in order), strict=True) if len(order) else ((), ())
    std, shift = np.array(factors) * stated.stated[order], stated.shift[order]
    columns = [
        words("Error of", [stated.kind[n] for n in order]),
        words("Where", [stated.place[n] for n in order]),
        words("What", [stated.change[n] for n in order]),
        Column("Fitted", "", shift * std, DIFFERENCE),
        words("Unit", units),
        Column("Stated ±", "", std, digits(3)),
        Column("Over stated", "", shift, DIFFERENCE),
        Column("Left of ±", "%", stated.spread[order], percent),
    ]
    note = (
        "Fitted with the parameters if the cost is the likelihood, with the stated standard deviation as"
        " prior. Beyond 3 the statement was too small, or something is missing from the model; 100 % left:"
        " the data do not determine it."
    )
    return Table("Nuisance parameters", columns, note)


def part_table(result: FitResult, stated: StatedUncertainty) -> Table:
    """Of each free parameter, the part of the variance behind its interval that comes from each kind of
    error, and from noise.
    """
    p = result.parameters
    parts = stated.parts[p.free] if p.free.any() else np.full((1, len(stated.kinds)), np.nan)
    noise = np.maximum(1.0 - parts.sum(axis=1), 0.0)
    columns = [
        words("Parameter", free_names(p) or [NONE]),
        Column("Noise", "%", 100 * noise, digits(2)),
        *several(stated.kinds, "%", 100 * parts, digits(2)),
    ]
    note = "Shares of the variance. A column's share would vanish if that quantity were known exactly."
    return Table("Where the intervals come from", columns, note)

"""What the report of a discovery shows: the models side by side, the fall of the gap, the parts and
candidates with room in a chart.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from identify.core.arrays import Array, Texts
from identify.core.thresholds import QUIET
from identify.reports.compare.pick import Shared
from identify.reports.shared.measurement_tables import use
from identify.results.comparison import Comparison
from identify.results.discovery import DiscoveryResult, GapByBand, OptionTable, PartTable, StepResult
from identify.results.tables import Geometry

BEFORE, AFTER = "study's model", "final model"
SHOWN = 12
"""Candidates that a chart and a table show; the others are folded on the page, and in the exported tables."""
PART_KINDS = {
    "band": "Frequency band",
    "mode": "Around a mode of the model",
    "point": "Point",
    "direction": "Direction",
    "force": "Impact at",
    "measurement": "Measurement",
}
"""What the gap is divided by, and what a chart calls it."""
_ALONG = ("band", "mode")
_WIDE = 5.0


def models(result: DiscoveryResult) -> Comparison:
    """The final model beside the study's, as fits; the study's alone where nothing was added."""
    runs = {AFTER: result.after, BEFORE: result.before} if result.added.sentence else {BEFORE: result.before}
    return Comparison(
        name=result.name,
        verdict=(),
        notes=(),
        seconds=result.seconds,
        runs=runs,
        provenance=result.provenance,
    )


def beside(result: DiscoveryResult) -> list[Shared]:
    """Every measurement with what the models make of it, the final one first; the start models' FRFs are left
    out.
    """
    runs = models(result).runs
    found = []
    for name, first in next(iter(runs.values())).measurements.items():
        own = {label: run.measurements[name] for label, run in runs.items()}
        frfs = {
            label: dataclasses.replace(m.frf, initial=None) for label, m in own.items() if m.frf is not None
        }
        bare = dataclasses.replace(first, frf=next(iter(frfs.values()), None))
        found.append(Shared(name, {**own, next(iter(runs)): bare}, frfs))
    return found


@dataclass(frozen=True)
class Fall:
    """One row of the waterfall: what it is, the gap on fitted and on other data before and after it; a whole
    model's begins at noise.
    """

    label: str
    whole: bool
    begin: tuple[float, float]
    end: tuple[float, float]


def waterfall(result: DiscoveryResult) -> list[Fall]:
    """The study's model, every addition in order, and the final model."""
    noise, now = (1.0, 1.0), first_gaps(result)
    rows = [Fall(BEFORE, True, noise, now)]
    for sentence, *gaps in zip(
        result.added.sentence, result.added.gap, result.added.gap_validation, strict=True
    ):
        after = (float(gaps[0]), float(gaps[1]))
        rows.append(Fall(f"+ {sentence}", False, now, after))
        now = after
    return [*rows, Fall(AFTER, True, noise, last_gaps(result))] if len(rows) > 1 else rows


def first_gaps(result: DiscoveryResult) -> tuple[float, float]:
    """The gap of the study's model on fitted and on other data."""
    other = [step.gap_validation for step in result.steps.values()][:1]
    return result.before.gap, other[0] if other else result.before.gap_validation


def last_gaps(result: DiscoveryResult) -> tuple[float, float]:
    """The gap of the final model on fitted and on other data; those are the validation measurements, or what
    was left out of a fit.
    """
    known = [first_gaps(result)[1], *result.added.gap_validation, result.after.gap_validation]
    return result.after.gap, float(next((gap for gap in reversed(known) if not np.isnan(gap)), np.nan))


def is_wide(values: Array) -> bool:
    """Whether gaps are so far apart that a logarithmic axis shows them better."""
    return bool(np.nanmax(values, initial=1.0) > _WIDE)


@dataclass(frozen=True)
class Bars:
    """The parts of one kind in a chart: title, names, gaps, and the share of what is above noise as text;
    total: how many there are.
    """

    title: str
    names: list[str]
    gap: Array
    share: list[str]
    total: int


def part_bars(parts: PartTable, gap: float) -> list[Bars]:
    """The parts of every kind, bands and modes by frequency, the others by share, at most twelve of a kind.

    Shares are left out where the gap as a whole is noise, and where it has too few parts to differ.
    """
    found = []
    for kind, title in PART_KINDS.items():
        rows = np.array([row for row, own in enumerate(parts.kind) if own == kind], dtype=np.intp)
        if len(rows) < 2:
            continue
        shown = (
            sorted(rows[:SHOWN], key=lambda row: parts.frequency_hz[row])
            if kind in _ALONG and len(parts.frequency_hz)
            else list(rows[:SHOWN])
        )
        share = [f"{100 * parts.share[row]:.0f} %" if gap > QUIET else "" for row in shown]
        found.append(Bars(title, [parts.name[row] for row in shown], parts.gap[shown], share, len(rows)))
    return found


def few(options: OptionTable) -> slice:
    """The candidates in a chart: the best ones."""
    return slice(0, min(SHOWN, len(options.sentence)))


STANDINGS = ("best", "cannot be distinguished from it", "other")


def standings(step: StepResult) -> list[int]:
    """How the candidates in a chart are drawn, by their number in `STANDINGS`."""
    return [
        0 if sentence == step.best else 1 if sentence in step.alike else 2
        for sentence in step.options.sentence[few(step.options)]
    ]


def gap_maps(result: DiscoveryResult) -> list[tuple[str, list[tuple[str, Array]]]]:
    """For every measurement its title and the gap (bands, channels) of the study's and of the final model."""
    return [
        (
            f"{name}, {use(result.after.measurements[name])}",
            [(label, one.gap[row]) for label, one in _maps(result)],
        )
        for row, name in enumerate(result.map_before.measurements)
    ]


def _maps(result: DiscoveryResult) -> list[tuple[str, GapByBand]]:
    """Of the study's model, and of the final one where it is another."""
    after = [(AFTER, result.map_after)] if result.added.sentence else []
    return [(BEFORE, result.map_before), *after]


@dataclass(frozen=True)
class OnRobot:
    """The robot at the posture of the first measurement, with the gap of each model at its points (n,): RMS
    over all measurements, bands and directions, NaN where nothing was measured.
    """

    geometry: Geometry
    gaps: list[tuple[str, Array]]


def gaps_on_robot(result: DiscoveryResult) -> OnRobot:
    """The study's model, and the final one where it is another."""
    geometry = next(iter(result.after.measurements.values())).geometry
    return OnRobot(geometry, [(label, _by_point(one, geometry.point_names)) for label, one in _maps(result)])


def _by_point(found: GapByBand, names: Texts) -> Array:
    squares = found.gap**2
    of = np.array([channel.rpartition(":")[0] for channel in found.channels])
    values = [squares[..., of == name] for name in names]
    return np.array([np.sqrt(np.nanmean(v)) if np.isfinite(v).any() else np.nan for v in values])


def reach(result: DiscoveryResult) -> float:
    """How far the colours of all gap maps go, times noise, to both sides of it."""
    top = max(np.nanmax(one.gap, initial=1.0) for one in (result.map_before, result.map_after))
    return float(np.clip(top, 4.0, 100.0))


def outcome(best: str, kept: bool) -> str:
    """What came of a step, in a few words."""
    if not best:
        return "no candidate is supported"
    return f"{best}, {'added' if kept else 'followed but not kept'}"

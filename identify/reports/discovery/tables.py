"""The tables of a discovery."""

from __future__ import annotations

import numpy as np

from identify.core.text import count, listed
from identify.core.thresholds import CONVINCING
from identify.discovery.evidence import removed
from identify.reports.compare.pick import Shared
from identify.reports.compare.tables import GAP, RELATIVE, error_columns, mode_columns
from identify.reports.discovery.pick import AFTER, BEFORE, PART_KINDS, first_gaps, last_gaps, outcome
from identify.reports.kit.cells import NONE, Column, Number, Table, angles, number, percent, unit, words
from identify.reports.kit.report import Tiles
from identify.reports.shared.measurement_tables import use
from identify.reports.shared.parameters import interval_columns
from identify.reports.shared.pick import mac_of
from identify.results.discovery import DiscoveryResult, StepResult
from identify.results.fit import MeasurementResult


def tiles(result: DiscoveryResult) -> Tiles:
    """The few numbers that are read first."""
    first, last = first_gaps(result), last_gaps(result)
    added, parameters = len(result.added.sentence), len(added_parameters(result))
    rivals = sum(len(step.alike) for step in result.steps.values())
    found = f"with {count(parameters, 'parameter')}" if added else "the study's model stays as it is"
    return (
        ("Gap, fitted data", _change(first[0], last[0], added), "residual over noise; 1 is perfect"),
        ("Gap, other data", _change(first[1], last[1], added), result.elsewhere),
        ("Added", count(added, "effect"), found),
        ("Rivals", str(rivals), f"that explain about as much; after {number(result.seconds, 3)} s"),
    )


def _change(first: float, last: float, added: int) -> str:
    return f"{number(first)} → {number(last)}" if added else str(number(first))


def added_table(result: DiscoveryResult) -> Table:
    """What was added, in order, with its log odds and the gap after it."""
    a, (first, first_other) = result.added, first_gaps(result)
    turn = {step.best: number_of for number_of, step in steps(result) if step.kept}
    known, without = (
        [*one, *[np.nan] * (len(a.sentence) - len(one))] for one in (a.probability, a.gap_without)
    )
    columns = [
        words("Step", [turn.get(sentence, NONE) for sentence in a.sentence]),
        words("Effect", a.sentence),
        Column("Gap", "", a.gap),
        Column("Gap, other data", "", a.gap_validation),
        Column("Explained", "%", [removed(first, gap) for gap in a.gap], percent),
        Column("Other data", "%", [removed(first_other, gap) for gap in a.gap_validation], percent),
        Column("Gap without it", "", without),
        Column("Log odds", "", a.log_odds),
        Column("Probability", "%", known, percent),
    ]
    note = (
        f"Gap: RMS residual over noise once it is added; before anything was added {number(first)}, on other"
        f" data {number(first_other)}. Explained: share of what was above noise at first. Gap without it:"
        " of the final model without this effect alone; effects are in this order. Log odds: model with it"
        f" against model without it; above {CONVINCING:.0f} is convincing. Probability: that it is present,"
        f" and none of its rivals, beside all other effects named. Other data: {result.elsewhere}."
    )
    return Table("Added effects", columns, note)


def added_parameters(result: DiscoveryResult) -> list[tuple[str, int]]:
    """The parameters of what was added: the effect's sentence and the row in the final model's table."""
    p = result.after.parameters
    return [
        (sentence, p.name.index(name))
        for sentence, names in zip(result.added.sentence, result.added.parameters, strict=True)
        for name in names.split(", ")
        if name in p.name
    ]


def added_parameter_table(result: DiscoveryResult) -> Table:
    """The parameters of what was added, with their intervals."""
    p, found = result.after.parameters, added_parameters(result)
    rows = [row for _, row in found]
    columns = [
        words("Effect", [sentence for sentence, _ in found]),
        words("Parameter", [p.name[row] for row in rows]),
        Column("Value", "", p.value[rows]),
        words("Unit", [unit(p.unit[row]) for row in rows]),
        *interval_columns(p, rows),
        words("Identifiability", [p.status[row] for row in rows]),
    ]
    return Table("Added parameters", columns)


def steps(result: DiscoveryResult) -> list[tuple[int, StepResult]]:
    """The steps in order, numbered from one."""
    return [(int(key) + 1, result.steps[key]) for key in sorted(result.steps, key=int)]


def step_title(number_of: int, step: StepResult) -> str:
    """What a step is called."""
    return f"Step {number_of}: {outcome(step.best, step.kept)}"


def model_sentence(step: StepResult) -> str:
    """Which model a step began with."""
    return f"Model: the study's{' with ' + listed(step.model) if step.model else ''}."


def doubt_sentence(step: StepResult) -> str:
    """What cannot be distinguished from what was found; empty where nothing is."""
    return f"The data cannot tell it from {listed(step.alike)}." if step.alike else ""


def option_table(number_of: int, step: StepResult) -> Table:
    """All candidates of a step, best first."""
    o = step.options
    columns = [
        words("Rank", range(1, len(o.sentence) + 1)),
        words("Candidate", o.sentence),
        Column("Parameters", "", o.parameters, lambda value: Number(str(int(value)), float(value))),
        Column("Gap", "", o.gap),
        Column("Gap, other data", "", o.gap_validation),
        Column("Log odds", "", o.log_odds),
        words("Verdict", o.verdict),
    ]
    without = f"gap {number(step.gap)}, on other data {number(step.gap_validation)}"
    note = (
        f"Without any: {without}. {NONE}: a fit to few lines was enough to rule it out, and the gap is the"
        " one on those."
    )
    return Table(f"Candidates of step {number_of}", columns, note)


def part_table(number_of: int, step: StepResult) -> Table:
    """The gap by part of the fitted data, largest share first within each kind."""
    p, order = step.parts, list(PART_KINDS)
    ranks = [order.index(kind) if kind in order else len(order) for kind in p.kind]
    rows = np.argsort(ranks, kind="stable")
    columns = [
        words("Divided by", [PART_KINDS.get(p.kind[row], p.kind[row]) for row in rows]),
        words("Part", [p.name[row] for row in rows]),
        Column("Gap", "", p.gap[rows]),
        Column("Share", "%", p.share[rows], percent),
    ]
    note = (
        "Share: of all that is above noise; parts of a kind add up to 100 %, modes may overlap. Noise alone"
        " can make it negative."
    )
    return Table(f"Gap by part, step {number_of}", columns, note)


def gap_table(shown: list[Shared]) -> Table:
    """Every measurement: what it was, and the gap of the models on it."""
    first = [one.first for one in shown]
    columns = [
        words("Measurement", [m.name for m in first]),
        words("Use", map(use, first)),
        words("Joint angles", [angles(m.posture_deg, ".1f") for m in first], "°"),
        words("Data", ["" if m.frf is None else count(len(m.frf.output), "FRF") for m in first]),
    ]
    for label in (BEFORE, AFTER):
        if label in shown[0].runs:
            columns += error_columns(f"Gap, {label}", [one.runs[label] for one in shown])
    return Table("Gap by measurement", columns, f"{GAP}. {RELATIVE}")


def mode_table(one: Shared) -> Table | None:
    """The measured modes beside those of both models; None without measured modes, or with one model
    alone.
    """
    models = {label: one.runs[label] for label in (BEFORE, AFTER) if label in one.runs}
    first = next(iter(models.values())).pairs
    if first is None or len(models) < 2:
        return None
    hz = first.measured_frequency_hz
    columns = [
        words("Mode", range(1, len(hz) + 1)),
        Column("Measured", "Hz", hz),
        Column("Damping", "%", first.measured_damping_ratio, percent),
    ]
    for label, m in models.items():
        own, ratio, mac = np.array([_partner(m, mode) for mode in range(len(hz))]).reshape(-1, 3).T
        columns += mode_columns(label, "Error", own, 100 * (own / hz - 1), ratio, mac)
    note = (
        f"Measured: {first.origin}. Errors are model minus measured. {NONE}: the model has no mode of that"
        " shape near."
    )
    return Table(f"Modes, {one.name}", columns, note)


def _partner(m: MeasurementResult, mode: int) -> tuple[float, float, float]:
    """Frequency, damping ratio and MAC of the model's mode that is paired with a measured one, or NaN."""
    if m.pairs is None or mode not in m.pairs.measured:
        return np.nan, np.nan, np.nan
    row = int(m.pairs.model[m.pairs.measured == mode][0])
    return float(m.modes.frequency_hz[row]), float(m.modes.damping_ratio[row]), mac_of(m.pairs, row)

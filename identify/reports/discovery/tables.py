"""The tables of a discovery, as finished text; HTML and PDF print the same ones."""

from __future__ import annotations

import numpy as np

from identify.core.text import count, listed
from identify.core.thresholds import CONVINCING
from identify.discovery.evidence import removed
from identify.reports.compare.pick import Shared
from identify.reports.discovery.pick import AFTER, BEFORE, PART_KINDS, SHOWN, first_gaps, last_gaps, outcome
from identify.reports.shared.measurement_tables import use
from identify.reports.shared.pick import half_interval, interval_limits, mac_of
from identify.reports.kit.cells import NONE, Column, Number, Table, number, percent, signed, unit, words
from identify.results.discovery import DiscoveryResult, StepResult
from identify.results.fit import MeasurementResult, ModePairs

Row = tuple[str, ...]


def tiles(result: DiscoveryResult) -> tuple[tuple[str, str, str], ...]:
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
    turn = {step.best: str(number_of) for number_of, step in steps(result) if step.kept}
    rows = []
    for i, sentence in enumerate(a.sentence):
        shares = percent(removed(first, a.gap[i])), percent(removed(first_other, a.gap_validation[i]))
        rows.append(
            (
                turn.get(sentence, NONE),
                sentence,
                number(a.gap[i]),
                number(a.gap_validation[i]),
                *shares,
                number(a.log_odds[i]),
                percent(a.probability[i]) if i < len(a.probability) else NONE,
            )
        )
    columns = (
        words("Step"),
        words("Effect"),
        Column("Gap"),
        Column("Gap, other data"),
        Column("Explained", "%"),
        Column("Other data", "%"),
        Column("Log odds"),
        Column("Probability", "%"),
    )
    note = (
        f"Gap: RMS residual over noise once it is added; before anything was added {number(first)}, on other"
        f" data {number(first_other)}. Explained: share of what was above noise at first. Log odds: of the"
        f" model with it over that without it; above {CONVINCING:.0f} convinces. Probability: that it is"
        f" there, and not one of its rivals, beside all else that was named. Other data: {result.elsewhere}."
    )
    return Table("Added effects", columns, tuple(rows), note)


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
    p, rows = result.after.parameters, []
    half, (low, high) = 100 * half_interval(p), interval_limits(p)
    for sentence, i in added_parameters(result):
        interval = (number(low[i]), number(high[i]), number(half[i], 2)) if p.free[i] else (NONE,) * 3
        rows.append((sentence, p.name[i], number(p.value[i]), unit(p.unit[i]), *interval, p.status[i]))
    columns = (
        words("Effect"),
        words("Parameter"),
        Column("Value"),
        words("Unit"),
        Column("95 % from"),
        Column("to"),
        Column("±", "%"),
        words("Identifiability"),
    )
    return Table("Added parameters", columns, tuple(rows))


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
    """What cannot be told from what was found; empty where nothing is."""
    return f"The data cannot tell it from {listed(step.alike)}." if step.alike else ""


def option_table(number_of: int, step: StepResult) -> Table:
    """All candidates of a step, best first."""
    o = step.options
    rows = [
        (
            str(i + 1),
            o.sentence[i],
            Number(str(int(o.parameters[i])), float(o.parameters[i])),
            number(o.gap[i]),
            number(o.gap_validation[i]),
            number(o.log_odds[i]),
            o.verdict[i],
        )
        for i in range(len(o.sentence))
    ]
    columns = (
        words("Rank"),
        words("Candidate"),
        Column("Parameters"),
        Column("Gap"),
        Column("Gap, other data"),
        Column("Log odds"),
        words("Verdict"),
    )
    without = f"gap {number(step.gap)}, on other data {number(step.gap_validation)}"
    note = (
        f"Without any: {without}. {NONE}: a fit to few lines was enough to rule it out, and the gap is the"
        " one on those."
    )
    return Table(f"Candidates of step {number_of}", columns, tuple(rows), note)


def split(table: Table) -> tuple[Table, Table]:
    """The rows that are shown, and the others; the note stays with the first."""
    shown, rest = table.rows[:SHOWN], table.rows[SHOWN:]
    return Table(table.title, table.columns, shown, table.note), Table(table.title, table.columns, rest)


def part_table(number_of: int, step: StepResult) -> Table:
    """The gap by part of the fitted data, largest share first within each kind."""
    p, order = step.parts, list(PART_KINDS)
    rows = sorted(
        range(len(p.kind)), key=lambda row: order.index(p.kind[row]) if p.kind[row] in order else len(order)
    )
    columns = (words("Divided by"), words("Part"), Column("Gap"), Column("Share", "%"))
    note = (
        "Share: of all that is above noise; parts of a kind add up to 100 %, modes may overlap. Noise alone"
        " can make it negative."
    )
    cells = [
        (PART_KINDS.get(p.kind[i], p.kind[i]), p.name[i], number(p.gap[i]), percent(p.share[i])) for i in rows
    ]
    return Table(f"Gap by part, step {number_of}", columns, tuple(cells), note)


def gap_table(shown: list[Shared]) -> Table:
    """Every measurement: what it was, and the gap of the models on it."""
    labels = [label for label in (BEFORE, AFTER) if label in shown[0].runs]
    heads = [head for label in labels for head in (Column(f"Gap, {label}"), Column("Relative error", "%"))]
    rows = []
    for one in shown:
        m = one.first
        cells: list[str] = []
        for label in labels:
            frf = one.frfs.get(label)
            cells += [
                number(one.runs[label].gap),
                NONE if frf is None else percent(float(np.nanmedian(frf.relative_error))),
            ]
        angles = ", ".join(f"{angle:.1f}" for angle in m.posture_deg)
        data = "" if m.frf is None else count(len(m.frf.output), "FRF")
        rows.append((m.name, use(m), angles, data, *cells))
    columns = (words("Measurement"), words("Use"), words("Joint angles", "°"), words("Data"), *heads)
    note = (
        "Gap: RMS residual over noise. Relative error: RMS difference over RMS measured, median of the FRFs."
    )
    return Table("Gap by measurement", columns, tuple(rows), note)


def mode_table(one: Shared) -> Table | None:
    """The measured modes beside those of both models; None without measured modes, or with one model
    alone.
    """
    pairs = {label: one.runs[label].pairs for label in (BEFORE, AFTER) if label in one.runs}
    first = next(iter(pairs.values()))
    if first is None or len(pairs) < 2:
        return None
    heads = [
        head
        for label in pairs
        for head in (Column(label, "Hz"), Column("Error", "%"), Column("Damping", "%"), Column("MAC"))
    ]
    rows = []
    for mode, (hz, ratio) in enumerate(
        zip(first.measured_frequency_hz, first.measured_damping_ratio, strict=True)
    ):
        beside = [cell for label, own in pairs.items() for cell in _paired(one.runs[label], own, mode, hz)]
        rows.append((str(mode + 1), number(hz), percent(ratio), *beside))
    columns = (words("Mode"), Column("Measured", "Hz"), Column("Damping", "%"), *heads)
    note = (
        f"Measured: {first.origin}. Errors are model minus measured. {NONE}: the model has no mode of that"
        " shape near."
    )
    return Table(f"Modes, {one.name}", columns, tuple(rows), note)


def _paired(m: MeasurementResult, pairs: ModePairs | None, mode: int, hz: float) -> Row:
    """The mode of a model that is paired with a measured one."""
    if pairs is None or mode not in pairs.measured:
        return (NONE,) * 4
    row = int(pairs.model[pairs.measured == mode][0])
    own, ratio = m.modes.frequency_hz[row], m.modes.damping_ratio[row]
    return number(own), signed(100 * (own / hz - 1), 3), percent(ratio), number(mac_of(pairs, row))

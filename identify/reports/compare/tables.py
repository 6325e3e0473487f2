"""The tables of a comparison, as finished text; HTML and PDF print the same ones."""

from __future__ import annotations

import numpy as np

from identify.core.text import count
from identify.reports.compare.pick import Shared, matched
from identify.reports.shared.measurement_tables import use
from identify.reports.shared.pick import errors, half_interval, partner, shown_modes
from identify.reports.kit.cells import NONE, Column, Table, number, percent, signed, unit, words
from identify.results.comparison import Comparison, apart_in_std
from identify.results.fit import FitResult, MeasurementResult

Row = tuple[str, ...]


def tiles(comparison: Comparison) -> tuple[tuple[str, str, str], ...]:
    """The gaps of every run, at most four runs."""
    shown = list(comparison.runs.items())[:4]
    return tuple(
        (f"Gap, {label}", number(run.gap), f"{number(run.gap_validation)} on data that were not fitted")
        for label, run in shown
    )


def run_table(comparison: Comparison) -> Table:
    """Cost, gap and effort of every run."""
    columns = (
        words("Run"),
        words("Cost kind"),
        Column("Cost"),
        Column("Gap"),
        Column("Gap, validation"),
        words("Determined"),
        Column("Starts"),
        Column("Evaluations"),
        Column("Time", "s"),
        words("Ended as it should"),
    )
    rows = [
        (label, run.cost_kind, *map(number, (run.cost, run.gap, run.gap_validation)), *_effort(run))
        for label, run in _runs(comparison)
    ]
    note = (
        "Gap: RMS residual over noise, 1 is perfect. Determined: parameters that the data determine, of all"
        " free ones."
    )
    return Table("Runs", columns, tuple(rows), note)


def _runs(comparison: Comparison) -> list[tuple[str, FitResult]]:
    return list(comparison.runs.items())


def _effort(run: FitResult) -> Row:
    status = [s for s, free in zip(run.parameters.status, run.parameters.free, strict=True) if free]
    determined = f"{status.count('determined')} of {len(status)}"
    spent = str(int(run.starts.evaluations.sum())), number(run.seconds, 3)
    return determined, str(len(run.starts.cost)), *spent, "yes" if run.converged else "no"


def effect_table(comparison: Comparison) -> Table:
    """The model of every run, effect by effect: in which runs it is."""
    effects = dict.fromkeys(effect for run in comparison.runs.values() for effect in run.effects)
    rows = [
        (effect, *("yes" if effect in run.effects else NONE for run in comparison.runs.values()))
        for effect in effects
    ]
    return Table("Models", (words("Effect"), *map(words, comparison.runs)), tuple(rows))


def parameter_table(comparison: Comparison) -> Table:
    """Fitted values with half their intervals, every run beside the first one."""
    runs = _runs(comparison)
    names = dict.fromkeys(
        (name, of)
        for _, run in runs
        for name, of in zip(run.parameters.name, run.parameters.unit, strict=True)
    )
    apart = [apart_in_std(runs[0][1], run) for _, run in runs[1:]]
    heads = [head for label, _ in runs for head in (Column(label), Column("±", "%"))]
    heads += [Column("Ratio" if len(runs) == 2 else f"{label} / {runs[0][0]}") for label, _ in runs[1:]]
    heads += [Column("Apart" if len(runs) == 2 else f"{label} apart", "std") for label, _ in runs[1:]]
    rows = []
    for name, of in names:
        values = [_value(run, name) for _, run in runs]
        ratios = [number(value / values[0][0]) if values[0][0] else NONE for value, _ in values[1:]]
        between = [number(one.get(name, np.nan), 3) for one in apart]
        rows.append(
            (
                name,
                unit(of),
                *(number(x, d) for pair in values for x, d in zip(pair, (4, 2), strict=True)),
                *ratios,
                *between,
            )
        )
    note = (
        f"± is half the 95 % interval over the value. Ratio: to {runs[0][0]}. Apart: difference over its"
        " standard deviation, both intervals taken as independent; beyond 2 the runs disagree."
    )
    return Table("Parameters", (words("Parameter"), words("Unit"), *heads), tuple(rows), note)


def _value(run: FitResult, name: str) -> tuple[float, float]:
    """Value and half its interval in per cent; NaN where the run has no such parameter."""
    if name not in run.parameters.name:
        return float("nan"), float("nan")
    row = run.parameters.name.index(name)
    return float(run.parameters.value[row]), float(100 * half_interval(run.parameters)[row])


def mode_table(one: Shared) -> Table:
    """Modes of the first run with what they became in the others, and the measured ones where there are
    any.
    """
    (label, a), *others = one.runs.items()
    measured = a.pairs is not None
    heads = [Column("Measured", "Hz")] if measured else []
    heads += [Column(label, "Hz"), Column("Damping", "%")]
    for other, _ in others:
        heads += [Column(other, "Hz"), Column("Change", "%"), Column("Damping", "%"), Column("MAC")]
    became = [(b, matched(a, b)) for _, b in others]
    rows = []
    for mode in range(shown_modes(a)):
        beside = [_measured(a, mode)] if measured else []
        own = number(a.modes.frequency_hz[mode]), percent(a.modes.damping_ratio[mode])
        rows.append(
            (
                str(mode + 1),
                *beside,
                *own,
                *(cell for b, pairs in became for cell in _became(a, mode, b, pairs.get(mode))),
            )
        )
    note = f"Modes of the models, paired by shape and frequency. Change and MAC: against {label}."
    return Table(f"Modes, {one.name}", (words("Mode"), *heads), tuple(rows), note)


def _measured(a: MeasurementResult, mode: int) -> str:
    found = None if a.pairs is None else partner(a.pairs, mode)
    return NONE if found is None or a.pairs is None else number(a.pairs.measured_frequency_hz[found])


def _became(a: MeasurementResult, mode: int, b: MeasurementResult, found: tuple[int, float] | None) -> Row:
    if found is None:
        return (NONE,) * 4
    other, mac = found
    hz, ratio = b.modes.frequency_hz[other], b.modes.damping_ratio[other]
    return number(hz), signed(100 * (hz / a.modes.frequency_hz[mode] - 1), 3), percent(ratio), number(mac)


def error_table(comparison: Comparison) -> Table:
    """Gap and median relative FRF error of every measurement in every run."""
    names = dict.fromkeys(name for run in comparison.runs.values() for name in run.measurements)
    heads = [
        head for label in comparison.runs for head in (Column(f"{label}: gap"), Column("Relative error", "%"))
    ]
    rows = []
    for name in names:
        found = [run.measurements.get(name) for run in comparison.runs.values()]
        uses = dict.fromkeys(use(m) for m in found if m is not None)
        rows.append((name, " / ".join(uses), *(cell for m in found for cell in _errors(m))))
    note = "Relative error: RMS difference over RMS measured, median of the FRFs."
    return Table("Errors", (words("Measurement"), words("Use"), *heads), tuple(rows), note)


def _errors(m: MeasurementResult | None) -> Row:
    if m is None:
        return NONE, NONE
    return number(m.gap), NONE if m.frf is None else percent(float(np.nanmedian(m.frf.relative_error)))


def frf_table(one: Shared) -> Table:
    """Every common FRF with its error in every run, the largest first."""
    frfs = list(one.frfs.values())
    in_noise = all(frf.gap is not None for frf in frfs)
    found = np.array([errors(frf) if in_noise else 100 * frf.relative_error for frf in frfs])
    order = np.argsort(-np.nan_to_num(found.max(axis=0), nan=-1.0), kind="stable")
    heads = (Column(label, "gap" if in_noise else "%") for label in one.frfs)
    rows = [(frfs[0].output[i], frfs[0].input[i], *map(number, found[:, i])) for i in order]
    title = f"FRF errors, {one.name}, {count(len(order), 'common FRF')}"
    return Table(title, (words("Output"), words("Input"), *heads), tuple(rows))


def setting_table(comparison: Comparison) -> Table | None:
    """Settings that are not the same in all runs, with the source of each value; None where there are none,
    or they were not kept.
    """
    kept = [run.provenance.settings for run in comparison.runs.values()]
    tables = [
        dict(zip(s.key, zip(s.value, s.source, strict=True), strict=True)) for s in kept if s is not None
    ]
    if len(tables) < len(kept):
        return None
    rows = []
    for key in dict.fromkeys(key for table in tables for key in table):
        found = [table.get(key, (NONE, "")) for table in tables]
        if len({value for value, _ in found}) > 1:
            rows.append((key, *(f"{value} ({source})" if source else value for value, source in found)))
    return (
        Table("Settings that differ", (words("Setting"), *map(words, comparison.runs)), tuple(rows))
        if rows
        else None
    )

"""The tables of a comparison."""

from __future__ import annotations

import numpy as np

from identify.core.arrays import Array
from identify.core.text import count
from identify.reports.compare.pick import Shared, matched
from identify.reports.kit.cells import NONE, Column, Table, digits, number, percent, unit, whole, words
from identify.reports.kit.report import Tiles
from identify.reports.shared.measurement_tables import DIFFERENCE, use
from identify.reports.shared.parameters import half_interval
from identify.reports.shared.pick import errors, partner, shown_modes
from identify.results.comparison import Comparison, apart_in_std
from identify.results.fit import FitResult, MeasurementResult

GAP = "Gap: RMS residual over noise"
RELATIVE = "Relative error: RMS difference over RMS measured, median of the FRFs."


def tiles(comparison: Comparison) -> Tiles:
    """The gaps of every run, at most four runs."""
    shown = list(comparison.runs.items())[:4]
    return tuple(
        (f"Gap, {label}", number(run.gap), f"{number(run.gap_validation)} on data that were not fitted")
        for label, run in shown
    )


def run_table(comparison: Comparison) -> Table:
    """Cost, gap and effort of every run."""
    runs = list(comparison.runs.values())
    free = [np.array(run.parameters.status)[run.parameters.free] for run in runs]
    columns = [
        words("Run", comparison.runs),
        words("Cost kind", [run.cost_kind for run in runs]),
        Column("Cost", "", [run.cost for run in runs]),
        Column("Gap", "", [run.gap for run in runs]),
        Column("Gap, validation", "", [run.gap_validation for run in runs]),
        words("Determined", [f"{np.sum(status == 'determined')} of {len(status)}" for status in free]),
        Column("Starts", "", [len(run.starts.cost) for run in runs], whole),
        Column("Evaluations", "", [run.starts.evaluations.sum() for run in runs], whole),
        Column("Time", "s", [run.seconds for run in runs], digits(3)),
        words("Ended as it should", ["yes" if run.converged else "no" for run in runs]),
    ]
    note = f"{GAP}, 1 is perfect. Determined: parameters that the data determine, of all free ones."
    return Table("Runs", columns, note)


def effect_table(comparison: Comparison) -> Table:
    """The model of every run, effect by effect: in which runs it is."""
    effects = dict.fromkeys(effect for run in comparison.runs.values() for effect in run.effects)
    runs = [
        words(label, ["yes" if effect in run.effects else NONE for effect in effects])
        for label, run in comparison.runs.items()
    ]
    return Table("Models", [words("Effect", effects), *runs])


def parameter_table(comparison: Comparison) -> Table:
    """Fitted values with half their intervals, every run beside the first one."""
    (first, base), *others = comparison.runs.items()
    units = {
        name: of
        for run in comparison.runs.values()
        for name, of in zip(run.parameters.name, run.parameters.unit, strict=True)
    }
    found = {label: np.array([_value(run, name) for name in units]) for label, run in comparison.runs.items()}
    columns = [words("Parameter", units), words("Unit", map(unit, units.values()))]
    for label, values in found.items():
        columns += [Column(label, "", values[:, 0]), Column("±", "%", values[:, 1], digits(2))]
    pair, divisor = len(others) == 1, np.where(found[first][:, 0] == 0, np.nan, found[first][:, 0])
    for label, _ in others:
        ratio = found[label][:, 0] / divisor
        columns.append(Column("Ratio" if pair else f"{label} / {first}", "", ratio))
    for label, run in others:
        apart = apart_in_std(base, run)
        between = [apart.get(name, np.nan) for name in units]
        columns.append(Column("Apart" if pair else f"{label} apart", "std", between, digits(3)))
    note = (
        f"± is half the 95 % interval over the value. Ratio: to {first}. Apart: difference over its standard"
        " deviation, both intervals taken as independent; beyond 2 the runs disagree."
    )
    return Table("Parameters", columns, note)


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
    count = shown_modes(a)
    columns = [words("Mode", range(1, count + 1))]
    if a.pairs is not None:
        partners = [partner(a.pairs, mode) for mode in range(count)]
        hz = [np.nan if row is None else a.pairs.measured_frequency_hz[row] for row in partners]
        columns.append(Column("Measured", "Hz", hz))
    own, damping = a.modes.frequency_hz[:count], a.modes.damping_ratio[:count]
    columns += [Column(label, "Hz", own), Column("Damping", "%", damping, percent)]
    for other, b in others:
        hz, ratio, mac = _became(a, b, count).T
        columns += mode_columns(other, "Change", hz, 100 * (hz / own - 1), ratio, mac)
    note = f"Modes of the models, paired by shape and frequency. Change and MAC: against {label}."
    return Table(f"Modes, {one.name}", columns, note)


def mode_columns(label: str, change: str, hz: Array, off: Array, ratio: Array, mac: Array) -> list[Column]:
    """Frequencies of a model, how far they are off in per cent, damping ratios, and MAC."""
    return [
        Column(label, "Hz", hz),
        Column(change, "%", off, DIFFERENCE),
        Column("Damping", "%", ratio, percent),
        Column("MAC", "", mac),
    ]


def _became(a: MeasurementResult, b: MeasurementResult, count: int) -> Array:
    """Frequency, damping ratio and MAC of the modes of b that those of a became, (modes, 3), NaN for none."""
    found = np.full((count, 3), np.nan)
    for mode, (other, mac) in matched(a, b).items():
        found[mode] = b.modes.frequency_hz[other], b.modes.damping_ratio[other], mac
    return found


def error_table(comparison: Comparison) -> Table:
    """Gap and median relative FRF error of every measurement in every run."""
    names = dict.fromkeys(name for run in comparison.runs.values() for name in run.measurements)
    found = {label: [run.measurements.get(name) for name in names] for label, run in comparison.runs.items()}
    uses = [dict.fromkeys(use(m) for m in row if m is not None) for row in zip(*found.values(), strict=True)]
    columns = [words("Measurement", names), words("Use", map(" / ".join, uses))]
    for label, own in found.items():
        columns += error_columns(f"{label}: gap", own)
    return Table("Errors", columns, RELATIVE)


def error_columns(heading: str, found: list[MeasurementResult | None]) -> list[Column]:
    """The gap of a model on measurements, and the median relative error of FRFs; NaN where there is none."""
    frfs = [None if m is None else m.frf for m in found]
    relative = [np.nan if frf is None else float(np.nanmedian(frf.relative_error)) for frf in frfs]
    gaps = [np.nan if m is None else m.gap for m in found]
    return [Column(heading, "", gaps), Column("Relative error", "%", relative, percent)]


def frf_table(one: Shared) -> Table:
    """Every common FRF with its error in every run, the largest first."""
    frfs = list(one.frfs.values())
    in_noise = all(frf.gap is not None for frf in frfs)
    found = np.array([errors(frf) if in_noise else 100 * frf.relative_error for frf in frfs])
    order = np.argsort(-np.nan_to_num(found.max(axis=0), nan=-1.0), kind="stable")
    columns = [
        words("Output", [frfs[0].output[i] for i in order]),
        words("Input", [frfs[0].input[i] for i in order]),
        *(
            Column(label, "gap" if in_noise else "%", own[order])
            for label, own in zip(one.frfs, found, strict=True)
        ),
    ]
    return Table(f"FRF errors, {one.name}, {count(len(order), 'common FRF')}", columns)


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
    heads = [words("Setting"), *map(words, comparison.runs)]
    return Table.of("Settings that differ", heads, rows) if rows else None

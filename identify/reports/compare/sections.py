"""The report of a comparison: runs and models, parameters, modes, FRFs and residuals side by side.

Figures of a comparison in the PDF: parameters of all runs relative to the first one, and residuals over
frequency.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from identify.core.arrays import Array
from identify.reports.compare import tables
from identify.reports.compare.pick import Shared, matched, shape_mac, shared
from identify.reports.kit import plotting as mpl
from identify.reports.kit.banded import Line, Panel, Plot
from identify.reports.kit.cells import NONE, Column, Curves, Table, number
from identify.reports.kit.figures import MUTED, PALETTE, WIDTH_IN, Room, head, wide
from identify.reports.kit.report import (
    EVERYWHERE,
    PAGE,
    Box,
    Code,
    Drawing,
    Fold,
    Heading,
    Part,
    Parts,
    Report,
    Section,
    Tabular,
    given,
    note,
    origin,
)
from identify.reports.shared import measurement_tables, pick
from identify.reports.shared.data import RESIDUAL, banded
from identify.reports.shared.page_data import channels, frf_data, mac_data, robot_data
from identify.reports.shared.parts import (
    Page,
    error_lists,
    frf_picker,
    mac,
    overlays_beside,
    shapes,
    stage,
    worst,
)
from identify.reports.shared.pick import errors
from identify.reports.shared.shapes import ModeView, beside_views
from identify.results.comparison import Comparison
from identify.results.fit import FrfComparison

SCRIPTS = ("compare.js",)
_RUNS = ("Run", "Cost kind", "Cost", "Gap", "Gap, validation", "Ended as it should")
_MARKERS = "oDs^vX"
_WIDE = 5.0
"""Ratio of residuals from which a logarithmic axis shows them better."""
_IN_ROW = 4
"""Runs in a row of a legend."""


def report(comparison: Comparison) -> Report:
    """What is said of several runs side by side."""
    found = shared(comparison)
    with_frf = [one for one in found if one.frfs]
    opening = [
        Tabular(tables.run_table(comparison), terminal=_RUNS, on=EVERYWHERE),
        Tabular(tables.effect_table(comparison), heading=True, on=EVERYWHERE),
    ]
    ratios = ratio_parts(comparison, tables.parameter_table(comparison), "the first run")
    sections = [
        Section("parameters", "Parameters", ratios),
        *(_modes(comparison, found) if found else []),
        Section("alone", "Modes at measurements of one run", _alone(comparison, found), "Modes of one run"),
        *(_frfs(with_frf) if with_frf else []),
        Section("errors", "Errors", _errors(comparison, with_frf)),
        *origin(comparison, "Settings", _asked(comparison)),
    ]
    return Report(tables.tiles(comparison), opening, sections)


def ratio_parts(comparison: Comparison, table: Table, first: str) -> Parts:
    """The parameters of all runs, and their values over those of the first."""
    caption = f"Values with their 95 % intervals over those of {first}."
    names, values = ratios(comparison)
    drawn = partial(parameters, comparison) if names else None
    span = shown_range(values) if names else (0.1, 10.0)
    page = {"name": names, "runs": values, "range": span, "first": next(iter(comparison.runs))}
    brief = ("Parameter", "Unit", "Fitted", *comparison.runs)
    return [
        Tabular(table, sort="parameters", terminal=brief, on=EVERYWHERE),
        Drawing("ratio-plot", drawn, caption, lambda: [table], page={"parameters": page}, scripts=SCRIPTS),
    ]


def _modes(comparison: Comparison, found: list[Shared]) -> list[Section]:
    first, *others = comparison.runs
    numbers = {label: k for k, label in enumerate(comparison.runs)}
    runs = {f"run{k}": label for k, label in enumerate(others, 1)}
    page = {
        "measurements": [_measurement(one, numbers) for one in found],
        "curves": {"measured": "measured", "fitted": first, **runs},
        "stages": dict(zip(("model", "measured"), comparison.runs, strict=False)),
    }
    blocks = [Box("block wide", _mode_block(k, one)) for k, one in enumerate(found)]
    matrices = [matrix for matrix in map(shape_mac, found) if matrix]
    macs = mac(matrices, "Modal assurance criterion (MAC) of the models' shapes.")
    return [
        Section("modes", "Modes", [*blocks, *macs]),
        Section("robot", "Mode shapes", _shapes(found, page), "Shapes"),
    ]


def _mode_block(k: int, one: Shared) -> Parts:
    table = Tabular(tables.mode_table(one), heading=True, on=EVERYWHERE)
    return [table, Heading("MAC of the models' shapes", on=PAGE), Drawing(f"mac-{k}", look="mac")]


def _alone(comparison: Comparison, found: list[Shared]) -> Parts:
    """The modes of every run at measurements that no other run has."""
    shown, brief = {one.name for one in found}, measurement_tables.MODES_TERMINAL
    alone = [m for run in comparison.runs.values() for m in run.measurements.values() if m.name not in shown]
    return [given(measurement_tables.mode_table(m), terminal=brief, on=EVERYWHERE) for m in alone]


def _shapes(found: list[Shared], page: Page) -> Parts:
    first, views = found[0], mode_views(found[0])
    a, b = list(first.runs)[:2]
    stages = [("model", f"the model of {a}"), ("measured", f"the points of {b}, moving in the same mode")]
    caption = f"Modes at {first.name}: at rest (grey), {a} at both ends of the motion, enlarged"
    caption += f"; rings: points of {b}."
    moving = stage([one.first for one in found], stages, page)
    return [moving, shapes(first.first, views, views, caption)]


def _frfs(with_frf: list[Shared]) -> list[Section]:
    drawn = [overlays_beside(one.name, one.frfs, "errors are those of") for one in with_frf]
    picker = frf_picker([one.first for one in with_frf])
    left = [*residual_parts(with_frf), note("All common FRFs together, in bands.")]
    return [
        Section("frf", "Frequency response functions", [picker, *drawn], "FRFs"),
        Section("residuals", "Where the models disagree with the data", left, "Residuals"),
    ]


def residual_parts(with_frf: list[Shared]) -> list[Part]:
    """The residual of every run over frequency, a plot a measurement."""
    parts: list[Part] = []
    for k, one in enumerate(with_frf):
        plot = residuals(f"residual-{k}", one)
        parts += [Heading(one.name, on=PAGE), plot.drawing(partial(_residual_curves, one))]
    return parts


def _residual_curves(one: Shared) -> list[Curves]:
    """The residual of every run over frequency."""
    bands = [band_gaps(frf) for frf in one.frfs.values()]
    what = RESIDUAL[one.in_noise]
    values = np.column_stack([values for _, values in bands])
    return [Curves("residuals", banded(bands[0][0], list(one.frfs), what, values))]


def _errors(comparison: Comparison, with_frf: list[Shared]) -> Parts:
    lists = [tables.frf_table(one) for one in with_frf]
    every = Tabular(tables.error_table(comparison), on=EVERYWHERE)
    return [every, *(error_lists(lists) if lists else []), *map(worst, lists)]


def _asked(comparison: Comparison) -> Parts:
    runs = comparison.runs.items()
    studies = [Fold(f"Study of {label}", [Code(run.provenance.config)]) for label, run in runs]
    return [given(tables.setting_table(comparison)), *studies]


def _measurement(one: Shared, numbers: dict[str, int]) -> dict[str, Any]:
    first = one.first
    return {
        "name": one.name,
        "use": measurement_tables.use(first),
        "robot": robot_data(first.geometry, channels(first.frf), mode_views(one), [], ("", "")),
        "frf": _frf(one, numbers) if one.frfs else None,
        "mac": mac_data(shape_mac(one)),
    }


def mode_views(one: Shared) -> list[ModeView]:
    """The modes of the first run with what they became in the second one, to look at."""
    a, b = list(one.runs.values())[:2]
    return beside_views(a, b, {mode: other for mode, (other, _) in matched(a, b).items()})


def _frf(one: Shared, numbers: dict[str, int]) -> dict[str, Any]:
    (_, first), *others = one.frfs.items()
    found = frf_data(first, {f"run{numbers[label]}": frf.fitted for label, frf in others})
    return found | {"title": titles(one, _error)}


def titles(one: Shared, error: Callable[[FrfComparison, int], str]) -> list[str]:
    """What stands above each FRF: the error of every model."""
    pairs = range(len(next(iter(one.frfs.values())).output))
    return [", ".join(f"{label} {error(frf, pair)}" for label, frf in one.frfs.items()) for pair in pairs]


def _error(frf: FrfComparison, pair: int) -> str:
    value = errors(frf)[pair]
    return f"gap {number(value)}" if frf.gap is not None else f"relative error {number(100 * value)} %"


def ratios(comparison: Comparison) -> tuple[list[str], dict[str, Array]]:
    """Names (p) of all parameters of the first run that are positive, and per run (p, 3): value and limits of
    the 95 % interval over the first run's value; NaN where a run has no such parameter, or no interval.
    """
    first = next(iter(comparison.runs.values())).parameters
    names = [name for name, value in zip(first.name, first.value, strict=True) if value > 0]
    base = np.array([first.value[first.name.index(name)] for name in names])
    found = {}
    for label, run in comparison.runs.items():
        p, values = run.parameters, np.full((len(names), 3), np.nan)
        for row, name in enumerate(names):
            if name in p.name:
                i = p.name.index(name)
                values[row] = p.value[i], p.low_95[i], p.high_95[i]
        values[values <= 0] = np.nan
        found[label] = values / base[:, None]
    return names, found


def parameters(comparison: Comparison) -> mpl.Figure:
    """Values with their intervals over those of the first run."""
    names, found = ratios(comparison)
    figure = mpl.Figure((WIDTH_IN, 0.8 + (0.13 + 0.06 * len(found)) * len(names)))
    [axes] = Room(0.15 + wide(names), top=0.12 + 0.18 * -(-len(found) // _IN_ROW)).axes(figure)
    rows = np.arange(len(names))
    for k, (label, values) in enumerate(found.items()):
        at, color = rows + 0.6 * ((k + 0.5) / len(found) - 0.5), PALETTE[k % len(PALETTE)]
        axes.hlines(at, values[:, 1], values[:, 2], color=color, lw=0.9)
        axes.plot(values[:, 0], at, _MARKERS[k % len(_MARKERS)], color=color, ms=3.6, label=label)
    axes.axvline(1.0, color=MUTED, lw=0.6, ls=":")
    low, high = shown_range(found)
    axes.set(
        xscale="log" if high > 3 * low else "linear",
        xlim=(low, high),
        yticks=rows,
        ylim=(len(names) - 0.5, -0.5),
    )
    axes.set_xlabel(f"Value over that of {next(iter(found))} ({NONE})")
    axes.set_yticklabels(names)
    head(figure, axes, _IN_ROW)
    return figure


def shown_range(found: dict[str, Array]) -> tuple[float, float]:
    """What the axis of ratios spans: all values, and intervals up to a factor of thirty."""
    every = np.concatenate(list(found.values()))
    low, high = np.nanmin(every[:, 0]), np.nanmax(every[:, 0])
    low, high = min(low, max(np.nanmin(every), low / 30)), max(high, min(np.nanmax(every), high * 30))
    return float(low / 1.15), float(high * 1.15)


def band_gaps(frf: FrfComparison) -> tuple[Array, Array]:
    """Edges of bands, Hz (b + 1,), and the RMS over all FRFs of the residual in each (b,), as in the gap
    map.
    """
    found = pick.gap_map(frf)
    return found.edges_hz, np.sqrt(np.nanmean(found.values**2, axis=1))


def residuals(anchor: str, one: Shared) -> Plot:
    """The residual of every run over frequency, all common FRFs together; steps from band to band."""
    bands = {label: band_gaps(frf) for label, frf in one.frfs.items()}
    lines = [Line(label, x, np.append(y, y[-1:]), look="steps") for label, (x, y) in bands.items()]
    every = np.concatenate([line.y for line in lines])
    low, high = float(np.nanmin(every)), float(np.nanmax(every))
    wide = high > _WIDE * low > 0
    y = Column("Residual / noise (1 = noise)" if one.in_noise else "Residual / measured")
    panel = Panel(y, lines, log=wide, top=None if wide else 1.05 * high)
    caption = f"Residual over frequency, {one.name}, all common FRFs together."
    return Plot(anchor, Column("Frequency", "Hz"), [panel], caption, height=1.7)

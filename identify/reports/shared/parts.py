"""Parts that the reports of fits, modal analyses, comparisons and discoveries share: robot and shapes, FRFs,
gap maps, MAC.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

from identify.core.text import count, listed
from identify.reports.kit.cells import Table
from identify.reports.kit.report import PAGE, PRINT, Drawing, Fold, Part, Tabular, Widget, note
from identify.reports.shared import data, figures, frf_figure, measurement_tables, pick, robot_figure
from identify.reports.shared.shapes import ModeView, mode_views
from identify.results.fit import FrfComparison, MeasurementResult

Page = Mapping[str, Any]
WORST_ROWS = 10
"""FRFs that the PDF lists, of each measurement."""
STAGES = {
    "model": "the model at its posture, moving in the chosen mode",
    "measured": "the measured points, moving in the mode that was measured",
    "motion": "the measured points, moving as they were measured at one line",
}
"""Canvases on which shapes move, and what they show."""


def stage(
    measurements: Sequence[Any], stages: Sequence[tuple[str, str]], page: Page, what: str = "Posture"
) -> Widget:
    """Canvases on which the shapes of measurements (with a name each) move; stages: (kind, what it shows);
    page: what the scripts of the page draw of the measurements, FRFs and MAC too.
    """
    return Widget("stage", {"measurements": measurements, "stages": stages, "what": what}, page)


def stages_of(measurements: Sequence[MeasurementResult]) -> list[tuple[str, str]]:
    """The canvases for shapes of these measurements: the measured one only where shapes were measured, that
    of motion at a line only where there are FRFs.
    """
    there = {
        "model": True,
        "measured": any(m.pairs and m.pairs.measured_shapes is not None for m in measurements),
        "motion": any(m.frf is not None and m.geometry.axes is not None for m in measurements),
    }
    return [(kind, about) for kind, about in STAGES.items() if there[kind]]


def frf_picker(measurements: Sequence[Any], initial: bool = False, page: Page | None = None) -> Widget:
    """One FRF of the page at a time; initial: whether the start model's can be shown; page: as of `stage`,
    where there is none.
    """
    return Widget("frf_picker", {"measurements": measurements, "initial": initial}, page or {})


def overlays(name: str, frf: FrfComparison, modelled: str = "fitted") -> list[Part]:
    """The PDF's chosen FRFs of a measurement, and a table of those with the largest error."""
    figure = partial(frf_figure.overlays, frf, modelled)
    drawn = Drawing("", figure, _chosen(name, frf), partial(data.frfs, frf, modelled))
    return [drawn, worst(measurement_tables.frf_table(name, frf))]


def worst(table: Table) -> Tabular:
    """The FRFs with the largest error in the PDF."""
    return Tabular(table, heading=True, rows=WORST_ROWS, on=PRINT)


def _chosen(name: str, frf: FrfComparison) -> str:
    by = "relative error" if frf.gap is None else "gap"
    pairs = pick.shown_frfs(frf)
    drive = sum(pick.is_drive_point(frf, pair) for pair in pairs)
    parts = [count(drive, "drive point")] if drive else []
    if drive < len(pairs):
        parts.append(f"the {len(pairs) - drive} other {frf.noun.several} with the largest {by}")
    coherence = "" if frf.coherence is None else " \N{GREEK SMALL LETTER GAMMA}²: coherence."
    return f"{name}: {frf.quantity}, {measurement_tables.band(frf)}; {listed(parts)}.{coherence}"


def overlays_beside(name: str, frfs: Mapping[str, FrfComparison], said: str) -> Drawing:
    """The PDF's chosen FRFs of several models by label; said: whose errors stand above them."""
    (label, frf), *others = frfs.items()
    beside = {other: of.fitted for other, of in others}

    def numbers() -> list[Any]:
        return [one for key, of in frfs.items() for one in data.frfs(of, key)[(0 if key == label else 1) : 2]]

    caption = f"{name}: {frf.quantity}, {measurement_tables.band(frf)}; {said} {label}."
    return Drawing("", partial(frf_figure.overlays, frf, label, beside), caption, numbers)


def gap_maps(named: Sequence[tuple[str, FrfComparison]], measurements: Sequence[Any]) -> list[Part]:
    """Where in frequency and channel the residual is: one measurement at a time on the page."""
    drawings = [_gap_map(name, frf) for name, frf in named]
    return [Widget("gap_map", {"measurements": measurements}), *drawings]


def _gap_map(name: str, frf: FrfComparison) -> Drawing:
    figure, caption = partial(figures.gap_map, name, frf), f"Residual by band and FRF, {name}."
    return Drawing("", figure, caption, lambda: [data.gap_map(frf)])


def error_lists(tables: Sequence[Table]) -> list[Part]:
    """Every FRF with its errors, a table a measurement, on the page."""
    folds = [
        Fold(table.title, [Tabular(table, sort=f"frf-{k}", limit=15)], open=not k, on=PAGE)
        for k, table in enumerate(tables)
    ]
    return [*folds, note("Worst first. Click a heading to sort, a row to see its FRF.")]


def mac(matrices: Sequence[figures.Mac], caption: str) -> list[Part]:
    """MAC matrices in the PDF."""
    figure = partial(figures.mac, matrices)
    return [Drawing("", figure, caption, lambda: [*map(data.mac, matrices)])] if matrices else []


def first_shapes(m: MeasurementResult, of: str) -> Drawing:
    """The first modes of a model at a posture, in the PDF."""
    views = mode_views(m)
    caption = f"Modes of the {of}, {m.name}: at rest (grey) and at both ends of the motion, enlarged"
    caption += "; rings: measured." if m.pairs and m.pairs.measured_shapes is not None else "."
    return shapes(m, views, views[: pick.modes_in_band(m)], caption)


def shapes(m: Any, views: Sequence[ModeView], drawn: Sequence[ModeView], caption: str) -> Drawing:
    """Shapes on the geometry of a measurement, in the PDF; views: those that are exported."""
    figure = partial(robot_figure.shapes, m.geometry, drawn)
    return Drawing(
        "", figure, caption, lambda: [data.shapes(m.geometry, views), data.geometry(m.name, m.geometry)]
    )

"""The PDF report of a batch: the same tables as its HTML page, and printed figures."""

from __future__ import annotations

from identify.reports.batch import tables as batch_tables
from identify.reports.kit import figures, posture_figure
from identify.reports.kit.cells import Column, Table, number, words
from identify.reports.kit.document import Document
from identify.reports.kit.posture_pick import Postures, Quantity, batch_postures
from identify.results.batch import BatchResult

_ROWS = 60
_WORST_ROWS = 30
_PANELS = 18


def document(result: BatchResult) -> Document:
    """The PDF of a batch, in the making."""
    made, postures = Document(), batch_postures(result)
    with figures.style():
        made.opening(result, batch_tables.tiles(result))
        failures = batch_tables.failure_table(result)
        if failures is not None:
            made.table(failures, heading=True, rows=_ROWS)
        made.add("heading", "Does a parameter depend on posture?")
        made.table(batch_tables.dependence_table(result))
        made.table(batch_tables.trend_table(result), heading=True)
        _trends(made, postures)
        _modes(made, postures)
        _maps(made, result, postures)
    made.add("heading", "Fits")
    jobs = batch_tables.job_table(result)
    made.table(jobs, rows=_WORST_ROWS)
    _said(made, jobs, _WORST_ROWS)
    made.tables.append(batch_tables.value_table(result))
    made.sources(result)
    return made


def _said(made: Document, table: Table, rows: int) -> None:
    if len(table.rows) > rows:
        made.add("paragraph", f"The first {rows} of {len(table.rows)}; all are on the HTML page.")


def _trends(made: Document, postures: Postures) -> None:
    shown = postures.of("parameter")[:_PANELS]
    if shown:
        caption = (
            "Parameters of each posture on its own, with 95 % intervals, over the joint they change with;"
            " orange: the weighted mean; "
        )
        caption += "crosses: not counted."
        made.figure(posture_figure.trends(postures, shown), caption, values(postures, shown))


def _modes(made: Document, postures: Postures) -> None:
    made.add("heading", "Modes and errors")
    for kind, what in (("frequency", "Frequencies"), ("damping", "Damping ratios")):
        if postures.of(kind):
            shown = postures.of(kind)
            made.figure(
                posture_figure.modes(postures, kind), f"{what} of the fitted models.", values(postures, shown)
            )
    errors = postures.of("error")
    if errors:
        caption = (
            "Errors by posture; frequency and damping errors are those of the modes that are paired with"
            " measured ones."
        )
        made.figure(posture_figure.trends(postures, errors[-_PANELS:]), caption, values(postures, errors))


def _maps(made: Document, result: BatchResult, postures: Postures) -> None:
    if not postures.varied:
        return
    made.add("heading", "Maps of the postures")
    depends = [one for one in postures.of("parameter") if one.name in _dependent(result)][:3]
    shown = [
        *depends,
        *postures.of("frequency")[:1],
        *(one for one in postures.of("error") if one.name == "gap"),
    ]
    maps(made, postures, shown)


def maps(made: Document, postures: Postures, shown: list[Quantity]) -> None:
    """Maps of some quantities, three a figure."""
    for first in range(0, len(shown), 3):
        some = shown[first : first + 3]
        caption = "Over two joints, and over the place of the tool from the side and from above."
        made.figure(posture_figure.maps(postures, some), caption, values(postures, some))


def _dependent(result: BatchResult) -> list[str]:
    d = result.dependence
    return [name for name, depends in zip(d.parameter, d.depends, strict=True) if depends]


def values(postures: Postures, shown: list[Quantity]) -> Table:
    """Quantities by posture, for export."""
    columns = [
        words("Posture"),
        *(Column(f"Joint {joint + 1}", "°") for joint in range(postures.angles_deg.shape[1])),
    ]
    columns += [Column(one.name, one.unit) for one in shown]
    rows = []
    for k, name in enumerate(postures.names):
        rows.append((name, *map(number, postures.angles_deg[k]), *(number(one.value[k]) for one in shown)))
    return Table("by posture", tuple(columns), tuple(rows))

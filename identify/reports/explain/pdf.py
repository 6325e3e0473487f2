"""The PDF report of an explained motion: the same tables as its HTML page, and printed figures."""

from __future__ import annotations

import numpy as np

from identify.reports.explain import figure as explain_figure
from identify.reports.explain import tables as explain_tables
from identify.reports.explain.pick import history
from identify.reports.kit import figures
from identify.reports.kit.cells import Column, Curves, sentence, words
from identify.reports.kit.cells import Table as Cells
from identify.reports.kit.document import Document
from identify.results.explain import Curves as Recorded
from identify.results.explain import ExplainResult, TargetResult


def document(result: ExplainResult) -> Document:
    """The PDF of an explained motion, in the making."""
    made = Document()
    with figures.style():
        made.opening(result, explain_tables.tiles(result))
        for found in result.targets.values():
            _target(made, found)
        made.add("heading", "What these records cannot say")
        for text in result.unknown:
            made.add("paragraph", sentence(text))
        made.add("heading", "What was done to the records")
        made.table(
            Cells("Records", (words("Record and treatment"),), tuple((text,) for text in result.conditioning))
        )
    made.sources(result)
    return made


def _target(made: Document, found: TargetResult) -> None:
    made.add("heading", explain_tables.title(found))
    made.table(explain_tables.residual_table(found))
    for curves in found.curves.values():
        use = "held out" if curves.use == "validate" else "fitted"
        made.figure(
            explain_figure.histories(found, curves), f"Record {curves.name}, {use}.", *_data(found, curves)
        )
    if found.steps.name:
        made.figure(
            explain_figure.shares(found),
            "Left: how much of the squares on the held-out record each effect took when it was added, in that"
            " order. Right: the gap.",
        )
    for table in (
        explain_tables.effect_table,
        explain_tables.step_table,
        explain_tables.value_table,
        explain_tables.bound_table,
    ):
        one = table(found)
        if one.rows:
            made.table(one, heading=True)


def _data(found: TargetResult, curves: Recorded) -> list[Curves]:
    """The numbers behind the histories: a set per joint."""
    unit = explain_tables.scale(found)[1]
    sets = []
    for row, joint in enumerate(found.joints):
        h = history(found, curves, row)
        columns = (
            Column("Time", "s"),
            Column("Measured", unit),
            Column("Known", unit),
            Column("Explained", unit),
        )
        values = np.column_stack([h.time_s, h.measured, h.known, h.explained])
        sets.append(
            Curves(f"{explain_tables.title(found)}, record {curves.name}, joint {joint}", columns, values)
        )
    return sets

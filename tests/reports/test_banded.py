"""Lines with bands: which of them can be told apart, with colour and without."""

from __future__ import annotations

import numpy as np

from identify.reports.kit.banded import Line, Panel, Plot
from identify.reports.kit.cells import Column

X = np.arange(3.0)
PLOT = Plot(
    "plot",
    Column("Speed", "rpm"),
    [
        Panel(Column("Depth", "mm"), [Line("a", X, X), Line("b", X, X), Line("c", X, X, points=True)]),
        Panel(Column("Chatter", "Hz"), [Line("d", X, X), Line("a", X, X), Line("e", X, X, points=True)]),
    ],
    "",
)


def test_lines_of_all_panels_differ_in_colour_and_in_strokes_or_marks() -> None:
    drawn = [line for panel in PLOT.data()["banded"][0]["panels"] for line in panel["lines"]]
    assert [line["name"] for line in drawn] == ["a", "b", "c", "d", "a", "e"]
    assert [line["number"] for line in drawn] == [0, 1, 2, 3, 0, 4]
    dashes = [line["dash"] for line in drawn if not line["points"]]
    assert len(set(dashes)) == 3 and dashes[0] == dashes[3]
    assert len({line["mark"] for line in drawn if line["points"]}) == 2


def test_print_has_the_colours_of_the_page() -> None:
    lines = [line for axes in PLOT.figure().axes for line in axes.lines]
    colours = [line.get_color() for line in lines]
    assert len(set(colours)) == 5 and colours[0] == colours[4]
    assert lines[2].get_marker() != lines[5].get_marker()

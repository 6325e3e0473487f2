"""The numbers of a figure read back from what was drawn, with the units its axes are labelled with."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from identify.reports.kit import plotting as mpl
from identify.reports.kit.cells import Column, Table, words


def drawn_curves(figure: mpl.Figure) -> list[Table]:
    """One table of all labelled lines and bars (of all where none is labelled), one of every coloured map;
    empty where there are none.
    """
    curves = [row for panel, axes in enumerate(figure.axes, 1) for row in _lines(panel, axes)]
    across = dict.fromkeys(axes.get_xlabel() for axes in figure.axes if axes.get_xlabel())
    up = dict.fromkeys(axes.get_ylabel() for axes in figure.axes if axes.get_ylabel())
    ends = Column(" or ".join(across) or "x"), Column(" or ".join(up) or "y")
    found = [Table.of("curves", (words("Panel"), words("Curve"), *ends), curves)] if curves else []
    return found + [table for axes in figure.axes for table in _maps(axes)]


def _lines(panel: int, axes: mpl.Axes) -> Iterator[tuple[str, str, float, float]]:
    title = axes.get_title(loc="left") or str(panel)
    drawn = [(str(line.get_label()), _places(line)) for line in axes.get_lines()]
    drawn += [
        (str(bars.get_label()), _tops(bars)) for bars in axes.containers if isinstance(bars, mpl.BarContainer)
    ]
    named = [one for one in drawn if not one[0].startswith("_")]
    for name, places in named or drawn:
        yield from ((title, name.lstrip("_"), x, y) for x, y in places)


def _tops(bars: mpl.BarContainer) -> Iterator[tuple[float, float]]:
    """Middle and end of every bar, across and up."""
    for bar in bars.patches:
        (x, y), wide, high = bar.get_xy(), bar.get_width(), bar.get_height()
        yield (x + wide / 2, y + high) if bars.orientation == "vertical" else (x + wide, y + high / 2)


def _places(line: mpl.Line2D) -> Iterator[tuple[float, float]]:
    x, y = (np.asarray(values, dtype=float) for values in (line.get_xdata(), line.get_ydata()))
    return zip(x.tolist(), y.tolist(), strict=True)


def _maps(axes: mpl.Axes) -> Iterator[Table]:
    for mesh in axes.collections:
        values = mesh.get_array() if isinstance(mesh, mpl.QuadMesh) else None
        if values is None:
            continue
        rows = [(*at, value) for at, value in np.ndenumerate(np.asarray(values))]
        down, across = axes.get_ylabel() or "row", axes.get_xlabel() or "column"
        yield Table.of(
            axes.get_title(loc="left") or "map", (Column(down), Column(across), Column("Value")), rows
        )

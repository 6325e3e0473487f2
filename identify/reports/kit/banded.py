"""Lines with bands, panels under each other over the same axis: on the page, in the PDF, and as data."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from textwrap import fill
from typing import Any, TypeAlias

import numpy as np

from identify.core.arrays import Array
from identify.reports.kit import plotting as mpl
from identify.reports.kit.cells import Column, Curves, Table
from identify.reports.kit.figures import INK, PALETTE, WIDTH_IN
from identify.reports.kit.report import Drawing

_LETTERS = 15
"""Of a label beside a panel in one line, for each inch of its height."""
_MANY = 200
"""Points from which on they are dots."""
_DASHES = ((), (6, 2), (1, 1.5), (6, 1.5, 1, 1.5), (11, 2), (11, 1.5, 1, 1.5))
"""Strokes and gaps of lines, over their width: told apart without colour, as in print."""
_MARKS = (("o", "circle-open"), ("s", "square-open"), ("^", "triangle-up-open"), ("D", "diamond-open"))
"""Of points, in print and on the page."""


Numbers: TypeAlias = Callable[[], Sequence[Table | Curves]]


@dataclass(frozen=True)
class Line:
    """One line, or points: x, y (n,), with the limits of its band, of points of their error bars, where there
    are any.

    look: `noisy`, drawn thin and dark behind the others, or `steps`, each value from its x to the next.
    """

    name: str
    x: Array
    y: Array
    low: Array | None = None
    high: Array | None = None
    points: bool = False
    look: str = ""

    @classmethod
    def within(cls, name: str, x: Array, size: Array, half: Array) -> Line:
        """A size with a band of plus or minus `half`, which stays positive, as on a logarithmic axis."""
        size = np.maximum(size, 1e-9)
        return cls(name, x, size, np.maximum(size - half, 1e-3 * size), size + half)


@dataclass(frozen=True)
class Panel:
    """Lines over one axis; top: where it ends, if not at the highest value, or both ends; x: what they are
    over, if not over that of the plot, and log_x: whether that is logarithmic; title: what stands above it.
    """

    y: Column
    lines: Sequence[Line]
    log: bool = False
    top: float | tuple[float, float] | None = None
    x: Column | None = None
    title: str = ""
    log_x: bool = False


@dataclass(frozen=True)
class Plot:
    """Panels under each other, or row by row in columns, all over x; anchor: of the plot on the page; height:
    of a panel, inches.
    """

    anchor: str
    x: Column
    panels: Sequence[Panel]
    caption: str
    note: str = ""
    log_x: bool = False
    height: float = 2.3
    columns: int = 1

    def drawing(self, numbers: Numbers | None = None) -> Drawing:
        """The part of a report; numbers: what is exported in place of a set per line."""
        data, page = numbers or self.curves, self.data()
        return Drawing(self.anchor, self.figure, self.caption, data, self.note, "", page, ("banded.js",))

    def printed(self, numbers: Numbers | None = None) -> Drawing:
        """The same where the page draws in another way."""
        return Drawing("", self.figure, self.caption, numbers or self.curves)

    def data(self) -> dict[str, Any]:
        """What `banded.js` draws from."""
        panels = [
            {
                "y": panel.y.head,
                "x": panel.x.head if panel.x else None,
                "log_x": panel.log_x,
                "title": panel.title,
                "log": panel.log,
                "top": panel.top,
                "lines": [vars(one) | self._style(one) for one in panel.lines],
            }
            for panel in self.panels
        ]
        plot = {"id": self.anchor, "x": self.x.head, "log": self.log_x, "columns": self.columns}
        return {"banded": [{**plot, "panels": panels}]}

    def _style(self, line: Line) -> dict[str, Any]:
        """By which a line is known in all panels: number of its colour, dashes, and mark of points."""
        named = {one.name: one.points for panel in self.panels for one in panel.lines}
        alike = [name for name, points in named.items() if points == line.points]
        number = alike.index(line.name)
        return {
            "number": list(named).index(line.name),
            "dash": _DASHES[number % len(_DASHES)],
            "mark": _MARKS[number % len(_MARKS)],
        }

    def curves(self) -> list[Curves]:
        """The numbers behind it, a set per line."""
        return [
            Curves(
                ", ".join(filter(None, (panel.title, panel.y.heading, line.name))),
                [replace(panel.x or self.x, values=line.x), *_limits(panel.y, line)],
            )
            for panel in self.panels
            for line in panel.lines
        ]

    def figure(self) -> mpl.Figure:
        """The printed figure."""
        rows = -(-len(self.panels) // self.columns)
        figure = mpl.Figure((WIDTH_IN, 0.5 + self.height * rows), layout="constrained")
        own = any(panel.x for panel in self.panels)
        every = figure.subplots(rows, self.columns, sharex=not own, squeeze=False).ravel()
        handles: dict[str, Any] = {}
        for axes in every[len(self.panels) :]:
            axes.set_axis_off()
        for k, (axes, panel) in enumerate(zip(every, self.panels, strict=False)):
            for line in panel.lines:
                handles.setdefault(line.name, _drawn(axes, line, **self._style(line)))
            self._framed(axes, panel)
            if own or k >= len(every) - self.columns:
                axes.set_xlabel((panel.x or self.x).head)
        if self.log_x:
            _plain(every[-1])
        columns = len(handles) if len(handles) <= 4 else 3
        figure.legend(list(handles.values()), list(handles), loc="outside upper left", ncols=columns)
        return figure

    def _framed(self, axes: mpl.Axes, panel: Panel) -> None:
        """Title, label, scales and limits."""
        axes.set_ylabel(fill(panel.y.head, round(_LETTERS * self.height), break_long_words=False))
        x_log = self.log_x or panel.log_x
        axes.set(xscale="log" if x_log else "linear", yscale="log" if panel.log else "linear")
        axes.set_title(panel.title)
        if isinstance(panel.top, tuple):
            axes.set_ylim(*panel.top)
        elif panel.top is not None:
            axes.set_ylim(None if panel.log else 0.0, panel.top)


def _limits(y: Column, line: Line) -> list[Column]:
    """The values of a line, and those of its band."""
    sides = (("", line.y), (", 95 % low", line.low), (", 95 % high", line.high))
    return [Column(f"{y.heading}{side}", y.unit, own) for side, own in sides if own is not None]


def _drawn(axes: mpl.Axes, line: Line, number: int, dash: tuple[float, ...], mark: tuple[str, str]) -> Any:
    color = PALETTE[number % len(PALETTE)]
    y = np.where(np.isfinite(line.y), line.y, np.nan)
    many = len(line.x) > _MANY
    if line.low is not None and line.high is not None and line.points:
        axes.vlines(line.x, line.low, line.high, color=color, alpha=0.4, lw=0.5, rasterized=many)
    elif line.low is not None and line.high is not None:
        axes.fill_between(
            line.x, line.low, line.high, where=np.isfinite(y).tolist(), color=color, alpha=0.25, lw=0
        )
    if line.points:
        look: Any = {"mfc": color, "mew": 0.0, "ms": 1.2} if many else {"mfc": "none", "ms": 3.5}
        return axes.plot(line.x, y, mark[0], color=color, rasterized=many, **look)[0]
    if line.look == "noisy":
        return axes.plot(line.x, y, color=INK, lw=0.5, zorder=1)[0]
    if line.look == "steps":
        return axes.step(line.x, y, where="post", color=color, ls=(0, dash) if dash else "-", lw=1.2)[0]
    return axes.plot(line.x, y, color=color, ls=(0, dash) if dash else "-")[0]


def _plain(axes: mpl.Axes) -> None:
    """Numbers as they are read, where a logarithmic axis has few decades."""
    low, high = axes.get_xlim()
    several = (1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 7.0) if high < 5 * low else (1.0, 2.0, 5.0)
    axes.xaxis.set_major_locator(mpl.LogLocator(subs=several))
    axes.xaxis.set_major_formatter(mpl.FuncFormatter(lambda value, _: f"{value:g}"))
    axes.xaxis.set_minor_formatter(mpl.NullFormatter())

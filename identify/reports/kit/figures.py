"""The common style of figures, and how they are saved: as SVG that is the same for the same result."""

from __future__ import annotations

import io
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from identify.reports.kit import plotting as mpl

WIDTH_IN = 6.85
INK, MUTED, GRID, BLUE, ORANGE, GREEN = "#1b2027", "#5c6673", "#dfe3e8", "#0072b2", "#d98200", "#00805f"
PALETTE = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#8c6bb1", "#7f7f7f")
"""Okabe and Ito's colours, told apart by colour-blind readers."""
DIVERGING = ("#0b5394", "#7fb6dc", "#f3f3f1", "#e8903a", "#8c2d04")
_BAR_TICKS = (0.001, 0.01, 0.03, 0.1, 0.25, 0.5, 1, 2, 4, 10, 30, 100)
_STYLE: Any = {
    "font.family": "STIXGeneral",
    "text.parse_math": False,  # names may hold what begins a formula
    "font.size": 8.0,
    "axes.linewidth": 0.5,
    "axes.edgecolor": MUTED,
    "axes.labelcolor": INK,
    "axes.grid": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.axisbelow": True,
    "axes.titlesize": 8.5,
    "axes.titlelocation": "left",
    "axes.titley": 1.0,  # told, it is not searched for, which takes a tenth of the time
    "grid.color": GRID,
    "grid.linewidth": 0.5,
    "xtick.color": MUTED,
    "ytick.color": MUTED,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "legend.frameon": False,
    "lines.linewidth": 1.0,
    "path.simplify": False,
    "svg.fonttype": "none",
    "svg.hashsalt": "identify",
}


@contextmanager
def style() -> Iterator[None]:
    """The look of all figures; it must hold from the making of a figure to its saving."""
    with mpl.rc_context(_STYLE):
        yield


def fonts() -> Path:
    """The folder of the fonts in which figures are written."""
    return Path(mpl.get_data_path()) / "fonts" / "ttf"


def outlined(figure: mpl.Figure) -> bytes:
    """The figure as SVG that looks the same where its fonts are not installed."""
    with mpl.rc_context({"svg.fonttype": "path"}):
        return svg(figure)


def plain_powers(figure: mpl.Figure) -> mpl.Figure:
    """The same figure with plain numbers on its logarithmic axes: no text is read as a formula."""
    for axis in (axis for axes in figure.axes for axis in (axes.xaxis, axes.yaxis)):
        if isinstance(axis.get_major_formatter(), mpl.LogFormatter):
            axis.set_major_formatter(mpl.FormatStrFormatter("%g"))
            axis.set_minor_formatter(mpl.NullFormatter())
    return figure


def svg(figure: mpl.Figure) -> bytes:
    """The figure as SVG without date or random names, for readers that have `fonts`."""
    plain_powers(figure)
    engine = figure.get_layout_engine()
    if engine is not None:
        engine.execute(figure)
        figure.set_layout_engine(None)  # else all is laid out and drawn twice, to the same places
    stream = io.BytesIO()
    figure.savefig(stream, format="svg", dpi=200, metadata={"Date": None, "Creator": None})
    return stream.getvalue()


def head(figure: mpl.Figure, axes: mpl.Axes, columns: int) -> None:
    """A legend at the upper left end of a figure."""
    figure.legend(*axes.get_legend_handles_labels(), loc="upper left", ncols=columns, borderaxespad=0.2)


def decades_beside(bar: mpl.Colorbar, label: str, limits: tuple[float, float]) -> None:
    """A bar of colours on a logarithmic scale between limits: its label, and plain numbers beside it."""
    low, high = limits
    shown = [tick for tick in _BAR_TICKS if low <= tick * 1.001 and tick <= high * 1.001]
    bar.set_label(label)
    bar.set_ticks(shown, labels=[f"{tick:g}" for tick in shown])
    bar.ax.minorticks_off()
    bar.ax.spines["outline"].set_visible(False)


@dataclass(frozen=True)
class Room:
    """What is kept free around the axes of a figure, inches: told, because a layout engine takes as long to
    find it as it takes to draw the figure.
    """

    left: float = 0.5
    right: float = 0.08
    bottom: float = 0.42
    top: float = 0.22

    def axes(
        self, figure: mpl.Figure, shares: Sequence[float] = (1.0,), apart: float = 0.15
    ) -> list[mpl.Axes]:
        """Axes side by side, as wide as their shares, so far apart; several share y."""
        width, height = figure.get_size_inches()
        each = (width - self.left - self.right - (len(shares) - 1) * apart) / sum(shares)
        bottom, high = self.bottom / height, (height - self.bottom - self.top) / height
        found: list[mpl.Axes] = []
        at = self.left
        for share in shares:
            box = (at / width, bottom, share * each / width, high)
            found.append(figure.add_axes(box, sharey=found[0] if found else None))
            at += share * each + apart
        for axes in found[1:]:
            axes.tick_params(labelleft=False)
        return found

    def with_bar(self, figure: mpl.Figure, count: int = 1) -> tuple[list[mpl.Axes], mpl.Axes]:
        """Axes of so many maps, and of their bar of colours to their right."""
        width, height = figure.get_size_inches()
        maps = Room(self.left, self.right + 0.72, self.bottom, self.top).axes(figure, (1.0,) * count)
        high = (height - self.bottom - self.top) / height
        bar = ((width - self.right - 0.66) / width, self.bottom / height, 0.1 / width, high)
        return maps, figure.add_axes(bar)


def wide(labels: Sequence[str], size: float = 8.0) -> float:
    """About how wide the widest line of labels is, inches, in letters of a size in points."""
    return 0.5 * size / 72 * max((len(line) for label in labels for line in label.splitlines()), default=0)


def plain_decades(axis: mpl.Axis) -> None:
    """Label a logarithmic axis in plain numbers where they are short, which need not be set as formulas: 1, 2
    and 5 over few decades.
    """
    low, high = axis.get_view_interval()
    if low > 1e-5 and high < 1e5:
        few = high < 1e3 * low
        axis.set_major_locator(mpl.LogLocator(subs=(1.0, 2.0, 5.0) if few else (1.0,)))
        axis.set_major_formatter(mpl.FormatStrFormatter("%g"))
        axis.set_minor_locator(mpl.NullLocator())

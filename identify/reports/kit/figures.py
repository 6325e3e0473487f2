"""Figures of the PDF, as SVG that is the same for the same result: parameters, gap map, MAC, convergence;
their common style.
"""

from __future__ import annotations

import io
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from identify.fitting.uncertainty import AT_LOWER, AT_UPPER
from identify.reports.fit import pick
from identify.reports.kit import plotting as mpl
from identify.reports.kit.cells import NONE, number, unit
from identify.results.fit import FitResult, FrfComparison, MeasurementResult

WIDTH_IN = 6.85
INK, MUTED, GRID, BLUE, ORANGE, GREEN = "#1b2027", "#5c6673", "#dfe3e8", "#0072b2", "#d98200", "#00805f"
PALETTE = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#8c6bb1", "#7f7f7f")
"""Okabe and Ito's colours, told apart by colour-blind readers."""
_STATUS = {
    "determined": ("#0072b2", "o"),
    "weak": ("#e69f00", "D"),
    "not determined": ("#d55e00", "X"),
    AT_LOWER: ("#cc79a7", "v"),
    AT_UPPER: ("#cc79a7", "^"),
    "fixed": ("#7f7f7f", "s"),
}
DIVERGING = ("#0b5394", "#7fb6dc", "#f3f3f1", "#e8903a", "#8c2d04")
_RISING = ("#f3f3f1", "#e8903a", "#8c2d04")
_MAC = ("#f3f3f1", "#0072b2")
_BAR_TICKS = (0.001, 0.01, 0.03, 0.1, 0.25, 0.5, 1, 2, 4, 10, 30, 100)
_WIDE = 10.0
"""Ratio from which a logarithmic axis pays."""
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


def parameters(result: FitResult) -> mpl.Figure:
    """Left, start and fitted values with their intervals between the bounds; right, the size of the
    intervals.
    """
    table = result.parameters
    rows = np.arange(len(table.name))
    figure = mpl.Figure((WIDTH_IN, 0.75 + 0.165 * len(rows)))
    left, right = Room(0.15 + wide(table.name), bottom=0.4, top=0.3).axes(figure, (3, 2), 0.35)
    place = {
        name: pick.between_bounds(table, getattr(table, name))
        for name in ("initial", "value", "low_95", "high_95")
    }
    left.plot(place["initial"], rows, "o", mfc="none", mec=MUTED, ms=4.5, label="start")
    left.hlines(rows, place["low_95"], place["high_95"], color=INK, lw=0.9)
    half = 100 * pick.half_interval(table)
    for status, (color, marker) in _STATUS.items():
        chosen = np.array([s == status for s in table.status])
        if chosen.any():
            left.plot(place["value"][chosen], rows[chosen], marker, color=color, ms=4.5, label=status)
            right.plot(half[chosen], rows[chosen], marker, color=color, ms=4.5)
    left.set(
        xlim=(-0.02, 1.02),
        xlabel=f"Place between the bounds ({NONE})",
        yticks=rows,
        ylim=(len(rows) - 0.5, -0.5),
    )
    left.set_xticks([0, 0.25, 0.5, 0.75, 1], ["lower", "¼", "½", "¾", "upper"])
    left.set_yticklabels(table.name)
    right.set(xscale="log", xlabel="Half the 95 % interval (% of the value)")
    plain_decades(right.xaxis)
    head(figure, left, 5)
    return figure


def head(figure: mpl.Figure, axes: mpl.Axes, columns: int) -> None:
    """A legend at the upper left end of a figure."""
    figure.legend(*axes.get_legend_handles_labels(), loc="upper left", ncols=columns, borderaxespad=0.2)


def gap_map(name: str, frf: FrfComparison) -> mpl.Figure:
    """Band by FRF: RMS residual over noise, or over the measurement where the noise is not known."""
    found, order = pick.gap_map(frf), pick.map_order(frf)
    values = np.maximum(found.values.T[order], 1e-12)
    figure = mpl.Figure((WIDTH_IN, float(np.clip(0.9 + 0.026 * len(order), 2.2, 4.2))))
    ticks = _first_of_inputs(frf, order)
    labels = [f"{frf.output[order[row]]} / {frf.input[order[row]]}" for row in ticks]
    [axes], beside = Room(0.42 + wide(labels)).with_bar(figure)
    top = float(np.nanmax(values))
    reach = float(np.clip(top, 4.0, 100.0))
    low, high = (1 / reach, reach) if found.in_noise else (1e-3, float(np.clip(top, 1.0, 10.0)))
    colors = mpl.shades(DIVERGING if found.in_noise else _RISING)
    rows = np.arange(len(order) + 1)
    mesh = axes.pcolorfast(found.edges_hz, rows, values, norm=mpl.LogNorm(low, high), cmap=colors)
    axes.grid(False)
    axes.set_yticks([row + 0.5 for row in ticks], labels)
    axes.set(xlabel="Frequency (Hz)", ylabel="Output / input", ylim=(len(order), 0), title=name)
    label = "Residual / noise (1 = noise)" if found.in_noise else "Residual / measured"
    decades_beside(figure.colorbar(mesh, cax=beside), label, (low, high))
    return figure


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


def _first_of_inputs(frf: FrfComparison, order: NDArray[np.intp]) -> list[int]:
    """Rows to label: about twenty-five, evenly spaced within each input."""
    every = -(-len(order) // 25)
    rows: list[int] = []
    inputs = [frf.input[i] for i in order]
    for row, channel in enumerate(inputs):
        since = row - inputs.index(channel)
        left = len(inputs) - inputs[::-1].index(channel) - 1 - row
        apart = not rows or row - rows[-1] >= every
        if apart and since % every == 0 and (since == 0 or left >= every - 1):
            rows.append(row)
    return rows


@dataclass(frozen=True)
class Mac:
    """A MAC matrix (rows, columns) with the frequencies and the names of its sides."""

    name: str
    values: NDArray[np.float64]
    rows_hz: NDArray[np.float64]
    columns_hz: NDArray[np.float64]
    down: str = "Measured (Hz)"
    across: str = "Model (Hz)"


def pair_mac(m: MeasurementResult) -> Mac | None:
    """Measured by model; None without shapes of both."""
    if m.pairs is None or m.pairs.mac_matrix is None:
        return None
    shown = pick.shown_modes(m)
    return Mac(
        m.name, m.pairs.mac_matrix[:, :shown], m.pairs.measured_frequency_hz, m.modes.frequency_hz[:shown]
    )


def mac(found: Sequence[Mac]) -> mpl.Figure:
    """MAC matrices, three a row where they are small."""
    most = max(one.values.shape[1] for one in found)
    columns = min(len(found), 3 if most <= 8 else 1)
    rows = -(-len(found) // columns)
    height = 0.75 + 0.26 * max(len(one.values) for one in found)
    figure = mpl.Figure((max(WIDTH_IN * columns / 3, min(WIDTH_IN, 0.7 + 0.42 * most), 3.2), height * rows))
    each, high = 1 / columns, 1 / rows
    left, bottom = 0.62 / figure.get_figwidth(), 0.42 / figure.get_figheight()
    for place, one in enumerate(found):
        row, column = divmod(place, columns)
        box = (column * each + left, 1 - (row + 1) * high + bottom)
        size = (each - left - 0.08 / figure.get_figwidth(), high - bottom - 0.2 / figure.get_figheight())
        axes = figure.add_axes((*box, *size))
        _mac(axes, one)
        axes.set_title(one.name)
    return figure


def _mac(axes: mpl.Axes, one: Mac) -> None:
    axes.pcolormesh(one.values, vmin=0, vmax=1, cmap=mpl.shades(_MAC), edgecolors="white", linewidth=1.0)
    axes.grid(False)
    for (row, column), value in np.ndenumerate(one.values):
        axes.text(
            column + 0.5,
            row + 0.5,
            f"{value:.2f}",
            ha="center",
            va="center",
            color="white" if value > 0.5 else INK,
            fontsize=6.5,
        )
    axes.set_xticks(np.arange(one.values.shape[1]) + 0.5, [number(hz) for hz in one.columns_hz], fontsize=7)
    axes.set_yticks(np.arange(len(one.values)) + 0.5, [number(hz) for hz in one.rows_hz], fontsize=7)
    axes.set(xlabel=one.across, ylabel=one.down, ylim=(len(one.values), 0))


def profiles(result: FitResult) -> mpl.Figure:
    """Profile likelihoods, three a row."""
    count = len(result.profiles)
    rows = -(-count // 3)
    figure = mpl.Figure((WIDTH_IN, 1.9 * rows), layout="constrained")
    panels = figure.subplots(rows, 3, squeeze=False).ravel()
    for axes, (name, curve) in zip(panels, result.profiles.items(), strict=False):
        row = result.parameters.name.index(name)
        axes.plot(curve.values, curve.rise, ".-", color=BLUE)
        axes.axhline(3.84, color=PALETTE[1], ls=":")
        wide = bool(result.parameters.log[row]) and curve.values.max() > _WIDE * curve.values.min()
        axes.set(xscale="log" if wide else "linear", xlabel=f"{name} ({unit(result.parameters.unit[row])})")
        axes.set(
            ylim=(0, min(max(5.0, float(np.nanmax(curve.rise))), 20.0)), ylabel=f"Rise of chi-square ({NONE})"
        )
    for axes in panels[count:]:
        axes.set_axis_off()
    return figure


def convergence(result: FitResult) -> mpl.Figure:
    """Best cost of every start and stage over the evaluations of the start."""
    figure = mpl.Figure((WIDTH_IN, 2.1))
    [axes] = Room(0.62, top=0.1).axes(figure)
    for start, stage, evaluations, cost in pick.cost_lines(result.history):
        label = f"start {start + 1}" if stage == 0 else None
        color = PALETTE[start % len(PALETTE)]
        axes.step(evaluations, cost, where="post", color=color, ls=("-", "--", ":")[stage % 3], label=label)
    axes.set(
        xlabel=f"Evaluations of the start ({NONE})",
        ylabel=f"Best cost, {result.cost_kind} ({NONE})",
        yscale="log",
    )
    plain_decades(axes.yaxis)
    axes.legend(ncols=5, loc="upper right")
    return figure


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

"""FRF overlays of the PDF: a page's worth of FRFs, magnitude above phase.

Many small plots of a printed figure on one pair of axes: eighteen pairs of axes take ten times as long.

Places are in inches of the figure.  Frames and grids of all panels are one collection each, and curves of one
name are one line with gaps.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from identify.core.arrays import Array, Complex
from identify.reports.kit import plotting as mpl
from identify.reports.kit.cells import NONE, number, unit
from identify.reports.kit.figures import BLUE, GREEN, GRID, INK, MUTED, ORANGE, PALETTE, WIDTH_IN
from identify.reports.shared.measurement_tables import pair_name
from identify.reports.shared.pick import is_drive_point, shown_frfs
from identify.results.fit import FrfComparison

Ticks = Sequence[tuple[float, str]]
"""Values and what is written at them."""
Box = tuple[float, float, float, float]
"""Left, bottom, width and height, inches of the figure."""
_TICK_IN, _PAD_IN = 0.045, 0.075
_MARGIN = 0.05
_MOST = 5
"""Labels on a side."""
_DOT_IN = 1e-3
_GAP = np.array([np.nan])


@dataclass(frozen=True)
class Panel:
    """Where a small plot is, and its limits; log: of y."""

    box: Box
    x: tuple[float, float]
    y: tuple[float, float]
    log: bool = False

    def across(self, x: Array) -> Array:
        """Inches of values (n,)."""
        left, _, width, _ = self.box
        return np.asarray(left + width * (np.asarray(x) - self.x[0]) / (self.x[1] - self.x[0]))

    def up(self, y: Array) -> Array:
        """Inches of values (n,), NaN where a logarithm has none."""
        _, bottom, _, height = self.box
        low, high = _scaled(np.array(self.y), self.log)
        return np.asarray(bottom + height * (_scaled(np.asarray(y), self.log) - low) / (high - low))


def _scaled(values: Array, log: bool) -> Array:
    return np.log10(np.where(values > 0, values, np.nan)) if log else values


def limits(values: Sequence[Array], log: bool = False) -> tuple[float, float]:
    """From the least to the largest of several curves with a margin, in decades where `log`."""
    known = _scaled(np.concatenate([np.ravel(one) for one in values]), log)
    known = known[np.isfinite(known)]
    low, high = (float(known.min()), float(known.max())) if len(known) else (0.0, 1.0)
    room = _MARGIN * (high - low) or 0.5
    low, high = low - room, high + room
    return (10.0**low, 10.0**high) if log else (low, high)


def ticks(limit: tuple[float, float], log: bool = False) -> Ticks:
    """Round values inside limits; decades, or 1, 2 and 5 of them where they are few."""
    low, high = limit
    if not log:
        found = mpl.MaxNLocator(_MOST, steps=[1, 2, 2.5, 5, 10]).tick_values(low, high)
        return [(float(one), f"{one:g}") for one in found if low <= one <= high]
    decades = np.floor(np.log10(high)) - np.ceil(np.log10(low))
    subs = (1.0,) if decades >= 1 else (1.0, 2.0, 5.0)
    found = mpl.LogLocator(subs=subs, numticks=_MOST).tick_values(low, high)
    inside = [float(one) for one in found if low <= one <= high]
    return [(one, f"{one:g}") for one in inside]


class SmallPanels:
    """The panels of a figure: frame them, add curves, then finish."""

    def __init__(self, figure: mpl.Figure) -> None:
        width, height = figure.get_size_inches()
        self.axes = figure.add_axes((0.0, 0.0, 1.0, 1.0), xlim=(0, width), ylim=(0, height))
        self.axes.set_axis_off()
        self._grid: list[Array] = []
        self._frame: list[Array] = []
        self._curves: dict[str, tuple[dict[str, Any], list[Array]]] = {}
        self._bands: dict[str, tuple[str, list[Array]]] = {}

    def frame(self, panel: Panel, across: Ticks, up: Ticks, written: bool = True) -> None:
        """Left and lower side, grid, and labels of y; written: those of x too."""
        left, bottom, width, height = panel.box
        right, top = left + width, bottom + height
        self._frame.append(np.array([[left, top], [left, bottom], [right, bottom]]))
        for (_, label), x in zip(across, panel.across(np.array([x for x, _ in across])), strict=True):
            self._grid.append(np.array([[x, bottom], [x, top]]))
            self._frame.append(np.array([[x, bottom], [x, bottom - _TICK_IN]]))
            if written:
                self._text(x, bottom - _PAD_IN, label, "center", "top")
        for (_, label), y in zip(up, panel.up(np.array([y for y, _ in up])), strict=True):
            self._grid.append(np.array([[left, y], [right, y]]))
            self._frame.append(np.array([[left, y], [left - _TICK_IN, y]]))
            self._text(left - _PAD_IN, y, label, "right", "center_baseline")

    def title(self, box: Box, text: str) -> None:
        """Above the left end of a panel."""
        left, bottom, _, height = box
        self.axes.text(left, bottom + height + _PAD_IN, text, fontsize=7.5, color=INK)

    def under(self, box: Box, text: str) -> None:
        """What goes across a panel."""
        left, bottom, width, _ = box
        self._text(left + width / 2, bottom - 0.25, text, "center", "top")

    def beside(self, box: Box, text: str, away: float) -> None:
        """What goes up a panel, so many inches to its left."""
        left, bottom, _, height = box
        self.axes.text(
            left - away, bottom + height / 2, text, color=INK, rotation=90, ha="center", va="center"
        )

    def curve(self, panel: Panel, name: str, x: Array, y: Array, **look: Any) -> None:
        """A curve over values (n,); the look of a name is the same in all panels."""
        places = np.stack([np.append(panel.across(x), _GAP), np.append(panel.up(y), _GAP)])
        self._curves.setdefault(name, (look, []))[1].append(places)

    def dots(self, panel: Panel, x: Array, y: Array, color: str) -> None:
        """A dot at each value of a curve: short lines with round ends, much less to write than markers."""
        places = np.stack([panel.across(x), panel.up(y)])
        ends = np.stack([places, places + np.array([[_DOT_IN], [0.0]]), np.full_like(places, np.nan)], axis=2)
        look = {"color": color, "lw": 0.9, "solid_capstyle": "round"}
        self._curves.setdefault("_dots", (look, []))[1].append(ends.reshape(2, -1))

    def band(self, panel: Panel, name: str, x: Array, ends: tuple[Array, Array], color: str) -> None:
        """What lies between the lower and the upper of two curves."""
        across, (down, top) = panel.across(x), map(panel.up, ends)
        ring = np.stack([np.append(across, across[::-1]), np.append(down, top[::-1])], axis=1)
        self._bands.setdefault(name, (color, []))[1].append(ring)

    def finish(self) -> None:
        """Draw what was collected."""
        grid, frame = (
            mpl.LineCollection(lines, colors=color, linewidths=0.5, zorder=zorder)
            for lines, color, zorder in ((self._grid, GRID, 0.5), (self._frame, MUTED, 2.5))
        )
        self.axes.add_collection(grid)
        self.axes.add_collection(frame)
        for name, (look, places) in self._curves.items():
            self.axes.plot(*np.concatenate(places, axis=1), label=name, **look)
        for name, (color, rings) in self._bands.items():
            filled = mpl.PolyCollection(rings, facecolors=color, alpha=0.25, lw=0, label=name)
            self.axes.add_collection(filled)

    def _text(self, x: float, y: float, text: str, across: str, up: str) -> None:
        self.axes.text(x, y, text, color=INK, ha=across, va=up)


_COLUMNS = 3
_ROW_IN, _COHERENCE_IN, _LEGEND_IN = 2.4, 0.3, 0.3
_LEFT_IN, _APART_IN, _HEAD_IN, _FOOT_IN, _BETWEEN_IN = 0.6, 0.42, 0.16, 0.36, 0.12
"""Room left of the first column, between columns, above, below and inside a cell."""
_SHARES = (5.0, 2.0, 1.1)
"""Of magnitude, phase and coherence in the height of a cell."""
_LABEL_IN = 0.5
_PHASES = [(-180.0, "\N{MINUS SIGN}180"), (0.0, "0"), (180.0, "180")]
_COHERENCES = [(0.0, "0"), (1.0, "1")]
_LOOKS: dict[str, dict[str, Any]] = {
    "measured": {"color": INK, "lw": 0.5},
    "start model": {"color": ORANGE, "lw": 0.8, "ls": "--"},
}


def overlays(
    frf: FrfComparison, modelled: str = "fitted", beside: Mapping[str, Complex] | None = None
) -> mpl.Figure:
    """The FRFs that `pick.shown_frfs` chooses, three a row.

    modelled: what the curve beside the measured one is called; beside: further curves by name, each (lines,
    pairs).
    """
    pairs = shown_frfs(frf)
    rows = -(-len(pairs) // _COLUMNS)
    high = _ROW_IN + (0.0 if frf.coherence is None else _COHERENCE_IN)
    figure = mpl.Figure((WIDTH_IN, high * rows + _LEGEND_IN))
    panels = SmallPanels(figure)
    for place, pair in enumerate(pairs):
        row, column = divmod(place, _COLUMNS)
        boxes = _boxes(high * (rows - row), high, column, 2 if frf.coherence is None else 3)
        curves = _curves(frf, pair, modelled, beside or {})
        _drawn(panels, boxes, frf, pair, curves)
        if column == 0:
            labels = (f"Magnitude ({unit(frf.unit)})", "Phase (°)", f"\N{GREEK SMALL LETTER GAMMA}² ({NONE})")
            for box, label in zip(boxes, labels, strict=False):
                panels.beside(box, label, _LABEL_IN)
        if place + _COLUMNS >= len(pairs):
            panels.under(boxes[-1], "Frequency (Hz)")
    panels.finish()
    figure.legend(
        *panels.axes.get_legend_handles_labels(),
        loc="upper left",
        ncols=4,
        bbox_to_anchor=(0.07, 1.0),
        borderaxespad=0,
    )
    return figure


def _boxes(top: float, high: float, column: int, count: int) -> list[Box]:
    """Of the panels of a cell whose upper end is at `top`, from above, inches."""
    width = (WIDTH_IN - _LEFT_IN - 0.04 - (_COLUMNS - 1) * _APART_IN) / _COLUMNS
    inside = high - _HEAD_IN - _FOOT_IN - (count - 1) * _BETWEEN_IN
    found, upper = [], top - _HEAD_IN
    for share in _SHARES[:count]:
        height = inside * share / sum(_SHARES[:count])
        found.append((_LEFT_IN + column * (width + _APART_IN), upper - height, width, height))
        upper -= height + _BETWEEN_IN
    return found


def _curves(
    frf: FrfComparison, pair: int, modelled: str, beside: Mapping[str, Complex]
) -> dict[str, tuple[Complex, dict[str, Any]]]:
    """Values (lines,) and looks by name, in the order in which they are drawn."""
    found = {"measured": (frf.measured[:, pair], _LOOKS["measured"])}
    if frf.initial is not None:
        found["start model"] = frf.initial[:, pair], _LOOKS["start model"]
    found[modelled] = frf.fitted[:, pair], {"color": BLUE, "lw": 1.0}
    for turn, (name, values) in enumerate(beside.items(), 1):
        dashes = ("--", "-.", ":")[(turn - 1) % 3]
        found[name] = values[:, pair], {"color": PALETTE[turn % len(PALETTE)], "lw": 0.9, "ls": dashes}
    return found


Curves = Mapping[str, tuple[Complex, dict[str, Any]]]


def _drawn(panels: SmallPanels, boxes: list[Box], frf: FrfComparison, pair: int, curves: Curves) -> None:
    """One FRF in its cell."""
    f = frf.frequency_hz
    limit, across = (float(f[0]), float(f[-1])), ticks((float(f[0]), float(f[-1])))
    band = _band(frf, pair)
    sizes = [np.abs(values) for values, _ in curves.values()] + list(band or ())
    log = bool(np.any(sizes[0] > 0))
    top = Panel(boxes[0], limit, limits(sizes, log), log)
    bottom = Panel(boxes[1], limit, (-190.0, 190.0))
    panels.frame(top, across, ticks(top.y, log), written=False)
    panels.frame(bottom, across, _PHASES, written=frf.coherence is None)
    panels.title(top.box, _title(frf, pair))
    panels.dots(top, f, sizes[0], color=INK)
    panels.dots(bottom, f, _degrees(curves["measured"][0]), color=INK)
    for name, (values, look) in curves.items():
        panels.curve(top, name, f, np.abs(values), **look)
        panels.curve(bottom, name, f, _degrees(values), **look)
    if band:
        panels.band(top, "95 % band", f, band, BLUE)
    if frf.coherence is not None:
        lowest = Panel(boxes[2], limit, (0.0, 1.08))
        panels.frame(lowest, across, _COHERENCES)
        panels.curve(lowest, "_coherence", f, frf.coherence[:, pair], color=GREEN, lw=0.7)


def _band(frf: FrfComparison, pair: int) -> tuple[Array, Array] | None:
    """Lower and upper end of the band of magnitudes, where there is one."""
    if frf.band_95 is None:
        return None
    half, size = frf.band_95[:, pair], np.abs(frf.fitted[:, pair])
    return np.maximum(size - half, size * 1e-3), size + half


def _title(frf: FrfComparison, pair: int) -> str:
    error = (
        f"relative error {number(100 * frf.relative_error[pair])} %"
        if frf.gap is None
        else f"gap {number(frf.gap[pair])}"
    )
    return f"{pair_name(frf, pair)}{' drive point' if is_drive_point(frf, pair) else ''}, {error}"


def _degrees(values: Complex) -> Array:
    """Phase in degrees, none of zero; the line is broken where it jumps from one end of the circle to the
    other.
    """
    phase = np.where(values == 0, np.nan, np.degrees(np.angle(values)))
    phase[1:][np.abs(np.diff(phase)) > 270] = np.nan
    return phase

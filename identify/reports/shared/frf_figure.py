"""FRF overlays of the PDF: a page's worth of FRFs, magnitude above phase."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from identify.core.arrays import Array, Complex
from identify.reports.kit import plotting as mpl
from identify.reports.kit.cells import NONE, number, unit
from identify.reports.kit.figures import BLUE, GREEN, INK, ORANGE, PALETTE, WIDTH_IN
from identify.reports.kit.small_panels import Box, Panel, SmallPanels, limits, ticks
from identify.reports.shared.measurement_tables import pair_name
from identify.reports.shared.pick import is_drive_point, shown_frfs
from identify.results.fit import FrfComparison

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

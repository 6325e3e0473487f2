"""FRF overlays of the PDF: a page's worth of FRFs, magnitude above phase."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator
from numpy.typing import NDArray

from identify.reports.cells import number, unit
from identify.reports.figures import BLUE, INK, ORANGE, WIDTH_IN
from identify.reports.measurement_tables import pair_name
from identify.reports.pick import is_drive_point, shown_frfs
from identify.results import FrfComparison

_COLUMNS = 3
_ROW_IN, _LEGEND_IN = 2.45, 0.4


def overlays(frf: FrfComparison, modelled: str = "fitted") -> Figure:
    """The FRFs that `pick.shown_frfs` chooses, three a row; modelled: what the curve beside the measured one is called."""
    pairs = shown_frfs(frf)
    rows = -(-len(pairs) // _COLUMNS)
    height = _ROW_IN * rows + _LEGEND_IN
    figure = Figure((WIDTH_IN, height))
    # Fixed places: a layout engine takes a second a figure.
    cells = figure.add_gridspec(
        rows, _COLUMNS, left=0.085, right=0.995, top=1 - _LEGEND_IN / height, bottom=0.38 / height, hspace=0.24, wspace=0.2
    )
    for place, pair in enumerate(pairs):
        top, bottom = cells[place].subgridspec(2, 1, height_ratios=[5, 2], hspace=0.08).subplots(sharex=True, squeeze=False).ravel()
        _overlay((top, bottom), frf, pair, modelled)
        if place % _COLUMNS == 0:
            top.set_ylabel(f"Magnitude ({unit(frf.unit)})")
            bottom.set_ylabel("Phase (°)")
        if place + _COLUMNS >= len(pairs):
            bottom.set_xlabel("Frequency (Hz)")
    figure.legend(*figure.axes[0].get_legend_handles_labels(), loc="upper left", ncols=4, bbox_to_anchor=(0.07, 1.0), borderaxespad=0)
    return figure


def _overlay(panels: tuple[Axes, Axes], frf: FrfComparison, pair: int, modelled: str) -> None:
    top, bottom = panels
    f = frf.frequency_hz
    measured, fitted = frf.measured[:, pair], frf.fitted[:, pair]
    for axes, shape in ((top, np.abs), (bottom, _degrees)):
        axes.plot(f, shape(measured), color=INK, lw=0.5, marker=".", ms=1.8, mew=0, label="measured")
        if frf.initial is not None:
            axes.plot(f, shape(frf.initial[:, pair]), color=ORANGE, lw=0.8, ls="--", label="start model")
        axes.plot(f, shape(fitted), color=BLUE, lw=1.0, label=modelled)
    if frf.band_95 is not None:
        half, size = frf.band_95[:, pair], np.abs(fitted)
        top.fill_between(f, np.maximum(size - half, size * 1e-3), size + half, color=BLUE, alpha=0.25, lw=0, label="95 % band")
    top.set(yscale="log" if np.any(np.abs(measured) > 0) else "linear", xlim=(f[0], f[-1]))
    error = f"relative error {number(100 * frf.relative_error[pair])} %" if frf.gap is None else f"gap {number(frf.gap[pair])}"
    top.set_title(f"{pair_name(frf, pair)}{' drive point' if is_drive_point(frf, pair) else ''}, {error}", fontsize=7.5)
    top.yaxis.set_minor_locator(NullLocator())
    bottom.set(ylim=(-190, 190), yticks=[-180, 0, 180])


def _degrees(values: NDArray[np.complex128]) -> NDArray[np.float64]:
    """Phase in degrees, none of zero; the line is broken where it jumps from one end of the circle to the other."""
    phase = np.where(values == 0, np.nan, np.degrees(np.angle(values)))
    phase[1:][np.abs(np.diff(phase)) > 270] = np.nan
    return phase

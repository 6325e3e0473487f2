"""FRF overlays of the PDF: a page's worth of FRFs, magnitude above phase."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator
from numpy.typing import NDArray

from identify.reports.fit.measurement_tables import pair_name
from identify.reports.fit.pick import is_drive_point, shown_frfs
from identify.reports.kit.cells import NONE, number, unit
from identify.reports.kit.figures import BLUE, GREEN, INK, ORANGE, PALETTE, WIDTH_IN
from identify.results.fit import FrfComparison

_COLUMNS = 3
_ROW_IN, _COHERENCE_IN, _LEGEND_IN = 2.45, 0.3, 0.4


def overlays(
    frf: FrfComparison, modelled: str = "fitted", beside: Mapping[str, NDArray[np.complex128]] | None = None
) -> Figure:
    """The FRFs that `pick.shown_frfs` chooses, three a row.

    modelled: what the curve beside the measured one is called; beside: further curves by name, each (lines,
    pairs).
    """
    pairs = shown_frfs(frf)
    rows = -(-len(pairs) // _COLUMNS)
    heights = [5, 2] if frf.coherence is None else [5, 2, 1.1]
    labels = (f"Magnitude ({unit(frf.unit)})", "Phase (°)", f"\N{GREEK SMALL LETTER GAMMA}² ({NONE})")
    height = (_ROW_IN + (0.0 if frf.coherence is None else _COHERENCE_IN)) * rows + _LEGEND_IN
    figure = Figure((WIDTH_IN, height))
    # Fixed places: a layout engine takes a second a figure.
    cells = figure.add_gridspec(
        rows,
        _COLUMNS,
        left=0.085,
        right=0.995,
        top=1 - _LEGEND_IN / height,
        bottom=0.38 / height,
        hspace=0.24,
        wspace=0.2,
    )
    for place, pair in enumerate(pairs):
        panels = (
            cells[place]
            .subgridspec(len(heights), 1, height_ratios=heights, hspace=0.2)
            .subplots(sharex=True, squeeze=False)
            .ravel()
        )
        _overlay((panels[0], panels[1]), frf, pair, modelled)
        for turn, (name, values) in enumerate((beside or {}).items(), 1):
            look: Any = {
                "color": PALETTE[turn % len(PALETTE)],
                "lw": 0.9,
                "ls": ("--", "-.", ":")[(turn - 1) % 3],
                "label": name,
            }
            panels[0].plot(frf.frequency_hz, np.abs(values[:, pair]), **look)
            panels[1].plot(frf.frequency_hz, _degrees(values[:, pair]), **look)
        if frf.coherence is not None:
            _coherence(panels[2], frf.frequency_hz, frf.coherence[:, pair])
        if place % _COLUMNS == 0:
            for axes, label in zip(panels, labels, strict=False):
                axes.set_ylabel(label)
        if place + _COLUMNS >= len(pairs):
            panels[-1].set_xlabel("Frequency (Hz)")
    figure.legend(
        *figure.axes[0].get_legend_handles_labels(),
        loc="upper left",
        ncols=4,
        bbox_to_anchor=(0.07, 1.0),
        borderaxespad=0,
    )
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
        top.fill_between(
            f,
            np.maximum(size - half, size * 1e-3),
            size + half,
            color=BLUE,
            alpha=0.25,
            lw=0,
            label="95 % band",
        )
    top.set(yscale="log" if np.any(np.abs(measured) > 0) else "linear", xlim=(f[0], f[-1]))
    error = (
        f"relative error {number(100 * frf.relative_error[pair])} %"
        if frf.gap is None
        else f"gap {number(frf.gap[pair])}"
    )
    top.set_title(
        f"{pair_name(frf, pair)}{' drive point' if is_drive_point(frf, pair) else ''}, {error}", fontsize=7.5
    )
    top.yaxis.set_minor_locator(NullLocator())
    bottom.set(ylim=(-190, 190), yticks=[-180, 0, 180])


def _coherence(axes: Axes, frequency_hz: NDArray[np.float64], coherence: NDArray[np.float64]) -> None:
    axes.plot(frequency_hz, coherence, color=GREEN, lw=0.7)
    axes.set(ylim=(0, 1.08), yticks=[0, 1])


def _degrees(values: NDArray[np.complex128]) -> NDArray[np.float64]:
    """Phase in degrees, none of zero; the line is broken where it jumps from one end of the circle to the
    other.
    """
    phase = np.where(values == 0, np.nan, np.degrees(np.angle(values)))
    phase[1:][np.abs(np.diff(phase)) > 270] = np.nan
    return phase

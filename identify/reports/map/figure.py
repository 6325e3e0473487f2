"""The printed figure of a map: what the tool does at a few postures."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from identify.reports.kit import plotting as mpl
from identify.reports.kit.figures import PALETTE, WIDTH_IN
from identify.results.map import MapResult


def receptances(result: MapResult, rows: Sequence[int]) -> mpl.Figure:
    """Direct receptances at chosen postures."""
    figure = mpl.Figure((WIDTH_IN, 2.4), layout="constrained")
    panels = figure.subplots(1, 3, sharey=True)
    for axis, axes in enumerate(panels):
        for number, row in enumerate(rows):
            size = 1e6 * np.abs(result.rows.receptance_m_per_n[row, :, axis, axis])
            band = 1e6 * result.rows.band_95[row, :, axis, axis]
            color = PALETTE[number]
            axes.fill_between(
                result.line_hz,
                np.maximum(size - band, 1e-3 * size),
                size + band,
                color=color,
                alpha=0.25,
                lw=0,
            )
            axes.plot(result.line_hz, size, color=color, label=result.rows.name[row])
        axes.set(yscale="log", xlabel="Frequency (Hz)", title=f"along {'xyz'[axis]}")
    panels[0].set_ylabel("Receptance (µm/N)")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper right", ncols=3)
    return figure

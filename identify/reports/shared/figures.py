"""Figures of the PDF that reports of several kinds share: the gap by band and FRF, and MAC matrices."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from identify.core.arrays import Array, Index
from identify.reports.kit import plotting as mpl
from identify.reports.kit.cells import number
from identify.reports.kit.figures import DIVERGING, INK, WIDTH_IN, Room, decades_beside, wide
from identify.reports.shared import pick
from identify.results.fit import FrfComparison, MeasurementResult

_RISING = ("#f3f3f1", "#e8903a", "#8c2d04")
_MAC = ("#f3f3f1", "#0072b2")


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


def _first_of_inputs(frf: FrfComparison, order: Index) -> list[int]:
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
    """A MAC matrix (rows, columns) with the frequencies, Hz, and the names of its sides."""

    name: str
    values: Array
    rows_hz: Array
    columns_hz: Array
    down: str = "Measured"
    across: str = "Model"


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
    axes.set(xlabel=f"{one.across} (Hz)", ylabel=f"{one.down} (Hz)", ylim=(len(one.values), 0))

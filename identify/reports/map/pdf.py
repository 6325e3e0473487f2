"""The PDF report of a map of postures: the same tables as its HTML page, and printed figures."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from identify.reports.batch.pdf import maps, values
from identify.reports.kit import figures, posture_figure
from identify.reports.kit.cells import Column, Curves
from identify.reports.kit.document import Document
from identify.reports.kit.figures import PALETTE, WIDTH_IN
from identify.reports.kit.posture_pick import Postures, map_postures_of
from identify.reports.map import tables as map_tables
from identify.reports.map.html import chosen
from identify.results.map import MapResult

_DRAWN = 3


def document(result: MapResult) -> Document:
    """The PDF of a map, in the making."""
    made, postures = Document(), map_postures_of(result)
    with figures.style():
        made.opening(result, map_tables.tiles(result))
        made.table(map_tables.mode_table(result))
        _maps(made, postures)
        made.add("heading", "Modes over the postures")
        for kind, what in (("frequency", "Frequencies"), ("damping", "Damping ratios")):
            shown = postures.of(kind)
            made.figure(
                posture_figure.modes(postures, kind),
                f"{what} of the modes, with 95 % intervals.",
                values(postures, shown),
            )
        made.add("heading", "Receptance of the tool")
        caption = (
            f"Receptance of {result.tool} at the stiffest, a middling and the softest posture, with 95 %"
            " bands, along the base's axes."
        )
        made.figure(receptances(result), caption, *_curves(result))
    made.tables.append(map_tables.posture_table(result))
    made.add(
        "paragraph",
        f"All {len(result.rows.name)} postures are in the table of the HTML page, in the CSV file and in the"
        " result file.",
    )
    made.sources(result)
    return made


def _maps(made: Document, postures: Postures) -> None:
    if postures.varied:
        made.add("heading", "Maps")
        shown = [*postures.of("frequency")[:1], *postures.of("damping")[:1], *postures.of("compliance")[:3]]
        maps(made, postures, shown)


def receptances(result: MapResult) -> Figure:
    """Direct receptances at the stiffest, a middling and the softest posture."""
    figure = Figure((WIDTH_IN, 2.4), layout="constrained")
    panels = figure.subplots(1, 3, sharey=True)
    for axis, axes in enumerate(panels):
        for number, row in enumerate(chosen(result, _DRAWN)):
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


def _curves(result: MapResult) -> list[Curves]:
    """The direct receptances of the drawn postures."""
    found = []
    for row in chosen(result, _DRAWN):
        size = 1e6 * np.abs(result.rows.receptance_m_per_n[row][:, range(3), range(3)]).astype(float)
        columns = (Column("Frequency", "Hz"), *(Column(f"Receptance along {axis}", "µm/N") for axis in "xyz"))
        found.append(Curves(result.rows.name[row], columns, np.column_stack([result.line_hz, size])))
    return found

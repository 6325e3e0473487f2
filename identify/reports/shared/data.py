"""The numbers behind figures, for export: whole, where a figure shows a choice or a projection."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np

from identify.core.arrays import Array, Complex
from identify.reports.kit.cells import Column, Curves, Table, number, several, words
from identify.reports.shared import pick
from identify.reports.shared.figures import Mac
from identify.reports.shared.shapes import ModeView
from identify.results.fit import FrfComparison
from identify.results.tables import Geometry

_AXES = ("X", "Y", "Z")
RESIDUAL = ("residual/measured", "residual/noise")
"""What residuals are over: the measurement, or the noise where it is known."""


def frfs(frf: FrfComparison, modelled: str = "fitted") -> tuple[Curves, ...]:
    """All FRFs: measured (with coherence), modelled and, where there are any, the start model's, the 95 %
    band and the noise.

    Those of complex values are laid out as `identify` reads FRFs from CSV.
    """
    complex_values = {"measured": frf.measured, modelled: frf.fitted, "start model": frf.initial}
    found = [_complex(frf, title, values) for title, values in complex_values.items() if values is not None]
    real = {"half width of the 95 % band": frf.band_95, "std of the noise": frf.noise}
    return tuple(found + [_real(frf, title, values) for title, values in real.items() if values is not None])


def _complex(frf: FrfComparison, title: str, values: Complex) -> Curves:
    coherence = frf.coherence if title == "measured" else None
    columns = [Column("frequency_hz", "", frf.frequency_hz)]
    for pair, name in enumerate(_pairs(frf)):
        columns += several([f"{name} real", f"{name} imag"], "", _parts(values[:, pair]))
        columns += [] if coherence is None else [Column(f"{name} coherence", "", coherence[:, pair])]
    note = f"{title} {frf.quantity}\nunit: {frf.unit}\nwindow_decay_per_s: {frf.window_decay_per_s:.9g}"
    return Curves(title, columns, note)


def _real(frf: FrfComparison, title: str, values: Array) -> Curves:
    columns = [Column("Frequency", "Hz", frf.frequency_hz), *several(_pairs(frf), frf.unit, values)]
    return Curves(title, columns, f"{title} of the real and of the imaginary part")


def _parts(values: Complex) -> Array:
    """Real and imaginary part (n, 2) of values (n,)."""
    return np.stack([values.real, values.imag], axis=-1)


def _pairs(frf: FrfComparison) -> list[str]:
    return [f"{o}/{i}" for o, i in zip(frf.output, frf.input, strict=True)]


def gap_map(frf: FrfComparison) -> Curves:
    """The gap map, a row per band."""
    found = pick.gap_map(frf)
    return Curves("gap by band", banded(found.edges_hz, _pairs(frf), RESIDUAL[found.in_noise], found.values))


def banded(edges_hz: Array, headings: Sequence[str], of: str, values: Array) -> list[Column]:
    """Values (bands, headings) with the ends of their bands."""
    ends = several(("From", "To"), "Hz", np.stack([edges_hz[:-1], edges_hz[1:]], axis=1))
    return [*ends, *several(headings, of, values)]


def mac(one: Mac) -> Table:
    """A MAC matrix with the frequencies of its sides."""
    side = Column(one.down, "Hz", one.rows_hz)
    return Table(
        f"MAC {one.name}", [side, *several([f"{number(hz)} Hz" for hz in one.columns_hz], "", one.values)]
    )


def geometry(name: str, g: Geometry) -> Table:
    """The points at a posture, in the base's axes."""
    names = [words("Node", g.nodes), words("Name", g.point_names), words("Link", g.point_links)]
    return Table(f"points {name}", [*names, *several(_AXES, "m", g.points)])


def shapes(g: Geometry, views: Sequence[ModeView]) -> Table:
    """Shapes at the points, in the base's axes; the largest displacement of a mode is 1."""
    rows = list(product(views, range(len(g.nodes))))
    columns = [
        words("Mode", [view.label for view, _ in rows]),
        words("Node", [g.nodes[row] for _, row in rows]),
    ]
    for what, moved in (("model", "points"), ("measured", "measured_points")):
        shown = [getattr(view, moved) for view in views]
        values = np.array([np.full((len(g.nodes), 3), np.nan + 0j) if one is None else one for one in shown])
        heads = [f"{what} {part} {axis}" for axis in _AXES for part in ("real", "imag")]
        columns += several(heads, "", _parts(values).reshape(len(rows), 6))
    return Table("mode shapes", columns)

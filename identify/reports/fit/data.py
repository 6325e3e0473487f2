"""The numbers behind figures, for export: whole, where a figure shows a choice or a projection."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from identify.reports.fit import pick
from identify.reports.kit.cells import Column, Curves, Table, number, unit, words
from identify.reports.kit.figures import Mac
from identify.reports.kit.shapes import ModeView
from identify.results.fit import FitResult, FrfComparison
from identify.results.modes import AnalysedMeasurement
from identify.results.tables import Geometry

_AXES = ("X", "Y", "Z")


def frfs(frf: FrfComparison, modelled: str = "fitted") -> tuple[Curves, ...]:
    """All FRFs: measured (with coherence), modelled and, where there are any, the start model's, the 95 %
    band and the noise.

    Those of complex values are laid out as `identify` reads FRFs from CSV.
    """
    complex_values = {"measured": frf.measured, modelled: frf.fitted, "start model": frf.initial}
    found = [_complex(frf, title, values) for title, values in complex_values.items() if values is not None]
    real = {"half width of the 95 % band": frf.band_95, "std of the noise": frf.noise}
    return tuple(found + [_real(frf, title, values) for title, values in real.items() if values is not None])


def _complex(frf: FrfComparison, title: str, values: NDArray[np.complex128]) -> Curves:
    columns, stack = [Column("frequency_hz")], [frf.frequency_hz]
    coherence = frf.coherence if title == "measured" else None
    for pair, name in enumerate(_pairs(frf)):
        columns += [Column(f"{name} real"), Column(f"{name} imag")]
        stack += [values[:, pair].real, values[:, pair].imag]
        if coherence is not None:
            columns.append(Column(f"{name} coherence"))
            stack.append(coherence[:, pair])
    note = f"{title} {frf.quantity}\nunit: {frf.unit}\nwindow_decay_per_s: {frf.window_decay_per_s:.9g}"
    return Curves(title, tuple(columns), np.stack(stack, axis=1), note)


def _real(frf: FrfComparison, title: str, values: NDArray[np.float64]) -> Curves:
    columns = (Column("Frequency", "Hz"), *(Column(name, frf.unit) for name in _pairs(frf)))
    return Curves(
        title,
        columns,
        np.column_stack([frf.frequency_hz, values]),
        f"{title} of the real and of the imaginary part",
    )


def _pairs(frf: FrfComparison) -> list[str]:
    return [f"{o}/{i}" for o, i in zip(frf.output, frf.input, strict=True)]


def gap_map(frf: FrfComparison) -> Curves:
    """The gap map, a row per band."""
    found = pick.gap_map(frf)
    what = "residual/noise" if found.in_noise else "residual/measured"
    columns = (Column("From", "Hz"), Column("To", "Hz"), *(Column(name, what) for name in _pairs(frf)))
    return Curves(
        "gap by band", columns, np.column_stack([found.edges_hz[:-1], found.edges_hz[1:], found.values])
    )


def mac(one: Mac) -> Table:
    """A MAC matrix with the frequencies of its sides."""
    columns = (
        Column(one.down.removesuffix(" (Hz)"), "Hz"),
        *(Column(f"{number(hz)} Hz") for hz in one.columns_hz),
    )
    rows = (map(number, (hz, *values)) for hz, values in zip(one.rows_hz, one.values, strict=True))
    return Table(f"MAC {one.name}", columns, tuple(map(tuple, rows)))


def geometry(name: str, g: Geometry) -> Table:
    """The points at a posture, in the base's axes."""
    columns = (words("Node"), words("Name"), words("Link"), *(Column(axis, "m") for axis in _AXES))
    rows = zip(g.nodes, g.point_names, g.point_links, g.points, strict=True)
    return Table(
        f"points {name}",
        columns,
        tuple((str(node), point, link, *map(number, at)) for node, point, link, at in rows),
    )


def shapes(g: Geometry, views: Sequence[ModeView]) -> Table:
    """Shapes at the points, in the base's axes; the largest displacement of a mode is 1."""
    heads = tuple(
        Column(f"{what} {part} {axis}")
        for what in ("model", "measured")
        for axis in _AXES
        for part in ("real", "imag")
    )
    rows = []
    for view in views:
        for row, node in enumerate(g.nodes):
            rows.append(
                (view.label, str(node), *_moves(view.points, row), *_moves(view.measured_points, row))
            )
    return Table("mode shapes", (words("Mode"), words("Node"), *heads), tuple(rows))


def _moves(shape: NDArray[np.complex128] | None, row: int) -> list[str]:
    values = np.full(3, np.nan + 0j) if shape is None else shape[row]
    return [number(part) for value in values for part in (value.real, value.imag)]


def history(result: FitResult) -> Curves:
    """The best cost of every start and stage over evaluations and time."""
    columns = (
        Column("Start"),
        Column("Stage"),
        Column("Evaluations of the stage"),
        Column("Best cost"),
        Column("Time", "s"),
    )
    values = result.history[:, :5].copy()
    values[:, :2] += 1
    return Curves("convergence", columns, values)


def starts(result: FitResult) -> tuple[Curves, ...]:
    """The parameters before and after every start, a row per start."""
    p = result.parameters
    columns = (Column("Start"), *(Column(name, unit(of)) for name, of in zip(p.name, p.unit, strict=True)))
    numbers = np.arange(1, len(result.starts.cost) + 1)
    sides: tuple[tuple[str, Any], ...] = (("before", result.starts.initial), ("after", result.starts.final))
    return tuple(Curves(title, columns, np.column_stack([numbers, values])) for title, values in sides)


def correlation(result: FitResult) -> Curves:
    """The correlation of the estimates, free parameters in their order."""
    names = [name for name, free in zip(result.parameters.name, result.parameters.free, strict=True) if free]
    return Curves("correlation", tuple(map(Column, names)), result.correlation)


def profiles(result: FitResult) -> tuple[Curves, ...]:
    """Every profile likelihood."""
    units = dict(zip(result.parameters.name, result.parameters.unit, strict=True))
    return tuple(
        Curves(
            name,
            (Column(name, unit(units[name])), Column("Rise of chi-square")),
            np.column_stack([curve.values, curve.rise]),
        )
        for name, curve in result.profiles.items()
    )


def stabilisation(m: AnalysedMeasurement) -> tuple[Curves, ...]:
    """Poles of all orders, and the mode indicator over the lines."""
    d = m.diagram
    marked = d.marked()
    heads = (
        *(Column("Order"), Column("Frequency", "Hz"), Column("Damping ratio", "%"), Column("Stable")),
        *(Column(name.capitalize()) for name, _ in marked),
    )
    what = [d.order, d.frequency_hz, 100 * d.damping_ratio, d.stable, *(rows for _, rows in marked)]
    poles = np.column_stack(what)
    lines = (
        Column("Frequency", "Hz"),
        *(Column(f"CMIF {k + 1}", unit(m.frf.unit)) for k in range(d.indicator.shape[1])),
    )
    return Curves("poles", heads, poles), Curves(
        "indicator", lines, np.column_stack([d.line_hz, d.indicator])
    )

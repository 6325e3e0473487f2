"""The HTML report: one file that opens from disk without network; the data are embedded once, `page.js` draws
them.

`page` is of a fit; what it shares with the page of a modal analysis (`modes_html`) is public.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import jinja2
import numpy as np
from markupsafe import Markup
from numpy.typing import NDArray
from plotly.offline import get_plotlyjs

from identify.reports.fit import measurement_tables, pick, tables
from identify.reports.kit.cells import number, sentence, unit
from identify.reports.kit.packing import pack, pack_frfs
from identify.reports.kit.settings import default_table, given_table
from identify.reports.kit.shapes import ModeView, mode_views
from identify.results.fit import FitResult, FrfComparison, MeasurementResult, ProfileCurve
from identify.results.header import Header
from identify.results.tables import Geometry

_HERE = Path(__file__).parents[1] / "assets"
_EARLY, _LATE = ("page.js", "robot.js"), ("frf.js", "mac.js")
"""Scripts before and after the plotting library: text, tables and the robot need not wait for it."""
_EXCITED = ("where it was excited", "excited here")
_MAP_STEP = 1e-3
"""Decades to which the gap map is rounded."""
STAGES = {
    "model": "the model at its posture, moving in the chosen mode",
    "measured": "the measured points, moving in the mode that was measured",
}
"""Canvases on which shapes move, and what they show."""


def page(result: FitResult) -> str:
    """The whole page of a fit."""
    measurements = list(result.measurements.values())
    return render(
        "fit.html.j2",
        "charts.js",
        payload(result),
        result=result,
        measurements=measurements,
        sections=_sections(result),
        stages=stages_of(measurements),
        tables=tables,
        tiles=tables.tiles(result),
        measurement_tables=measurement_tables,
        frf_tables=[measurement_tables.frf_table(m.name, m.frf) for m in measurements if m.frf],
    )


def stages_of(measurements: Sequence[MeasurementResult]) -> list[tuple[str, str]]:
    """The canvases for shapes of these measurements: the measured one only where shapes were measured."""
    measured_shapes = any(m.pairs and m.pairs.measured_shapes is not None for m in measurements)
    return [(kind, about) for kind, about in STAGES.items() if kind == "model" or measured_shapes]


def render(
    template: str, script: str | tuple[str, ...], data: dict[str, Any], result: Header, **context: Any
) -> str:
    """A page from its template, with the common look, parts and scripts, its own script or scripts, and the
    data that they draw.
    """
    own = (script,) if isinstance(script, str) else script
    loader = jinja2.FileSystemLoader(_HERE)
    environment = jinja2.Environment(
        loader=loader, autoescape=True, trim_blocks=True, lstrip_blocks=True, undefined=jinja2.StrictUndefined
    )
    common = {
        "provenance": tables.provenance_table(result),
        "given": given_table(result.provenance),
        "defaults": default_table(result.provenance),
    }
    return environment.get_template(template).render(
        **{**common, **context},
        result=result,
        sentence=sentence,
        style=_text("report.css"),
        scripts=[*map(_text, _EARLY), Markup(get_plotlyjs()), *map(_text, (_LATE[0], *own, _LATE[1]))],
        data=Markup(_json(data)),
    )


def _text(name: str) -> Markup:
    return Markup((_HERE / name).read_text("utf-8"))


def _sections(result: FitResult) -> list[tuple[str, str]]:
    """Anchors and labels of the sections this result has."""
    with_frf = any(m.frf for m in result.measurements.values())
    frfs = [("frf", "FRFs"), ("gap", "Gap map")] if with_frf else []
    ends = [
        ("convergence", "Convergence"),
        ("identifiability", "Identifiability"),
        ("asked", "Study"),
        ("provenance", "Provenance"),
    ]
    errors = [("errors", "Errors")] if with_frf else []
    return [
        ("verdict", "Verdict"),
        ("robot", "Robot"),
        *frfs,
        ("parameters", "Parameters"),
        ("modes", "Modes"),
        *errors,
        *ends,
    ]


def payload(result: FitResult) -> dict[str, Any]:
    """What the scripts of the page draw from."""
    p = result.parameters
    free = p.free
    names = [name for name, is_free in zip(p.name, free, strict=True) if is_free]
    return {
        "measurements": [measurement_data(m) for m in result.measurements.values()],
        "curves": {"measured": "measured", "initial": "start model", "fitted": "fitted"},
        "parameters": {
            "name": list(p.name),
            "status": list(p.status),
            "half": 100 * pick.half_interval(p),
            **{
                key: pick.between_bounds(p, getattr(p, key))
                for key in ("initial", "value", "low_95", "high_95")
            },
        },
        "free": names,
        "profiles": [_profile(result, name, curve) for name, curve in result.profiles.items()],
        "correlation": result.correlation,
        "singular": result.singular_values,
        "starts": {
            "cost": result.starts.cost,
            "initial": pick.between_bounds(p, result.starts.initial)[:, free],
            "final": pick.between_bounds(p, result.starts.final)[:, free],
        },
        "history": pick.cost_lines(result.history),
        "cost": result.cost_kind,
    }


def measurement_data(
    m: MeasurementResult, beside: Mapping[str, NDArray[np.complex128]] | None = None
) -> dict[str, Any]:
    """What a model makes of a measurement: robot, FRFs (beside: further curves as in `pack_frfs`), MAC."""
    return {
        "name": m.name,
        "use": measurement_tables.use(m),
        "robot": robot_data(
            m.geometry, m.frf, mode_views(m), [] if m.frf is None else pick.nodes(m.frf.input), _EXCITED
        ),
        "frf": None if m.frf is None else frf_data(m.frf, beside),
        "mac": _mac(m),
    }


def _profile(result: FitResult, name: str, curve: ProfileCurve) -> dict[str, Any]:
    row = result.parameters.name.index(name)
    log, label = bool(result.parameters.log[row]), f"{name} ({unit(result.parameters.unit[row])})"
    return {
        "label": label,
        "log": log,
        "values": curve.values,
        "rise": curve.rise,
        "best": result.parameters.value[row],
    }


def robot_data(
    g: Geometry, frf: FrfComparison | None, views: list[ModeView], ringed: list[int], said: tuple[str, str]
) -> dict[str, Any]:
    """Geometry and modes to look at; shapes as real and imaginary part in thousandths of the largest
    displacement.

    ringed: nodes to mark, said: what they are, in the legend and at the point.
    """
    modes = [
        {
            "label": view.label,
            "model": view.model,
            "measured": view.measured,
            "points": _thousandths(view.points),
            "skeleton": _thousandths(view.skeleton),
            "measured_points": _thousandths(view.measured_points),
        }
        for view in views
    ]
    return {
        "node": g.nodes,
        "name": list(g.point_names),
        "link": list(g.point_links),
        "points": g.points,
        "skeleton": g.skeleton,
        "segments": g.segments,
        "arrows": {
            kind: [[row, *way] for row, way in pick.arrows(g, channels)]
            for kind, channels in (("response", frf.output), ("force", frf.input))
        }
        if frf is not None
        else {},
        "measured": [] if frf is None else pick.nodes(frf.output),
        "ring": {"nodes": ringed, "about": said[0], "tip": said[1]},
        "modes": modes,
    }


def _thousandths(shape: NDArray[np.complex128] | None) -> dict[str, Any] | None:
    return (
        None if shape is None else {part: np.round(1000 * getattr(shape, part)) for part in ("real", "imag")}
    )


def frf_data(
    frf: FrfComparison, beside: Mapping[str, NDArray[np.complex128]] | None = None
) -> dict[str, Any]:
    """Curves, errors and gap map of an FRF set; beside: further curves as in `pack_frfs`."""
    gap_map, order = pick.gap_map(frf), pick.map_order(frf)
    with np.errstate(divide="ignore"):
        values = pack(np.log10(gap_map.values.T[order]), _MAP_STEP)
    return {
        "quantity": frf.quantity,
        "unit": unit(frf.unit),
        "frequency": frf.frequency_hz,
        "output": list(frf.output),
        "input": list(frf.input),
        "title": [measurement_tables.pair_errors(frf, pair) for pair in range(len(frf.output))],
        "first": pick.shown_frfs(frf)[0],
        "curves": pack_frfs(frf, beside),
        "map": {"edges": gap_map.edges_hz, "order": order, "values": values, "in_noise": gap_map.in_noise},
    }


def _mac(m: MeasurementResult) -> dict[str, Any] | None:
    if m.pairs is None or m.pairs.mac_matrix is None:
        return None
    shown = pick.shown_modes(m)
    rows, columns = (
        [number(hz) for hz in values]
        for values in (m.pairs.measured_frequency_hz, m.modes.frequency_hz[:shown])
    )
    return {
        "rows": rows,
        "columns": columns,
        "down": "Measured (Hz)",
        "across": "Model (Hz)",
        "values": m.pairs.mac_matrix[:, :shown],
    }


def _json(value: dict[str, Any]) -> str:
    """JSON that may stand inside a script element."""
    return json.dumps(_plain(value), separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")


def _short(value: float) -> float | int:
    rounded = float(f"{value:.6g}")
    return int(rounded) if rounded.is_integer() and abs(rounded) < 1e6 else rounded


def _plain(value: Any) -> Any:
    """Arrays as lists with six significant digits, NaN as null."""
    if isinstance(value, np.ndarray):
        return _plain(value.tolist())
    if isinstance(value, dict):
        return {key: _plain(entry) for key, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(entry) for entry in value]
    if isinstance(value, float):
        return _short(value) if np.isfinite(value) else None
    return value

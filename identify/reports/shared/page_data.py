"""What the scripts of a page draw from: robot, shapes, FRFs and MAC of a measurement.

Curves are packed small: whole steps, differences along the curve, bytes by weight, deflated, base64.  A
plot shows about three digits, so a curve is rounded to a step; smooth curves then have differences of a
few steps, and the high bytes, being all zero, cost nothing.  `page.js` has the way back (`unpack`).
"""

from __future__ import annotations

import base64
import zlib
from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np

from identify.core.arrays import Array, Complex
from identify.reports.kit.cells import number, unit
from identify.reports.shared import measurement_tables, pick
from identify.reports.shared.figures import Mac, pair_mac
from identify.reports.shared.shapes import ModeView, mode_views
from identify.results.fit import FrfComparison, MeasurementResult
from identify.results.tables import Bodies, Geometry

_EXCITED = ("where it was excited", "excited here")
_SIDES = ("response", "force")
_MAP_STEP = 1e-3
"""Decades to which the gap map is rounded."""
Channels: TypeAlias = tuple[Sequence[str], Sequence[str]]
"""Of responses, then of forces."""
MAGNITUDE_STEP, PHASE_STEP, BAND_STEP, COHERENCE_STEP = 1e-4, 1e-3, 1e-2, 1e-3
"""Steps: decades of magnitude (0.012 % at most), radians, decades of the half width of the band, coherence.
"""
_MISSING = np.int32(-(2**31))
_BLOCK = 64


def measurement_data(m: MeasurementResult, beside: Mapping[str, Complex] | None = None) -> dict[str, Any]:
    """What a model makes of a measurement: robot, FRFs (beside: further curves as in `pack_frfs`), MAC."""
    return {
        "name": m.name,
        "use": measurement_tables.use(m),
        "robot": robot_data(
            m.geometry,
            channels(m.frf),
            mode_views(m),
            [] if m.frf is None else pick.nodes(m.frf.input),
            _EXCITED,
        ),
        "frf": None if m.frf is None else frf_data(m.frf, beside),
        "mac": mac_data(pair_mac(m)),
    }


def channels(frf: FrfComparison | None) -> Channels:
    """Those of FRFs; none where there are no FRFs."""
    return ((), ()) if frf is None else (frf.output, frf.input)


def robot_data(
    g: Geometry, seen: Channels, views: list[ModeView], ringed: list[int], said: tuple[str, str]
) -> dict[str, Any]:
    """Geometry and modes to look at; shapes as real and imaginary part in thousandths of the largest
    displacement.

    seen: channels; ringed: nodes to mark, said: what they are, in the legend and at the point.
    """
    modes = [
        {
            "label": view.label,
            "hz": view.hz,
            "model": view.model,
            "measured": view.measured,
            "points": _thousandths(view.points),
            "skeleton": _thousandths(view.skeleton),
            "measured_points": _thousandths(view.measured_points),
            "bodies": _thousandths(view.bodies),
        }
        for view in views
    ]
    return {
        "node": g.nodes,
        "name": list(g.point_names),
        "link": list(g.point_links),
        "points": g.points,
        "skeleton": g.skeleton,
        "links": list(g.skeleton_links or ()),
        "bodies": _bodies_data(g.bodies),
        "segments": g.segments,
        "arrows": {kind: list(_arrows(g, some).values()) for kind, some in zip(_SIDES, seen, strict=True)},
        "ways": _arrows(g, seen[0]),
        "measured": pick.nodes(seen[0]),
        "ring": {"nodes": ringed, "about": said[0], "tip": said[1]},
        "modes": modes,
    }


def _arrows(g: Geometry, channels: Sequence[str]) -> dict[str, list[Any]]:
    """Of channels: row of the point, and direction."""
    return {name: [row, *way] for name, (row, way) in pick.ways(g, channels).items()}


def _bodies_data(bodies: Bodies | None) -> dict[str, Any] | None:
    """Triangles in the base's axes, whole millimetres, and about which places, m, the bodies turn."""
    if bodies is None:
        return None
    return {
        "names": list(bodies.links),
        "middle": bodies.middle,
        "vertices": np.round(1000 * bodies.placed),
        "of_link": bodies.of_link,
        "triangles": bodies.triangles,
        "bare": bodies.bare,
        "missing": list(bodies.missing),
    }


def _thousandths(shape: Complex | None) -> dict[str, Any] | None:
    return (
        None if shape is None else {part: np.round(1000 * getattr(shape, part)) for part in ("real", "imag")}
    )


def frf_data(frf: FrfComparison, beside: Mapping[str, Complex] | None = None) -> dict[str, Any]:
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


def mac_data(one: Mac | None) -> dict[str, Any] | None:
    """A MAC matrix with the frequencies of its sides."""
    if one is None:
        return None
    rows, columns = ([number(hz) for hz in side] for side in (one.rows_hz, one.columns_hz))
    return {
        "rows": rows,
        "columns": columns,
        "down": f"{one.down} (Hz)",
        "across": f"{one.across} (Hz)",
        "values": one.values,
    }


def pack(values: Array, step: float, order: int = 1) -> dict[str, Any]:
    """Curves (curves, n) rounded to a step, as `order`-th differences; what is not finite comes back as
    NaN.
    """
    with np.errstate(invalid="ignore"):
        steps = np.where(np.isfinite(values), np.round(values / step), 0.0).astype(np.int32)
    steps[~np.isfinite(values)] = _MISSING
    for _ in range(order):
        steps = np.diff(steps, axis=1, prepend=np.int32(0))
    # Zigzag: small numbers of either sign have zero high bytes.
    bits = ((steps << 1) ^ (steps >> 31)).astype("<u4")
    planes = np.ascontiguousarray(bits).reshape(-1).view(np.uint8).reshape(-1, 4).T
    data = base64.b64encode(zlib.compress(np.ascontiguousarray(planes).tobytes(), 6)).decode()
    return {"n": values.shape[1], "step": step, "order": order, "data": data}


def pack_frfs(frf: FrfComparison, beside: Mapping[str, Complex] | None = None) -> dict[str, Any]:
    """All curves of an FRF set in blocks of 64 pairs, so that a page unpacks only the block it shows.

    beside: further smooth curves by name, each (lines, pairs).
    """
    pairs = len(frf.output)
    blocks = [
        _pack_block(frf, beside or {}, slice(first, first + _BLOCK)) for first in range(0, pairs, _BLOCK)
    ]
    return {"size": _BLOCK, "blocks": blocks}


def _pack_block(frf: FrfComparison, beside: Mapping[str, Complex], pairs: slice) -> dict[str, Any]:
    block: dict[str, Any] = {}
    smooth = {"fitted": frf.fitted, "initial": frf.initial, **beside}
    for name, curve, order in (
        ("measured", frf.measured, 1),
        *((name, curve, 2) for name, curve in smooth.items()),
    ):
        if curve is None:
            continue
        values = curve[:, pairs]
        block[name] = {
            "magnitude": pack(_decades(np.abs(values)).T, MAGNITUDE_STEP, order),
            "phase": pack(_unwrapped(values).T, PHASE_STEP, order),
        }
    if frf.band_95 is not None:
        block["band"] = pack(_decades(frf.band_95[:, pairs]).T, BAND_STEP)
    if frf.coherence is not None:
        block["coherence"] = pack(frf.coherence[:, pairs].T, COHERENCE_STEP)
    return block


def _decades(values: Array) -> Array:
    with np.errstate(divide="ignore"):
        return np.asarray(np.log10(values))


def _unwrapped(values: Complex) -> Array:
    """Phase without jumps along the lines; a missing line, or a zero, leaves its neighbours alone."""
    known = np.isfinite(values) & (values != 0)
    return np.where(known, np.unwrap(np.angle(np.where(known, values, 1.0)), axis=0), np.nan)

"""Curves packed small for a page: whole steps, differences along the curve, bytes by weight, deflated,
base64.

A plot shows about three digits, so a curve is rounded to a step; smooth curves then have differences of a few
steps, and the high bytes, being all zero, cost nothing.  `page.js` has the way back (`unpack`).
"""

from __future__ import annotations

import base64
import zlib
from collections.abc import Mapping
from typing import Any

import numpy as np

from identify.core.arrays import Array, Complex
from identify.results.fit import FrfComparison

MAGNITUDE_STEP, PHASE_STEP, BAND_STEP, COHERENCE_STEP = 1e-4, 1e-3, 1e-2, 1e-3
"""Steps: decades of magnitude (0.012 % at most), radians, decades of the half width of the band, coherence.
"""
_MISSING = np.int32(-(2**31))
_BLOCK = 64


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

"""Depth limits of a cut on a fitted model at one posture, with the bands that fit, cut and posture leave.

The 95 % bands: a limit is the least of several crossings, each with a depth that moves in proportion to
exp(g z), z the independent standard normal numbers of all that is uncertain: to first order in the logarithm,
in which depths that are products (stiffness times damping over a cutting coefficient) are exact.  The band is
that of the least of all crossings over draws of z, so that it knows of another lobe that may come first.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identify.core.arrays import Array, Complex
from identify.core.interruption import check
from identify.core.thresholds import PERCENTILES_95
from identify.machining.engagement import Engagement
from identify.machining.exact_limit import ExactLimit, exact_coupling, exact_limit
from identify.machining.lobes import (
    Limits,
    crossings,
    inverse_eigenvalues,
    mode_coupling,
    uneven_crossings,
    zeroth_order,
)
from identify.machining.mounted import Cutting, Uncertain
from identify.machining.multi_frequency import multi_frequency
from identify.machining.semi_discretization import TimeDomain
from identify.results.stability import DepthLimits, LimitChecks

_SEED = 1
UNKNOWN = (0.0, np.inf)


def relative_band(
    crossings: Sequence[ExactLimit], tip: Uncertain, coefficients: float, draws: int
) -> tuple[float, float]:
    """95 % limits of the least of crossings, over the least of them; 0 and infinity without any.

    coefficients: relative standard deviation of all cutting coefficients together.
    """
    if not crossings:
        return UNKNOWN
    least = min(one.depth for one in crossings)
    rng = np.random.default_rng(_SEED)
    moves = [tip.relative(one) for one in crossings]
    shared = rng.standard_normal((draws, len(moves[0][0])))
    found = np.full(draws, np.inf)
    for one, (change, misfit) in zip(crossings, moves, strict=True):
        log = shared @ change + misfit * rng.standard_normal(draws)
        with np.errstate(over="ignore"):
            found = np.minimum(found, one.depth / least * np.exp(log))
    found = found * np.exp(coefficients * rng.standard_normal(draws))
    low, high = np.percentile(found, PERCENTILES_95)
    return min(float(low), 1.0), max(float(high), 1.0)


_EVERY, _FEEDS = 6, 24
"""Every sixth speed is checked by another method; feeds about the spindle."""
_FINE, _COARSE = 1600, 300
"""Lines between the modes, of the limits themselves and of what is compared with them."""
_CROSSINGS, _BESIDE, _SAME = 4, 1.6, 1e-6
"""Crossings looked at for bands, up to so many times the limit; from what part on two are not the same."""


def nominal(on: Cutting) -> tuple[Limits, Limits]:
    """The first crossings at all speeds (speeds, count), and the limit of mode coupling, of zeroth order."""
    cut, line_hz = on.cut, on.lines_hz(_FINE)
    inverse = inverse_eigenvalues(cut.mean, on.tip(line_hz))
    return _crossings(cut, inverse, line_hz, on.rpm), mode_coupling(inverse, line_hz)


def _crossings(cut: Engagement, inverse: Complex, line_hz: Array, rpm: Array) -> Limits:
    if cut.pitches:
        return uneven_crossings(inverse, line_hz, cut.pitches, rpm, _CROSSINGS)
    return crossings(inverse, line_hz, cut.teeth, rpm, _CROSSINGS)


def coupling(on: Cutting, found: Limits) -> Array:
    """(4,): depth limit of mode coupling with its 95 % limits, m, and its frequency, Hz; found: of zeroth
    order.
    """
    depth, hz = float(found.depth), float(found.chatter_hz)
    if not 0 < depth < np.inf:
        return np.array([depth, depth, depth, hz])
    exact = exact_coupling(on.cut, on.tip, (depth, hz))
    if exact is None:
        return np.array([depth, *(depth * part for part in UNKNOWN), hz])
    low, high = relative_band([exact], on.uncertain, on.coefficients, on.draws)
    return np.array([exact.depth, exact.depth * low, exact.depth * high, exact.chatter_hz])


def limits(on: Cutting, found: Limits) -> tuple[DepthLimits, LimitChecks]:
    """The limits with their bands, and by every method at some of the speeds; found: crossings of zeroth
    order.

    The least limit is looked for by semi-discretisation, or by the multi-frequency solution where there is
    none in time, and of uneven teeth, whose many harmonics take long, among the crossings; the limit itself
    is the exact one beside it.
    """
    structure, cut, most = on.in_time, on.cut, on.tool.max_depth_mm / 1e3
    rpm, zeroth = on.rpm, found.depth[:, 0]
    highest = _highest_hz(on, found)
    some = slice(None, None, _EVERY * (3 if cut.pitches else 1))
    several = _several(on, cut, highest, rpm[some] if structure or cut.pitches else rpm)
    compared = LimitChecks(rpm[some], zeroth[some], several.depth, None)
    if cut.pitches:
        first = Limits(zeroth, found.chatter_hz[:, 0])
    elif structure is not None:
        first = _in_time(TimeDomain(structure, cut, highest), rpm, zeroth, most)
        compared = replace(compared, semi_discretization=first.depth[some])
    else:
        first, compared = several, replace(compared, multi_frequency=several.depth[some])
    rows = [_exact(on, highest, number, first, found) for number in range(len(rpm))]
    depth, low, high, chatter = np.array(rows).T
    free = depth > most
    chatter = np.where(free, np.nan, chatter)
    at, low, high = (np.where(free, np.inf, part) for part in (depth, low, high))
    return DepthLimits(rpm, at, low, high, chatter, zeroth), compared


def _exact(on: Cutting, highest: float, number: int, first: Limits, found: Limits) -> list[float]:
    """Depth, its 95 % limits, and frequency of chatter at the spindle speed of that number."""
    check()
    depth, hz, rpm = float(first.depth[number]), float(first.chatter_hz[number]), on.rpm[number]
    if not np.isfinite(depth):
        return [np.inf, np.inf, np.inf, np.nan]
    uneven = bool(on.cut.pitches)  # whose harmonics are many enough as they are
    exact = exact_limit(on.cut, on.tip, highest, rpm, (depth, hz), quick=uneven)
    if exact is None:
        return [depth, *(depth * part for part in UNKNOWN), hz]
    others = [
        exact_limit(on.cut, on.tip, highest, rpm, (float(near), float(at)), quick=uneven)
        for near, at in zip(found.depth[number], found.chatter_hz[number], strict=True)
        if near < _BESIDE * exact.depth
    ]
    if uneven:  # nothing has looked for the least of them yet
        exact = min([exact, *filter(None, others)], key=lambda one: one.depth)
    # a crossing below the least limit would be one that semi-discretisation has seen
    after = [one for one in others if one is not None and one.depth > (1 + _SAME) * exact.depth]
    low, high = relative_band([exact, *after], on.uncertain, on.coefficients, on.draws)
    heard = exact.strongest_hz if on.in_time is None or uneven else exact.chatter_hz
    return [exact.depth, exact.depth * low, exact.depth * high, heard]


def _highest_hz(on: Cutting, found: Limits) -> float:
    """The highest frequency at which the tool chatters, or that matters where it does not."""
    chatter = found.chatter_hz[np.isfinite(found.chatter_hz)]
    return float(chatter.max()) if chatter.size else on.highest_hz


def _several(on: Cutting, cut: Engagement, highest: float, rpm: Array) -> Limits:
    return multi_frequency(cut, on.tip, on.lines_hz(_COARSE), highest, rpm)


def _in_time(domain: TimeDomain, rpm: Array, near: Array, most: float) -> Limits:
    """The limits at all speeds by semi-discretisation."""
    depth = np.array([domain.limit(speed, guess, most) for speed, guess in zip(rpm, near, strict=True)])
    chatter = [
        domain.chatter_hz(speed, at) if np.isfinite(at) else np.nan
        for speed, at in zip(rpm, depth, strict=True)
    ]
    return Limits(depth, np.array(chatter))


def over_feeds(on: Cutting) -> tuple[Array, Array]:
    """Feeds (f,), degrees about the spindle from the tool's own, and the least depth limit over the speeds
    (f,), m.
    """
    cut, rpm, line_hz = on.cut, on.rpm, on.lines_hz(_COARSE)
    tip = on.tip(line_hz)
    angles = np.arange(_FEEDS) * 360.0 / _FEEDS
    sin, cos, zero, one = (
        np.sin(np.radians(angles)),
        np.cos(np.radians(angles)),
        np.zeros(_FEEDS),
        np.ones(_FEEDS),
    )
    turn = np.array([[cos, sin, zero], [-sin, cos, zero], [zero, zero, one]]).transpose(2, 0, 1)[:, None]
    inverse = inverse_eigenvalues(cut.mean, turn @ tip @ np.swapaxes(turn, -1, -2))
    if cut.pitches:
        uneven = [uneven_crossings(one, line_hz, cut.pitches, rpm, 1) for one in inverse]
        return angles, np.array([one.depth.min() for one in uneven])
    return angles, zeroth_order(inverse, line_hz, cut.teeth, rpm).depth.min(axis=-1)


def tip_receptance(on: Cutting, line_hz: Array) -> tuple[Complex, Array]:
    """Receptance of the tip (lines, 3, 3), m/N, along the tool's axes, and half its 95 % band."""
    return on.tip(line_hz), on.uncertain.half_band(line_hz)

"""The depth limit at one spindle speed, quickly: searched for with coarse steps, then exact."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from identify.core.arrays import Array
from identify.machining.exact_limit import ExactLimit, exact_limit
from identify.machining.lobes import crossings, inverse_eigenvalues
from identify.machining.mounted import Mounted
from identify.machining.multi_frequency import multi_frequency
from identify.machining.semi_discretization import TimeDomain

_LINES = 200


def limit_at(on: Mounted, rpm: float) -> tuple[float, float, ExactLimit | None]:
    """Depth, m, and frequency of chatter, Hz, infinite and NaN where there is none up to the largest depth;
    and the exact limit, None where the one found is not exact.
    """
    structure, cut, most = on.here, on.cut, on.tool.max_depth_mm / 1e3
    line_hz = on.lines_hz(_LINES)
    inverse = inverse_eigenvalues(cut.mean, on.tip(line_hz))
    near = crossings(inverse, line_hz, cut.teeth, np.array([rpm]), 1)
    guess, highest = float(near.depth[0, 0]), float(near.chatter_hz[0, 0])
    guess = guess if np.isfinite(guess) else most
    highest = highest if np.isfinite(highest) else float(line_hz.max() / 3)
    if on.coupled is not None or cut.pitches:
        return _over_frequencies(on, rpm, line_hz, highest)
    if not structure.real:  # viscous, of the same size at that frequency, to find the limit in time
        damping = structure.damping + structure.stiffness.imag / (2 * np.pi * highest)
        structure = replace(structure, damping=damping, stiffness=structure.stiffness.real)
    domain = TimeDomain(structure, cut, highest, coarse=True)
    depth = domain.limit(rpm, guess, most)
    if not np.isfinite(depth):
        return np.inf, np.nan, None
    hz = domain.chatter_hz(rpm, depth)
    exact = exact_limit(cut, on.tip, highest, rpm, (depth, hz), quick=True)
    if exact is None:
        return replace(domain, coarse=False).limit(rpm, depth, most), hz, None
    return exact.depth, exact.chatter_hz, exact


def _over_frequencies(
    on: Mounted, rpm: float, line_hz: Array, highest: float
) -> tuple[float, float, ExactLimit | None]:
    """The same where there is no equation in time, by the multi-frequency solution."""
    found = multi_frequency(on.cut, on.tip, line_hz, highest, np.array([rpm]))
    depth, hz = float(found.depth[0]), float(found.chatter_hz[0])
    if not depth <= on.tool.max_depth_mm / 1e3:
        return np.inf, np.nan, None
    exact = exact_limit(on.cut, on.tip, highest, rpm, (depth, hz), quick=True)
    return (depth, hz, None) if exact is None else (exact.depth, exact.chatter_hz, exact)

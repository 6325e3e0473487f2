"""The result of `identify stability`: depth limits of a cut, as kept in its HDF5 file."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from identify.core.arrays import Array, Texts
from identify.results.header import Header


@dataclass(frozen=True)
class DepthLimits:
    """Depth limits, m, at spindle speeds (s,), inf where there is none up to the largest depth, with their
    95 % limits, and the frequency, Hz, of the chatter that begins there, NaN where there is none.

    zeroth_order: the same from the mean of the cut alone, of which the bands' relative width is.
    """

    rpm: Array
    depth_m: Array
    low_95: Array
    high_95: Array
    chatter_hz: Array
    zeroth_order: Array


@dataclass(frozen=True)
class LimitChecks:
    """The limits, m, at some of the speeds (c,), by each method; semi_discretization is None where there is
    hysteretic damping, which no equation in time has.
    """

    rpm: Array
    zeroth_order: Array
    multi_frequency: Array
    semi_discretization: Array | None


@dataclass(frozen=True)
class TipReceptance:
    """Receptance of the tip (lines, 3, 3), m/N, along feed, normal and spindle axis, and half its 95 %
    band.
    """

    line_hz: Array
    receptance: NDArray[np.complex64]
    band_95: NDArray[np.float32]


@dataclass(frozen=True, kw_only=True)
class StabilityResult(Header):
    """Depth limits of a tool on a fitted model at one posture.

    axes (3, 3): feed, normal and spindle axis (from the tip to the spindle) as rows, in the base's axes;
    engagement_deg (2,): entry and exit of a tooth; cutting (3,), N/m^2: tangential, radial, axial; coupling
    (4,): depth limit of mode coupling with its 95 % limits, m, and its frequency, Hz; feed_deg (f,): feeds
    turned about the spindle from the tool's own, and feed_depth_m (f,): the least limit over the speeds.
    """

    KIND: ClassVar[str] = "stability"
    model: str
    tool: str
    place: str
    source: str
    joints: Texts
    posture_deg: Array
    tip_m: Array
    axes: Array
    engagement_deg: Array
    cutting: Array
    max_depth_m: float
    draws: int
    limits: DepthLimits
    checks: LimitChecks
    coupling: Array
    feed_deg: Array
    feed_depth_m: Array
    mode_hz: Array
    mode_damping: Array
    tip: TipReceptance

"""The result of `identify stability`: depth limits of a cut, as kept in its HDF5 file."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

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

    rpm: Annotated[Array, "rpm"]
    depth_m: Annotated[Array, "rpm"]
    low_95: Annotated[Array, "rpm", "m"]
    high_95: Annotated[Array, "rpm", "m"]
    chatter_hz: Annotated[Array, "rpm"]
    zeroth_order: Annotated[Array, "rpm", "m"]


@dataclass(frozen=True)
class LimitChecks:
    """The limits, m, at some of the speeds (c,), by each method; semi_discretization is None where there is
    hysteretic damping, which no equation in time has.
    """

    rpm: Annotated[Array, "rpm"]
    zeroth_order: Annotated[Array, "rpm", "m"]
    multi_frequency: Annotated[Array, "rpm", "m"]
    semi_discretization: Annotated[Array | None, "rpm", "m"]


@dataclass(frozen=True)
class TipReceptance:
    """Receptance of the tip (lines, 3, 3), m/N, along feed, normal and spindle axis, and half its 95 %
    band.
    """

    line_hz: Annotated[Array, "line_hz"]
    receptance: Annotated[NDArray[np.complex64], "line_hz tool_response tool_force", "m/N"]
    band_95: Annotated[NDArray[np.float32], "line_hz tool_response tool_force", "m/N"]


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
    joints: Annotated[Texts, "joints"]
    posture_deg: Annotated[Array, "joints"]
    tip_m: Annotated[Array, "axis"]
    axes: Annotated[Array, "tool_axis axis"]
    engagement_deg: Annotated[Array, "entry_and_exit"]
    cutting: Annotated[Array, "cutting_direction", "N/m^2"]
    max_depth_m: float
    draws: int
    limits: DepthLimits
    checks: LimitChecks
    coupling: Annotated[Array, "coupling_value", "m, the last Hz"]
    feed_deg: Annotated[Array, "feed_deg"]
    feed_depth_m: Annotated[Array, "feed_deg"]
    mode_hz: Annotated[Array, "mode"]
    mode_damping: Annotated[Array, "mode"]
    tip: TipReceptance

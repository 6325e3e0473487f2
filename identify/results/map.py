"""The result of `identify map`: a fitted model over many postures, as kept in its HDF5 file (layout and
writer: `identify.results.file`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from identify.core.arrays import Array, Texts
from identify.results.header import Header


@dataclass(frozen=True)
class PostureRows:
    """n postures, one row each: where the tool is (n, 3), m, base axes; m modes by frequency, NaN beyond
    those of a posture, each with its 95 % limits; receptance of the tool (n, lines, 3, 3), m/N, responses by
    forces along the base's axes, in single precision, and half the width of its 95 % band; compliance (n, 3,
    3): the same at rest; peak (n, 3): its largest size over the lines along each axis.
    """

    name: Texts
    posture_deg: Array
    tool_m: Array
    frequency_hz: Array
    frequency_low_95: Array
    frequency_high_95: Array
    damping_ratio: Array
    damping_low_95: Array
    damping_high_95: Array
    compliance_m_per_n: Array
    receptance_m_per_n: NDArray[np.complex64]
    band_95: NDArray[np.float32]
    peak_m_per_n: Array


SAME = ("feed_deg",)
"""Arrays of `LimitRows` that have no row a posture."""


@dataclass(frozen=True)
class LimitRows:
    """A limit at n postures and in f feed directions, (n, f), with its 95 % limits; kind: depth, m, infinite
    where there is none up to most; deflection, m; or frequency, Hz, of the first mode.

    chatter_hz, rpm (n, f): of a depth, the frequency of the chatter and the spindle speed, NaN elsewhere;
    feed_deg (f,): feeds, turned about the spindle from the tool's own; about: what it is the limit of.
    """

    kind: str
    about: str
    most: float
    feed_deg: Array
    value: Array
    low_95: Array
    high_95: Array
    chatter_hz: Array
    rpm: Array


@dataclass(frozen=True)
class MapPart:
    """Part of a map, as a worker leaves it; key says of which map."""

    KIND: ClassVar[str] = "map-part"
    layout: int
    kind: str
    key: str
    rows: PostureRows
    limit: LimitRows | None = None


@dataclass(frozen=True, kw_only=True)
class MapResult(Header):
    """A whole map: of which fit (its name and file), for which point of the robot, at which frequencies
    (lines,).
    """

    KIND: ClassVar[str] = "map"
    workers: str
    model: str
    tool: str
    joints: Texts
    line_hz: Array
    rows: PostureRows
    limit: LimitRows | None = None

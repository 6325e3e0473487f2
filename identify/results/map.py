"""The result of `identify map`: a fitted model over many postures, as kept in its HDF5 file (layout and
writer: `identify.results.file`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

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

    name: Annotated[Texts, "name"]
    posture_deg: Annotated[Array, "name joints"]
    tool_m: Annotated[Array, "name axis"]
    frequency_hz: Annotated[Array, "name mode"]
    frequency_low_95: Annotated[Array, "name mode", "Hz"]
    frequency_high_95: Annotated[Array, "name mode", "Hz"]
    damping_ratio: Annotated[Array, "name mode"]
    damping_low_95: Annotated[Array, "name mode"]
    damping_high_95: Annotated[Array, "name mode"]
    compliance_m_per_n: Annotated[Array, "name response force"]
    receptance_m_per_n: Annotated[NDArray[np.complex64], "name line_hz response force"]
    band_95: Annotated[NDArray[np.float32], "name line_hz response force", "m/N"]
    peak_m_per_n: Annotated[Array, "name axis"]


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
    most: Annotated[float, "", "see kind"]
    feed_deg: Annotated[Array, "feed_deg"]
    value: Annotated[Array, "posture feed_deg", "see kind"]
    low_95: Annotated[Array, "posture feed_deg", "see kind"]
    high_95: Annotated[Array, "posture feed_deg", "see kind"]
    chatter_hz: Annotated[Array, "posture feed_deg"]
    rpm: Annotated[Array, "posture feed_deg"]


@dataclass(frozen=True)
class CorrectionRows:
    """A map corrected by what its model leaves of measured postures, at n postures, each with 95 % limits of
    what would be measured: frequencies and damping of m modes, largest receptance along 3 axes of the base;
    NaN where nothing of the kind was measured.

    known: the share of the variance before any data that these have taken away, 0 far from all of them.
    """

    frequency_hz: Annotated[Array, "posture mode"]
    frequency_low_95: Annotated[Array, "posture mode", "Hz"]
    frequency_high_95: Annotated[Array, "posture mode", "Hz"]
    frequency_known: Annotated[Array, "posture mode"]
    damping_ratio: Annotated[Array, "posture mode"]
    damping_low_95: Annotated[Array, "posture mode"]
    damping_high_95: Annotated[Array, "posture mode"]
    damping_known: Annotated[Array, "posture mode"]
    peak_m_per_n: Annotated[Array, "posture axis"]
    peak_low_95: Annotated[Array, "posture axis", "m/N"]
    peak_high_95: Annotated[Array, "posture axis", "m/N"]
    peak_known: Annotated[Array, "posture axis"]


@dataclass(frozen=True)
class ProcessTable:
    """What was learned of each quantity (k): frequency, damping, peak, from how many numbers at how many
    postures; log odds for an error that depends on the posture, over scatter alone; its size, relative; by
    which turn of the joints it is another; its correlation between robots of a type (1: one robot); scatter.
    """

    quantity: Annotated[Texts, "quantity"]
    numbers: Annotated[NDArray[np.int_], "quantity"]
    postures: Annotated[NDArray[np.int_], "quantity"]
    log_odds: Annotated[Array, "quantity"]
    amplitude: Annotated[Array, "quantity"]
    length_deg: Annotated[Array, "quantity"]
    shared: Annotated[Array, "quantity"]
    scatter: Annotated[Array, "quantity"]


@dataclass(frozen=True)
class LeftOutTable:
    """Measured numbers (n), Hz, damping ratios or m/N, of a mode (from 1) or an axis of the sensor (1 to 3),
    beside the model and what all other postures make of it, with 95 % limits.
    """

    measurement: Annotated[Texts, "number"]
    quantity: Annotated[Texts, "number"]
    item: Annotated[NDArray[np.int_], "number"]
    measured: Annotated[Array, "number", "see quantity"]
    model: Annotated[Array, "number", "see quantity"]
    corrected: Annotated[Array, "number", "see quantity"]
    low_95: Annotated[Array, "number", "see quantity"]
    high_95: Annotated[Array, "number", "see quantity"]


@dataclass(frozen=True)
class Learnt:
    """What a map learned of measured postures; like: files of other robots of the type."""

    processes: ProcessTable
    left_out: LeftOutTable
    like: Annotated[Texts, "like_file"]


@dataclass(frozen=True)
class MapPart:
    """Part of a map, as a worker leaves it; key says of which map."""

    KIND: ClassVar[str] = "map-part"
    layout: int
    kind: str
    key: str
    rows: PostureRows
    limit: LimitRows | None = None
    correction: CorrectionRows | None = None


@dataclass(frozen=True, kw_only=True)
class MapResult(Header):
    """A whole map: of which fit (its name and file), for which point of the robot, at which frequencies
    (lines,).
    """

    KIND: ClassVar[str] = "map"
    workers: str
    model: str
    tool: str
    joints: Annotated[Texts, "joints"]
    line_hz: Annotated[Array, "line_hz"]
    rows: PostureRows
    limit: LimitRows | None = None
    correction: CorrectionRows | None = None
    learnt: Learnt | None = None

"""The result of `identify deflection`: how far forces push a tool, as kept in its HDF5 file."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from identify.core.arrays import Array, Texts
from identify.results.header import Header


@dataclass(frozen=True)
class DeflectionRows:
    """n places, one row each: joint angles, where the tip is, the force on it (n, 3), N, and its static
    deflection (n, 3), m, with its 95 % limits, all in the base's axes; size, size_low, size_high (n,): its
    length.

    compliance (n, 3): the principal compliances, m/N, the softest first, with limits, and their directions
    (n, 3, 3), as rows.  target_m (n, 3): where the tip is to be sent, and target_deg (n, joints) the joint
    angles that send it there, so that the force pushes it to where it was wanted.
    """

    name: Texts
    posture_deg: Array
    tip_m: Array
    force_n: Array
    deflection_m: Array
    low_95: Array
    high_95: Array
    size_m: Array
    size_low_95: Array
    size_high_95: Array
    compliance: Array
    compliance_low_95: Array
    compliance_high_95: Array
    directions: Array
    target_m: Array
    target_deg: Array


@dataclass(frozen=True)
class DynamicDeflection:
    """Amplitude (lines, 3), m, of the tip along the base's axes, by a force of the first place that
    oscillates, and half its 95 % band.
    """

    line_hz: Array
    amplitude_m: NDArray[np.float64]
    band_95: NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class DeflectionResult(Header):
    """Deflections of a fitted model's tool under forces, at a posture or along a path."""

    KIND: ClassVar[str] = "deflection"
    model: str
    place: str
    joints: Texts
    draws: int
    rows: DeflectionRows
    dynamic: DynamicDeflection

"""The result of `identify deflection`: how far forces push a tool, as kept in its HDF5 file."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

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

    name: Annotated[Texts, "name"]
    posture_deg: Annotated[Array, "name joints"]
    tip_m: Annotated[Array, "name axis"]
    force_n: Annotated[Array, "name axis"]
    deflection_m: Annotated[Array, "name axis"]
    low_95: Annotated[Array, "name axis", "m"]
    high_95: Annotated[Array, "name axis", "m"]
    size_m: Annotated[Array, "name"]
    size_low_95: Annotated[Array, "name", "m"]
    size_high_95: Annotated[Array, "name", "m"]
    compliance: Annotated[Array, "name principal", "m/N"]
    compliance_low_95: Annotated[Array, "name principal", "m/N"]
    compliance_high_95: Annotated[Array, "name principal", "m/N"]
    directions: Annotated[Array, "name principal axis"]
    target_m: Annotated[Array, "name axis"]
    target_deg: Annotated[Array, "name joints"]


@dataclass(frozen=True)
class DynamicDeflection:
    """Amplitude (lines, 3), m, of the tip along the base's axes, by a force of the first place that
    oscillates, and half its 95 % band.
    """

    line_hz: Annotated[Array, "line_hz"]
    amplitude_m: Annotated[NDArray[np.float64], "line_hz axis"]
    band_95: Annotated[NDArray[np.float64], "line_hz axis", "m"]


@dataclass(frozen=True, kw_only=True)
class DeflectionResult(Header):
    """Deflections of a fitted model's tool under forces, at a posture or along a path."""

    KIND: ClassVar[str] = "deflection"
    model: str
    place: str
    joints: Annotated[Texts, "joints"]
    draws: int
    rows: DeflectionRows
    dynamic: DynamicDeflection

"""The result of `identify excite`: a periodic motion and what it promises, as kept in its HDF5 file."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
from numpy.typing import NDArray

from identify.core.arrays import Array, Texts
from identify.results.header import Header


@dataclass(frozen=True)
class ExcitedTable:
    """What the motion promises for each parameter: what is expected of it (NaN where nothing is), half its
    95 % interval, that of a motion at random within the same limits (median), and of the rehearsal: 1.96
    standard deviations, mean error, shares of runs whose own and whose promised interval hold the truth;
    wanted: 1 for those that the motion was chosen for.
    """

    name: Annotated[Texts, "name"]
    unit: Annotated[Texts, "name"]
    expected: Annotated[Array, "name", "$unit"]
    promised: Annotated[Array, "name", "$unit"]
    random: Annotated[Array, "name", "$unit"]
    scatter: Annotated[Array, "name", "$unit"]
    error: Annotated[Array, "name", "$unit"]
    held: Annotated[Array, "name"]
    kept: Annotated[Array, "name"]
    wanted: Annotated[NDArray[np.int_], "name"]


@dataclass(frozen=True, kw_only=True)
class ExciteResult(Header):
    """One period: time_s (samples,), position, velocity, acceleration (samples, joints), rad, s; limits (5,
    joints): least and most angle, speed, acceleration as asked, and 1 for those that move; sine, cosine
    (harmonics, joints) and centre (joints,): the series' coefficients, rad; room_m: least distance that
    points keep inside the workspace, NaN where there is none; random_ratio, come_true: medians over what is
    wanted of random over promised, and of rehearsed over promised.
    """

    KIND: ClassVar[str] = "excitation"
    target: str
    joints: Annotated[Texts, "joints"]
    time_s: Annotated[Array, "time_s"]
    position: Annotated[Array, "time_s joints", "rad"]
    velocity: Annotated[Array, "time_s joints", "rad/s"]
    acceleration: Annotated[Array, "time_s joints", "rad/s^2"]
    limits: Annotated[Array, "limit joints", "rad, rad/s, rad/s^2"]
    centre: Annotated[Array, "joints", "rad"]
    sine: Annotated[Array, "harmonic joints", "rad"]
    cosine: Annotated[Array, "harmonic joints", "rad"]
    period_s: float
    periods: int
    draws: int
    room_m: float
    random_ratio: float
    come_true: float
    promised: ExcitedTable

"""The result of `identify plan`: a test to be done, as kept in its HDF5 file."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, ClassVar

import numpy as np
from numpy.typing import NDArray

from identify.core.arrays import Array, Texts
from identify.results.header import Header
from identify.results.tables import Geometry, Modes


@dataclass(frozen=True)
class PromisedTable:
    """What the test promises for each parameter: its value, and half its 95 % interval relative to it: now
    (inf where nothing is known), after this test, and after a test of the same size at random (median).
    """

    name: Annotated[Texts, "name"]
    unit: Annotated[Texts, "name"]
    value: Annotated[Array, "name", "$unit"]
    now: Annotated[Array, "name"]
    promised: Annotated[Array, "name"]
    random: Annotated[Array, "name"]


@dataclass(frozen=True)
class Worth:
    """By how much the intervals widen, at the median, where one posture (q,), impact (i,) or sensor (s,) is
    left out; infinite where it is the only one.
    """

    postures: Annotated[Array, "postures"]
    impacts: Annotated[Array, "impacts"]
    sensors: Annotated[Array, "sensors"]


@dataclass(frozen=True)
class PlannedPlace:
    """The robot at a posture of the test, with the modes to be expected there."""

    name: str
    geometry: Geometry
    modes: Modes


@dataclass(frozen=True, kw_only=True)
class PlanResult(Header):
    """Postures (q, joints), impacts as channels, sensors with their nodes, names, links, places (s, 3), m, in
    the link's frame, and axes (s, 3, 3), as rows.

    level (q, i, s): RMS accelerance expected over the band, m/s^2/N; noise_floor: standard deviation of its
    real part, m/s^2/N; candidates (3,): postures, impacts and sensors that it was chosen from; random_ratio:
    median of the random tests' intervals over the promised ones; study: the study to be filled.  worth, and
    places by name of the measurement: None and empty in files of before they were kept.
    """

    KIND: ClassVar[str] = "plan"
    criterion: str
    joints: Annotated[Texts, "joints"]
    posture_deg: Annotated[Array, "posture joints"]
    impacts: Annotated[Texts, "impacts"]
    sensors: Annotated[NDArray[np.int_], "sensors"]
    sensor_names: Annotated[Texts, "sensors"]
    sensor_links: Annotated[Texts, "sensors"]
    sensor_m: Annotated[Array, "sensors axis"]
    sensor_axes: Annotated[Array, "sensors direction axis"]
    level: Annotated[Array, "posture impacts sensors", "m/s^2/N"]
    noise_floor: Annotated[float, "", "m/s^2/N"]
    band_hz: Annotated[Array, "edge"]
    resolution_hz: float
    candidates: Annotated[NDArray[np.int_], "of"]
    random_ratio: float
    promised: PromisedTable
    study: str
    worth: Worth | None = None
    places: dict[str, PlannedPlace] = field(default_factory=dict)

"""The result of `identify fit` on a study of joints, as it is kept in its HDF5 file (layout and writer:
`identify.results.file`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from identify.core.arrays import Array, Texts
from identify.results.header import Header


@dataclass(frozen=True)
class JointValues:
    """Values (v) with 95 % intervals; status as in `identify.joints.intervals`; expected: what the robot's
    description says, or NaN.
    """

    name: Annotated[Texts, "name"]
    unit: Annotated[Texts, "name"]
    value: Annotated[Array, "name", "$unit"]
    low_95: Annotated[Array, "name", "$unit"]
    high_95: Annotated[Array, "name", "$unit"]
    status: Annotated[Texts, "name"]
    expected: Annotated[Array, "name", "$unit"]
    meaning: Annotated[Texts, "name"]


@dataclass(frozen=True)
class Series:
    """Points or a line: x (n,), y (n,) in the units of the panel, gaps as NaN; look: `points`, `noisy` (a
    thin line) or `line`.
    """

    look: str
    x: Annotated[Array, "x", "$x_unit"]
    y: Annotated[Array, "x", "$y_unit"]


@dataclass(frozen=True)
class Panel:
    """What was measured and the identified curve over it, in SI units."""

    x_label: str
    x_unit: str
    y_label: str
    y_unit: str
    series: dict[str, Series]


@dataclass(frozen=True)
class CurveResult:
    """One identified curve.  rms: of what is left, in `unit`; said: how it was done, in sentences; notes:
    warnings; robot: the robot's description with the identified bodies, the text of its file, where the curve
    is of bodies.
    """

    title: str
    kind: str
    unit: str
    rms: Annotated[float, "", "$unit"]
    samples: int
    values: JointValues
    panels: dict[str, Panel]
    said: Annotated[Texts, "statement"]
    notes: Annotated[Texts, "curve_note"]
    robot: str = ""


@dataclass(frozen=True, kw_only=True)
class JointsResult(Header):
    """A whole run, a curve for each entry of `curves`."""

    KIND: ClassVar[str] = "joints"
    curves: dict[str, CurveResult]

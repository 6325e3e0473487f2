"""Read a serial arm from a Denavit-Hartenberg table in YAML.

    name: two-link arm
    convention: standard            # or modified
    gravity_m_s2: [0, 0, -9.81]     # in the axes of the ground; this is the default
    base_pose: {xyz_m: [0, 0, 0.6], rpy_deg: [0, 0, 0]}   # frame 0 on the frame `ground`; default: there
    # the inertia of the base may be left out
    base: {name: base, mass_kg: 90, centre_m: [0, 0, 0.1], inertia_kg_m2: [2, 2, 3, 0, 0, 0]}
    joints:                         # one row of the table each
      - {name: joint1, theta_offset_deg: 0, d_m: 0.5, a_m: 0.2, alpha_deg: -90, limits_deg: [-170, 170]}
      - {name: joint2, theta_offset_deg: -90, d_m: 0, a_m: 0.7, alpha_deg: 0}
    links:                          # link i is moved by joint i; its inertial data are in its frame i
      - {name: shoulder, mass_kg: 60, centre_m: [0, 0.1, 0], inertia_kg_m2: [1.5, 1.2, 1.1, 0, 0, 0]}
      - {name: arm, mass_kg: 40, centre_m: [-0.3, 0, 0], inertia_kg_m2: [[0.4,0,0], [0,1.9,0], [0,0,1.9]]}
    frames:                         # further frames, each fixed to a link
      - {name: flange, link: arm, xyz_m: [0, 0, 0.1], rpy_deg: [0, 90, 0]}

Row i of the table takes frame i-1 to frame i at joint angle q by Rz(q + theta_offset) Tz(d) Tx(a) Rx(alpha)
in the standard convention (Denavit and Hartenberg 1955; Paul 1981), and by Rx(alpha) Tx(a) Rz(q +
theta_offset) Tz(d) in the modified one (Craig 1986), where alpha and a of row i are alpha_(i-1) and a_(i-1).
An inertia is about the centre of mass, as a matrix or as [xx, yy, zz, xy, xz, yz] with the products as the
matrix has them. The angles of rpy_deg are about the fixed x, y, z axes in that order, as in URDF.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from reprlib import repr as shortened
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BeforeValidator, Field, ValidationError

from identify.core.arrays import Array
from identify.core.config import Settings
from identify.core.errors import InputError, InputErrors
from identify.core.yaml_input import line_of, plain, read_yaml_file
from identify.robot.description import Joint, Link, Robot, as_base, inertia_fault
from identify.robot.pose import inverse, pose
from identify.robot.units import SI, RobotUnits

Key = tuple[str | int, ...]
Fault = tuple[Key, str, str]
"""Key, what was found, what was expected."""
GROUND = "ground"
"""The frame that base_pose places the base in."""
_PHYSICAL = "a mass and inertia that a rigid body can have"
_SIX = ("xx", "yy", "zz", "xy", "xz", "yz")
Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Vector = tuple[Number, Number, Number]
Name = Annotated[str, Field(min_length=1)]


def read_dh(
    path: Path,
    *,
    unknown_bodies: bool = False,
    gravity: Sequence[float] | None = None,
    units: RobotUnits = SI,
) -> Robot:
    """The arm in a Denavit-Hartenberg file; a base without inertia gets mass 0.

    unknown_bodies: masses and inertias of zero are allowed, of bodies that are not known; gravity: in the
    axes of the ground, m/s^2, in place of that of the file; units: those of the file.

    Raises InputError for a file that cannot be read and InputErrors with every other fault: key, line, what
    was found and expected.
    """
    data = read_yaml_file(path, "a Denavit-Hartenberg table in YAML")
    if not isinstance(data, Mapping):
        expected = "`convention`, `joints`, `links` and the other keys of a Denavit-Hartenberg table"
        raise InputError(path.name, "not a mapping of keys", expected, "see docs/descriptions.md")
    try:
        table = DhTable.model_validate(plain(data))
    except ValidationError as error:
        raise InputErrors(
            [
                _explain(_where(path, data, fault["loc"]), fault["msg"], fault["input"])
                for fault in error.errors()
            ]
        ) from error
    found_faults = [
        InputError(_where(path, data, key), found, expected)
        for key, found, expected in faults(table, unknown_bodies=unknown_bodies)
    ]
    if found_faults:
        raise InputErrors(found_faults)
    pulled = table if gravity is None else table.model_copy(update={"gravity_m_s2": gravity})
    return units.robot(_robot(pulled))


def _robot(table: DhTable) -> Robot:
    base = table.base
    names = (base.name, *(link.name for link in table.links))
    joints = tuple(
        _joint(table.convention, row, *names[number : number + 2]) for number, row in enumerate(table.joints)
    )
    at = table.base_pose.matrix()
    frames = {GROUND: (base.name, inverse(at))} if base.name != GROUND else {}
    frames.update({frame.name: (frame.link, frame.matrix()) for frame in table.frames})
    links = (base.link(), *(link.link() for link in table.links))
    return Robot(table.name, links, joints, frames, at[:3, :3].T @ np.array(table.gravity_m_s2))


def _joint(convention: str, row: DhRow, parent: str, child: str) -> Joint:
    offset, twist = np.radians(row.theta_offset_deg), np.radians(row.alpha_deg)
    lower, upper = np.radians(row.limits_deg) if row.limits_deg else (-np.inf, np.inf)
    turned, twisted = pose((0, 0, row.d_m), (0, 0, offset)), pose((row.a_m, 0, 0), (twist, 0, 0))
    # Rz and Tz commute, so the joint may turn after the shift d; Rx and Tx too.
    if convention == "modified":
        return Joint(
            row.name, parent, child, twisted @ turned, np.array([0.0, 0.0, 1.0]), lower=lower, upper=upper
        )
    return Joint(row.name, parent, child, turned, np.array([0.0, 0.0, 1.0]), twisted, lower, upper)


def _explain(where: str, message: str, value: object) -> InputError:
    if message == "Field required":
        return InputError(where, "this key is missing", fix="add it")
    if message == "Extra inputs are not permitted":
        return InputError(where, "unknown key", fix="remove it or correct its spelling")
    return InputError(where, shortened(value), message.removeprefix("Input should be "))


def _where(path: Path, data: Any, key: Key) -> str:
    """File, line and key; the line is that of the innermost part of the key that the file has."""
    line = line_of(data, list(key)) or " line 1"
    return f"{path.name}{line}, {'.'.join(str(part) for part in key)}"


def _as_matrix(value: object) -> object:
    if (
        isinstance(value, list)
        and len(value) == len(_SIX)
        and not any(isinstance(entry, list) for entry in value)
    ):
        xx, yy, zz, xy, xz, yz = value
        return [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]
    return value


Matrix = Annotated[tuple[Vector, Vector, Vector], BeforeValidator(_as_matrix)]


class DhRow(Settings):
    """One row of the table: angles in degrees, lengths in metres."""

    name: Name
    d_m: Number
    a_m: Number
    alpha_deg: Number
    theta_offset_deg: Number = 0.0
    limits_deg: tuple[Number, Number] | None = None


class LinkTable(Settings):
    """Mass, centre of mass and inertia about it, in the link's frame."""

    name: Name
    mass_kg: Number
    centre_m: Vector
    inertia_kg_m2: Matrix

    def link(self) -> Link:
        """The rigid body."""
        return Link(self.name, self.mass_kg, np.array(self.centre_m), np.array(self.inertia_kg_m2))


class BaseTable(Settings):
    """The base link; its inertia may be left out as a whole where the base never moves."""

    name: Name = "base"
    mass_kg: Number | None = None
    centre_m: Vector | None = None
    inertia_kg_m2: Matrix | None = None

    def link(self) -> Link:
        """The rigid body, of mass 0 where no inertia or one of zero is given."""
        if self.mass_kg is None or self.centre_m is None or self.inertia_kg_m2 is None:
            return Link(self.name, 0.0, np.zeros(3), np.zeros((3, 3)))
        own = Link(self.name, self.mass_kg, np.array(self.centre_m), np.array(self.inertia_kg_m2))
        return as_base(own)


class PoseTable(Settings):
    """A shift and fixed-axis rotations."""

    xyz_m: Vector = (0.0, 0.0, 0.0)
    rpy_deg: Vector = (0.0, 0.0, 0.0)

    def matrix(self) -> Array:
        """The pose (4, 4)."""
        return pose(self.xyz_m, np.radians(self.rpy_deg))


class FrameTable(PoseTable):
    """A frame fixed to a link."""

    name: Name
    link: Name


class DhTable(Settings):
    """The whole file."""

    name: Name
    convention: Literal["standard", "modified"]
    joints: Annotated[tuple[DhRow, ...], Field(min_length=1)]
    links: tuple[LinkTable, ...]
    base: BaseTable = BaseTable()
    base_pose: PoseTable = PoseTable()
    frames: tuple[FrameTable, ...] = ()
    gravity_m_s2: Vector = (0.0, 0.0, -9.81)


def faults(table: DhTable, *, unknown_bodies: bool = False) -> list[Fault]:
    """Everything a single value cannot show: counts, inertias that no body can have (but for zero where
    bodies are not known), crossed limits, names given twice or unknown.
    """
    found: list[Fault] = []
    if len(table.links) != len(table.joints):
        count = f"{len(table.links)} links for {len(table.joints)} joints"
        found.append((("links",), count, "one link per joint (the base is given under base)"))
    base = table.base
    given = [value is not None for value in (base.mass_kg, base.centre_m, base.inertia_kg_m2)]
    if any(given) and not all(given):
        found.append(
            (
                ("base",),
                "only a part of the inertia is given",
                "mass_kg, centre_m and inertia_kg_m2, or none of them",
            )
        )
    elif base.link().mass != 0 and (fault := inertia_fault(base.link())):
        found.append((("base",), fault, _PHYSICAL))
    for number, link in enumerate(table.links):
        if fault := inertia_fault(link.link(), unknown=unknown_bodies):
            found.append((("links", number), f"link {link.name!r}: {fault}", _PHYSICAL))
    for number, row in enumerate(table.joints):
        if row.limits_deg and row.limits_deg[0] > row.limits_deg[1]:
            found.append(
                (
                    ("joints", number, "limits_deg"),
                    f"limits {row.limits_deg[0]:g}, {row.limits_deg[1]:g}",
                    "lower <= upper",
                )
            )
    return found + _name_faults(table)


def _name_faults(table: DhTable) -> list[Fault]:
    links = [table.base.name, *(link.name for link in table.links)]
    named: list[tuple[Key, str]] = [(("base", "name"), table.base.name)]
    named += [(("links", number, "name"), link.name) for number, link in enumerate(table.links)]
    named += [(("frames", number, "name"), frame.name) for number, frame in enumerate(table.frames)]
    found = _doubled(named, {GROUND} - {table.base.name}, "link or frame")
    found += _doubled(
        [(("joints", number, "name"), row.name) for number, row in enumerate(table.joints)], set(), "joint"
    )
    for number, frame in enumerate(table.frames):
        if frame.link not in links:
            found.append(
                (("frames", number, "link"), f"unknown link {frame.link!r}", "one of " + ", ".join(links))
            )
    return found


def _doubled(named: list[tuple[Key, str]], taken: set[str], what: str) -> list[Fault]:
    found: list[Fault] = []
    for key, name in named:
        if name in taken:
            found.append((key, f"a second {what} named {name!r}", "a name of its own for each"))
        taken.add(name)
    return found

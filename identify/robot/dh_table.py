"""The contents of a Denavit-Hartenberg file as a checked table; dh.py describes the format and makes a robot
of it.
"""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field

from identify.core.arrays import Array
from identify.robot.description import Link, as_base, inertia_fault
from identify.robot.pose import pose

Key = tuple[str | int, ...]
Fault = tuple[Key, str, str]
"""Key, what was found, what was expected."""

GROUND = "ground"
"""The frame that base_pose places the base in."""

_PHYSICAL = "a mass and inertia that a rigid body can have"
_SIX = ("xx", "yy", "zz", "xy", "xz", "yz")


def _as_matrix(value: object) -> object:
    if (
        isinstance(value, list)
        and len(value) == len(_SIX)
        and not any(isinstance(entry, list) for entry in value)
    ):
        xx, yy, zz, xy, xz, yz = value
        return [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]
    return value


Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Vector = tuple[Number, Number, Number]
Matrix = Annotated[tuple[Vector, Vector, Vector], BeforeValidator(_as_matrix)]
Name = Annotated[str, Field(min_length=1)]


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class DhRow(_Table):
    """One row of the table: angles in degrees, lengths in metres."""

    name: Name
    d_m: Number
    a_m: Number
    alpha_deg: Number
    theta_offset_deg: Number = 0.0
    limits_deg: tuple[Number, Number] | None = None


class LinkTable(_Table):
    """Mass, centre of mass and inertia about it, in the link's frame."""

    name: Name
    mass_kg: Number
    centre_m: Vector
    inertia_kg_m2: Matrix

    def link(self) -> Link:
        """The rigid body."""
        return Link(self.name, self.mass_kg, np.array(self.centre_m), np.array(self.inertia_kg_m2))


class BaseTable(_Table):
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


class PoseTable(_Table):
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


class DhTable(_Table):
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

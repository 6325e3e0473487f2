"""The elements of a URDF file as records, each with the line it stands on; the tree they form is read in
urdf.py.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from identify.core.arrays import Array
from identify.core.errors import InputError
from identify.core.text_input import LARGEST
from identify.core.xml_input import Lines
from identify.robot.description import Link
from identify.robot.pose import pose, seen_from

MOVING = ("revolute", "continuous")
MOMENTS = {"ixx": (0, 0), "ixy": (0, 1), "ixz": (0, 2), "iyy": (1, 1), "iyz": (1, 2), "izz": (2, 2)}
"""Where an inertia has what <inertia> says."""
HELD = ("fixed", "prismatic", "floating", "planar")
"""Kinds of joints that turn, and that are held where they are."""


@dataclass(frozen=True)
class Mimic:
    """That a joint follows another: its value is times that of master, plus offset."""

    master: str
    times: float
    offset: float


@dataclass(frozen=True)
class UrdfJoint:
    """A joint as written: origin (4, 4) in the parent link's frame, axis (3,), unit, in its own, of no
    meaning where the joint is fixed; where says the file, line and name.
    """

    name: str
    kind: str
    parent: str
    child: str
    origin: Array
    axis: Array
    lower: float
    upper: float
    where: str
    mimic: Mimic | None = None


@dataclass(frozen=True)
class UrdfLink:
    """A link as written: inertia in the link's frame, or None where the file gives none."""

    name: str
    inertial: Link | None
    where: str


@dataclass(frozen=True)
class UrdfDocument:
    """A parsed XML file that remembers the line of every element; made: what it is, where it is not the file
    itself; angle: the unit of its `rpy`, rad.
    """

    path: Path
    root: ElementTree.Element
    lines: Lines
    made: str = ""
    notes: tuple[str, ...] = ()
    angle: float = 1.0

    def where(self, element: ElementTree.Element, owner: str = "") -> str:
        """File, line and element, for an error."""
        name = element.get("name")
        label = f"<{element.tag}" + (f' name="{name}">' if name else ">") + (f" of {owner}" if owner else "")
        return f"{self.path.name}{self.made} line {self.lines[element]}, {label}"

    def text(self, element: ElementTree.Element, key: str, owner: str = "") -> str:
        """A required attribute; a missing or empty one is an InputError."""
        value = element.get(key, "").strip()
        if not value:
            raise InputError(
                self.where(element, owner),
                f'attribute "{key}" is missing',
                fix=f'write {key}="..." in this element',
            )
        return value

    def numbers(self, element: ElementTree.Element, key: str, count: int, owner: str) -> list[float]:
        """`count` finite numbers in a required attribute."""
        text = self.text(element, key, owner)
        try:
            values = [float(word) for word in text.split()]
        except ValueError:
            values = []
        if len(values) != count or not np.all(np.abs(values) < LARGEST):
            expected = f"{count} finite number{'s' * (count > 1)}"
            raise InputError(self.where(element, owner), f'{key}="{text}"', expected)
        return values

    def child(self, element: ElementTree.Element, tag: str, owner: str) -> ElementTree.Element:
        """A required child element."""
        found = self.only(element, tag)
        if found is None:
            raise InputError(
                self.where(element), f"element <{tag}> is missing", fix=f"add <{tag} .../> to {owner}"
            )
        return found

    def only(self, element: ElementTree.Element, tag: str) -> ElementTree.Element | None:
        """A child element, None where there is none; two are an InputError."""
        found = element.findall(tag)
        if len(found) > 1:
            raise InputError(self.where(found[1], f"<{element.tag}>"), "a second one", "one", "remove one")
        return found[0] if found else None

    def origin(self, element: ElementTree.Element, owner: str) -> Array:
        """Pose (4, 4) of an optional <origin>; the identity where there is none, as the format says."""
        found = self.only(element, "origin")
        if found is None:
            return np.eye(4)
        xyz, rpy = (
            self.numbers(found, key, 3, owner) if key in found.attrib else [0.0, 0.0, 0.0]
            for key in ("xyz", "rpy")
        )
        return pose(xyz, self.angle * np.array(rpy))

    @property
    def largest_turn(self) -> float:
        """The largest angle of any `rpy`, rad; of what is no number 0."""
        found = [0.0]
        for element in self.root.iter("origin"):
            with suppress(ValueError):
                found += [abs(float(word)) for word in element.get("rpy", "").split()]
        return self.angle * max(found)


def links(document: UrdfDocument) -> dict[str, UrdfLink]:
    """Every <link> by name; a name used twice is an InputError."""
    found: dict[str, UrdfLink] = {}
    for element in document.root.findall("link"):
        name, where = document.text(element, "name"), document.where(element)
        if name in found:
            raise InputError(where, f"a second link named {name!r}", fix="give every link its own name")
        found[name] = UrdfLink(name, _inertial(document, element, name), where)
    return found


def joints(document: UrdfDocument) -> list[UrdfJoint]:
    """Every <joint>, in the order of the file; a name used twice is an InputError."""
    found: dict[str, UrdfJoint] = {}
    for element in document.root.findall("joint"):
        joint = _joint(document, element)
        if joint.name in found:
            raise InputError(
                joint.where, f"a second joint named {joint.name!r}", fix="give every joint its own name"
            )
        found[joint.name] = joint
    return list(found.values())


def _inertial(document: UrdfDocument, link: ElementTree.Element, name: str) -> Link | None:
    element, owner = document.only(link, "inertial"), f"link {name!r}"
    if element is None:
        return None
    mass = document.numbers(document.child(element, "mass", owner), "value", 1, owner)[0]
    tensor = document.child(element, "inertia", owner)
    xx, yy, zz, xy, xz, yz = (
        document.numbers(tensor, key, 1, owner)[0] for key in ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
    )
    own = Link(name, mass, np.zeros(3), np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))
    return seen_from(own, document.origin(element, owner))


def _joint(document: UrdfDocument, element: ElementTree.Element) -> UrdfJoint:
    name, kind, where = (
        document.text(element, "name"),
        document.text(element, "type"),
        document.where(element),
    )
    owner = f"joint {name!r}"
    if kind not in (*MOVING, *HELD):
        raise InputError(where, f'unknown joint type "{kind}"', ", ".join((*MOVING, *HELD)))
    parent, child = (
        document.text(document.child(element, tag, owner), "link", owner) for tag in ("parent", "child")
    )
    limited = kind in ("revolute", "prismatic")
    lower, upper = _limits(document, element, owner) if limited else (-np.inf, np.inf)
    return UrdfJoint(
        name,
        kind,
        parent,
        child,
        document.origin(element, owner),
        _axis(document, element, owner) if kind in (*MOVING, "prismatic") else np.array([1.0, 0.0, 0.0]),
        lower,
        upper,
        where,
        None if kind == "fixed" else _mimic(document, element, owner),
    )


def _mimic(document: UrdfDocument, joint: ElementTree.Element, owner: str) -> Mimic | None:
    element = document.only(joint, "mimic")
    if element is None:
        return None
    times, offset = (
        document.numbers(element, key, 1, owner)[0] if key in element.attrib else default
        for key, default in (("multiplier", 1.0), ("offset", 0.0))
    )
    return Mimic(document.text(element, "joint", owner), times, offset)


def _axis(document: UrdfDocument, joint: ElementTree.Element, owner: str) -> Array:
    element = document.only(joint, "axis")
    if element is None:
        return np.array([1.0, 0.0, 0.0])  # the default of the format
    axis = np.array(document.numbers(element, "xyz", 3, owner))
    length = float(np.linalg.norm(axis))
    if length < 1e-12:
        raise InputError(
            document.where(element, owner),
            "the axis has no direction (its length is zero)",
            "three numbers, not all zero",
        )
    return axis / length


def _limits(document: UrdfDocument, joint: ElementTree.Element, owner: str) -> tuple[float, float]:
    element = document.only(joint, "limit")
    if element is None or not {"lower", "upper"} & set(element.attrib):
        return -np.inf, np.inf
    lower, upper = (
        document.numbers(element, key, 1, owner)[0] if key in element.attrib else 0.0
        for key in ("lower", "upper")
    )
    if lower > upper:
        raise InputError(
            document.where(element, owner),
            f"lower limit {lower:g} rad above the upper limit {upper:g} rad",
            "lower <= upper",
        )
    return lower, upper

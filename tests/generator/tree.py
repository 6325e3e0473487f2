"""An arm at a posture as a tree of rigid parts with elastic coordinates: what effects change and what is
simulated.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike

from tests.generator.arm import Arm
from tests.generator.rigid import Array, Inertia


@dataclass
class Dof:
    """One elastic coordinate between a part and its parent: a hinge or a slide along `axis` (3,) through the
    part's origin.

    stiffness in N m/rad or N/m, damping in N m s/rad or N s/m, armature (kg m^2 or kg) turns with the
    coordinate without weight.
    """

    name: str
    slides: bool
    axis: Array
    stiffness: float
    damping: float
    armature: float = 0.0


@dataclass
class Part:
    """A rigid part: pose of its frame in its parent's (parent -1 is the floor), inertia in its own frame.

    dofs act in their order, the first next to the parent.
    """

    name: str
    parent: int
    position: Array
    rotation: Array
    inertia: Inertia
    dofs: list[Dof] = field(default_factory=list)


@dataclass
class Sensor:
    """A triaxial accelerometer on a part, along the part's axes."""

    name: str
    node: int
    part: int
    position: Array


@dataclass
class Strut:
    """A spring and damper from a part's point to the floor along a direction in the floor's axes (N/m, N
    s/m).
    """

    part: int
    position: Array
    direction: Array
    stiffness: float
    damping: float


@dataclass
class Tree:
    """Parts in any order; the first len(arm.links) are the links of the arm.  gravity (3,), m/s^2, in the
    floor's axes.
    """

    parts: list[Part]
    sensors: list[Sensor]
    struts: list[Strut] = field(default_factory=list)
    gravity: Array = field(default_factory=lambda: np.array([0.0, 0.0, -9.81]))

    def part(self, name: str) -> int:
        """Index of a part."""
        return [part.name for part in self.parts].index(name)

    def sensor(self, name: str) -> Sensor:
        """The sensor of that name."""
        return next(sensor for sensor in self.sensors if sensor.name == name)

    def add(
        self, name: str, link: str, position: ArrayLike, inertia: Inertia, dofs: list[Dof] | None = None
    ) -> None:
        """Put a further part on a link, its frame parallel to the link's."""
        at = np.asarray(position, dtype=float)
        self.parts.append(Part(name, self.part(link), at, np.eye(3), inertia, dofs or []))

    def dof(self, name: str) -> Dof:
        """The coordinate of that name."""
        return next(dof for part in self.parts for dof in part.dofs if dof.name == name)

    def outboard(self, number: int) -> Inertia:
        """Everything that a part carries, itself too, as one rigid body in the part's frame."""
        total = self.parts[number].inertia
        for index, part in self._children(number):
            total = total + self.outboard(index).seen_from(part.rotation, part.position)
        return total

    def outboard_about(self, name: str, axis: ArrayLike) -> float:
        """Moment of inertia (kg m^2) of all that a part carries about an axis through the part's origin, in
        the part's axes.
        """
        return self.outboard(self.part(name)).about_axis(np.zeros(3), axis)

    def _children(self, number: int) -> Iterator[tuple[int, Part]]:
        return ((index, part) for index, part in enumerate(self.parts) if part.parent == number)

    def order(self, parent: int = -1) -> Iterator[int]:
        """Indices of the parts, parents first."""
        for number, _ in self._children(parent):
            yield number
            yield from self.order(number)

    def pose(self, number: int) -> tuple[Array, Array]:
        """Rotation (3, 3) and position (3,) of a part in the floor's frame."""
        rotation, position = np.eye(3), np.zeros(3)
        while number >= 0:
            part = self.parts[number]
            rotation, position = part.rotation @ rotation, part.position + part.rotation @ position
            number = part.parent
        return rotation, position


def at_posture(arm: Arm, posture_deg: ArrayLike) -> Tree:
    """The arm held at joint angles (joints,), degrees, by its joint springs; `joint1.rz` and so on are the
    only coordinates.
    """
    angles = np.radians(np.asarray(posture_deg, dtype=float))
    parts = [Part(arm.links[0].name, -1, np.zeros(3), np.eye(3), arm.links[0].inertia)]
    for number, (joint, link) in enumerate(zip(arm.joints, arm.links[1:], strict=True)):
        drive = Dof(
            f"{joint.name}.rz", False, joint.axis, float(arm.stiffness[number]), float(arm.damping[number])
        )
        parts.append(
            Part(link.name, number, joint.xyz, joint.rotation(float(angles[number])), link.inertia, [drive])
        )
    names = [part.name for part in parts]
    sensors = [Sensor(point.name, point.node, names.index(point.link), point.xyz) for point in arm.points]
    return Tree([replace(part, dofs=list(part.dofs)) for part in parts], sensors)

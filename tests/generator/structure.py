"""Hidden effects in the structure: compliances, flexible links, resonators, masses, struts, rotors."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from tests.generator.effect import StructureEffect
from tests.generator.rigid import Array, Inertia, ball, frame_with_z, turn
from tests.generator.tree import Dof, Part, Strut, Tree

AXES = ("tx", "ty", "tz", "rx", "ry", "rz")
CLASSES = {"tilt": ("rx", "ry"), "radial": ("tx", "ty"), "axial": ("tz",)}
"""Axes of a joint by class, in a frame whose z is the joint's axis."""


class Turned(StructureEffect):
    """An effect whose axes may be turned about z; the truth of one that is not does not say so."""

    turned_deg: float

    def truth(self) -> dict[str, Any]:
        """Kind and parameters for the truth file."""
        told = super().truth()
        return told if self.turned_deg else {key: told[key] for key in told if key != "turned_deg"}


@dataclass(frozen=True)
class BaseCompliance(Turned):
    """Springs and dampers under the base link, through its origin along its axes; one number per axis.

    turned_deg: by how much the axes are turned about the base's own z.
    """

    axes: tuple[str, ...]
    stiffness: tuple[float, ...]
    damping: tuple[float, ...]
    turned_deg: float = 0.0
    kind = "base-compliance"

    @property
    def sentence(self) -> str:
        """Its axes."""
        return f"compliance of the base {', '.join(self.axes)}"

    def build(self, tree: Tree) -> None:
        """The base comes loose from the floor."""
        frame = turn([0, 0, 1], np.radians(self.turned_deg))
        tree.parts[0].dofs += _dofs("base", frame, self.axes, self.stiffness, self.damping)


@dataclass(frozen=True)
class JointCompliance(Turned):
    """Springs and dampers of a joint (1 to 6) across or along its axis; one number per axis of the class.

    turned_deg: by how much the axes are turned about the joint's own.
    """

    joint: int
    axes_class: str
    stiffness: tuple[float, ...]
    damping: tuple[float, ...]
    turned_deg: float = 0.0
    kind = "joint-compliance"

    @property
    def sentence(self) -> str:
        """Joint and class."""
        return f"joint {self.joint} {self.axes_class} {', '.join(CLASSES[self.axes_class])}"

    def build(self, tree: Tree) -> None:
        """Further coordinates outboard of the drive: they turn with the link."""
        part = tree.parts[self.joint]
        frame = frame_with_z(part.dofs[0].axis) @ turn([0, 0, 1], np.radians(self.turned_deg))
        part.dofs += _dofs(
            f"joint{self.joint}", frame, CLASSES[self.axes_class], self.stiffness, self.damping
        )


@dataclass(frozen=True)
class RelaxingJoint(StructureEffect):
    """A joint that gives way about the first axis of a class through Kelvin-Voigt elements in series: a pad
    with relaxation times, or with many in geometric sequence a fractional damper.

    inertia: of what moves, of which a small share sits between the elements, or they could not be told apart.
    """

    joint: int
    axes_class: str
    stiffness: tuple[float, ...]
    damping: tuple[float, ...]
    inertia: float
    law: str = "viscoelastic-pad"
    kind = "relaxing-joint"

    @property
    def sentence(self) -> str:
        """Joint, class and law."""
        return f"joint {self.joint} {self.axes_class} gives way as a {self.law}"

    def build(self, tree: Tree) -> None:
        """One coordinate for each element."""
        part = tree.parts[self.joint]
        frame = frame_with_z(part.dofs[0].axis)
        axis = CLASSES[self.axes_class][0]
        direction = frame[:, "xyz".index(axis[1])]
        for number, (k, c) in enumerate(zip(self.stiffness, self.damping, strict=True)):
            name = f"joint{self.joint}.{axis}" + (f".{number}" if number else "")
            between = 0.15 * self.inertia if number else 0.0
            part.dofs.append(Dof(name, axis[0] == "t", direction, k, c, between))


@dataclass(frozen=True)
class LinkFlexibility(StructureEffect):
    """A link cut into `segments` + 1 rigid pieces along a line from its origin, with bending and torsion
    hinges between them.

    along (3,) ends where the next joint sits; stiffness and damping are those of one hinge.  With stiff
    hinges mass, centre and inertia of the whole are those of the rigid link.
    """

    link: str
    along: tuple[float, float, float]
    bending_stiffness: float
    torsion_stiffness: float
    bending_damping: float
    torsion_damping: float
    segments: int = 4
    kind = "link-flexibility"

    @property
    def sentence(self) -> str:
        """The link."""
        return f"{self.link} flexible in bending and torsion, {self.segments} hinges"

    def build(self, tree: Tree) -> None:
        """Cut the part, then hand everything that it carried to the piece at the same place."""
        root = tree.part(self.link)
        axis = np.array(self.along) / np.linalg.norm(self.along)
        length = float(np.linalg.norm(self.along))
        hinges = (np.arange(self.segments) + 0.5) / self.segments * length
        edges = np.concatenate([[0.0], hinges, [length]])
        pieces = cut(tree.parts[root].inertia, axis, edges)
        carried = [part for part in tree.parts if part.parent == root]
        chain = [root, *range(len(tree.parts), len(tree.parts) + self.segments)]
        starts = np.concatenate([[0.0], hinges])
        tree.parts[root].inertia = pieces[0]
        for number in range(1, self.segments + 1):
            shift = (starts[number] - starts[number - 1]) * axis
            inertia = replace(pieces[number], centre=pieces[number].centre - starts[number] * axis)
            name = f"{self.link}.segment{number}"
            tree.parts.append(
                Part(name, chain[number - 1], shift, np.eye(3), inertia, self._hinge(name, axis))
            )
        for item in carried:
            item.parent, item.position = _place(item.position, axis, hinges, chain)
        for sensor in tree.sensors:
            if sensor.part == root:
                sensor.part, sensor.position = _place(sensor.position, axis, hinges, chain)
        for strut in tree.struts:
            if strut.part == root:
                strut.part, strut.position = _place(strut.position, axis, hinges, chain)

    def _hinge(self, name: str, axis: Array) -> list[Dof]:
        stiffness = (self.bending_stiffness, self.bending_stiffness, self.torsion_stiffness)
        damping = (self.bending_damping, self.bending_damping, self.torsion_damping)
        return _dofs(name, frame_with_z(axis), ("rx", "ry", "rz"), stiffness, damping)


@dataclass(frozen=True)
class AppendedResonator(StructureEffect):
    """A mass on a spring that slides along one axis of a link, at `position` (3,) in its frame: a hose, a
    cover, a gripper finger.
    """

    link: str
    axis: str
    position: tuple[float, float, float]
    mass_kg: float
    frequency_hz: float
    damping_ratio: float
    kind = "appended-resonator"

    @property
    def sentence(self) -> str:
        """Link, axis and frequency."""
        return f"appended resonator on {self.link} along {self.axis} at {self.frequency_hz:.1f} Hz"

    def build(self, tree: Tree) -> None:
        """A part that slides."""
        speed = 2 * np.pi * self.frequency_hz
        stiffness, damping = self.mass_kg * speed**2, 2 * self.damping_ratio * self.mass_kg * speed
        name = f"resonator_{self.link}_{self.axis}"
        slide = Dof(name, True, np.eye(3)["xyz".index(self.axis)], stiffness, damping)
        tree.add(name, self.link, self.position, ball(self.mass_kg, np.zeros(3), 0.03), [slide])


@dataclass(frozen=True)
class SoftMount(StructureEffect):
    """A gripper that is told as payload, and whose mount at `position` (3,) gives way about the axes of the
    link that carries it; nothing gives way without stiffness.

    centre (3,): of the gripper, from its mount; a ball of that radius, m.
    """

    carrier: str
    position: tuple[float, float, float]
    centre: tuple[float, float, float]
    mass_kg: float
    radius_m: float
    stiffness: tuple[float, ...] = ()
    damping: tuple[float, ...] = ()
    kind = "mount-compliance"

    @property
    def sentence(self) -> str:
        """The link."""
        return f"gripper of {self.mass_kg:.1f} kg on {self.carrier} on a soft mount"

    @property
    def body(self) -> Inertia:
        """In the axes of its link, about its mount."""
        return ball(self.mass_kg, self.centre, self.radius_m)

    def payload(self) -> dict[str, Any]:
        """As a study is told."""
        xx, yy, zz = np.diag(self.body.tensor).tolist()
        return {
            "link": self.carrier,
            "mass_kg": self.mass_kg,
            "centre_m": np.add(self.position, self.centre).round(4).tolist(),
            "inertia_kg_m2": [xx, yy, zz, 0.0, 0.0, 0.0],
        }

    def build(self, tree: Tree) -> None:
        """A part that turns."""
        dofs = _dofs(
            "gripper", np.eye(3), ("rx", "ry", "rz")[: len(self.stiffness)], self.stiffness, self.damping
        )
        tree.add("gripper", self.carrier, self.position, self.body, dofs)


@dataclass(frozen=True)
class AddedMass(StructureEffect):
    """A body fixed to a link at `position` (3,) in its frame that the robot description lacks."""

    link: str
    position: tuple[float, float, float]
    mass_kg: float
    kind = "added-mass"

    @property
    def sentence(self) -> str:
        """Mass and link."""
        return f"unmodelled mass of {self.mass_kg:.2f} kg on {self.link}"

    def build(self, tree: Tree) -> None:
        """A small ball."""
        tree.add(f"mass_{self.link}", self.link, self.position, ball(self.mass_kg, np.zeros(3), 0.04))


@dataclass(frozen=True)
class SensorMass(StructureEffect):
    """The mass (kg) of every accelerometer, left on during all impacts."""

    mass_kg: float
    kind = "sensor-mass"

    @property
    def sentence(self) -> str:
        """The mass."""
        return f"sensors of {self.mass_kg:.3f} kg at all points"

    def build(self, tree: Tree) -> None:
        """A small ball at every sensor."""
        for sensor in tree.sensors:
            tree.add(
                f"sensor_{sensor.name}",
                tree.parts[sensor.part].name,
                sensor.position,
                ball(self.mass_kg, np.zeros(3), 0.01),
            )


@dataclass(frozen=True)
class SpringToGround(StructureEffect):
    """A strut from a link's `position` (3,) to the floor along a direction (3,) in the floor's axes: a
    balancer, a hose to the ceiling.
    """

    link: str
    position: tuple[float, float, float]
    direction: tuple[float, float, float]
    stiffness: float
    damping: float
    kind = "spring-to-ground"

    @property
    def sentence(self) -> str:
        """The link."""
        return f"spring from {self.link} to the ground"

    def build(self, tree: Tree) -> None:
        """A strut without preload."""
        unit = np.array(self.direction) / np.linalg.norm(self.direction)
        tree.struts.append(
            Strut(tree.part(self.link), np.array(self.position), unit, self.stiffness, self.damping)
        )


@dataclass(frozen=True)
class RotorInertia(StructureEffect):
    """n^2 J (kg m^2) of a rotor that turns with the drive coordinate of a joint."""

    joint: int
    reflected_inertia: float
    kind = "rotor-inertia"

    @property
    def sentence(self) -> str:
        """The joint."""
        return f"rotor inertia {self.reflected_inertia:.3g} kg m^2 on joint {self.joint}"

    def build(self, tree: Tree) -> None:
        """Inertia without weight on the drive."""
        tree.dof(f"joint{self.joint}.rz").armature = self.reflected_inertia


@dataclass(frozen=True)
class HeldRotor(StructureEffect):
    """A rotor of n^2 J (kg m^2) behind the gear of a joint, which its servo holds by a spring (N m/rad) and a
    damper (N m s/rad).
    """

    joint: int
    reflected_inertia: float
    stiffness: float
    damping: float
    kind = "held-rotor"

    @property
    def sentence(self) -> str:
        """The joint."""
        return f"rotor of joint {self.joint} held by {self.stiffness:.3g} N m/rad"

    def build(self, tree: Tree) -> None:
        """A part of next to no mass that turns about the joint's axis, and carries the link."""
        name, part = f"joint{self.joint}.rotor", tree.parts[self.joint]
        turns = Dof(name, False, part.dofs[0].axis, self.stiffness, self.damping, self.reflected_inertia)
        place = part.parent, part.position, part.rotation
        part.parent, part.position, part.rotation = len(tree.parts), np.zeros(3), np.eye(3)
        tree.parts.append(Part(name, *place, ball(1e-6, np.zeros(3), 0.01), [turns]))


def cut(body: Inertia, axis: Array, edges: Array) -> list[Inertia]:
    """Pieces between edges (n + 1,) along `axis` with masses in proportion to their lengths; together they
    are the body.

    The pieces' centres are spread along the axis about the body's centre as far as its inertia allows, and
    not at all where its moments are nearly those of a plate.
    """
    shares = np.diff(edges) / (edges[-1] - edges[0])
    middles = (edges[1:] + edges[:-1]) / 2
    offsets = middles - shares @ middles
    across = np.eye(3) - np.outer(axis, axis)
    spread = body.mass * float(shares @ offsets**2)
    scales = 0.95 ** np.arange(100)
    allowed = (one for one in scales if _physical(body.tensor - one**2 * spread * across, 0.02))
    scale = float(next(allowed, 0.0))
    rest = body.tensor - scale**2 * spread * across
    return [
        Inertia(body.mass * s, body.centre + scale * offset * axis, s * rest)
        for s, offset in zip(shares, offsets, strict=True)
    ]


def _physical(tensor: Array, margin: float) -> bool:
    """Whether a rigid body can have this inertia tensor, by a margin."""
    moments = np.linalg.eigvalsh(tensor)
    return bool(moments[0] > margin * moments[2] and moments[2] <= (1 - margin) * (moments[0] + moments[1]))


def _dofs(stem: str, frame: Array, axes: ArrayLike, stiffness: ArrayLike, damping: ArrayLike) -> list[Dof]:
    """Coordinates along and about the columns of a frame, slides first."""
    values: list[tuple[Any, Any, Any]] = sorted(
        zip(axes, stiffness, damping, strict=True), key=lambda item: AXES.index(item[0])
    )  # type: ignore[arg-type]
    return [
        Dof(f"{stem}.{axis}", axis[0] == "t", frame[:, "xyz".index(axis[1])], k, c) for axis, k, c in values
    ]


def _place(position: Array, axis: Array, hinges: Array, chain: list[int]) -> tuple[int, Array]:
    """The piece beside a position in the link's frame, and the position from that piece's own origin."""
    number = int(np.searchsorted(hinges, position @ axis))
    start = 0.0 if number == 0 else hinges[number - 1]
    return chain[number], position - start * axis

"""What a robot is made of: rigid links with inertia and revolute joints in a row, whichever format they came
from.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace

import numpy as np

from identify.core.arrays import Array
from identify.core.errors import InputError
from identify.robot.mesh import Visual

_HEAVIEST = 1e9
"""Mass (kg) and distance (m) that no link reaches; 1 over it, the smallest mass that one can have."""


@dataclass(frozen=True)
class Link:
    """A rigid body: mass (kg), centre of mass (3,) (m) in the link's frame, inertia (3, 3) (kg m^2) about the
    centre in link axes.
    """

    name: str
    mass: float
    centre: Array
    inertia: Array


@dataclass(frozen=True)
class Joint:
    """A revolute joint: origin (4, 4) is the child link's frame in the parent's at zero angle; axis (3,),
    unit, in the child's frame.

    At angle q the child's frame is origin @ rotation(axis, q) @ mount, with mount (4, 4) the identity for
    URDF and the constant rest of the link transform for Denavit-Hartenberg tables, whose link frame sits at
    the far end.
    """

    name: str
    parent: str
    child: str
    origin: Array
    axis: Array
    mount: Array = field(default_factory=lambda: np.eye(4))
    lower: float = -np.inf
    upper: float = np.inf


@dataclass(frozen=True)
class Robot:
    """A serial arm: links[0] is the base, joints[i] connects links[i] to links[i + 1].

    frames maps the name of a further frame (a flange, a tool) to the link that carries it and its pose
    (4, 4) there. gravity (3,) is in the base link's axes (m/s^2); visuals: what links look like;
    payloads: bodies that were merged into links, with the name of the link; notes: what was left out or
    assumed when it was read, in sentences; largest_turn: of any pose that its file states, rad.
    """

    name: str
    links: tuple[Link, ...]
    joints: tuple[Joint, ...]
    frames: dict[str, tuple[str, Array]] = field(default_factory=dict)
    gravity: Array = field(default_factory=lambda: np.array([0.0, 0.0, -9.81]))
    visuals: tuple[Visual, ...] = ()
    payloads: tuple[tuple[str, Link], ...] = ()
    notes: tuple[str, ...] = ()
    largest_turn: float = 0.0

    def link(self, name: str, where: str = "robot") -> Link:
        """The link of that name; an unknown name is an InputError with the known ones."""
        for link in self.links:
            if link.name == name:
                return link
        raise InputError(
            where, f"unknown link {name!r}", "one of " + ", ".join(link.name for link in self.links)
        )

    def joint_number(self, joint: int | str, where: str = "robot") -> int:
        """1-based number of a joint given by number or by name."""
        names = [j.name for j in self.joints]
        if isinstance(joint, int) and 1 <= joint <= len(names):
            return joint
        if joint in names:
            return names.index(str(joint)) + 1
        raise InputError(
            where,
            f"unknown joint {joint!r}",
            f"a number from 1 to {len(names)} or one of " + ", ".join(names),
        )

    def carrier(self, name: str) -> tuple[str, Array]:
        """The link that carries the frame of that name, and the pose (4, 4) of the frame there; of another
        name itself, as it is.
        """
        return self.frames.get(name, (name, np.eye(4)))

    def stretched(self, first: int = 0) -> float:
        """How far it is from joint to joint, all in one line, m; first: number of the joint, from 0, whose
        offset from the one before it is the first that counts.
        """
        return float(sum(np.linalg.norm((j.origin @ j.mount)[:3, 3]) for j in self.joints[first:]))

    def joint_numbers(self, joints: Iterable[int | str], where: str = "robot") -> list[int]:
        """1-based numbers of joints; one that comes twice is an InputError."""
        numbers = [self.joint_number(joint, where) for joint in joints]
        for number in numbers:
            if numbers.count(number) > 1:
                raise InputError(where, f"joint {number} twice", "each joint once")
        return numbers

    def detach(self, first: str, where: str = "robot") -> Robot:
        """The robot without link `first` and everything beyond it, as when the wrist was taken off for a
        test.
        """
        number = self.links.index(self.link(first, where))
        if number == 0:
            raise InputError(where, f"cannot detach the base link {first!r}", "a moving link")
        kept = self.links[:number]
        names = {link.name for link in kept}
        frames = {name: frame for name, frame in self.frames.items() if frame[0] in names}
        return replace(self, links=kept, joints=self.joints[: number - 1], frames=frames)

    def with_payload(
        self, link: str, mass: float, centre: Array, inertia: Array, where: str = "robot"
    ) -> Robot:
        """The robot with a rigid body added to a link: mass (kg), centre (3,) in link axes, inertia (3, 3)
        about that centre.
        """
        old = self.link(link, where)
        if old.mass == 0:
            raise InputError(
                where,
                f"a payload on link {link!r}, whose own inertia is not known",
                "a link with mass and inertia",
            )
        payload = Link("payload", mass, centre, inertia)
        new = merge(old, payload)
        fault = f"mass {mass:g} kg is not positive" if mass <= 0 else inertia_fault(new)
        if fault:
            raise InputError(
                where, f"payload on link {link!r}: {fault}", "a mass and inertia that a rigid body can have"
            )
        links = tuple(new if other is old else other for other in self.links)
        return replace(self, links=links, payloads=(*self.payloads, (link, payload)))


def merge(a: Link, b: Link) -> Link:
    """One rigid body out of two in the same frame (parallel-axis theorem), named after the first."""
    mass = a.mass + b.mass
    if mass == 0:
        return replace(a, inertia=a.inertia + b.inertia)
    centre = (a.mass * a.centre + b.mass * b.centre) / mass
    inertia = np.zeros((3, 3))
    for body in (a, b):
        d = body.centre - centre
        inertia += body.inertia + body.mass * (d @ d * np.eye(3) - np.outer(d, d))
    return Link(a.name, mass, centre, inertia)


def as_base(link: Link) -> Link:
    """A base as a file tells it: with an inertia of zero, which files give to what stands still, nothing is
    known of the body and its mass is 0, so that an effect that moves it is refused.
    """
    return link if np.any(link.inertia) or link.mass < 0 else replace(link, mass=0.0)


def inertia_fault(link: Link, *, unknown: bool = False) -> str | None:
    """Why no rigid body can have this mass and inertia, or None where one can.

    unknown: a mass or inertia of zero means that it is not known.
    """
    if unknown and not np.any(link.inertia):
        link = replace(link, mass=link.mass or 1.0, inertia=np.eye(3))
    if not (np.isfinite(link.mass) and link.mass > 0):
        return f"mass {link.mass:g} kg is not positive"
    if not (np.all(np.isfinite(link.centre)) and np.all(np.isfinite(link.inertia))):
        return "centre of mass or inertia is not finite"
    if not np.allclose(link.inertia, link.inertia.T):
        return "inertia tensor is not symmetric"
    principal = np.asarray(np.linalg.eigvalsh(link.inertia), dtype=np.float64)
    return _moment_fault(principal) or _size_fault(link, principal)


def _size_fault(link: Link, principal: Array) -> str | None:
    """Why no link of a robot is so light, heavy or far, or None; beyond this, numbers under- or overflow."""
    if not 1 / _HEAVIEST < link.mass < _HEAVIEST:
        return f"mass {link.mass:g} kg is beyond {1 / _HEAVIEST:g} to {_HEAVIEST:g} kg"
    if not ((np.abs(link.centre) < _HEAVIEST).all() and principal[0] > 1e-20 and principal[2] < _HEAVIEST**2):
        return "centre of mass or inertia is beyond all that robots have"
    return None


def _moment_fault(principal: Array) -> str | None:
    """Why no rigid body can have these moments of inertia (3,), rising, kg m^2, or None."""
    if principal[0] <= 0:
        return f"principal moments of inertia {principal.round(9).tolist()} kg m^2 are not all positive"
    # Published tables and boxes drawn around real shapes miss the triangle inequality by some per cent; more
    # is a mistake.
    if principal[2] > (principal[0] + principal[1]) * 1.1:
        moments = principal.round(9).tolist()
        return f"principal moments of inertia {moments} kg m^2: the largest exceeds the sum of the others"
    return None

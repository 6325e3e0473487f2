"""Bodies out of meshes, where a description has none: half of a link's mass fills its mesh evenly, half sits
on the surface.

A robot's links are neither solid nor hollow.  Solid alone makes the wrists too light, surface alone makes all
inertias too large; the mean of both is right on average (docs/mesh_bodies.md has the numbers).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
import scipy

from identify.core.arrays import Array
from identify.core.errors import InputError
from identify.core.text import listed
from identify.robot.description import Link, Robot, inertia_fault, merge
from identify.robot.mesh import Mesh
from identify.robot.visual import by_link, readable

_LEAST_FILLED, _MOST_FILLED = 0.05, 1.02
"""Volume that a closed surface holds, over that of its convex hull: beyond, the surface is open or turned
inside out."""
_FIX = "give the bodies in the file's <inertial> elements"


@dataclass(frozen=True)
class Moments:
    """Of an even distribution over a volume or a surface: its size (m^3 or m^2), centre (3,), and inertia
    (3, 3) about the centre per kg.
    """

    size: float
    centre: Array
    inertia: Array

    @classmethod
    def of(cls, size: float, first: Array, second: Array) -> Moments:
        """From first (3,) and second (3, 3) moments about the origin."""
        centre = first / size
        spread = second / size - np.outer(centre, centre)
        return cls(size, centre, np.trace(spread) * np.eye(3) - spread)

    def body(self, mass: float, name: str = "") -> Link:
        """It with a mass."""
        return Link(name, mass, self.centre, mass * self.inertia)


@dataclass(frozen=True)
class Shape:
    """What a mesh tells of a body."""

    mesh: Mesh

    @cached_property
    def hull(self) -> Moments:
        """Of its convex hull."""
        return volume(_hull(self.mesh))

    @cached_property
    def solid(self) -> Moments:
        """Of what it encloses, holes closed towards the centre of its convex hull; where that is nothing that
        a surface can enclose, of the hull.
        """
        middle = self.hull.centre
        found = volume(Mesh(self.mesh.vertices - middle, self.mesh.triangles))
        found = replace(found, centre=found.centre + middle)
        filled = _LEAST_FILLED < found.size / self.hull.size < _MOST_FILLED
        return found if filled and np.linalg.eigvalsh(found.inertia)[0] > 0 else self.hull

    @cached_property
    def surface(self) -> Moments:
        """Of its surface."""
        return surface(self.mesh)


def volume(mesh: Mesh) -> Moments:
    """Of what a closed surface encloses, by tetrahedra from the origin; whichever way it is turned."""
    a, b, c = mesh.corners
    each = np.einsum("ti,ti->t", a, np.cross(b, c)) / 6
    each = each if each.sum() >= 0 else -each
    first, second = _sums(each, (a, b, c), 1 / 4, 1 / 20)
    return Moments.of(max(float(each.sum()), np.finfo(float).tiny), first, second)


def surface(mesh: Mesh) -> Moments:
    """Of a surface of even thickness."""
    each = mesh.areas
    first, second = _sums(each, mesh.corners, 1 / 3, 1 / 12)
    return Moments.of(max(float(each.sum()), np.finfo(float).tiny), first, second)


def _sums(each: Array, corners: Sequence[Array], of_first: float, of_second: float) -> tuple[Array, Array]:
    """First and second moments of simplices with sizes (t,) and corners (t, 3), the origin being one of those
    of a tetrahedron (Tonon 2004).
    """
    together = corners[0] + corners[1] + corners[2]
    squares = sum(np.einsum("t,ti,tj->ij", each, x, x) for x in (*corners, together))
    return np.asarray(of_first * each @ together), np.asarray(of_second * squares)


def _hull(mesh: Mesh) -> Mesh:
    try:
        found = scipy.spatial.ConvexHull(mesh.vertices)
    except (scipy.spatial.QhullError, ValueError) as error:
        raise InputError("a mesh", "all its points lie in a plane", "a body", _FIX) from error
    corners = mesh.vertices[found.simplices]
    outward = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    turned = np.einsum("ti,ti->t", outward, found.equations[:, :3]) < 0
    triangles = np.where(turned[:, None], found.simplices[:, ::-1], found.simplices)
    return Mesh(mesh.vertices, triangles)


def shapes(robot: Robot) -> dict[str, Shape]:
    """Of each link whose mesh, or that of what is fixed to it, can be read."""
    meshes = zip(robot.links, by_link(robot, readable(robot).meshes), strict=True)
    return {link.name: Shape(mesh) for link, mesh in meshes if mesh is not None}


@dataclass(frozen=True)
class Wanted:
    """What is stated of a robot whose bodies are made: mass_kg, of all of it, by its data sheet; base_kg, of
    what does not move; motors, kg by the joint that each turns; everything: also where the file has bodies.
    """

    mass_kg: float | None = None
    base_kg: float | None = None
    motors: Mapping[str, float] = field(default_factory=dict)
    everything: bool = False


def unknown(robot: Robot, everything: bool = False) -> list[str]:
    """Moving links of which mass or inertia is not known."""
    return [link.name for link in robot.links[1:] if everything or not np.any(link.inertia)]


def made_bodies(robot: Robot, wanted: Wanted) -> list[Link]:
    """Bodies of the moving links of which nothing, or no inertia, is known, and of a base that shares in the
    mass; InputError where meshes or the mass are missing.
    """
    names = unknown(robot, wanted.everything)
    found = _found(robot, names)
    given = {link.name: link.mass for link in robot.links if link.mass > 0 and not wanted.everything}
    weightless = [name for name in names if name not in given]
    base = robot.links[0].name
    if weightless and wanted.base_kg is None and base in found and base not in given:
        weightless, names = [base, *weightless], [base, *names]
    motors = _motors(robot, wanted.motors, weightless)
    rest = _rest(robot, wanted, given, found, sum(wanted.motors.values())) if weightless else 0.0
    bodies = []
    for name in names:
        if name in given:
            body = _centred(_halves(found[name], given[name], given[name]), robot.link(name).centre)
        else:
            shares = _shares(found[name], [found[n] for n in weightless])
            body = _halves(found[name], *(rest * part for part in shares))
            body = merge(body, motors[name]) if name in motors else body
        bodies.append(_possible(replace(body, name=name)))
    return bodies


def _centred(body: Link, centre: Array) -> Link:
    """With the stated centre, where it was."""
    return replace(body, centre=centre) if np.any(centre) else body


def _found(robot: Robot, names: Sequence[str]) -> dict[str, Shape]:
    """All shapes there are; InputError where one of these links has none."""
    found = shapes(robot)
    missing = [name for name in names if name not in found]
    if missing:
        why = "; ".join(fault for _, fault in readable(robot).faults) or "the file names none"
        raise InputError(robot.name, f"no mesh for {listed(missing)} ({why})", "a mesh for each link", _FIX)
    return found


def _halves(shape: Shape, solid_kg: float, surface_kg: float) -> Link:
    """Half of each mass in its place."""
    return merge(shape.solid.body(solid_kg / 2), shape.surface.body(surface_kg / 2))


def _shares(shape: Shape, of: Sequence[Shape]) -> tuple[float, float]:
    """A shape's part of the volume and of the surface of several."""
    return (
        shape.solid.size / sum(one.solid.size for one in of),
        shape.surface.size / sum(one.surface.size for one in of),
    )


def _rest(
    robot: Robot, wanted: Wanted, given: Mapping[str, float], found: Mapping[str, Shape], motors_kg: float
) -> float:
    """The mass that is left for links of unknown mass, and the base where it shares in it."""
    base = robot.links[0].name
    if wanted.mass_kg is None:
        missing = f"no mass of {listed(unknown(robot, wanted.everything))}"
        fix = "give that of its data sheet: --mass-kg"
        raise InputError(robot.name, missing, "the mass of the robot", fix)
    if wanted.base_kg is None and base not in (*given, *found):
        missing = f"no mesh of the base {base!r}, so that its part of {wanted.mass_kg:g} kg is not known"
        fix = "give the mass of what stands still: --base-kg"
        raise InputError(robot.name, missing, "a mesh, or its mass", fix)
    moving = sum(mass for name, mass in given.items() if name != base)
    of_base = wanted.base_kg if wanted.base_kg is not None else given.get(base, 0.0)
    rest = wanted.mass_kg - moving - of_base - motors_kg
    if rest <= 0:
        more = f"{wanted.mass_kg:g} kg, which the parts of known mass exceed by {-rest:.4g} kg"
        raise InputError("--mass-kg", more, "the mass of the whole robot")
    return rest


def _motors(robot: Robot, given: Mapping[str, float], weightless: Sequence[str]) -> dict[str, Link]:
    """Point masses at the joints that motors turn, by the link that carries them."""
    found: dict[str, Link] = {}
    for name, mass in given.items():
        joint = robot.joints[robot.joint_number(int(name) if name.isdigit() else name, "--motor") - 1]
        if joint.parent not in weightless:
            known = f"link {joint.parent!r}, which carries the motor of joint {name}, has a mass by the file"
            raise InputError("--motor", known, "motors on links whose mass is not known")
        point = Link("motor", mass, joint.origin[:3, 3], np.zeros((3, 3)))
        found[joint.parent] = merge(found[joint.parent], point) if joint.parent in found else point
    return found


def _possible(body: Link) -> Link:
    fault = inertia_fault(body)
    if fault:
        raise InputError(f"the mesh of link {body.name!r}", fault, "a body", _FIX)
    return body

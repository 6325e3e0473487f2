"""What the links of a URDF look like: its `<visual>` bodies or, where a link has none that can be read, its
`<collision>` bodies.

They are only drawn: what cannot be read costs a sentence, never a fit.  Mesh files are not opened before
something is drawn.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from identify.core.errors import InputError
from identify.core.text import listed
from identify.robot.description import Robot
from identify.robot.mesh import Mesh, Surface, Visual, box, cylinder, joined, simplified, sphere
from identify.robot.mesh_file import read_mesh
from identify.robot.package import package_folder
from identify.robot.urdf_elements import UrdfDocument

MOST = 1500
"""Triangles of a whole robot that is drawn."""
_TOO_WIDE = 10.0
"""A body so many times as wide as the whole arm is long is in another unit."""


@dataclass(frozen=True)
class Looks:
    """Meshes by link or frame, in its axes, m; missing: why others have none, in sentences."""

    meshes: dict[str, Mesh] = field(default_factory=dict)
    missing: tuple[str, ...] = ()


def visuals(document: UrdfDocument) -> tuple[Visual, ...]:
    """Those of every link that has any."""
    found = []
    for link in document.root.findall("link"):
        name = link.get("name", "")
        choices = (
            tuple(_surface(document, element, f"link {name!r}") for element in link.findall(tag))
            for tag in ("visual", "collision")
        )
        found.append(Visual(name, tuple(filter(None, choices))))
    return tuple(one for one in found if one.choices)


def looks(robot: Robot, most: int = MOST) -> Looks:
    """What the links look like, with at most so many triangles in all."""
    found = readable(robot)
    each = most // max(len(found.meshes), 1)
    drawn = {link: simplified(mesh, each) for link, mesh in found.meshes.items()}
    return Looks(drawn, _missing(found.faults))


def _missing(faults: Sequence[tuple[str, str]]) -> tuple[str, ...]:
    """One sentence on the links that are not drawn as they look, however many."""
    if not faults:
        return ()
    link, fault = faults[0]
    if len(faults) == 1:
        return (f"link {link} is drawn as a line, not as its body ({fault})",)
    names = listed([name for name, _ in faults])
    return (f"{len(faults)} links are drawn as lines, not as their bodies: {names} ({link}: {fault})",)


@dataclass(frozen=True)
class Readable:
    """Meshes by link or frame, in its axes, m, and why others cannot be read."""

    meshes: dict[str, Mesh]
    faults: tuple[tuple[str, str], ...]


def readable(robot: Robot) -> Readable:
    """The meshes of a robot with all their triangles."""
    reach_m = sum(float(np.linalg.norm(joint.origin[:3, 3])) for joint in robot.joints)
    meshes: dict[str, Mesh] = {}
    faults = []
    for one in robot.visuals:
        fault = ""
        for surfaces in one.choices:
            try:
                meshes[one.link] = _mesh(surfaces, reach_m)
                break
            except InputError as error:
                fault = fault or f"{Path(error.where).name}: {error.found}"
        else:
            faults.append((one.link, fault))
    return Readable(meshes, tuple(faults))


def by_link(robot: Robot, meshes: Mapping[str, Mesh]) -> list[Mesh | None]:
    """What each link looks like with everything that is fixed to it, in its frame, by meshes of links and
    frames; None for nothing.
    """
    own: dict[str, list[Mesh]] = {link.name: [] for link in robot.links}
    for name, mesh in meshes.items():
        link, pose = robot.carrier(name)
        if link in own:
            own[link].append(mesh.placed(pose))
    return [joined(own[link.name]) if own[link.name] else None for link in robot.links]


def _mesh(surfaces: tuple[Surface, ...], reach_m: float) -> Mesh:
    """Several surfaces of a link as one."""
    mesh = joined([_placed(one) for one in surfaces])
    width = float(np.ptp(mesh.vertices, axis=0).max())
    if not width <= _TOO_WIDE * max(reach_m, 0.1):
        found = f"{width:.3g} m wide beside an arm of {reach_m:.3g} m, in mm without a `scale`?"
        raise InputError(surfaces[0].where, found)
    return mesh


def _placed(one: Surface) -> Mesh:
    if one.fault:
        raise InputError(one.where, one.fault)
    mesh = one.mesh if one.file is None else read_mesh(one.file)
    return Mesh(mesh.vertices * one.scale, mesh.triangles).placed(one.pose)


def _surface(document: UrdfDocument, element: ElementTree.Element, owner: str) -> Surface:
    """A `<visual>` or `<collision>`; what is wrong with it is kept as its fault."""
    where = document.where(element, owner)
    try:
        pose, geometry = document.origin(element, owner), document.child(element, "geometry", owner)
        found = next(iter(geometry), None)
        tag = "nothing" if found is None else found.tag
        if found is None or tag not in ("box", "cylinder", "sphere", "mesh"):
            return Surface(where, pose, fault=f"{tag} in <geometry>")
        if tag == "mesh":
            scale = document.numbers(found, "scale", 3, owner) if "scale" in found.attrib else [1.0] * 3
            file = mesh_place(document.path.resolve().parent, document.text(found, "filename", owner))
            return Surface(where, pose, file=file, scale=np.array(scale))
        return Surface(where, pose, _plain(document, found, owner))
    except InputError as error:
        return Surface(where, np.eye(4), fault=error.found)


def _plain(document: UrdfDocument, found: ElementTree.Element, owner: str) -> Mesh:
    """A box, a cylinder or a sphere."""
    if found.tag == "box":
        return box(document.numbers(found, "size", 3, owner))
    radius = document.numbers(found, "radius", 1, owner)[0]
    return (
        cylinder(radius, document.numbers(found, "length", 1, owner)[0])
        if found.tag == "cylinder"
        else sphere(radius)
    )


def mesh_place(folder: Path, name: str) -> Path:
    """Where a mesh is that a URDF in a folder names: beside it, or for `package://NAME/...` in that package,
    or what stands for it, above the URDF; the first place where nothing is found.
    """
    places = list(_places(folder, name))
    return next((place for place in places if os.path.isfile(place)), places[0])


def _places(folder: Path, name: str) -> Iterator[Path]:
    scheme, found, rest = name.partition("://")
    if not found or scheme == "file":
        yield folder / (rest if found else name)
        return
    package, _, inside = rest.partition("/")
    found_folder = package_folder(package, folder)
    if found_folder is not None:
        yield found_folder / inside
    yield folder / inside
    for above in folder.parents:
        yield above / inside

"""What the links of a URDF look like: its `<visual>` bodies or, where a link has none that can be read, its
`<collision>` bodies.

They are only drawn: what cannot be read costs a sentence, never a fit.  Mesh files are not opened before
something is drawn.

Of a mesh file, STL, binary or text, OBJ or COLLADA, only the triangles are read, no colours.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from itertools import pairwise
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from identify.core.arrays import Array
from identify.core.errors import InputError
from identify.core.files import MEBIBYTE, read_bytes
from identify.core.text import listed
from identify.robot.dae import read_dae
from identify.robot.description import Robot
from identify.robot.mesh import Mesh, Surface, Visual, box, cylinder, joined, simplified, sphere
from identify.robot.package import package_folder
from identify.robot.urdf_elements import UrdfDocument

MOST = 1500
"""Triangles of a whole robot that is drawn."""
_TOO_WIDE = 10.0
"""A body so many times as wide as the whole arm is long is in another unit."""
_LARGEST = 64 * MEBIBYTE
_HEAD, _FACET = 84, 50
"""Bytes before the facets of a binary STL file, and of each."""
_VERTEX = re.compile(rb"^\s*vertex\s+(\S+)\s+(\S+)\s+(\S+)", re.MULTILINE)
_READ = "an STL, OBJ or COLLADA file"


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


def read_mesh(path: Path) -> Mesh:
    """The triangles of a file, in its own unit; InputError for what cannot be read or holds none."""
    try:
        status = path.stat()
    except (OSError, ValueError):  # what is wrong with it is said on reading
        return _read(path, (0, 0))
    return _read(path, (status.st_mtime_ns, status.st_size))


@lru_cache(maxsize=32)
def _read(path: Path, stamp: tuple[int, int]) -> Mesh:
    """The same of a file as it was at a time, ns, with a size: masses and drawings look at it in turn."""
    del stamp
    readers = {".stl": _stl, ".obj": _obj, ".dae": read_dae}
    reader = readers.get(path.suffix.lower())
    if reader is None:
        raise InputError(str(path), f"meshes of the kind {path.suffix or '(none)'} are not read", _READ)
    try:
        mesh = reader(path)
    except (ValueError, LookupError, StopIteration) as error:
        raise InputError(str(path), f"a damaged mesh ({error})", _READ) from error
    rows = mesh.triangles
    if not len(rows) or rows.min() < 0 or rows.max() >= len(mesh.vertices):
        raise InputError(str(path), "a damaged mesh (no triangles, or corners that are not there)", _READ)
    if not np.isfinite(mesh.vertices).all():
        raise InputError(str(path), "a damaged mesh (places that are no numbers)", _READ)
    return mesh


def _stl(path: Path) -> Mesh:
    """A binary file is recognised by its length: its header may begin with `solid` as well."""
    content = read_bytes(path, _READ, _LARGEST)
    count = int.from_bytes(content[80:_HEAD], "little")
    if len(content) == _HEAD + _FACET * count:
        facets = np.frombuffer(content, np.uint8, offset=_HEAD).reshape(count, _FACET)
        corners = np.ascontiguousarray(facets[:, 12:48]).view("<f4").astype(float)
    else:
        corners = np.array(_VERTEX.findall(content), dtype=float)
    vertices: Array = corners.reshape(-1, 3)
    return Mesh(vertices, np.arange(len(vertices)).reshape(-1, 3))


def _obj(path: Path) -> Mesh:
    content = read_bytes(path, _READ, _LARGEST)
    vertices: list[list[float]] = []
    triangles: list[tuple[int, int, int]] = []
    for line in content.splitlines():
        words = line.split()
        if words[:1] == [b"v"]:
            vertices.append([float(word) for word in words[1:4]])
        elif words[:1] == [b"f"]:
            numbers = [int(word.split(b"/")[0]) for word in words[1:]]
            corners = [number - 1 if number > 0 else len(vertices) + number for number in numbers]
            triangles += [(corners[0], a, b) for a, b in pairwise(corners[1:])]
    return Mesh(np.array(vertices).reshape(-1, 3), np.array(triangles, dtype=int).reshape(-1, 3))

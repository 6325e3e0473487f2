"""Read a mesh file: STL, binary or text, OBJ or COLLADA; only triangles, no colours."""

from __future__ import annotations

import re
from functools import lru_cache
from itertools import pairwise
from pathlib import Path

import numpy as np

from identify.core.arrays import Array
from identify.core.errors import InputError
from identify.core.files import MEBIBYTE, read_bytes
from identify.robot.dae import read_dae
from identify.robot.mesh import Mesh

_LARGEST = 64 * MEBIBYTE
_HEAD, _FACET = 84, 50
"""Bytes before the facets of a binary STL file, and of each."""
_VERTEX = re.compile(rb"^\s*vertex\s+(\S+)\s+(\S+)\s+(\S+)", re.MULTILINE)
_READ = "an STL, OBJ or COLLADA file"


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

"""Triangles of a COLLADA file (.dae), in m: geometries where its scene puts them.

As other readers of robot descriptions do, `up_axis` is not looked at.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np
from numpy.typing import NDArray

from identify.core.arrays import Array
from identify.core.errors import InputError
from identify.core.xml_input import read_xml
from identify.robot.mesh import EMPTY, Mesh, joined
from identify.robot.pose import turned

_FACES = ("triangles", "polylist", "polygons")
_DEEPEST = 50
_READ = "a COLLADA file"


def read_dae(path: Path) -> Mesh:
    """The mesh; InputError for what is no COLLADA, ValueError, LookupError where parts are missing."""
    root, _ = read_xml(path, _READ, words=True)
    if _tag(root) != "COLLADA":
        raise InputError(str(path), f"the root element is <{_tag(root)}>", _READ)
    unit = next((float(e.get("meter", "1")) for e in root.iter() if _tag(e) == "unit"), 1.0)
    scene = _Scene(root)
    parts = list(scene.placed())
    mesh = joined(parts) if parts else EMPTY
    return Mesh(mesh.vertices * unit, mesh.triangles)


def _tag(element: Element) -> str:
    return element.tag.rpartition("}")[2].rpartition(":")[2]


def _children(element: Element, *tags: str) -> Iterator[Element]:
    return (child for child in element if _tag(child) in tags)


def _numbers(element: Element | None) -> Array:
    return np.array([] if element is None else (element.text or "").split(), dtype=float)


class _Scene:
    """What elements name each other by, and the meshes of geometries as far as they were read."""

    def __init__(self, root: Element) -> None:
        self.root = root
        self.named = {e.get("id", ""): e for e in root.iter() if e.get("id")}
        self.meshes: dict[str, Mesh] = {}

    def placed(self) -> Iterator[Mesh]:
        """The meshes of all nodes of the scene, or of all geometries where there is no scene."""
        scenes = [e for e in self.root.iter() if _tag(e) == "visual_scene"]
        link = next((e.get("url", "") for e in self.root.iter() if _tag(e) == "instance_visual_scene"), "")
        scene = self.named.get(link.lstrip("#")) if link else None
        for one in [scene] if scene is not None else scenes[:1]:
            for node in _children(one, "node"):
                yield from self._node(node, np.eye(4), 0)
        if not scenes:
            yield from (self._mesh(e.get("id", "")) for e in self.root.iter() if _tag(e) == "geometry")

    def _node(self, node: Element, at: Array, depth: int) -> Iterator[Mesh]:
        if depth > _DEEPEST:
            raise ValueError("nodes that hold themselves")
        for child in node:
            at = at @ _moved(child)
        for child in node:
            url = child.get("url", "").lstrip("#")
            if _tag(child) == "node":
                yield from self._node(child, at, depth + 1)
            elif _tag(child) == "instance_node":
                yield from self._node(self.named[url], at, depth + 1)
            elif _tag(child) == "instance_geometry":
                yield self._mesh(url).placed(at)

    def _mesh(self, name: str) -> Mesh:
        if name not in self.meshes:
            found = [e for e in _children(self.named[name], "mesh")]
            faces = [self._faces(part) for mesh in found for part in _children(mesh, *_FACES)]
            self.meshes[name] = joined(faces) if faces else EMPTY
        return self.meshes[name]

    def _faces(self, part: Element) -> Mesh:
        inputs = list(_children(part, "input"))
        stride = 1 + max(int(one.get("offset", "0")) for one in inputs)
        vertex = next(one for one in inputs if one.get("semantic") == "VERTEX")
        source = self.named[vertex.get("source", "").lstrip("#")]
        position = next(e for e in _children(source, "input") if e.get("semantic") == "POSITION")
        vertices = self._positions(self.named[position.get("source", "").lstrip("#")])
        lists = [_numbers(e).astype(int).reshape(-1, stride) for e in _children(part, "p")]
        corners = [rows[:, int(vertex.get("offset", "0"))] for rows in lists]
        counts = _numbers(next(_children(part, "vcount"), None)).astype(int)
        return Mesh(vertices, _triangles(_tag(part), corners, counts))

    def _positions(self, source: Element) -> Array:
        values = _numbers(next(_children(source, "float_array")))
        accessor = next((e for e in source.iter() if _tag(e) == "accessor"), None)
        stride = 3 if accessor is None else int(accessor.get("stride", "3"))
        return values[: len(values) // stride * stride].reshape(-1, stride)[:, :3]


def _triangles(kind: str, corners: list[NDArray[np.int_]], counts: NDArray[np.int_]) -> NDArray[np.int_]:
    """(t, 3): polygons as fans."""
    if kind == "triangles":
        return np.concatenate([one.reshape(-1, 3) for one in corners] or [np.zeros((0, 3), dtype=int)])
    polygons = corners
    if kind == "polylist":
        polygons = np.split(np.concatenate(corners), np.cumsum(counts)[:-1]) if corners else []
    fans = [np.stack([np.full(len(p) - 2, p[0]), p[1:-1], p[2:]], axis=1) for p in polygons if len(p) > 2]
    return np.concatenate(fans or [np.zeros((0, 3), dtype=int)])


def _moved(element: Element) -> Array:
    """What an element of a node does to its frame (4, 4)."""
    tag, found = _tag(element), np.eye(4)
    if tag == "matrix":
        found = _numbers(element).reshape(4, 4)
    elif tag == "translate":
        found[:3, 3] = _numbers(element).reshape(3)
    elif tag == "rotate":
        x, y, z, angle = _numbers(element)
        axis = np.array([x, y, z]) / (np.linalg.norm([x, y, z]) or 1.0)
        found = turned(np.radians(angle) * axis)
    elif tag == "scale":
        found[:3, :3] = np.diag(_numbers(element).reshape(3))
    return found

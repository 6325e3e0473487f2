"""Measurement points, coordinate systems and trace lines of universal files: datasets 15, 2411, 18, 2420, 82,
2412 and the units 164.

Formats: SDRC universal datasets 15, 18, 82 (1987), 2411 (1987), 2420 (1994).  Lengths are in the file's unit:
dataset 164 says which; a file without it needs `length_unit`.  Positions stand in the definition system,
channels in the displacement system.  In a cylindrical one coordinates are r, theta (degrees) and z, and
channels X, Y and Z of a node look along these where it is.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from identify.core.arrays import Array
from identify.core.errors import InputError
from identify.measured.geometry import MeasuredGeometry
from identify.measured.loaders import FORMAT_OF_SUFFIX
from identify.measured.uff.blocks import Block, blocks
from identify.measured.uff.cursor import EXPORT

System = tuple[Array, Array]
_CARTESIAN, _CYLINDRICAL = 0, 1

_WITH_SECTION = (11, 21, 22, 23, 24)
"""Types of elements of dataset 2412 that have a line for their section and orientation."""
_NODES = (15, 2411)
LENGTH_M = {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "in": 0.0254, "ft": 0.3048}
"""Units of length a user can name, in m."""


@dataclass
class _Found:
    """What the datasets said so far: node -> (definition, displacement, coordinates); system -> (reference,
    axes, origin); curved: system -> kind, of those that are not Cartesian.
    """

    nodes: dict[int, tuple[int, int, Array]] = field(default_factory=dict)
    systems: dict[int, tuple[int, Array, Array]] = field(default_factory=dict)
    curved: dict[int, int] = field(default_factory=dict)
    lines: list[tuple[int, ...]] = field(default_factory=list)
    length: float | None = None


def has_geometry(path: Path, form: str | None = None) -> bool:
    """Whether a file is a universal one with nodes; form: of the file, which else its suffix tells."""
    universal = path.is_file() and (form or FORMAT_OF_SUFFIX.get(path.suffix.lower())) == "uff"
    return universal and any(block.number in _NODES for block in blocks(path))


def read_geometry(
    path: Path, length_unit: str | None = None, *, or_else: str | None = None
) -> MeasuredGeometry:
    """Nodes, channel directions and trace lines of a universal file, in m.

    length_unit (m, mm, cm, in, ft) is for files without dataset 164, or_else what those are taken to have.
    InputError where there are no nodes, no unit, or one too many, a system of a node that is missing or
    spherical, or a line to a node that is not there; a node is taken once.
    """
    found = _found(path)
    if not found.nodes:
        raise InputError(str(path), "no nodes (dataset 15 or 2411)", "measurement points")
    given = or_else if found.length is None and length_unit is None else length_unit
    scale = length_in(str(path), found.length, given)
    nodes = tuple(sorted(found.nodes))
    position, axes = np.zeros((len(nodes), 3)), np.zeros((len(nodes), 3, 3))
    for n, node in enumerate(nodes):
        place, axes[n] = _placed(found, node, str(path))
        position[n] = scale * place
    for node in (node for line in found.lines for node in line):
        if node not in found.nodes:
            raise InputError(
                str(path),
                f"a trace line (dataset 82 or 2412) through node {node}",
                "a node of dataset 15 or 2411",
            )
    return MeasuredGeometry(nodes, position, axes, tuple(found.lines))


def channel_axes(path: Path, nodes: Collection[int]) -> dict[int, Array]:
    """Of those of the nodes that the file defines: the directions of their channels X, Y and Z in the common
    frame, rows of (3, 3); none without datasets 15 and 2411.

    InputError for a system of such a node that is missing or spherical.
    """
    found = _found(path)
    return {node: _placed(found, node, str(path))[1] for node in found.nodes if node in nodes}


def _found(path: Path) -> _Found:
    """What the datasets of a file say of its geometry."""
    found = _Found()
    readers = {
        15: _nodes15,
        2411: _nodes2411,
        18: _systems18,
        2420: _systems2420,
        82: _lines82,
        2412: _rods2412,
        164: _units164,
    }
    for block in blocks(path):
        if block.number in readers:
            readers[block.number](block, found)
    return found


def length_in(name: str, length: float | None, unit: str | None) -> float:
    """The unit of length of a file in m, of which it says `length` (m) or nothing, and its user `unit` or
    nothing; InputError where neither does, or both differ.
    """
    if unit is not None and unit not in LENGTH_M:
        raise InputError("length_unit", f"{unit!r}", "one of " + ", ".join(LENGTH_M))
    if length is None and unit is None:
        raise InputError(
            name, "no units (dataset 164)", "the unit of length", "set length_unit to " + ", ".join(LENGTH_M)
        )
    if length is not None and unit is not None and not np.isclose(length, LENGTH_M[unit]):
        raise InputError(
            "length_unit",
            f"{unit!r} although the file says {length:g} m",
            fix="leave length_unit out",
        )
    return length if length is not None else LENGTH_M[str(unit)]


def _placed(found: _Found, node: int, name: str) -> tuple[Array, Array]:
    """Where a node is (3,), in the file's unit, and the directions of its channels, rows of (3, 3), in the
    common frame.
    """
    definition, displacement, coordinates = found.nodes[node]
    turn, origin = _global(definition, found, name, ())
    if found.curved.get(definition) == _CYLINDRICAL:
        angle = np.radians(coordinates[1])
        coordinates = np.array(
            [coordinates[0] * np.cos(angle), coordinates[0] * np.sin(angle), coordinates[2]]
        )
    place = coordinates @ turn + origin
    axes, middle = _global(displacement, found, name, ())
    if found.curved.get(displacement) == _CYLINDRICAL:
        x, y, _ = (place - middle) @ axes.T
        radial, along = np.array([x, y]) / (np.hypot(x, y) or 1.0), axes[2]
        out = radial @ axes[:2] if np.any(radial) else axes[0]
        axes = np.array([out, np.cross(along, out), along])
    return place, axes


def _global(number: int, found: _Found, name: str, seen: tuple[int, ...]) -> System:
    """Axes (rows) and origin of a coordinate system in the common frame; 0 and 1 are that frame where not
    defined.
    """
    kind = found.curved.get(number, _CARTESIAN)
    if kind not in (_CARTESIAN, _CYLINDRICAL) or (seen and kind != _CARTESIAN):
        used = f"system {seen[-1]} stands in" if seen else "nodes use"
        raise InputError(
            name,
            f"coordinate system {number}, which {used}, is of kind {kind}",
            "0, Cartesian" if seen else "0 or 1, Cartesian or cylindrical",
            "export Cartesian systems",
        )
    if number not in found.systems:
        if number in (0, 1):
            return np.eye(3), np.zeros(3)
        raise InputError(
            name, f"coordinate system {number} is used and not defined", "dataset 18 or 2420", EXPORT
        )
    if number in seen:
        raise InputError(
            name, f"coordinate system {number} refers to itself", "a chain that ends at 0", EXPORT
        )
    reference, axes, origin = found.systems[number]
    turn, start = _global(reference, found, name, (*seen, number))
    return axes @ turn, origin @ turn + start


def _nodes15(block: Block, found: _Found) -> None:
    """4I10,3E13.5 a node: number, definition system, displacement system, colour, coordinates."""
    while not block.done:
        integers, reals = block.split(40)
        node, definition, displacement = integers.integers(4)[:3]
        _add_node(block, found, node, (definition, displacement, reals.reals(3)))


def _nodes2411(block: Block, found: _Found) -> None:
    """4I10 as in 15, then 1P3D25.16."""
    while not block.done:
        node, definition, displacement = block.integers(3)[:3]
        _add_node(block, found, node, (definition, displacement, block.reals(3, 25)))


def _add_node(block: Block, found: _Found, node: int, value: tuple[int, int, Array]) -> None:
    old = found.nodes.setdefault(node, value)
    if old[:2] != value[:2] or not np.allclose(old[2], value[2]):
        raise InputError(block.where, f"node {node} a second time, elsewhere", "each node once")


def _systems18(block: Block, found: _Found) -> None:
    """5I10 (number, kind, reference), a name, then origin, a point on +x and one in the +xz plane, 6E13.5."""
    while not block.done:
        number, kind, reference = block.integers(3)[:3]
        block.line()
        values = block.reals(9).reshape(3, 3)
        if kind != _CARTESIAN:
            found.curved[number] = kind
        if kind not in (_CARTESIAN, _CYLINDRICAL):
            continue
        x, across = values[1] - values[0], values[2] - values[0]
        y = np.cross(across, x)
        if min(np.linalg.norm(x), np.linalg.norm(y)) <= 1e-9 * max(float(np.abs(values).max()), 1e-300):
            raise InputError(
                block.where, f"coordinate system {number} has its three points on a line", "a plane", EXPORT
            )
        z = np.cross(x, y)
        found.systems[number] = (reference, np.stack([v / np.linalg.norm(v) for v in (x, y, z)]), values[0])


def _systems2420(block: Block, found: _Found) -> None:
    """Part number, part name; then 3I10 (number, kind), a name and 4 rows 1P3D25.16: the three axes and the
    origin.
    """
    block.line()
    block.line()
    while not block.done:
        number, kind = block.integers(2)[:2]
        block.line()
        rows = block.reals(12, 25).reshape(4, 3)
        if kind != _CARTESIAN:
            found.curved[number] = kind
        if kind not in (_CARTESIAN, _CYLINDRICAL):
            continue
        if not np.allclose(rows[:3] @ rows[:3].T, np.eye(3), atol=1e-4):
            raise InputError(
                block.where,
                f"coordinate system {number} has axes that are not perpendicular unit vectors",
                fix=EXPORT,
            )
        found.systems[number] = (0, rows[:3], rows[3])


def _lines82(block: Block, found: _Found) -> None:
    """3I10 (number, count, colour), a name, then nodes 8I10; 0 lifts the pen."""
    count = block.integers(2)[1]
    block.line()
    nodes: list[int] = []
    while len(nodes) < count:
        nodes += block.integers(1)
    run: list[int] = []
    for node in [*nodes[:count], 0]:
        if node:
            run.append(node)
        elif len(run) > 1:
            found.lines.append(tuple(run))
        if not node:
            run = []


def _rods2412(block: Block, found: _Found) -> None:
    """6I10 an element (number, type, ..., nodes), for rods and beams 3I10, then the nodes 8I10; those of two
    nodes are lines.
    """
    while not block.done:
        kind, count = (values := block.integers(6))[1], values[5]
        if kind in _WITH_SECTION:
            block.integers(3)
        nodes: list[int] = []
        while len(nodes) < count:
            nodes += block.integers(min(8, count - len(nodes)))
        if count == 2:
            found.lines.append((nodes[0], nodes[1]))


def _units164(block: Block, found: _Found) -> None:
    """I10,20A1,I10, then 1P3D25.17: what lengths and forces are divided by to be SI, and more."""
    block.line()
    factor = float(block.reals(3, 25)[0])
    if factor <= 0:
        raise InputError(
            block.where, f"unit of length {factor:g} in dataset 164", "a positive number", EXPORT
        )
    if found.length is not None and not np.isclose(found.length, 1 / factor, rtol=1e-9):
        said = f"1 m = {factor:g} of the file, {1 / found.length:g} before"
        raise InputError(block.where, said, "one dataset 164", "remove the wrong one")
    found.length = 1 / factor


def geometry_text(geometry: MeasuredGeometry) -> str:
    """Datasets 164 (SI), 18 (where channels do not look along the common axes), 15 and 82 of a geometry."""
    local = [n for n, axes in enumerate(geometry.axes) if not np.allclose(axes, np.eye(3), atol=1e-12)]
    systems = {n: 2 + k for k, n in enumerate(local)}
    parts = ["".join(f"{value:25.17E}" for value in (1.0, 1.0, 1.0)) + f"\n{273.15:25.17E}\n"]
    text = f"    -1\n   164\n{1:10d}{'SI: Meter (newton)':20s}{2:10d}\n{parts[0]}    -1\n"
    if systems:
        text += (
            "    -1\n    18\n"
            + "".join(_system_text(number, geometry.axes[n]) for n, number in systems.items())
            + "    -1\n"
        )
    text += "    -1\n    15\n"
    for n, node in enumerate(geometry.nodes):
        text += f"{node:10d}{0:10d}{systems.get(n, 0):10d}{1:10d}" + reals_text(geometry.position_m[n])
    text += "    -1\n"
    for number, line in enumerate(geometry.lines, start=1):
        nodes = "".join(
            "".join(f"{node:10d}" for node in line[start : start + 8]) + "\n"
            for start in range(0, len(line), 8)
        )
        text += f"    -1\n    82\n{number:10d}{len(line):10d}{1:10d}\nNONE\n{nodes}    -1\n"
    return text


def _system_text(number: int, axes: Array) -> str:
    points = np.concatenate([np.zeros(3), axes[0], axes[2]])
    return f"{number:10d}{0:10d}{0:10d}{1:10d}{1:10d}\nSYS{number}\n" + reals_text(points)


def reals_text(values: Array) -> str:
    """Numbers 6E13.5, as many lines as needed."""
    numbers = [f"{value:13.5E}" for value in values.tolist()]
    return "".join("".join(numbers[i : i + 6]) + "\n" for i in range(0, len(numbers), 6))

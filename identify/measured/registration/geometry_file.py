"""The geometry of a test from whichever file has it: a universal file, or a CSV of nodes in one frame.

Columns of a CSV, in any order: `node`; `x`, `y` and `z`, or `x_m`, `x_mm`, `x_cm`, `x_in` or `x_ft` and so
on; and either `rx_deg`, `ry_deg`, `rz_deg` (the sensor's axes are those of the frame turned about its fixed
x, y, z in that order) or `nx`, `ny`, `nz` (its Z looks along this normal, turned about it anyhow).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from identify.core.arrays import Array
from identify.core.errors import InputError, InputErrors
from identify.core.text_input import finite, node_number, read_csv
from identify.measured.geometry import MeasuredGeometry
from identify.measured.loaders import FORMAT_OF_SUFFIX
from identify.measured.uff.blocks import has_functions
from identify.measured.uff.geometry import LENGTH_M, has_geometry, length_in, read_geometry
from identify.robot.points import ANGLES
from identify.robot.pose import pose

_NORMAL = ("nx", "ny", "nz")
_UNITS = ("", *LENGTH_M)
_EXPECTED = "a CSV of nodes: node,x_m,y_m,z_m"


def has_nodes(path: Path, form: str | None = None) -> bool:
    """Whether a file has a geometry: a universal one with nodes, or a CSV of them; form: of the file, which
    else its suffix tells.
    """
    return has_geometry(path, form) or (form is None and _is_table(path))


def nodes_alone(path: Path) -> bool:
    """Whether a file has a geometry and no FRFs."""
    return _is_table(path) or (has_geometry(path) and not has_functions(path))


def geometry_of(path: Path, length_unit: str | None = None) -> MeasuredGeometry:
    """Nodes and directions of their channels, in m; length_unit: of a file that does not say it, by default
    m.

    InputError as `read_geometry`, and with the line of a CSV for what is no number, and InputErrors for
    several.
    """
    return _table(path, length_unit) if _is_table(path) else read_geometry(path, length_unit, or_else="m")


def _is_table(path: Path) -> bool:
    """A CSV file with nodes and coordinates, without links, which would make it one of points."""
    if FORMAT_OF_SUFFIX.get(path.suffix.lower()) != "csv" or not path.is_file():
        return False
    header = next((cells for _, _, cells in read_csv(path, _EXPECTED) if cells), [])
    names = [name.strip().lower() for name in header]
    return "node" in names and "link" not in names and _coordinates(names) is not None


def _coordinates(names: Sequence[str]) -> str | None:
    """The unit in the names of the coordinates, empty where they say none; None where there are none."""
    for unit in _UNITS:
        if all((f"{axis}_{unit}" if unit else axis) in names for axis in "xyz"):
            return unit
    return None


class _Columns(NamedTuple):
    """The columns of a CSV by name; those of coordinates and of what turns a node's axes, by number; scale: m
    per unit of coordinates.
    """

    names: list[str]
    place: list[int]
    turn: list[int]
    scale: float


def _table(path: Path, length_unit: str | None) -> MeasuredGeometry:
    (first, header), *rows = [
        (f"{path} line {number}", cells)
        for number, _, cells in read_csv(path, _EXPECTED, skip_space=True)
        if cells
    ]
    columns = _columns(path, first, header, length_unit)
    known, places, axes, faults = dict[int, str](), list[Array](), list[Array](), list[InputError]()
    for where, cells in rows:
        try:
            node, place, turn = _row(where, cells, columns, known)
        except InputError as fault:
            faults.append(fault)
            continue
        known[node] = where
        places.append(place)
        axes.append(turn)
    if faults:
        raise InputErrors(faults)
    if not known:
        raise InputError(str(path), "no nodes", "a line for each node")
    order = np.argsort(list(known))
    return MeasuredGeometry(tuple(sorted(known)), np.array(places)[order], np.array(axes)[order])


def _columns(path: Path, where: str, header: Sequence[str], length_unit: str | None) -> _Columns:
    names = [name.strip().lower() for name in header]
    said = _coordinates(names) or ""
    scale = length_in(str(path), LENGTH_M[said] if said else None, length_unit or (None if said else "m"))
    place = [names.index(f"{axis}_{said}" if said else axis) for axis in "xyz"]
    turned = next((own for own in (ANGLES, _NORMAL) if all(name in names for name in own)), ())
    known = {"node", *turned, *(names[n] for n in place), "name", ""}
    unknown = [name for name in names if name not in known]
    if unknown:
        found = f"the columns {', '.join(unknown)}"
        raise InputError(where, found, f"{_EXPECTED}, {','.join(ANGLES)} or nx,ny,nz")
    return _Columns(names, place, [names.index(name) for name in turned], scale)


def _row(
    where: str, cells: Sequence[str], columns: _Columns, known: Mapping[int, str]
) -> tuple[int, Array, Array]:
    """Number of a node, where it is (3,), m, and its axes (3, 3)."""
    names = columns.names
    if len(cells) != len(names):
        raise InputError(where, f"{len(cells)} cells", f"{len(names)}, as in the first line")
    node = node_number(where, cells[names.index("node")].strip())
    if node in known:
        raise InputError(where, f"node {node} is given already ({known[node]})", "one line per node")
    place, turn = (
        np.array([finite(where, names[n], cells[n]) for n in own]) for own in (columns.place, columns.turn)
    )
    return node, columns.scale * place, _axes(where, tuple(names[n] for n in columns.turn), turn)


def _axes(where: str, turned: tuple[str, ...], values: Array) -> Array:
    """(3, 3): rows are the directions of a sensor."""
    if turned == ANGLES:
        return np.asarray(pose(np.zeros(3), np.radians(values))[:3, :3].T)
    if turned != _NORMAL:
        return np.eye(3)
    length = float(np.linalg.norm(values))
    if length == 0:
        raise InputError(where, "a normal of 0, 0, 0", "the direction that the sensor looks in")
    z = values / length
    x = np.eye(3)[int(np.argmin(np.abs(z)))]
    x = x - (x @ z) * z
    x /= np.linalg.norm(x)
    return np.array([x, np.cross(z, x), z])

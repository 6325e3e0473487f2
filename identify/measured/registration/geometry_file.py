"""The geometry of a test from whichever file has it: a universal file, or a CSV of nodes in one frame.

Columns of a CSV, in any order: `node`; `x`, `y` and `z`, or `x_m`, `x_mm`, `x_cm`, `x_in` or `x_ft` and so
on; and either `rx_deg`, `ry_deg`, `rz_deg` (the sensor's axes are those of the frame turned about its fixed
x, y, z in that order) or `nx`, `ny`, `nz` (its Z looks along this normal, turned about it anyhow).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from identify.core.arrays import Array
from identify.core.errors import InputError, InputErrors
from identify.core.text_input import LARGEST, read_csv
from identify.measured.geometry import MeasuredGeometry
from identify.measured.loaders import FORMAT_OF_SUFFIX
from identify.measured.uff.blocks import has_functions
from identify.measured.uff.geometry import LENGTH_M, has_geometry, length_in, read_geometry
from identify.robot.pose import pose

_ANGLES, _NORMAL = ("rx_deg", "ry_deg", "rz_deg"), ("nx", "ny", "nz")
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


def _table(path: Path, length_unit: str | None) -> MeasuredGeometry:
    rows = [(number, cells) for number, _, cells in read_csv(path, _EXPECTED, skip_space=True) if cells]
    names = [name.strip().lower() for name in rows[0][1]]
    said = _coordinates(names) or ""
    scale = length_in(str(path), LENGTH_M[said] if said else None, length_unit or (None if said else "m"))
    columns = [names.index(f"{axis}_{said}" if said else axis) for axis in "xyz"]
    turned = next((own for own in (_ANGLES, _NORMAL) if all(name in names for name in own)), ())
    turns = [names.index(name) for name in turned]
    known = {"node", *turned, *(names[n] for n in columns), "name", ""}
    unknown = [name for name in names if name not in known]
    if unknown:
        found = f"the columns {', '.join(unknown)}"
        raise InputError(f"{path} line {rows[0][0]}", found, f"{_EXPECTED}, {','.join(_ANGLES)} or nx,ny,nz")
    nodes, places, axes = dict[int, str](), [], []
    faults = []
    for number, cells in rows[1:]:
        where = f"{path} line {number}"
        try:
            node = _node(where, cells, names, nodes)
            place, turn = (
                np.array([_number(where, names[n], cells[n]) for n in own]) for own in (columns, turns)
            )
            axes.append(_axes(where, turned, turn))
        except InputError as fault:
            faults.append(fault)
            continue
        nodes[node] = where
        places.append(scale * place)
    if faults:
        raise InputErrors(faults)
    if not nodes:
        raise InputError(str(path), "no nodes", "a line for each node")
    order = np.argsort(list(nodes))
    return MeasuredGeometry(tuple(sorted(nodes)), np.array(places)[order], np.array(axes)[order])


def _node(where: str, cells: Sequence[str], names: Sequence[str], known: dict[int, str]) -> int:
    if len(cells) != len(names):
        raise InputError(where, f"{len(cells)} cells", f"{len(names)}, as in the first line")
    text = cells[names.index("node")].strip()
    if not (text.isascii() and text.isdigit() and int(text) > 0):
        raise InputError(where, f"node {text!r}", "a positive whole number")
    if int(text) in known:
        raise InputError(where, f"node {text} is given already ({known[int(text)]})", "one line per node")
    return int(text)


def _number(where: str, column: str, text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not abs(value) < LARGEST:
        raise InputError(where, f"{column} is {text!r}", "a finite number")
    return value


def _axes(where: str, turned: tuple[str, ...], values: Array) -> Array:
    """(3, 3): rows are the directions of a sensor."""
    if turned == _ANGLES:
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

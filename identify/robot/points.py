"""Measurement points: where sensors and hammer impacts are on the robot, read from a CSV file.

Columns `node, name, link, x_m, y_m, z_m` in any order: the number used in the measured data, a free label,
the link or frame that carries the point, and the position in that link's frame.  The optional columns
`rx_deg, ry_deg, rz_deg` turn the sensor: its axes are those of the link turned about the link's fixed x, y, z
axes in that order (the convention of URDF's rpy).
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import scipy

from identify.core.arrays import Array
from identify.core.errors import InputError, InputErrors
from identify.core.text_input import finite, joined, node_number, read_csv
from identify.robot.description import Robot
from identify.robot.pose import pose

COLUMNS = ("node", "name", "link", "x_m", "y_m", "z_m")
ANGLES = ("rx_deg", "ry_deg", "rz_deg")
_TURNED = 1e-6


@dataclass(frozen=True)
class Point:
    """A point fixed to a link or frame: position (3,), m, in its axes; the rows of axes (3, 3) are the
    sensor's x, y, z in its axes.

    `axes @ v` are the sensor's readings of a vector v in link axes; where says the file and line, for errors.
    """

    node: int
    name: str
    link: str
    position: Array
    axes: Array
    where: str


def read_points(path: Path) -> dict[int, Point]:
    """The points of a CSV file by node number.

    Raises InputError for a file without the columns and InputErrors for every row with a doubled node or
    something that is no number.
    """
    rows = [
        (number, cells) for number, _, cells in read_csv(path, "a CSV file of measurement points") if cells
    ]
    if not rows:
        raise InputError(path.name, "the file is empty", f"a first line with the columns {','.join(COLUMNS)}")
    header = _header(path, *rows[0])
    points: dict[int, Point] = {}
    faults: list[InputError] = []
    for number, cells in rows[1:]:
        where = f"{path.name} line {number}"
        try:
            point = _point(where, header, cells)
        except InputError as fault:
            faults.append(fault)
            continue
        if point.node in points:
            faults.append(
                InputError(
                    where,
                    f"node {point.node} is given already ({points[point.node].where})",
                    "one line per node",
                )
            )
        points[point.node] = point
    if faults:
        raise InputErrors(faults)
    if not points:
        raise InputError(path.name, "no points", "a line per measurement point")
    return points


def points_text(path: Path, points: Mapping[int, Point]) -> str:
    """The text of a CSV file of points with other links, positions and axes of sensors, by node; all else, of
    what has a line, as it was.
    """
    lines = read_csv(path, "a CSV file of measurement points")
    header = next(cells for _, _, cells in lines if cells)
    turned = any(name in header for name in ANGLES)
    wide = turned or any(np.abs(point.axes - np.eye(3)).max() > 0 for point in points.values())
    columns = [*header, *(ANGLES if wide and not turned else ())]
    nominal = read_points(path)
    written = []
    for _, text, cells in lines:
        if cells is header:
            written.append(joined(columns) if columns != header else text)
        elif cells:
            old = dict(zip(header, cells, strict=True))
            new = _cells(nominal[int(old["node"])], points.get(int(old["node"])), wide=wide)
            row = {**dict.fromkeys(columns, "0"), **old, **new}
            written.append(joined([row[name] for name in columns]))
        else:
            written.append(text)
    return "\n".join(written) + "\n"


def as_written(point: Point) -> Point:
    """The point as a new file of points has it, to 0.01 mm and 0.001 degrees."""
    turn = np.round(_turn_deg(point), 3)
    axes = np.eye(3) if not turn.any() else pose(np.zeros(3), np.radians(turn))[:3, :3].T
    return replace(point, position=np.round(point.position, 5) + 0.0, axes=axes)


def _turn_deg(point: Point) -> Array:
    """Angles (3,) about the link's fixed x, y, z, in that order, that turn its axes to those of the point."""
    turn = scipy.spatial.transform.Rotation.from_matrix(point.axes.T)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # a quarter turn about y: several angles say the same
        return np.asarray(turn.as_euler("xyz", degrees=True))


def new_points_text(points: Mapping[int, Point]) -> str:
    """The text of a CSV file of points that has no lines yet."""
    wide = any(np.abs(point.axes - np.eye(3)).max() > _TURNED for point in points.values())
    lines = [joined([*COLUMNS, *(ANGLES if wide else ())])]
    for node, point in points.items():
        cells = [f"{x:.5f}" for x in point.position]
        cells += [f"{x:.3f}" for x in _turn_deg(point)] if wide else []
        lines.append(joined([str(node), point.name, point.link, *cells]))
    return "\n".join(lines) + "\n"


def _cells(nominal: Point, point: Point | None, *, wide: bool) -> dict[str, str]:
    """The cells that say where a point is and how its sensor is turned; none where it is as stated."""
    if point is None:
        return {}
    found = {"link": point.link}
    if np.all(point.position == nominal.position) and np.all(point.axes == nominal.axes):
        return found
    found |= {name: f"{x:.9g}" for name, x in zip(COLUMNS[3:], point.position, strict=True)}
    if wide and np.any(point.axes != nominal.axes):
        found |= {name: f"{x:.9g}" for name, x in zip(ANGLES, _turn_deg(point), strict=True)}
    return found


def check_links(points: Mapping[int, Point], robot: Robot) -> None:
    """Raise InputErrors with every point that is on no link or frame of the robot."""
    known = [link.name for link in robot.links] + list(robot.frames)
    lost = [point for point in points.values() if point.link not in known]
    if lost:
        raise InputErrors(
            [
                InputError(point.where, f"unknown link {point.link!r}", "one of " + ", ".join(known))
                for point in lost
            ]
        )


def _header(path: Path, number: int, cells: list[str]) -> list[str]:
    where = f"{path.name} line {number}"
    missing = [name for name in COLUMNS if name not in cells]
    if missing:
        found = f"no column {', '.join(missing)} in {','.join(cells)!r}"
        raise InputError(where, found, f"the columns {','.join(COLUMNS)}, separated by commas")
    unknown = [name for name in cells if name not in (*COLUMNS, *ANGLES)]
    if unknown or len(set(cells)) != len(cells):
        raise InputError(
            where,
            f"unknown or doubled columns in {','.join(cells)!r}",
            f"only {','.join((*COLUMNS, *ANGLES))}",
        )
    if 0 < sum(name in cells for name in ANGLES) < len(ANGLES):
        raise InputError(
            where, "only a part of the sensor's orientation", f"all of {','.join(ANGLES)}, or none"
        )
    return cells


def _point(where: str, header: list[str], cells: list[str]) -> Point:
    if len(cells) != len(header):
        raise InputError(where, f"{len(cells)} cells", f"{len(header)}, as in the first line")
    row = dict(zip(header, cells, strict=True))
    node = node_number(where, row["node"])
    if not row["link"]:
        raise InputError(where, "the link is empty", "the name of a link or frame of the robot")
    position = np.array([finite(where, name, row[name]) for name in COLUMNS[3:]])
    turn = pose(np.zeros(3), np.radians([finite(where, name, row.get(name, "0")) for name in ANGLES]))[:3, :3]
    return Point(node, row["name"], row["link"], position, turn.T, where)

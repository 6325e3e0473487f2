"""What a map is asked for, read from its options and checked before the work begins; places of a
workpiece, and the postures that put the tool there.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from identify.batch.posture_table import read_postures
from identify.core.arrays import Array
from identify.core.errors import InputError
from identify.machining.run_deflection import parse_force
from identify.machining.tool import Tool, read_tool
from identify.map.limits import KINDS, Wanted
from identify.robot.points import Point
from identify.robot.reach import about, placed, reached, shortest
from identify.vibration.fitted_model import FittedModel, check_band, tool_point

_WITHOUT_BAND_HZ = (1.0, 100.0)
_EXPECTED = "X1:X2:COUNT,Y1:Y2:COUNT,Z1:Z2:COUNT in metres, such as 1.2:1.8:7,-0.4:0.4:5,0.8:0.8:1"


@dataclass(frozen=True)
class MapOptions:
    """What is mapped: postures from a table (`name`, `joint1_deg`, ...) or a grid (joint number: first, last,
    how many; the other joints as in the first fitted posture); for the point with a node (default: the last);
    lines over a band, Hz; how many modes.

    limit: of `identify.map.limits.KINDS`, with cutter, the file of a milling tool, rpm, its spindle speeds
    (default: the highest), and feeds about the spindle, or with a force FX,FY,FZ, N.  workpiece: places of
    the tip of the cutter instead of postures, with turns about the spindle, X1:X2:COUNT,... and spindle
    X,Y,Z (`identify.map.asked`).  like: results of other robots of the type, whose measured postures tell
    of this one too.
    """

    postures: Path | None = None
    grid: tuple[tuple[int, float, float, int], ...] = ()
    tool: int | None = None
    band_hz: tuple[float, float] | None = None
    lines: int = 100
    modes: int = 6
    limit: str | None = None
    cutter: Path | None = None
    rpm: tuple[float, ...] = ()
    feeds: int = 1
    force: str | None = None
    workpiece: str | None = None
    turns: int = 1
    spindle: str | None = None
    like: tuple[Path, ...] = ()


def parse_grid(text: str) -> tuple[int, float, float, int]:
    """One axis of a grid from `JOINT:FIRST:LAST:COUNT`; InputError for another text."""
    try:
        joint, first, last, count = text.split(":")
        return int(joint), float(first), float(last), int(count)
    except ValueError as error:
        raise InputError(
            "--grid", f"{text!r}", "JOINT:FIRST:LAST:COUNT, degrees, such as 2:-60:60:9"
        ) from error


@dataclass(frozen=True)
class Asked:
    """Names and postures (n, joints), rad; lines (l,), Hz; the point that is looked at; the limit, if any;
    notes: what could not be done.
    """

    names: list[str]
    postures: Array
    line_hz: Array
    point: Point
    wanted: Wanted | None
    notes: tuple[str, ...]


def asked_of(fitted: FittedModel, options: MapOptions) -> Asked:
    """Raises InputError or InputErrors for postures, places, points and tools that cannot be."""
    tool = None if options.cutter is None else read_tool(options.cutter).study
    where = str(options.cutter)
    if tool is not None and options.tool is not None:
        raise InputError("--tool", "with a cutter, which says where it is", "one of the two")
    point = tool_point(fitted, options.tool) if tool is None else tool.point(fitted, where)
    wanted = _wanted(options, tool)
    notes: tuple[str, ...] = ()
    _one_source(options)
    if options.workpiece is None:
        names, postures = _postures(fitted, options)
    else:
        names, postures, notes = _placed(fitted, options, tool, point)
    line_hz = _lines(fitted, options)
    if wanted is not None and wanted.kind == "depth" and tool is not None:
        for posture in postures:  # a feed along the spindle is refused now
            tool.axes(placed(fitted.robot, posture, point.link, point.position)[1], where=where)
    return Asked(names, postures, line_hz, point, wanted, notes)


def _wanted(options: MapOptions, tool: Tool | None) -> Wanted | None:
    kind = options.limit
    if kind is None:
        for name in ("rpm", "force"):
            if getattr(options, name):
                raise InputError(f"--{name}", "without `--limit`", "`--limit depth` or `--limit deflection`")
        return None
    if kind not in KINDS:
        raise InputError("--limit", repr(kind), "one of " + ", ".join(KINDS))
    if kind == "deflection":
        if options.force is None:
            raise InputError("--limit deflection", "no force", "`--force 100,0,-50`, N, in the base's axes")
        return Wanted(kind, force=tuple(parse_force(options.force).tolist()))
    return _depth(options, tool) if kind == "depth" else Wanted(kind)


def _depth(options: MapOptions, tool: Tool | None) -> Wanted:
    if tool is None:
        raise InputError("--limit depth", "no milling tool", "`--cutter tool.yaml`")
    if options.feeds < 1 or any(not np.isfinite(one) or one <= 0 for one in options.rpm):
        raise InputError("--rpm, --feeds", f"{options.rpm}, {options.feeds}", "numbers above 0")
    return Wanted("depth", tool, options.rpm or (tool.spindle_rpm[1],), options.feeds)


def _placed(
    fitted: FittedModel, options: MapOptions, tool: Tool | None, point: Point
) -> tuple[list[str], Array, tuple[str, ...]]:
    if tool is None:
        raise InputError("--workpiece", "no milling tool, whose tip goes there", "`--cutter tool.yaml`")
    if options.turns < 1:
        raise InputError("--turns", str(options.turns), "1 or more")
    spindle = None if options.spindle is None else parse_spindle(options.spindle)
    piece = Workpiece(parse_workpiece(str(options.workpiece)), options.turns, spindle)
    axis = np.array(tool.spindle_axis) / np.linalg.norm(tool.spindle_axis)
    names, postures, missed = postures_of(fitted, point, axis, piece)
    of = missed + len(names)
    said = f"{missed} of {of} places and turns are out of reach, or were not found, and are left out"
    return names, postures, (said,) if missed else ()


def _one_source(options: MapOptions) -> None:
    given = [options.postures is not None, bool(options.grid), options.workpiece is not None]
    if sum(given) != 1:
        raise InputError(
            "identify map",
            "none or several of a table, a grid and a workpiece",
            "`--postures table.csv`, `--grid 2:-60:60:9`, or `--workpiece`",
        )


def _postures(fitted: FittedModel, options: MapOptions) -> tuple[list[str], Array]:
    """Names and postures (n, joints), rad, of the table or the grid."""
    joints = len(fitted.robot.joints)
    if options.postures is not None:
        return read_postures(options.postures, joints)[:2]
    axes = [np.rad2deg(fitted.posture)[joint : joint + 1] for joint in range(joints)]
    asked = [joint for joint, *_ in options.grid]
    for joint, first, last, count in options.grid:
        if not 1 <= joint <= joints or count < 1 or not np.isfinite([first, last]).all():
            raise InputError(
                "--grid",
                f"joint {joint} in {count} steps from {first:g} to {last:g}",
                f"a joint from 1 to {joints} and at least one step between two angles",
            )
        if asked.count(joint) > 1:
            raise InputError("--grid", f"joint {joint} twice", "each joint once")
        axes[joint - 1] = np.linspace(first, last, count)
    found = np.deg2rad(np.array(list(itertools.product(*axes))))
    return [f"p{number:0{len(str(len(found)))}d}" for number in range(1, len(found) + 1)], found


def _lines(fitted: FittedModel, options: MapOptions) -> Array:
    low, high = options.band_hz or fitted.band_hz or _WITHOUT_BAND_HZ
    check_band((low, high))
    if options.lines < 2:
        raise InputError("--lines", str(options.lines), "two or more")
    return np.linspace(low, high, options.lines)


@dataclass(frozen=True)
class Workpiece:
    """Places (n, 3), m, in the base's axes; turns: how many angles about the spindle at each, evenly over a
    turn; spindle (3,): its direction towards the tip in the base's axes, None: that of the fit's first
    posture.
    """

    places: Array
    turns: int = 1
    spindle: Array | None = None


def parse_workpiece(text: str) -> Array:
    """(n, 3), m, from three ranges; InputError for another text."""
    try:
        axes = []
        for part in text.split(","):
            first, last, count = part.split(":")
            axes.append(np.linspace(float(first), float(last), int(count)))
        found = np.array(list(itertools.product(*axes)))
    except ValueError as error:
        raise InputError("--workpiece", repr(text), _EXPECTED) from error
    if found.ndim != 2 or found.shape[1] != 3 or not np.isfinite(found).all():
        raise InputError("--workpiece", repr(text), _EXPECTED)
    return found


def parse_spindle(text: str) -> Array:
    """(3,) from `X,Y,Z`; InputError for another text."""
    try:
        found = np.array([float(part) for part in text.split(",")])
    except ValueError:
        found = np.array([])
    if found.shape != (3,) or not np.isfinite(found).all() or not found.any():
        raise InputError(
            "--spindle", repr(text), "X,Y,Z, from the spindle to the tip in the base's axes, such as 0,0,-1"
        )
    return found


def postures_of(
    model: FittedModel, point: Point, axis: Array, piece: Workpiece
) -> tuple[list[str], Array, int]:
    """Names and postures (n, joints), rad, that the robot reaches, and how many it does not; axis (3,): from
    spindle to tip, in the axes of the link that carries the point.

    InputError where it reaches none.
    """
    robot, first = model.robot, model.posture
    attitude = placed(robot, first, point.link, point.position)[1]
    wanted = attitude @ axis if piece.spindle is None else piece.spindle
    attitude = shortest(attitude @ axis, wanted) @ attitude
    names, found, last = [], [], first
    turns = np.arange(piece.turns) * 2 * np.pi / piece.turns
    width = len(str(len(piece.places)))
    for number, place in enumerate(piece.places, 1):
        for turn in turns:
            axes = about(wanted, float(turn)) @ attitude
            posture = reached(robot, point.link, point.position, place, axes, [first, last])
            if posture is None:
                continue
            last = posture
            said = f" turned {np.degrees(turn):.0f}°" if piece.turns > 1 else ""
            names.append(f"place{number:0{width}d}{said}")
            found.append(posture)
    if not found:
        raise InputError(
            "--workpiece", "no place that the robot reaches so", "places within reach", "see `--spindle`"
        )
    return names, np.array(found), len(piece.places) * piece.turns - len(found)

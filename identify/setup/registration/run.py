"""`identify points`: from a robot, its posture and the files of a test to where each node is."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from identify.core.arrays import Array
from identify.core.errors import InputError
from identify.core.text import count, listed
from identify.measured.frf_records import FrfFileOptions
from identify.measured.geometry import MeasuredGeometry
from identify.measured.uff.blocks import has_functions
from identify.measured.uff.geometry import has_geometry, read_geometry
from identify.robot.chain import Choice
from identify.robot.description import Robot
from identify.robot.points import Point, check_links, read_points
from identify.robot.read import read_robot, settings_of
from identify.robot.visual import Looks, looks
from identify.setup.registration.align import Pairs, Task
from identify.setup.registration.register import Node, Registration, register
from identify.setup.registration.surface import skins
from identify.vibration.starter import loaded

_WHOLE = 2**31
"""Triangles of a mesh that is measured, not drawn: all."""
SURE = 0.95
"""Probability of a link below which it is to be looked at."""
_FAR = 4.0
"""Scales of the distances of nodes beyond which one is to be looked at."""
_ASLANT = 30.0
"""Degrees from the normal of the surface beyond which an only axis is to be looked at."""


@dataclass(frozen=True)
class Placing:
    """A robot with its joints at stated angles (joints,), rad, and what is known of the nodes of a test.

    nodes: their numbers, in order; points: those that have a place; doubts: by node, what is to be looked at;
    notes: what is to be said of all of them.
    """

    robot: Robot
    shown: Looks
    angles: Array
    nodes: tuple[int, ...] = ()
    points: Mapping[int, Point] | None = None
    doubts: Mapping[int, str] | None = None
    notes: tuple[str, ...] = ()
    geometry: MeasuredGeometry | None = None
    registration: Registration | None = None


@dataclass(frozen=True)
class Asked:
    """posture_deg: stated angles, none for all 0; angle_deg: one standard deviation of each; pair_m: of the
    places of pairs; pairs: a file of points; choice, arguments: which part of the description is the arm, and
    of a xacro.
    """

    posture_deg: Sequence[float] = ()
    angle_deg: float = 3.0
    pairs: Path | None = None
    pair_m: float = 0.03
    length_unit: str | None = None
    choice: Choice = field(default_factory=Choice)
    arguments: Mapping[str, str] = field(default_factory=dict)


def place_points(robot_file: Path, data: Sequence[Path], asked: Asked) -> Placing:
    """The nodes of files on a robot; without a geometry in them, their numbers alone.

    InputError for a file that cannot be read, or nodes that fit nowhere.
    """
    settings = settings_of(robot_file, asked.choice, asked.arguments)
    robot = read_robot(settings, Path(), unknown_bodies=True)
    stated = np.radians(asked.posture_deg or [0.0] * len(robot.joints))
    if len(stated) != len(robot.joints):
        expected = f"{len(robot.joints)}, one per joint ({', '.join(j.name for j in robot.joints)})"
        raise InputError("--posture", f"{len(stated)} angles", expected)
    channels = _channels(data)
    plain = Placing(robot, looks(robot, _WHOLE), stated, tuple(sorted(channels)))
    source = next((path for path in data if has_geometry(path)), None)
    if source is None:
        for option, value in (("--pairs", asked.pairs), ("--length-unit", asked.length_unit)):
            if value is not None:
                found = f"{value}, and no geometry in the data"
                raise InputError(option, found, "a universal file with a geometry (datasets 15 or 2411)")
        return replace(plain, notes=plain.shown.missing)
    if not asked.posture_deg:
        joints = ", ".join(joint.name for joint in robot.joints)
        found = f"the geometry of {source.name}, and no posture"
        raise InputError("--posture", found, f"the angles of {joints} in degrees, such as 0,30,-60,0,45,0")
    geometry = read_geometry(source, asked.length_unit, or_else="m")
    task = Task(
        robot,
        skins(robot, plain.shown, stated),
        geometry.position_m,
        stated,
        np.full(len(stated), np.radians(asked.angle_deg)),
        _pairs(asked, robot, geometry),
    )
    return _placed(plain, geometry, register(task, geometry), channels)


def _channels(data: Sequence[Path]) -> dict[int, set[int]]:
    """Of the nodes of measured FRFs: their axes, 1 to 3."""
    found: dict[int, set[int]] = {}
    for path in data:
        if has_geometry(path) and not has_functions(path):
            continue
        frfs, _ = loaded([path], FrfFileOptions())
        for channel in (*frfs.outputs, *frfs.inputs):
            found.setdefault(channel.node, set()).add(abs(channel.direction))
    return found


def _pairs(asked: Asked, robot: Robot, geometry: MeasuredGeometry) -> Pairs:
    """Points of a file for nodes of the geometry."""
    if asked.pairs is None:
        return Pairs()
    points = read_points(asked.pairs)
    check_links(points, robot)
    lost = [str(node) for node in points if node not in geometry.nodes]
    if lost:
        raise InputError(str(asked.pairs), f"nodes {listed(lost)}", "nodes of the geometry")
    names = [link.name for link in robot.links]
    rows, links, places = [], [], []
    for point in points.values():
        link, pose = robot.carrier(point.link)
        rows.append(geometry.nodes.index(point.node))
        links.append(names.index(link))
        places.append(pose[:3, :3] @ point.position + pose[:3, 3])
    return Pairs(np.array(rows), np.array(links), np.array(places), asked.pair_m)


def _placed(
    plain: Placing, geometry: MeasuredGeometry, found: Registration, channels: Mapping[int, Collection[int]]
) -> Placing:
    on = [one for one in found.nodes if one.link]
    points = {
        one.node: Point(one.node, "", one.link, one.position, one.axes, f"node {one.node}") for one in on
    }
    doubts = {one.node: "; ".join(doubts_of(one, found, channels.get(one.node, ()))) for one in found.nodes}
    return replace(
        plain,
        nodes=geometry.nodes,
        points=points,
        doubts={node: text for node, text in doubts.items() if text},
        notes=(*_notes(plain, found), *plain.shown.missing),
        geometry=geometry,
        registration=found,
    )


def doubts_of(one: Node, found: Registration, axes: Collection[int]) -> Iterator[str]:
    """What is to be looked at of a node whose FRFs have these axes."""
    if not one.link:
        yield "on no link: it is left out"
        return
    if one.probability < SURE:
        other = f"or on {one.other}" if one.other else "or on none"
        yield f"on {one.link} ({100 * one.probability:.0f} %) {other}"
    if abs(one.height_m) > _FAR * max(found.scale_m, one.spread_m):
        where = "above" if one.height_m > 0 else "below"
        yield f"{1000 * abs(one.height_m):.0f} mm {where} the surface"
    only = [axis for axis in axes if 1 <= axis <= 3]
    if len(only) == 1:
        angle = np.degrees(np.arccos(min(abs(float(one.axes[only[0] - 1] @ one.normal)), 1.0)))
        if angle > _ASLANT:
            name = "XYZ"[only[0] - 1]
            yield f"its only axis, {name}, is {angle:.0f}° from the normal of the surface"


def _notes(plain: Placing, found: Registration) -> Iterator[str]:
    """What is to be said of a registration."""
    if found.rivals:
        yield (
            f"the geometry lies as well on the robot in {count(found.rivals, 'other way')}: pair three nodes"
            " with places on links (`--pairs`)"
        )
    if found.unit != 1:
        yield f"lengths of the geometry are {found.unit:.4g} times what its unit says, and were taken so"
    off = np.degrees(found.angles - plain.angles)
    spread = np.degrees(found.angle_spread)
    wrong = [
        f"{joint.name} {np.degrees(q):.1f} ± {s:.1f}°, not {np.degrees(p):.1f}°"
        for joint, p, q, d, s in zip(plain.robot.joints, plain.angles, found.angles, off, spread, strict=True)
        if abs(d) > max(1.0, 2 * s)
    ]
    if wrong:
        yield f"the geometry was measured at other angles than stated: {listed(wrong)}"
    far = [f"{node} by {1000 * away:.0f} mm" for node, away in found.pairs_m.items() if away > 0.1]
    if far:
        yield f"pairs that are far off: {listed(far)}"

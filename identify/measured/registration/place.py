"""From a robot at stated angles and the geometry of a test to points on links, and their doubts: what
`identify points` does."""

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
from identify.measured.loaders import load_of_any_unit
from identify.measured.registration.align import Pairs, Task
from identify.measured.registration.geometry_file import geometry_of, has_nodes, nodes_alone
from identify.measured.registration.register import Node, Registration, register
from identify.measured.registration.settings import RegistrationSettings
from identify.measured.registration.surface import skins
from identify.robot.chain import Choice
from identify.robot.description import Robot
from identify.robot.points import Point, as_written, check_links, read_points
from identify.robot.read import read_robot, settings_of
from identify.robot.visual import Looks, looks

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

    nodes: their numbers, in order; points: those that have a place; notes: what is to be said of all of
    them; axes: of the channels at each node with FRFs, 1 to 3; said: what is to be known of nodes.
    """

    robot: Robot
    shown: Looks
    angles: Array
    nodes: tuple[int, ...] = ()
    points: Mapping[int, Point] | None = None
    notes: tuple[str, ...] = ()
    geometry: MeasuredGeometry | None = None
    registration: Registration | None = None
    axes: Mapping[int, Collection[int]] = field(default_factory=dict)
    said: Mapping[int, str] = field(default_factory=dict)

    @property
    def doubts(self) -> dict[int, str]:
        """What is to be looked at, by node."""
        if self.registration is None:
            return {}
        each = ((one, self.axes.get(one.node, ())) for one in self.registration.nodes)
        found = {one.node: "; ".join(doubts_of(one, self.registration, axes)) for one, axes in each}
        return {node: text for node, text in found.items() if text}


def unplaced(robot: Robot, angles: Array, nodes: tuple[int, ...] = ()) -> Placing:
    """The robot as it looks, with its joints at angles (joints,), rad, and none of its nodes placed."""
    return Placing(robot, looks(robot, _WHOLE), angles, nodes)


def placed(
    plain: Placing,
    geometry: MeasuredGeometry,
    pairs: Mapping[int, Point],
    settings: RegistrationSettings,
) -> Placing:
    """The nodes of a geometry on the robot; pairs: nodes whose place is roughly known.  Points are those that
    a file of them has.

    InputError for pairs that the geometry or the robot does not have, and for nodes that fit nowhere.
    """
    task = Task(
        plain.robot,
        skins(plain.robot, plain.shown, plain.angles),
        geometry.position_m,
        plain.angles,
        np.full(len(plain.angles), np.radians(settings.angle_error_deg)),
        _pairs(pairs, plain.robot, geometry, settings),
    )
    found = register(task, geometry)
    on = [one for one in found.nodes if one.link]
    points = {
        one.node: as_written(Point(one.node, "", one.link, one.position, one.axes, f"node {one.node}"))
        for one in on
    }
    return replace(
        plain,
        nodes=geometry.nodes,
        points=points,
        notes=(*_notes(plain, found), *plain.shown.missing),
        geometry=geometry,
        registration=found,
    )


def summary(placing: Placing) -> str:
    """How many nodes are placed, and how near to the surface they are."""
    placed_ones, found = count(len(placing.points or ()), "node"), placing.registration
    near = "" if found is None else f", {1000 * found.scale_m:.1f} mm (RMS) from its surface"
    return f"{placed_ones} of {len(placing.nodes)} on {placing.robot.name}{near}"


def _pairs(
    points: Mapping[int, Point], robot: Robot, geometry: MeasuredGeometry, settings: RegistrationSettings
) -> Pairs:
    if not points:
        return Pairs()
    check_links(points, robot)
    lost = [str(node) for node in points if node not in geometry.nodes]
    if lost:
        where = str(settings.pairs) if settings.pairs else "pairs"
        raise InputError(where, f"nodes {listed(lost)}", "nodes of the geometry")
    names = [link.name for link in robot.links]
    rows, links, places = [], [], []
    for point in points.values():
        link, pose = robot.carrier(point.link)
        rows.append(geometry.nodes.index(point.node))
        links.append(names.index(link))
        places.append(pose[:3, :3] @ point.position + pose[:3, 3])
    return Pairs(np.array(rows), np.array(links), np.array(places), settings.pair_error_m)


def doubts_of(one: Node, found: Registration, axes: Collection[int]) -> Iterator[str]:
    """What is to be looked at of a node whose FRFs have these axes."""
    if not one.link:
        yield "on no link: it is left out"
        return
    if one.probability < SURE:
        other = f"or on {one.other}" if one.other else "or on none"
        yield f"on {one.link} ({100 * one.probability:.0f} %) {other}"
    if abs(one.height_m - found.height_m) > _FAR * max(found.scale_m, one.spread_m):
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
            f"the geometry fits the robot as well in {count(found.rivals, 'other way')}: pair three nodes"
            " with places on links (`--pairs`)"
        )
    if found.unit != 1:
        yield f"lengths of the geometry are {found.unit:.4g} times what its unit says, and were corrected"
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


@dataclass(frozen=True)
class Asked:
    """posture_deg: stated angles, none for all 0; registration: how the geometry lies on the robot; choice,
    arguments: which part of the description is the arm, and of a xacro.
    """

    posture_deg: Sequence[float] = ()
    registration: RegistrationSettings = field(default_factory=RegistrationSettings)
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
    channels, told = _channels(data), asked.registration
    plain = unplaced(robot, stated, tuple(sorted(channels)))
    source = next((path for path in data if has_nodes(path)), None)
    if source is None:
        for option, value in (("--pairs", told.pairs), ("--length-unit", told.length_unit)):
            if value is not None:
                found = f"{value}, and no geometry in the data"
                raise InputError(option, found, "a universal file or CSV with the nodes of the test")
        return replace(plain, notes=plain.shown.missing)
    if not asked.posture_deg:
        joints = ", ".join(joint.name for joint in robot.joints)
        found = f"the geometry of {source.name}, and no posture"
        raise InputError("--posture", found, f"the angles of {joints} in degrees, such as 0,30,-60,0,45,0")
    pairs = {} if told.pairs is None else read_points(told.pairs)
    return replace(placed(plain, geometry_of(source, told.length_unit), pairs, told), axes=channels)


def _channels(data: Sequence[Path]) -> dict[int, set[int]]:
    """Of the nodes of measured FRFs: their axes, 1 to 3."""
    found: dict[int, set[int]] = {}
    for path in data:
        if nodes_alone(path):
            continue
        frfs, _ = load_of_any_unit([path], FrfFileOptions())
        for channel in (*frfs.outputs, *frfs.inputs):
            found.setdefault(channel.node, set()).add(abs(channel.direction))
    return found

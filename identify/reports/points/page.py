"""Nodes on a robot: one HTML file that loads nothing (the robot with its meshes, the nodes of a test and
where they are), the points for a study, what the terminal says of them, and the same page of a planned
test.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import jinja2
import numpy as np
from markupsafe import Markup

from identify.core.arrays import Array
from identify.core.atomic import ELSEWHERE, write_text
from identify.core.errors import InputError
from identify.core.text import count, listed
from identify.measured.channel import Channel
from identify.measured.registration.place import Asked, Placing, place_points, summary, unplaced
from identify.measured.registration.register import Node
from identify.reports.kit.page import ASSETS, asset, json_inside
from identify.reports.shown import working
from identify.results.plan import PlanResult
from identify.robot.description import Robot
from identify.robot.kinematics import chain
from identify.robot.mesh import Mesh, cylinder, joined, simplified, sphere
from identify.robot.points import Point, new_points_text
from identify.robot.pose import inverse, pose
from identify.robot.posture import z_to
from identify.robot.visual import by_link

_MOST = 20_000
"""Triangles of a robot that a plain canvas turns without waiting."""
_THICK = 0.04
"""Radius of a plain link over the length of the robot."""
_TENTHS = 10_000
"""Of a millimetre, which vertices are rounded to."""


def points_page(placing: Placing) -> str:
    """The page of nodes on a robot."""
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(ASSETS), autoescape=True, undefined=jinja2.StrictUndefined
    )
    meshes = by_link(placing.robot, placing.shown.meshes)
    total = sum(0 if mesh is None else len(mesh.triangles) for mesh in meshes)
    posture = ", ".join(f"{angle:.4g}" for angle in np.degrees(_angles(placing)))
    return environment.get_template("points.html.j2").render(
        name=placing.robot.name,
        notes=[f"{note[:1].upper()}{note[1:]}." for note in placing.notes],
        posture=f"{posture} degrees",
        coarse=", simplified to some millimetres" if total > _MOST else "",
        style=asset("report.css"),
        own_style=asset("points.css"),
        script=asset("points.js"),
        data=Markup(json_inside(_data(placing, meshes))),
    )


def _data(placing: Placing, meshes: list[Mesh | None]) -> dict[str, Any]:
    """Links, nodes, and the geometry of the analyser."""
    found, poses = placing.registration, chain(placing.robot, _angles(placing)).poses
    each = _MOST // len(meshes)
    drawn = [
        _plain(placing.robot, number) if mesh is None else simplified(mesh, each)
        for number, mesh in enumerate(meshes)
    ]
    links = [
        {
            "name": link.name,
            "pose": pose,
            "vertices": np.round(mesh.vertices * _TENTHS).astype(int).ravel(),
            "triangles": mesh.triangles.ravel(),
        }
        for link, pose, mesh in zip(placing.robot.links, poses, drawn, strict=True)
    ]
    laid = {} if found is None else {one.node: one for one in found.nodes}
    nodes = [_node(placing, number, laid.get(number)) for number in placing.nodes]
    return {"links": links, "nodes": nodes, "overlay": _overlay(placing)}


def _plain(robot: Robot, number: int) -> Mesh:
    """A tube from joint to joint, and a ball, in the frame of a link that looks like nothing."""
    radius = _THICK * max(robot.stretched(), 0.1)
    start = inverse(robot.joints[number - 1].mount)[:3, 3] if number else np.zeros(3)
    end = robot.joints[number].origin[:3, 3] if number < len(robot.joints) else start
    length = float(np.linalg.norm(end - start))
    ball = sphere(1.2 * radius).placed(pose(start))
    if length < radius:
        return ball
    along = z_to((end - start) / length).copy()
    along[:3, 3] = (start + end) / 2
    return joined([ball, cylinder(radius, length).placed(along)])


def _angles(placing: Placing) -> Array:
    """Those that the geometry was measured at, where it tells them."""
    return placing.angles if placing.registration is None else placing.registration.angles


def _node(placing: Placing, number: int, one: Node | None) -> dict[str, Any]:
    about = placing.doubts.get(number, placing.said.get(number, ""))
    if one is None and number in (placing.points or {}):
        return _at(placing, (placing.points or {})[number], about)
    if one is None or not one.link:
        return {"node": number, "about": about}
    place = {"position": one.position, "axes": one.axes, "normal": one.normal}
    return {"node": number, "link": one.link, "about": about, **place}


def _at(placing: Placing, point: Point, about: str) -> dict[str, Any]:
    """A node that has a place from elsewhere, on the link that carries it."""
    link, there = placing.robot.carrier(point.link)
    turn = there[:3, :3]
    place = {"position": turn @ point.position + there[:3, 3], "axes": point.axes @ turn.T}
    return {"node": point.node, "name": point.name, "link": link, "about": about, **place}


def _overlay(placing: Placing) -> dict[str, Any] | None:
    """The analyser's geometry in the base's frame."""
    geometry, found = placing.geometry, placing.registration
    if geometry is None or found is None:
        return None
    places = found.unit * geometry.position_m @ found.pose[:3, :3].T + found.pose[:3, 3]
    row = {node: n for n, node in enumerate(geometry.nodes)}
    segments = [[row[a], row[b]] for line in geometry.lines for a, b in pairwise(line)]
    return {"places": places, "segments": segments}


def planned_page(result: PlanResult, robot: Robot, points: Mapping[int, Point]) -> str:
    """The robot in the first posture of a plan; points: all that could be hit and measured."""
    hit = dict[int, list[str]]()
    for impact in map(Channel.parse, result.impacts):
        hit.setdefault(impact.node, []).append(str(impact).partition(":")[2])
    sensors = {int(node) for node in result.sensors}
    said = {
        node: " and ".join(
            [
                *(["sensor"] if node in sensors else []),
                *([f"impacts along {listed(hit[node])}"] if node in hit else []),
            ]
        )
        for node in sorted({*sensors, *hit})
    }
    postures = "; ".join(", ".join(f"{angle:.1f}" for angle in one + 0.0) for one in result.posture_deg)
    places = {node: points[node] for node in said}
    placing = unplaced(robot, np.deg2rad(result.posture_deg[0]), tuple(said))
    note = f"postures of the test: {postures} degrees; drawn is the first, with the same points in all"
    return points_page(replace(placing, points=places, said=said, notes=(note, *placing.notes)))


def write_points(
    robot: Path, data: Sequence[Path], asked: Asked, out: Path, page: Path | None, quiet: bool
) -> tuple[Placing, list[Path]]:
    """Where the nodes of data are on a robot, and what was written: `out`, where the data have a geometry,
    and the page, by default beside it.  InputError for points that exist, which are kept.
    """
    page = page or out.with_suffix(".html")
    inputs = {path.resolve() for path in (robot, *data, asked.registration.pairs) if path is not None}
    for option, path in (("--out", out), ("--page", page)):
        if path.resolve() in inputs:
            fix = f"choose another with `{option}`"
            raise InputError(str(path), "an input, which would be overwritten", "a new file", fix)
    if page.resolve() == out.resolve():
        raise InputError("--page", f"{page}, which is the file of points", "a file of its own")
    if out.exists() and data:
        raise InputError(str(out), "the file exists", "a new file", ELSEWHERE)
    with working(quiet, "laying the geometry on the robot"):
        placing = place_points(robot, data, asked)
    texts = {out: new_points_text(placing.points)} if placing.points else {}
    texts[page] = points_page(placing)
    for path, text in texts.items():
        write_text(path, text)
    return placing, list(texts)


def sentences(placing: Placing) -> Iterator[str]:
    """How many nodes are placed, what is to be looked at, and what is left to do."""
    found = placing.registration
    if found is None:
        yield f"{count(len(placing.nodes), 'node')} to be put on {placing.robot.name}: open the page"
        yield from (f"note: {note}" for note in placing.notes)
        return
    yield summary(placing)
    yield from (f"note: {note}" for note in placing.notes)
    yield from (f"look at node {node}: {text}" for node, text in placing.doubts.items())

"""Every place of a study where something can be missing."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from identify.core.arrays import Array
from identify.measured.channel import Channel
from identify.model.effects.base import Effect
from identify.model.effects.link_flexibility import LinkFlexibility
from identify.model.effects.place import Attachment, Beside, Column, Place, Release, Rows
from identify.model.system import free_coordinates
from identify.robot.description import Robot
from identify.robot.posture import AXES
from identify.vibration.costs.target import FrfTarget
from identify.vibration.problem import Problem

_GROUPS = (("rx", "ry"), ("tx", "ty"), ("tz",), ("rz",))


def places_of(problem: Problem, candidates: Sequence[Effect] = ()) -> list[Place]:
    """Constraints, attachments and channels, and where candidates say that they sit; each once."""
    free = free_coordinates(problem.robot, problem.file.study.effects)
    found = [
        *_constraints(problem.robot, free),
        *_flexible(problem, free),
        *_attachments(problem.robot),
        *_readings(problem),
    ]
    own = [place for effect in candidates for place in effect.places(problem.robot, problem.points)]
    return list(dict.fromkeys([*found, *own]))


def with_misalignment(place: Place, problem: Problem) -> Place:
    """A constraint of a single coordinate, about or along an axis of its own direction; others as they are.

    Only towards what is locked: what is free moves along with it anyway.
    """
    if not isinstance(place, Release) or len(place.coordinates) > 1:
        return place
    [name] = place.coordinates
    free = free_coordinates(problem.robot, problem.file.study.effects)
    body, _, axis = name.partition(".")
    around = [f"{body}.{other}" for other in AXES if axis in AXES and other[0] == axis[0]]
    return replace(place, towards=tuple(other for other in around if other not in (name, *free)))


def _constraints(robot: Robot, free: set[str]) -> Iterator[Place]:
    bodies = [f"joint{number}" for number in range(1, len(robot.joints) + 1)]
    if robot.links[0].mass > 0:
        bodies.insert(0, "base")
    for body in bodies:
        for axes in _GROUPS:
            names = [f"{body}.{axis}" for axis in axes]
            locked = tuple(name for name in names if name not in free)
            if locked:
                yield Release(locked)
            for name in names:
                if name in free:
                    yield Beside((name,))


def _flexible(problem: Problem, free: set[str]) -> Iterator[Place]:
    for effect in LinkFlexibility.instances(problem.robot, problem.points):
        names = tuple(effect.free_coordinates(problem.robot))
        if not free.intersection(names):
            yield Release(names)


def _attachments(robot: Robot) -> Iterator[Place]:
    for link in robot.links[1:]:
        centre = (float(link.centre[0]), float(link.centre[1]), float(link.centre[2]))
        name = "at its centre of mass"
        yield Attachment(link.name, centre, ("x", "y", "z"), "link", name)
        yield Attachment(link.name, centre, ("rx", "ry", "rz"), "link", name)
        yield Attachment(link.name, centre, ("x", "y", "z"), "base", name)
        for joint in robot.joints:
            if joint.parent == link.name:
                yield Attachment(
                    link.name, _triple(joint.origin[:3, 3]), ("x", "y", "z"), "base", "at its far end"
                )


def _triple(point: Array) -> tuple[float, float, float]:
    return float(point[0]), float(point[1]), float(point[2])


def _motor(node: int) -> str:
    """The channel of a motor, by its node; empty of what is none."""
    motor = Channel(node, 6)
    return str(motor) if motor.motor else ""


def _readings(problem: Problem) -> Iterator[Place]:
    yield Column()
    targets = [m.target for m in problem.measurements if isinstance(m.target, FrfTarget)]
    for channel in targets[0].data.inputs:
        yield Column(str(channel))
    outputs = sorted({c.place for t in targets for c in t.data.outputs})
    for node in sorted({node for node, _ in outputs}):
        name = problem.points[node].name if node in problem.points else _motor(node)
        directions = [direction for other, direction in outputs if other == node]
        for direction in directions:
            yield Rows(node, (direction,), name)
        for group in (range(1, 4), range(4, 7)):
            own = tuple(direction for direction in directions if direction in group)
            if len(own) > 1:
                yield Rows(node, own, name)

"""Where added effects sit on the robot, and along which axes they act: what is marked in the picture."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from identify.core.arrays import Array
from identify.measured.channel import Channel
from identify.model.effects.base import Effect
from identify.model.effects.place import Attachment, Beside, Column, Place, Release, Rows
from identify.results.discovery import MarkTable
from identify.robot.engine import Engine
from identify.robot.posture import AXES
from identify.vibration.problem import Problem

_NOWHERE = np.full(3, np.nan)


def marks(problem: Problem, effects: Sequence[Effect]) -> MarkTable:
    """At the posture of the first measurement; effects without a place have none."""
    engine = problem.measurements[0].system.site.engine
    rows = [
        (effect.sentence(), *row)
        for effect in effects
        for place in effect.places(problem.robot, problem.points)[:1]
        for row in _of(problem, engine, place)
    ]
    sentences, at, along = zip(*rows, strict=True) if rows else ((), (), ())
    return MarkTable(sentences, np.reshape(at, (-1, 3)), np.reshape(along, (-1, 3)))


def _of(problem: Problem, engine: Engine, place: Place) -> Iterator[tuple[Array, Array]]:
    """Places and directions, each (3,), in the base's axes."""
    if isinstance(place, (Release, Beside)):
        for name in place.coordinates:
            yield from _of_coordinate(engine, *name.split(".", 1))
    elif isinstance(place, Attachment):
        yield engine.position(place.link, np.array(place.at_m)), _along(engine, place)
    elif isinstance(place, Rows):
        point = problem.points[place.node]
        yield engine.position(point.link, point.position), _NOWHERE
    elif isinstance(place, Column) and place.channel:
        struck = Channel.parse(place.channel)
        if struck.motor is not None:
            yield from _of_coordinate(engine, f"joint{struck.motor}", "rz")
            return
        point = problem.points[struck.node]
        yield engine.position(point.link, point.position), _NOWHERE


def _along(engine: Engine, place: Attachment) -> Array:
    """(3,): the only direction in which an attachment acts."""
    axes = engine.axes(place.link) if place.frame == "link" else np.eye(3)
    if place.along is not None:
        return np.asarray(axes @ place.along)
    single = place.axes[0] if len(place.axes) == 1 and place.axes[0] in "xyz" else ""
    return axes[:, "xyz".index(single)] if single else _NOWHERE


def _of_coordinate(engine: Engine, body: str, axis: str) -> Iterator[tuple[Array, Array]]:
    """The origin of a joint, or of a link that bends, and the axis of a joint's coordinate."""
    mechanism = engine.mechanism
    names = [one.name for one in mechanism.bodies]
    if body in names:
        frame, pose = next(
            (frame, pose) for frame, (number, pose) in mechanism.frames.items() if number == names.index(body)
        )
        axes = engine.axes(frame) @ pose[:3, :3].T
        along = axes[:, AXES.index(axis) % 3] if axis in AXES else _NOWHERE
        yield engine.position(frame, -pose[:3, :3].T @ pose[:3, 3]), along
    elif body in mechanism.frames:
        yield engine.position(body, np.zeros(3)), _NOWHERE

"""Where the points of a robot are at a posture, and which way their sensors look: what shapes are drawn
on.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from identify.core.arrays import Array, Complex
from identify.measured.geometry import MeasuredGeometry
from identify.model.effects.site import Site
from identify.model.modes import ComplexModes
from identify.model.system import System
from identify.results.tables import Geometry as DrawnGeometry
from identify.results.tables import Modes as DrawnModes
from identify.robot.engine import Engine
from identify.robot.points import Point


def standing(points: Mapping[int, Point], site: Site) -> list[Point]:
    """The points on links that were not taken off."""
    return [point for point in points.values() if point.link not in site.detached]


def joints(engine: Engine, points: Sequence[Point]) -> list[tuple[str, Array]]:
    """The joint origins and the last point, as (link or frame, position in it): the skeleton beyond the
    base's origin.
    """
    mechanism = engine.mechanism
    origins = []
    for body in range(len(mechanism.bodies)):
        frame, pose = next(
            (name, pose) for name, (number, pose) in mechanism.frames.items() if number == body
        )
        origins.append((frame, np.asarray(-pose[:3, :3].T @ pose[:3, 3])))
    return origins + [(point.link, point.position) for point in points[-1:]]


def drawn_geometry(engine: Engine, points: Sequence[Point]) -> DrawnGeometry:
    """Points and skeleton in the base's axes, m."""
    places = joints(engine, points)
    ground = (name for name, (body, _) in engine.mechanism.frames.items() if body < 0)
    return DrawnGeometry(
        nodes=np.array([point.node for point in points], dtype=int),
        point_names=tuple(point.name for point in points),
        point_links=tuple(point.link for point in points),
        points=np.array([engine.position(point.link, point.position) for point in points]).reshape(-1, 3),
        skeleton=np.array([np.zeros(3), *(engine.position(frame, at) for frame, at in places)]),
        axes=_axes(engine, points),
        skeleton_links=(next(ground, "base"), *(frame for frame, _ in places[:-1])),
    )


def drawn_modes(system: System, points: Sequence[Point], modes: ComplexModes) -> DrawnModes:
    """The modes of a system, with shapes at the points and the skeleton, in the base's axes."""
    skeleton = [
        np.zeros((3, len(system.coordinates))),
        *(system.base_jacobian(frame, at) for frame, at in joints(system.site.engine, points)),
    ]
    at_points = [system.base_jacobian(point.link, point.position) for point in points]
    shapes = (shapes_at(modes.shapes, places) for places in (at_points, skeleton))
    return DrawnModes(modes.frequency_hz, modes.damping_ratio, *shapes)


def shapes_at(shapes: Complex, jacobians: Sequence[Array]) -> Complex:
    """(modes, places, 3) from shapes over the coordinates (modes, n) and Jacobians (3, n)."""
    stack = np.array(jacobians).reshape(len(jacobians), 3, shapes.shape[1])
    return np.asarray(np.einsum("pcn,mn->mpc", stack, shapes))


def _axes(engine: Engine, points: Sequence[Point]) -> Array:
    """The directions of every point's channels, as rows (n, 3, 3), in the base's axes."""
    return np.array([point.axes @ engine.axes(point.link).T for point in points]).reshape(-1, 3, 3)


def sensor_geometry(engine: Engine, points: Sequence[Point]) -> MeasuredGeometry:
    """The points with the directions of their channels, in the base's axes; one line joins them in their
    order.
    """
    nodes = tuple(point.node for point in points)
    return MeasuredGeometry(
        nodes=nodes,
        position_m=np.array([engine.position(point.link, point.position) for point in points]).reshape(-1, 3),
        axes=_axes(engine, points),
        lines=(nodes,) if len(nodes) > 1 else (),
    )

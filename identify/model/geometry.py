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
from identify.results.tables import Bodies
from identify.results.tables import Geometry as DrawnGeometry
from identify.results.tables import Modes as DrawnModes
from identify.robot.engine import Engine
from identify.robot.mesh import EMPTY, Mesh, Surface, Visual, joined
from identify.robot.points import Point
from identify.robot.visual import Looks


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


def drawn_geometry(engine: Engine, points: Sequence[Point], looks: Looks | None = None) -> DrawnGeometry:
    """Points, skeleton and what the links look like in the base's axes, m."""
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
        bodies=None if looks is None else _bodies(engine, places, looks),
    )


def _bodies(engine: Engine, places: Sequence[tuple[str, Array]], looks: Looks) -> Bodies | None:
    """The links that are there, as they look; None where nothing is said of how they look."""
    frames = engine.mechanism.frames
    meshes = {link: mesh for link, mesh in looks.meshes.items() if link in frames}
    if not (meshes or looks.missing):
        return None
    whole = joined(list(meshes.values())) if meshes else EMPTY
    solid = {frames[link][0] for link in meshes}
    bare = [-1 not in solid, *(frames[frame][0] not in solid for frame, _ in places[:-1])]
    return Bodies(
        links=tuple(meshes),
        pose=np.array([_pose(engine, link) for link in meshes]).reshape(-1, 4, 4),
        vertices=whole.vertices,
        of_link=np.repeat(np.arange(len(meshes)), [len(mesh.vertices) for mesh in meshes.values()]),
        triangles=whole.triangles,
        bare=np.array(bare),
        missing=looks.missing,
    )


def visuals_of(geometry: DrawnGeometry) -> tuple[Visual, ...]:
    """What links look like, as it was drawn before: of a robot whose mesh files are not at hand."""
    bodies = geometry.bodies
    if bodies is None:
        return ()
    found = []
    for number, link in enumerate(bodies.links):
        own = bodies.of_link == number
        row = np.cumsum(own) - 1
        mesh = Mesh(bodies.vertices[own], row[bodies.triangles[own[bodies.triangles[:, 0]]]])
        found.append(Visual(link, ((Surface("", np.eye(4), mesh),),)))
    return tuple(found)


def _pose(engine: Engine, frame: str) -> Array:
    """(4, 4) of a frame in the base's axes."""
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = engine.axes(frame), engine.position(frame, np.zeros(3))
    return pose


def drawn_modes(
    system: System, points: Sequence[Point], modes: ComplexModes, bodies: Bodies | None = None
) -> DrawnModes:
    """The modes of a system, with shapes at the points and the skeleton and of drawn bodies, in the base's
    axes.
    """
    skeleton = [
        np.zeros((3, len(system.coordinates))),
        *(system.base_jacobian(frame, at) for frame, at in joints(system.site.engine, points)),
    ]
    at_points = [system.base_jacobian(point.link, point.position) for point in points]
    own, joint = (shapes_at(modes.shapes, places) for places in (at_points, skeleton))
    of_bodies = _body_shapes(system, modes, bodies)
    return DrawnModes(modes.frequency_hz, modes.damping_ratio, own, joint, of_bodies)


def _body_shapes(system: System, modes: ComplexModes, bodies: Bodies | None) -> Complex | None:
    """(m, b, 6).  A link that bends is drawn stiff, moving as its middle does."""
    if bodies is None:
        return None
    rows = [np.zeros((0, len(system.coordinates)))]
    for link, middle, pose in zip(bodies.links, bodies.middle, bodies.pose, strict=True):
        inside = pose[:3, :3].T @ (middle - pose[:3, 3])
        rows.append(np.kron(np.eye(2), pose[:3, :3]) @ system.jacobian(link, inside))
    return np.asarray(modes.shapes @ np.concatenate(rows).T).reshape(len(modes.shapes), len(bodies.links), 6)


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

"""The nuisances of one measurement: which they are, and what they make of its model, sensors and impacts."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy

from identify.core.arrays import Array, Index, cross
from identify.measured.channel import Channel, motors_of
from identify.model.effects.place import Form
from identify.model.nuisances.basis import Basis, Geometry, reduced
from identify.model.nuisances.inertia import CHANGES, moments
from identify.model.system import System
from identify.robot.points import Point
from identify.vibration.nuisances.nuisance import FORCE, IMPACTS, Key, Nuisances, Slot, posture_name, unsigned

_ABOUT_Z = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 1.0])


@dataclass(frozen=True, eq=False)
class Ends:
    """Channels (c of them) as places and directions: number of the point, axis (0 to 5), sign."""

    point: Index
    axis: Index
    sign: Array

    def of(self, chosen: Index) -> Ends:
        """Some of them."""
        return Ends(self.point[chosen], self.axis[chosen], self.sign[chosen])


@dataclass(frozen=True, eq=False)
class Placed:
    """basis: over the system's coordinates; points (P): those of the measurement, motion (P, 6, n) as
    `System.jacobian` has it, axes (P, 3, 3) of their sensors.

    Slots: links (L, 10), geometry (g,), positions and rotations (P, 3), gains (outputs,), impacts (inputs, 3)
    with the turns about all axes of the point, force and delay (); strength (inputs,) and duration () of the
    impacts where they are simulated.
    """

    basis: Basis
    motion: Array
    axes: Array
    outputs: Ends
    inputs: Ends
    links: Slot
    geometry: Slot
    positions: Slot
    rotations: Slot
    gains: Slot
    impacts: Slot
    force: Slot
    delay: Slot
    strength: Slot
    duration: Slot


def place(
    nuisances: Nuisances,
    basis: Basis,
    system: System,
    points: Mapping[int, Point],
    name: str,
    posture: Array,
    channels: tuple[tuple[Channel, ...], tuple[Channel, ...]],
    forms: Sequence[Form] = (),
) -> Placed:
    """The nuisances of a measurement at a posture (joints,), rad; channels: responses, then forces; forms: of
    the system's effects.  A motor is a point that only turns, about its own z, wherever it is.
    """
    own = basis_points(points)
    motors = sorted(-joint for joint in motors_of(channel for some in channels for channel in some))
    nodes = {node: number for number, node in enumerate([*(point.node for point in own), *motors])}
    outputs, inputs = (_ends(some, nodes) for some in channels)
    joints = range(1, len(posture) + 1)
    angles: list[Key] = [("joint", posture_name(posture), f"joint{number}") for number in joints]
    lengths: list[Key] = [("kinematics", f"joint{n}", f"origin_{x}") for n in joints for x in "xyz"]
    known = [key for key in (*angles, *lengths) if nuisances.has(key[0])]
    uncertain = forms if nuisances.has("form") else ()
    known += [("form", form.place, name) for form in uncertain for name, _ in form.errors]
    there = reduced(basis, system.site.shapes[:, system.free])
    changes = (change for form in uncertain for change in _changes(form, system, own))
    size, every = len(own) + len(motors), [*(str(p.node) for p in own), *map(str, motors)]
    still = [_beside_motors(change, len(motors)) for change in (*there.geometry, *changes)]
    motion = [system.jacobian(p.link, p.position) for p in own]
    turning = [np.outer(_ABOUT_Z, system.motor(-motor, name)) for motor in motors]
    return Placed(
        replace(there, geometry=tuple(still)),
        np.array([*motion, *turning]).reshape(size, 6, len(system.free)),
        np.array([*(point.axes for point in own), *[np.eye(3)] * len(motors)]).reshape(size, 3, 3),
        outputs,
        inputs,
        nuisances.slot(
            [("link", link.name, change) for link in basis.links for change in CHANGES],
            (len(basis.links), len(CHANGES)),
        ),
        nuisances.slot(known, (len(known),)),
        nuisances.slot([("point", node, x) for node in every for x in "xyz"], (size, 3)),
        nuisances.slot([("point", node, f"r{x}") for node in every for x in "xyz"], (size, 3)),
        nuisances.slot([("channel", unsigned(c), "gain") for c in channels[0]], (len(channels[0]),)),
        nuisances.slot(
            [("impact", f"{name} {c}", f"r{x}") for c in channels[1] for x in "xyz"], (len(channels[1]), 3)
        ),
        nuisances.slot([("channel", FORCE, "gain")], ()),
        nuisances.slot([("set", name, "delay")], ()),
        nuisances.slot([("impulse", f"{name} {c}", "strength") for c in channels[1]], (len(channels[1]),)),
        nuisances.slot([("impulse", IMPACTS, "duration")], ()),
    )


def _beside_motors(change: Geometry, motors: int) -> Geometry:
    """The same with so many motors beside the points, whose turns no geometry changes."""
    still = np.zeros((motors, *change.motion.shape[1:]))
    return replace(change, motion=np.concatenate([change.motion, still])) if motors else change


def _changes(form: Form, system: System, points: Sequence[Point]) -> Iterator[Geometry]:
    """What errors of a form change of a system, one after the other."""
    free = system.free
    mass, motion = form.changes(system.site)
    unmoved = np.zeros((6, len(free)))
    for number, one in enumerate(mass):
        moved = [motion[p.node][number][:, free] if p.node in motion else unmoved for p in points]
        yield Geometry(one[np.ix_(free, free)], np.zeros((len(free),) * 2), np.array(moved))


def basis_points(points: Mapping[int, Point]) -> list[Point]:
    """The points in the order in which a basis has them."""
    return [points[node] for node in sorted(points)]


def _ends(channels: Sequence[Channel], nodes: Mapping[int, int]) -> Ends:
    return Ends(
        np.array([nodes[channel.node] for channel in channels], dtype=int),
        np.array([channel.axis for channel in channels], dtype=int),
        np.array([channel.sign for channel in channels], dtype=float),
    )


@dataclass(frozen=True, eq=False)
class State:
    """What the nuisances of a measurement make of it at some values.

    mass, stiffness (n, n): what they add; slopes (L, 10, 10) of the links' inertial parameters; motion
    (P, 6, n) of the nominal points; shift (P, 3), m: where they are; turns (P, 3): rotation vectors of the
    sensors; sensors (P, 3, 3): rows are their axes; gain (outputs,) with the channels' signs; struck
    (inputs, 3): turns of the impacts about sensor axes, directions (inputs, 3) of the impacts in link axes;
    scale (inputs,): their signs over the sensitivity of the force transducer; out (outputs, n), force
    (n, inputs); delay, s; strength (inputs,) and duration of the impacts over what was stated.
    """

    mass: Array
    stiffness: Array
    slopes: Array
    motion: Array
    shift: Array
    turns: Array
    sensors: Array
    gain: Array
    struck: Array
    directions: Array
    scale: Array
    out: Array
    force: Array
    delay: float
    strength: Array
    duration: float


def state(placed: Placed, values: Array) -> State:
    """The state at values (nuisances,)."""
    mass, stiffness, slopes = _inertia(placed, values)
    motion = placed.motion
    for amount, change in zip(placed.geometry.at(values), placed.basis.geometry, strict=True):
        if amount and change.heavy:
            mass, stiffness = mass + amount * change.mass, stiffness + amount * change.stiffness
        if amount and change.moving:
            motion = motion + amount * change.motion
    shift, turns = placed.positions.at(values), placed.rotations.at(values)
    sensors = scipy.spatial.transform.Rotation.from_rotvec(-turns).as_matrix() @ placed.axes
    gain = placed.outputs.sign * np.exp(placed.gains.at(values))
    struck = placed.impacts.at(values)
    directions = _directions(placed, struck)
    scale = placed.inputs.sign * float(np.exp(-placed.force.at(values)))
    return State(
        mass,
        stiffness,
        slopes,
        motion,
        shift,
        turns,
        sensors,
        gain,
        struck,
        directions,
        scale,
        read(placed.outputs, motion, shift, sensors, gain),
        push(placed.inputs, motion, wrench(placed.inputs, directions, shift), scale),
        float(placed.delay.at(values)),
        np.exp(placed.strength.at(values)),
        float(np.exp(placed.duration.at(values))),
    )


def read(ends: Ends, motion: Array, shift: Array, sensors: Array, gain: Array) -> Array:
    """(outputs, n): what channels read of points with motion (P, 6, n) beside which they are (P, 3)."""
    turning, beside = motion[:, 3:].swapaxes(1, 2), shift[:, None]
    moved = motion[:, :3] + cross(turning, beside).swapaxes(1, 2)
    axes = np.concatenate([sensors @ moved, sensors @ motion[:, 3:]], axis=1)
    return np.asarray(gain[:, None] * axes[ends.point, ends.axis])


def push(ends: Ends, motion: Array, applied: Array, scale: Array) -> Array:
    """(n, inputs): generalised forces of wrenches (inputs, 6) about the nominal points."""
    return np.asarray(np.einsum("ikn,ik,i->ni", motion[ends.point], applied, scale))


def wrench(ends: Ends, directions: Array, shift: Array) -> Array:
    """(inputs, 6): force and moment about the nominal place of the point of unit impacts."""
    is_force = (ends.axis < 3)[:, None]
    lever = cross(shift[ends.point], directions)
    return np.concatenate(
        [np.where(is_force, directions, 0.0), np.where(is_force, lever, directions)], axis=1
    )


def _inertia(placed: Placed, values: Array) -> tuple[Array, Array, Array]:
    """What other inertias add to M and K_g, (n, n) each, and the slopes (L, 10, 10) of the parameters."""
    basis = placed.basis
    found, slopes = moments(basis.links, placed.links.at(values))
    return *basis.added(found - basis.nominal), slopes


def _directions(placed: Placed, turns: Array) -> Array:
    """(inputs, 3): unit directions of the impacts in link axes after turns (inputs, 3) about sensor axes."""
    axes = placed.axes[placed.inputs.point]
    along = axes[np.arange(len(axes)), placed.inputs.axis % 3]
    about = np.einsum("iab,ia->ib", axes, turns)
    return np.asarray(scipy.spatial.transform.Rotation.from_rotvec(about).apply(along)).reshape(along.shape)

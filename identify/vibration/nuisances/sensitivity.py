"""Exact derivatives of predicted FRFs with respect to all nuisances of a measurement.

Inertias and geometry change M and K_g: dH = -s^p S Z^-1 (dK + s^2 dM) X.  Places and turns of sensors change
rows of S, those of impacts columns of B, and H is linear in both.  Each sensor's own nuisances touch its own
channels only, so that they are kept as small blocks.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from identify.core.arrays import Array, Complex, Index
from identify.model.frf import motion_and_transfer
from identify.model.nuisances.basis import WEIGHTED
from identify.model.nuisances.turns import turn_slope
from identify.model.truncation import EndOfRecord, TruncationCorrection, end_by_matrices
from identify.vibration.nuisances.placed import Placed, State, push, read, wrench

Matrices = tuple[Array, Array, Array]


@dataclass(frozen=True)
class Block:
    """Derivatives (lines, channels, inputs, k) of some channels (their numbers) with respect to k nuisances
    (their numbers), in units of their standard deviations.
    """

    channels: Index
    numbers: Index
    slopes: Complex


@dataclass(frozen=True)
class Excited:
    """A model at its state under its impacts: s (lines,), the power of s in H, motion (3 of (lines, n,
    inputs)) and S Z^-1 (lines, outputs, n).
    """

    matrices: Matrices
    s: Complex
    power: int
    motion: list[Complex]
    transfer: Complex
    end: TruncationCorrection | None
    h: Complex


def excited(
    at: State, matrices: Matrices, s: Complex, power: int, record: float | None, changes: tuple[Array, Array]
) -> Excited:
    """A linear model; record as in `identify.model.frf`, changes (q, n, n) of M and K that it is to be
    differentiated by.
    """
    end = None if record is None else end_by_matrices(matrices, s, at.force, record, *changes)
    motion, transfer = motion_and_transfer(end, matrices, s, at.out, at.force)
    return Excited(matrices, s, power, motion, transfer, end, at.out @ motion[power])


def structural_changes(placed: Placed, at: State) -> tuple[Array, Array, Index]:
    """Changes of M and of K_g (q, n, n) per standard deviation, and the numbers (q,) of the nuisances."""
    basis, slot = placed.basis, placed.links
    slopes = at.slopes * slot.std[:, None, :]
    mass = np.einsum("lpq,lpij->lqij", slopes, basis.mass)
    stiffness = np.einsum("lpq,lpij->lqij", slopes[:, :WEIGHTED], basis.weight)
    kept = slot.numbers.ravel() >= 0
    size = mass.shape[-1]
    std = placed.geometry.std[:, None, None]
    geometry = [
        std * np.array([getattr(one, name) for one in basis.geometry]).reshape(-1, size, size)
        for name in ("mass", "stiffness")
    ]
    return (
        np.concatenate([mass.reshape(-1, size, size)[kept], geometry[0]]),
        np.concatenate([stiffness.reshape(-1, size, size)[kept], geometry[1]]),
        np.concatenate([slot.numbers.ravel()[kept], placed.geometry.numbers]),
    )


def structural(placed: Placed, at: State, model: Excited, changes: tuple[Array, Array, Index]) -> Block:
    """Of inertias and geometry, all channels."""
    mass, stiffness, numbers = changes
    lines, _, inputs = model.motion[0].shape
    size, count = mass.shape[1], len(numbers)
    pushed = mass.reshape(-1, size) @ model.motion[2] + stiffness.reshape(-1, size) @ model.motion[0]
    pushed = pushed.reshape(lines, count, size, inputs).transpose(0, 2, 3, 1).reshape(lines, size, -1)
    slopes = (-(model.s**model.power)[:, None, None] * model.transfer) @ pushed
    slopes = slopes.reshape(lines, -1, inputs, count)
    if isinstance(model.end, EndOfRecord):
        of_end = model.end.gradient(
            model.matrices[0], model.matrices[1], model.s, at.out, model.transfer, model.power
        )
        slopes += of_end
    first = count - len(placed.geometry.numbers)
    if first < count:
        slopes[..., first:] += _moved_ends(placed, at, model)
    return Block(np.arange(slopes.shape[1]), numbers, slopes)


def _moved_ends(placed: Placed, at: State, model: Excited) -> Complex:
    """(lines, outputs, inputs, g): what geometry does by way of sensors and impacts."""
    parts = []
    applied = wrench(placed.inputs, at.directions, at.shift)
    for change, std in zip(placed.basis.geometry, placed.geometry.std, strict=True):
        out = read(placed.outputs, change.motion, at.shift, at.sensors, at.gain)
        force = push(placed.inputs, change.motion, applied, at.scale)
        parts.append(std * (out @ model.motion[model.power] + _by_force(model, at, force)))
    return np.stack(parts, axis=-1)


def _by_force(model: Excited, at: State, force: Array) -> Complex:
    """(lines, outputs, c): response to other forces (n, c)."""
    line = model.s[:, None, None]
    load = np.broadcast_to(force.astype(complex), (len(model.s), *force.shape))
    end, response = None, np.zeros(1, dtype=complex)
    if isinstance(model.end, EndOfRecord):
        none = np.zeros((0, *model.matrices[0].shape))
        end = end_by_matrices(model.matrices, model.s, force, model.end.record, none, none)
    if end is not None:
        load = force - end.load(model.matrices[0], model.matrices[1], model.s)
        response = np.asarray(at.out @ end.motion(model.s, model.power))
    return np.asarray(line**model.power * (model.transfer @ load) + response)


def impacts(placed: Placed, at: State, model: Excited) -> list[Block]:
    """Of directions and places of the impacts, and of the sensitivity of the force transducer."""
    every, blocks = np.arange(model.h.shape[1]), []
    found = [one for entry in range(len(placed.inputs.point)) for one in _wrenches(placed, at, entry)]
    if found:
        entries, numbers, changes = zip(*found, strict=True)
        ends = placed.inputs.of(np.array(entries))
        force = push(ends, at.motion, np.array(changes), at.scale[list(entries)])
        response, unique = _by_force(model, at, force), list(dict.fromkeys(numbers))
        slopes = np.zeros((*model.h.shape, len(unique)), dtype=complex)
        for column, (entry, number) in enumerate(zip(entries, numbers, strict=True)):
            slopes[:, :, entry, unique.index(number)] += response[:, :, column]
        blocks.append(Block(every, np.array(unique), slopes))
    if placed.force.numbers >= 0:
        blocks.append(
            Block(every, placed.force.numbers.reshape(1), -float(placed.force.std) * model.h[..., None])
        )
    return blocks


def _wrenches(placed: Placed, at: State, entry: int) -> Iterator[tuple[int, int, Array]]:
    """Changes (6,) of the wrench of an impact, each with its entry and the number of its nuisance."""
    point, is_force = placed.inputs.point[entry], placed.inputs.axis[entry] < 3
    axes, turns = placed.axes[point], at.struck
    rotation, right = turn_slope(axes.T @ turns[entry])
    told = rotation.T @ at.directions[entry]
    for axis in range(3):
        number = placed.impacts.numbers[entry, axis]
        if number >= 0:
            turned = -placed.impacts.std[entry, axis] * rotation @ np.cross(told, right @ axes[axis])
            lever = np.cross(at.shift[point], turned)
            yield entry, int(number), np.concatenate([turned, lever] if is_force else [np.zeros(3), turned])
    for axis in range(3):
        number = placed.positions.numbers[point, axis]
        if number >= 0 and is_force:
            lever = placed.positions.std[point, axis] * np.cross(np.eye(3)[axis], at.directions[entry])
            yield entry, int(number), np.concatenate([np.zeros(3), lever])


def sensors(placed: Placed, at: State, model: Excited) -> list[Block]:
    """Of places, turns and gains of the sensors, each on its own channels."""
    motion = model.motion[model.power]
    blocks = []
    for point in np.unique(placed.outputs.point):
        own = np.flatnonzero(placed.outputs.point == point)
        columns = [*_of_place(placed, at, motion, point, own), *_of_turn(placed, at, motion, point, own)]
        for position, channel in enumerate(own):
            if placed.gains.numbers[channel] >= 0:
                slope = np.zeros((len(model.s), len(own), motion.shape[2]), dtype=complex)
                slope[:, position] = placed.gains.std[channel] * model.h[:, channel]
                columns.append((int(placed.gains.numbers[channel]), slope))
        if columns:
            numbers, slopes = zip(*columns, strict=True)
            blocks.append(Block(own, np.array(numbers), np.stack(slopes, axis=-1)))
    return blocks


def _of_place(
    placed: Placed, at: State, motion: Complex, point: int, own: Index
) -> Iterator[tuple[int, Complex]]:
    """Derivatives (lines, own, inputs) with respect to the position of a sensor."""
    turning = at.motion[point, 3:]
    for axis in range(3):
        number = placed.positions.numbers[point, axis]
        if number >= 0:
            moved = at.sensors[point] @ np.cross(turning.T, np.eye(3)[axis]).T
            rows = np.concatenate([moved, np.zeros_like(moved)])[placed.outputs.axis[own]]
            yield int(number), (placed.positions.std[point, axis] * at.gain[own, None] * rows) @ motion


def _of_turn(
    placed: Placed, at: State, motion: Complex, point: int, own: Index
) -> Iterator[tuple[int, Complex]]:
    """The same with respect to the turn of a sensor."""
    back, right = turn_slope(-at.turns[point])
    moved = at.motion[point, :3] + np.cross(at.motion[point, 3:], at.shift[point][:, None], axis=0)
    for axis in range(3):
        number = placed.rotations.numbers[point, axis]
        if number >= 0:
            turned = [
                back @ np.cross((placed.axes[point] @ one).T, right[:, axis]).T
                for one in (moved, at.motion[point, 3:])
            ]
            rows = np.concatenate(turned)[placed.outputs.axis[own]]
            yield int(number), (placed.rotations.std[point, axis] * at.gain[own, None] * rows) @ motion

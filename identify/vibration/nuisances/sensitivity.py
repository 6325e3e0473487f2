"""Exact derivatives of predicted FRFs with respect to all nuisances of a measurement.

Inertias and geometry change M and K_g: dH = -s^p S Z^-1 (dK + s^2 dM) X.  Places and turns of sensors change
rows of S, those of impacts columns of B, and H is linear in both.  Each sensor's own nuisances touch its own
channels only, so that they are kept as small blocks.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identify.core.arrays import Array, Complex, Index, cross_matrix, real_product
from identify.model.frf import motion_and_transfer
from identify.model.nuisances.basis import WEIGHTED, turn_slope
from identify.model.truncation import EndOfRecord, TruncationCorrection, end_by_matrices
from identify.vibration.nuisances.placed import Placed, State, push, read, wrench

Matrices = tuple[Array, Array, Array]


@dataclass(frozen=True)
class Block:
    """Derivatives (lines, channels, inputs, k) of some channels (their numbers) with respect to k nuisances
    (their numbers), in units of their standard deviations; inside: of the model's coordinates instead.
    """

    channels: Index
    numbers: Index
    slopes: Complex
    inside: bool = False


@dataclass(frozen=True)
class Excited:
    """A model at its state under its impacts: s (lines,), the power of s in H, motion (3 of (lines, n,
    inputs)); and looked at through T (k, n), of the outputs, or inside, where it is one: transfer T Z^-1
    (lines, k, n) and h (lines, k, inputs).
    """

    matrices: Matrices
    s: Complex
    power: int
    motion: list[Complex]
    through: Array
    transfer: Complex
    end: TruncationCorrection | None
    h: Complex
    inside: bool = False

    def block(self, numbers: Index, slopes: Complex) -> Block:
        """Of all that it is looked at through."""
        return Block(np.arange(slopes.shape[1]), numbers, slopes, self.inside)


def excited(
    at: State,
    matrices: Matrices,
    s: Complex,
    power: int,
    record: float | None,
    changes: tuple[Array, Array],
    *,
    inside: bool = False,
) -> Excited:
    """A linear model; record as in `identify.model.frf`, changes (q, n, n) of M and K that it is to be
    differentiated by.
    """
    through = np.eye(at.out.shape[1]) if inside else at.out
    end = None if record is None else end_by_matrices(matrices, s, at.force, record, *changes)
    motion, transfer = motion_and_transfer(end, matrices, s, through, at.force)
    h = motion[power] if inside else at.out @ motion[power]
    return Excited(matrices, s, power, motion, through, transfer, end, h, inside)


def structural_changes(placed: Placed, at: State) -> tuple[Array, Array, Index]:
    """Changes of M and of K_g (q, n, n) per standard deviation, and the numbers (q,) of the nuisances: links,
    then what of the geometry changes them at all.
    """
    basis, slot, heavy = placed.basis, placed.links, placed.basis.heavy
    slopes = at.slopes * slot.std[:, None, :]
    mass = np.einsum("lpq,lpij->lqij", slopes, basis.mass)
    stiffness = np.einsum("lpq,lpij->lqij", slopes[:, :WEIGHTED], basis.weight)
    kept = slot.numbers.ravel() >= 0
    size = mass.shape[-1]
    std = placed.geometry.std[heavy, None, None]
    geometry = [
        std * np.array([getattr(basis.geometry[n], name) for n in heavy]).reshape(-1, size, size)
        for name in ("mass", "stiffness")
    ]
    return (
        np.concatenate([mass.reshape(-1, size, size)[kept], geometry[0]]),
        np.concatenate([stiffness.reshape(-1, size, size)[kept], geometry[1]]),
        np.concatenate([slot.numbers.ravel()[kept], placed.geometry.numbers[heavy]]),
    )


def structural(placed: Placed, at: State, model: Excited, changes: tuple[Array, Array, Index]) -> list[Block]:
    """Of inertias and of the geometry that changes M or K_g."""
    mass, stiffness, numbers = changes
    held = ~np.any(model.motion[0], axis=(0, 2)) & (model.end is None)  # by springs of no compliance
    moved = np.flatnonzero(~held)
    if held.all():
        moved = np.arange(len(held))
    elif held.any():
        mass, stiffness = (matrices[:, moved[:, None], moved] for matrices in (mass, stiffness))
    lines, _, inputs = model.motion[0].shape
    size, count = len(moved), len(numbers)
    there = [_flat(model.motion[power][:, moved]) for power in (2, 0)]
    pushed = real_product(mass.reshape(-1, size), there[0]) + real_product(
        stiffness.reshape(-1, size), there[1]
    )
    turned = pushed.reshape(count, size, lines, inputs).transpose(2, 1, 3, 0)
    load = (-(model.s**model.power)[:, None, None, None] * turned).reshape(lines, size, -1)
    if isinstance(model.end, EndOfRecord):
        load += model.end.driving(model.matrices, model.s, model.power)
    slopes = (model.transfer[..., moved] @ load).reshape(lines, model.transfer.shape[1], inputs, count)
    heavy = placed.basis.heavy
    moving = np.array([placed.basis.geometry[n].moving for n in heavy], dtype=bool)
    if not moving.any():
        return [model.block(numbers, slopes)]
    own = count - len(heavy) + np.flatnonzero(moving)
    pushed, blocks = _moved_ends(placed, at, model, heavy[moving])
    slopes[..., own] += pushed
    return [model.block(numbers, slopes), *blocks]


def _flat(motion: Complex) -> Complex:
    """(n, lines * inputs) of motions (lines, n, inputs)."""
    return np.swapaxes(motion, 0, 1).reshape(motion.shape[1], -1)


def shapes(placed: Placed, at: State, model: Excited) -> list[Block]:
    """Of what changes nothing but how points move."""
    light = [n for n, one in enumerate(placed.basis.geometry) if one.moving and not one.heavy]
    if not light:
        return []
    pushed, blocks = _moved_ends(placed, at, model, np.array(light))
    return [model.block(placed.geometry.numbers[light], pushed), *blocks]


def _moved_ends(placed: Placed, at: State, model: Excited, moving: Index) -> tuple[Complex, list[Block]]:
    """What some of the changes of geometry, by their numbers, do by way of sensors and impacts: (lines, k,
    inputs, g) through the model; inside, only by way of impacts, and a block of what sensors read besides.
    """
    changes = [placed.basis.geometry[number] for number in moving.tolist()]
    applied = wrench(placed.inputs, at.directions, at.shift)
    out = np.array([read(placed.outputs, one.motion, at.shift, at.sensors, at.gain) for one in changes])
    force = np.array([push(placed.inputs, one.motion, applied, at.scale) for one in changes])
    moved = real_product(out.reshape(-1, out.shape[2]), model.motion[model.power])
    moved = moved.reshape(len(model.s), *out.shape[:2], -1).transpose(0, 2, 3, 1)
    pushed = _by_force(model, force.transpose(1, 2, 0).reshape(out.shape[2], -1))
    pushed, std = pushed.reshape(*model.h.shape, len(moving)), placed.geometry.std[moving]
    if not model.inside:
        return np.asarray(std * (moved + pushed)), []
    every = np.arange(moved.shape[1])
    return np.asarray(std * pushed), [Block(every, placed.geometry.numbers[moving], std * moved)]


def _by_force(model: Excited, force: Array) -> Complex:
    """(lines, k, c): response to other forces (n, c)."""
    line = model.s[:, None, None]
    load = np.broadcast_to(force.astype(complex), (len(model.s), *force.shape))
    response = np.zeros(1, dtype=complex)
    if isinstance(model.end, EndOfRecord):
        end = model.end.under(force)
        load = force - end.load(model.matrices[0], model.matrices[1], model.s)
        response = np.asarray(model.through @ end.motion(model.s, model.power))
    return np.asarray(line**model.power * (model.transfer @ load) + response)


def impacts(placed: Placed, at: State, model: Excited) -> list[Block]:
    """Of directions and places of the impacts, and of the sensitivity of the force transducer."""
    blocks = []
    known, changes = _wrenches(placed, at)
    entries, slots = np.nonzero(known >= 0)
    if len(entries):
        force = push(placed.inputs.of(entries), at.motion, changes[entries, slots], at.scale[entries])
        unique, which = np.unique(known[entries, slots], return_inverse=True)
        slopes = np.zeros((*model.h.shape, len(unique)), dtype=complex)
        slopes[:, :, entries, which] = _by_force(model, force)
        blocks.append(model.block(unique, slopes))
    if placed.force.numbers >= 0:
        strength = -float(placed.force.std) * model.h[..., None]
        blocks.append(model.block(placed.force.numbers.reshape(1), strength))
    return blocks


def _wrenches(placed: Placed, at: State) -> tuple[Index, Array]:
    """Numbers (inputs, 6) of the nuisances that change the wrenches of the impacts, -1 for none, and those
    changes (inputs, 6, 6): turns about the axes of the point, then its place.
    """
    ends = placed.inputs
    axes, is_force = placed.axes[ends.point], (ends.axis < 3)[:, None]
    rotation, right = turn_slope(np.einsum("cxi,cx->ci", axes, at.struck))
    nominal = np.einsum("cij,ci->cj", rotation, at.directions)
    about = np.cross(nominal[:, None], axes @ np.swapaxes(right, 1, 2))
    turned = -placed.impacts.std[:, :, None] * (about @ np.swapaxes(rotation, 1, 2))
    none, lever = np.zeros_like(turned), np.cross(at.shift[ends.point][:, None], turned)
    turns = np.where(
        is_force[..., None], np.concatenate([turned, lever], 2), np.concatenate([none, turned], 2)
    )
    moved = placed.positions.std[ends.point][..., None] * np.cross(np.eye(3), at.directions[:, None])
    of_place = np.where(is_force, placed.positions.numbers[ends.point], -1)
    return (
        np.concatenate([placed.impacts.numbers, of_place], axis=1),
        np.concatenate([turns, np.concatenate([none, moved], axis=2)], axis=1),
    )


def sensors(placed: Placed, at: State, model: Excited) -> list[Block]:
    """Of places, turns and gains of the sensors, each on its own channels."""
    motion, points = model.motion[model.power], placed.outputs.point
    h = at.out @ motion
    rows = _rows(placed, at)
    every = real_product(rows.reshape(-1, rows.shape[2]), motion).reshape(len(model.s), *rows.shape[:2], -1)
    slots = (placed.positions, placed.rotations)
    numbers = np.concatenate([slot.numbers for slot in slots], axis=1)
    blocks = []
    for point in np.unique(points):
        own, moves = np.flatnonzero(points == point), np.flatnonzero(numbers[point] >= 0)
        gained = np.flatnonzero(placed.gains.numbers[own] >= 0)
        known = np.concatenate([numbers[point, moves], placed.gains.numbers[own[gained]]])
        if len(known):
            slopes = np.zeros((len(model.s), len(own), motion.shape[2], len(known)), dtype=complex)
            slopes[..., : len(moves)] = np.swapaxes(every[:, own][:, :, moves], 2, 3)
            gains = placed.gains.std[own[gained], None] * h[:, own[gained]]
            slopes[:, gained, :, len(moves) + np.arange(len(gained))] = np.swapaxes(gains, 0, 1)
            blocks.append(Block(own, known, slopes))
    return blocks


def _rows(placed: Placed, at: State) -> Array:
    """(outputs, 6, n): change of what channels read with the place of their sensor, then with its turn, per
    standard deviation.
    """
    turning = at.motion[:, 3:]
    moved = at.motion[:, :3] + np.cross(turning, at.shift[:, :, None], axis=1)
    placing = -at.sensors[:, None] @ cross_matrix(np.eye(3)) @ turning[:, None]
    back, right = turn_slope(-at.turns)
    turn = -back[:, None] @ cross_matrix(np.swapaxes(right, 1, 2))
    turned = [turn @ (placed.axes @ one)[:, None] for one in (moved, turning)]
    rows = np.concatenate(
        [
            placed.positions.std[..., None, None] * np.concatenate([placing, np.zeros_like(placing)], axis=2),
            placed.rotations.std[..., None, None] * np.concatenate(turned, axis=2),
        ],
        axis=1,
    )
    ends = placed.outputs
    return np.asarray(at.gain[:, None, None] * rows[ends.point, :, ends.axis])

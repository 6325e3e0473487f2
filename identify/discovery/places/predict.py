"""What a place makes of the measured sets: residuals over noise, and their derivatives by what is unknown
there line by line and by the known parameters.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
import scipy

from identify.core.arrays import Array, Complex, Index, real_product
from identify.core.errors import InputError
from identify.core.parameters import Parameter
from identify.discovery.places.update import (
    Base,
    attached,
    moved_by,
    recharted,
    released,
    stiffness_of,
    symmetric,
    updated,
)
from identify.discovery.places.views import View, count_of, restricted, whitened
from identify.model.effects.place import Attachment, Beside, Column, Place, Release, Rows
from identify.model.frf import end_added
from identify.model.system import System

_RIDGE = 1e-12
"""Keeps apart powers of s that the lines do not tell apart."""
_LEAN = 1.0
"""How far an axis may be turned towards another coordinate, which is then as near."""


@dataclass(frozen=True)
class Predicted:
    """One set's residual (lines, outputs, inputs) and its derivatives by the unknowns of each line (..., m)
    and by the free parameters (..., p), all over noise; h: H itself.  Where `turned`, inputs come before
    what replaces outputs.
    """

    residual: Complex
    by_unknown: Complex
    by_parameter: Complex
    h: Complex
    turned: bool = False

    def by_force(self, lines: Index) -> list[ForceResponses]:
        """Each input by itself; lines: numbers of the lines among those that sets share."""
        parts = (self.residual, self.by_unknown, self.by_parameter, self.h)
        first = [np.moveaxis(part, 1 if self.turned else 2, 0) for part in parts]
        return [ForceResponses(lines, *own) for own in zip(*first, strict=True)]


@dataclass(frozen=True)
class ForceResponses:
    """What one set says of one force at lines (l): residual and h (l, r), derivatives by the unknowns of the
    line (l, r, m) and by the free parameters (l, r, p), all over noise.
    """

    lines: Index
    residual: Complex
    by_unknown: Complex
    by_parameter: Complex
    h: Complex


@dataclass(frozen=True)
class Unknown:
    """What is unknown at a place: values by line (l, m), and for a structural place the reference zeta (l, d,
    d) that they belong to.
    """

    values: Complex
    reference: Complex


class PlaceModel(Protocol):
    """One place in all sets."""

    views: Sequence[View]

    def start(self, values: Array) -> Unknown:
        """Nothing is missing, at parameter values."""

    def refreshed(self, unknown: Unknown, values: Array) -> Unknown:
        """The same unknown in the coordinates that suit other parameter values."""

    def predict(
        self, unknown: Unknown, values: Array, free: Index, rests: Sequence[Complex]
    ) -> list[Predicted]:
        """Each set's residual; rests: what the end of the record adds to its H."""

    def squares(self, unknown: Unknown, values: Array, rests: Sequence[Complex]) -> float:
        """Sum of |residual / noise|^2."""

    def rests(self, unknown: Unknown, values: Array) -> list[Complex]:
        """What the end of the record adds to each set's H (lines, channels, inputs), with the spring, damper
        and mass that come nearest to the unknown.
        """


def model_of(place: Place, views: Sequence[View]) -> PlaceModel:
    """A place in the sets that have it; InputError where none has."""
    if isinstance(place, (Rows, Column)):
        return ReadingModel(place, views)
    return StructuralModel(place, views)


def misalignments(place: Place) -> tuple[Parameter, ...]:
    """How far the axis of a place is misaligned towards others: their values follow those of the problem's
    parameters.
    """
    if not isinstance(place, Release):
        return ()
    names = [f"{place.coordinates[0]} towards {name}" for name in place.towards]
    return tuple(Parameter(name, "", 0.0, -_LEAN, _LEAN, log=False) for name in names)


class StructuralModel:
    """A constraint that gives way or something attached."""

    def __init__(self, place: Release | Attachment | Beside, views: Sequence[View]) -> None:
        self.views, self.place = views, place
        self.size = len(place.directions) if isinstance(place, Attachment) else len(place.coordinates)
        self.sign = 1.0 if isinstance(place, Release) else -1.0
        self._parts = [_Part(place, view, self.size) for view in views]

    def start(self, values: Array) -> Unknown:
        """A = 0 at the average of zeta over the sets."""
        lines, pairs = count_of(self.views), self.size * (self.size + 1) // 2
        return Unknown(np.zeros((lines, pairs), dtype=complex), self._zeta(values))

    def refreshed(self, unknown: Unknown, values: Array) -> Unknown:
        """The same dynamic stiffness at the zeta of other values."""
        new = self._zeta(values)
        a = recharted(symmetric(unknown.values, self.size), unknown.reference, new)
        rows, columns = np.triu_indices(self.size)
        return Unknown(a[:, rows, columns], new)

    def stiffness(self, unknown: Unknown) -> Complex:
        """(lines, d, d): the dynamic stiffness of the place."""
        return stiffness_of(symmetric(unknown.values, self.size), unknown.reference, self.sign)

    def predict(
        self, unknown: Unknown, values: Array, free: Index, rests: Sequence[Complex]
    ) -> list[Predicted]:
        """By the low-rank formulas."""
        a = symmetric(unknown.values, self.size)
        return [
            part.predict(a[part.view.lines], unknown.reference[part.view.lines], values, free, rest)
            for part, rest in zip(self._parts, rests, strict=True)
        ]

    def squares(self, unknown: Unknown, values: Array, rests: Sequence[Complex]) -> float:
        """Without derivatives."""
        a = symmetric(unknown.values, self.size)
        return sum(
            part.squares(a[part.view.lines], unknown.reference[part.view.lines], values, rest)
            for part, rest in zip(self._parts, rests, strict=True)
        )

    def zeta(self, number: int, values: Array) -> Complex:
        """(lines, d, d): what the model opposes at the place, in one of the sets."""
        return self._parts[number].base(values).zeta

    def predict_one(self, number: int, unknown: Unknown, values: Array, free: Index) -> Predicted:
        """One of the sets alone, the unknown and its reference by its own lines."""
        part, a = self._parts[number], symmetric(unknown.values, self.size)
        rest = part.rest(values, self._law(part.s_at(values), a, unknown.reference))
        return part.predict(a, unknown.reference, values, free, rest)

    def rests(self, unknown: Unknown, values: Array) -> list[Complex]:
        """With the law k + s c + s^2 m that comes nearest to the stiffness."""
        a = symmetric(unknown.values, self.size)
        law = self._law(self.lines(values), a, unknown.reference)
        return [part.rest(values, law) for part in self._parts]

    def _law(self, s: Complex, a: Complex, reference: Complex) -> tuple[Array, Array, Array] | None:
        """Stiffness, damping and mass nearest to what is unknown; None where nothing is missing."""
        if not np.any(a):
            return None
        with np.errstate(all="ignore"):  # A may be singular: a direction in which nothing is missing
            stiffness = stiffness_of(a, reference, self.sign)
        return _nearest(s, stiffness) if np.isfinite(stiffness).all() else None

    def _zeta(self, values: Array) -> Complex:
        total, count = np.zeros((count_of(self.views), self.size, self.size), dtype=complex), np.zeros(1)
        count = np.zeros((len(total), 1, 1))
        for part in self._parts:
            total[part.view.lines] += part.base(values).zeta
            count[part.view.lines] += 1
        return np.asarray(total / count)

    def lines(self, values: Array) -> Complex:
        """s of the lines that the sets share."""
        s = np.zeros(count_of(self.views), dtype=complex)
        for number, view in enumerate(self.views):
            s[view.lines] = self.lines_of(number, values)
        return s

    def lines_of(self, number: int, values: Array) -> Complex:
        """s of the lines of one of the sets."""
        return self._parts[number].s_at(values)


class _Part:
    """A structural place in one set; compared in coordinates where instruments read H as it is, because those
    are fewer than the outputs.
    """

    def __init__(self, place: Release | Attachment | Beside, view: View, size: int) -> None:
        self.view, released_too = view, isinstance(place, Release)
        names = (*place.coordinates, *place.towards) if isinstance(place, Release) else ()
        extra = view.numbers(names)
        if released_too and len(extra) < len(names):
            raise InputError("place", f"{place.sentence()}, where a link is detached", "all of its links")
        self.system, self.out, self.force = view.over(np.concatenate([view.known, extra]))
        self.directions = None if isinstance(place, Release) else view.directions(place)
        self._compressed: tuple[Array, Complex, float] | None = None
        if view.target.plain:
            self._compressed = view.compressed(np.concatenate([view.known, extra]))
            self.out = np.eye(len(self.force))
        self._size, self._misaligned = size, len(misalignments(place))
        self._last: tuple[bytes, Base] | None = None

    def s_at(self, values: Array) -> Complex:
        """s of its lines."""
        return self.view.target.s_at(self._own(values))

    def _own(self, values: Array) -> Array:
        """Those of the problem's parameters."""
        return values[: len(values) - self._misaligned]

    def _axis(self, values: Array) -> Array:
        """(d + towards, d): what moves with a unit of each coordinate of the place."""
        misalignment = values[len(values) - self._misaligned :]
        return np.concatenate([np.eye(self._size), np.outer(misalignment, np.ones(self._size))])

    def base(self, values: Array) -> Base:
        """The model as it is, at its lines."""
        whole = self._whole(self._own(values))
        if not self._misaligned:
            return whole
        axis = self._axis(values)
        return replace(whole, columns=whole.columns @ axis, zeta=axis.T @ whole.zeta @ axis)

    def _whole(self, values: Array) -> Base:
        """With what the axis is turned towards as columns of its own."""
        key = values.tobytes()
        if self._last is None or self._last[0] != key:
            self._last = key, self._base(values)
        return self._last[1]

    def _base(self, values: Array) -> Base:
        s, matrices = self.view.target.s_at(values), self.system.matrices(values)
        if self.directions is None:
            return released(matrices, s, len(self.view.known), self.out, self.force)
        return attached(matrices, s, self.directions, self.out, self.force)

    def predict(self, a: Complex, reference: Complex, values: Array, free: Index, rest: Complex) -> Predicted:
        """With A (lines, d, d) of a reference zeta."""
        s, own = self.s_at(values), self._own(values)
        new, scale = updated(self.base(values), a, reference), (s**self.view.power)[:, None, None]
        gradient = _gradient(self.system, scale * new.moved, new.to_out, s, free[free < len(own)])
        askew = free[free >= len(own)] - len(own)
        if askew.size:
            slopes = scale[..., None] * self._by_misalignment(a, reference, values)[..., askew]
            gradient = np.concatenate([gradient, slopes], axis=3)
        h = scale * (self.out @ new.moved) + rest
        if self._compressed is None:
            return compared(self.view, own, h, scale[..., None] * new.slopes, gradient)
        every = np.concatenate([h[..., None], scale[..., None] * new.slopes, gradient], axis=3)
        factor, wanted, _ = self._compressed
        turned = real_product(factor, np.moveaxis(every, 2, 1))
        unknowns = new.slopes.shape[3]
        slopes = turned[..., 1 : 1 + unknowns]
        return Predicted(turned[..., 0] - wanted, slopes, turned[..., 1 + unknowns :], turned[..., 0], True)

    def _by_misalignment(self, a: Complex, reference: Complex, values: Array) -> Complex:
        """(lines, outputs, inputs, towards): derivatives of S X B by how far the axis is misaligned: its own
        motion and what the model opposes change.
        """
        whole, axis, first = self._whole(self._own(values)), self._axis(values), self._size
        at = recharted(a, reference, self.base(values).zeta)
        outwards, inwards = whole.out @ whole.columns, np.swapaxes(whole.columns, 1, 2) @ whole.force
        left, right = (outwards @ axis @ at)[..., None], (at @ axis.T @ inwards)[..., None]
        opposed = 2 * (whole.zeta[:, first:] @ axis)[:, None, None, :, 0]
        along = outwards[:, :, None, first:] * right
        return np.asarray(
            along + left * np.swapaxes(inwards[:, first:], 1, 2)[:, None] - left * right * opposed
        )

    def squares(self, a: Complex, reference: Complex, values: Array, rest: Complex) -> float:
        """Sum of |residual / noise|^2."""
        base, s, own = self.base(values), self.s_at(values), self._own(values)
        h = (s**self.view.power)[:, None, None] * (self.out @ moved_by(base, a, reference)) + rest
        if self._compressed is None:
            read = self.view.target.read(h[..., None], own)[..., 0]
            with np.errstate(over="ignore"):
                return float(np.sum(np.abs(whitened(self.view, read - self.view.target.data.frf)) ** 2))
        factor, wanted, left = self._compressed
        turned = real_product(factor, np.swapaxes(h, 1, 2)[..., None])[..., 0]
        return float(np.sum(np.abs(turned - wanted) ** 2)) + left

    def rest(self, values: Array, law: tuple[Array, Array, Array] | None) -> Complex:
        """What the end of the record adds, with stiffness, damping and mass (d, d) at the place."""
        own, known = self._own(values), np.arange(len(self.view.known))
        if law is None:
            chosen = restricted(self.system, known)
            return end_of(self.view, chosen.matrices(own), self.out[:, known], self.force[known], own)
        matrices, out, force = self.system.matrices(own), self.out, self.force
        spread = self.directions
        if spread is None:
            moves = scipy.linalg.block_diag(np.eye(len(known)), self._axis(values))
            matrices, out, force = tuple(moves.T @ x @ moves for x in matrices), out @ moves, moves.T @ force
            spread = np.eye(moves.shape[1])[len(known) :]
        k, c, m = (spread.T @ part @ spread for part in law)
        mass, damping, stiffness = matrices
        return end_of(self.view, (mass + m, damping + c, stiffness + k), out, force, own)


class ReadingModel:
    """Instruments that read something else than they should: factors of rows, columns or all of H."""

    def __init__(self, place: Rows | Column, views: Sequence[View]) -> None:
        self.views, self.place = views, place
        self.chosen = [_channels(place, view) for view in views]
        if not any(len(chosen) for chosen in self.chosen):
            raise InputError("place", place.sentence(), "a channel of a measurement")
        self.size = max(len(chosen) for chosen in self.chosen) if isinstance(place, Rows) else 1
        if any(len(chosen) not in (0, self.size) for chosen in self.chosen if isinstance(place, Rows)):
            raise InputError("place", place.sentence(), "the same channels in all measurements")

    def start(self, values: Array) -> Unknown:
        """A factor of one."""
        zeros = np.zeros((count_of(self.views), self.size**2), dtype=complex)
        return Unknown(zeros, zeros[:, :0])

    def refreshed(self, unknown: Unknown, values: Array) -> Unknown:
        """The same."""
        return unknown

    def predict(
        self, unknown: Unknown, values: Array, free: Index, rests: Sequence[Complex]
    ) -> list[Predicted]:
        """(1 + Q) H."""
        return [
            self._one(view, chosen, unknown.values[view.lines], values, free, rest)
            for view, chosen, rest in zip(self.views, self.chosen, rests, strict=True)
        ]

    def _one(
        self, view: View, chosen: Index, q: Complex, values: Array, free: Index, rest: Complex
    ) -> Predicted:
        system, out, force = view.over(view.known)
        s, scale = view.target.s_at(values), (view.target.s_at(values) ** view.power)[:, None, None]
        base = attached(system.matrices(values), s, np.zeros((0, len(view.known))), out, force)
        gradient = _gradient(system, scale * base.moved, base.to_out, s, free)
        h = view.target.read((scale * (out @ base.moved) + rest)[..., None], values)
        gradient = view.target.read(gradient, values)
        slopes = np.zeros((*h.shape[:3], self.size**2), dtype=complex)
        if isinstance(self.place, Column):
            slopes[:, :, chosen, 0] = h[:, :, chosen, 0]
            gradient[:, :, chosen] *= 1 + q[:, :, None, None]
        else:
            for a, row in enumerate(chosen):
                for b, other in enumerate(chosen):
                    slopes[:, row, :, a * self.size + b] = h[:, other, :, 0]
            if len(chosen):
                turn = q.reshape(-1, self.size, self.size)
                gradient[:, chosen] += np.einsum("lab,lbip->laip", turn, gradient[:, chosen])
        changed = h[..., 0] + np.einsum("loim,lm->loi", slopes, q)
        return Predicted(
            whitened(view, changed - view.target.data.frf),
            whitened(view, slopes),
            whitened(view, gradient),
            whitened(view, changed),
        )

    def squares(self, unknown: Unknown, values: Array, rests: Sequence[Complex]) -> float:
        """Of residuals."""
        parts = self.predict(unknown, values, np.zeros(0, dtype=int), rests)
        return sum(float(np.sum(np.abs(part.residual) ** 2)) for part in parts)

    def rests(self, unknown: Unknown, values: Array) -> list[Complex]:
        """Those of the model as it is."""
        result = []
        for view in self.views:
            system, out, force = view.over(view.known)
            result.append(end_of(view, system.matrices(values), out, force, values))
        return result


def _channels(place: Rows | Column, view: View) -> Index:
    data = view.target.data
    if isinstance(place, Rows):
        numbers = [
            n
            for n, c in enumerate(data.outputs)
            if c.node == place.node and abs(c.direction) in place.directions
        ]
    else:
        numbers = [n for n, c in enumerate(data.inputs) if place.channel in ("", str(c))]
    return np.array(numbers, dtype=int)


def compared(view: View, values: Array, h: Complex, slopes: Complex, gradient: Complex) -> Predicted:
    """H (lines, channels, inputs) and its derivatives as instruments read them, against what was measured,
    over noise.
    """
    predicted = view.target.read(h[..., None], values)[..., 0]
    return Predicted(
        whitened(view, predicted - view.target.data.frf),
        whitened(view, view.target.read(slopes, values)),
        whitened(view, view.target.read(gradient, values)),
        whitened(view, predicted),
    )


def end_of(
    view: View, matrices: tuple[Array, Array, Array], out: Array, force: Array, values: Array
) -> Complex:
    """(lines, channels, inputs): what the end of the record adds to H."""
    s, record = view.target.s_at(values), view.target.end_at(values)
    if record is None:
        return np.zeros((len(s), out.shape[0], force.shape[1]), dtype=complex)
    return end_added(matrices, s, out, force, view.power, record)


def _nearest(s: Complex, stiffness: Complex) -> tuple[Array, Array, Array]:
    """Stiffness, damping and mass (d, d) nearest to a dynamic stiffness (lines, d, d), each line counted by
    its own size.
    """
    size = stiffness.shape[-1]
    rows, columns = np.triu_indices(size)
    wanted = stiffness[:, rows, columns].T
    typical = np.abs(wanted)
    least = 1e-9 * typical.max() + np.finfo(float).tiny
    weight = 1 / np.maximum(typical, np.maximum(np.median(typical, axis=1), least)[:, None])
    powers = weight[..., None] * np.stack([np.ones_like(s), s, s * s], axis=1)
    found = _least_squares(powers, wanted * weight)
    result = np.zeros((3, size, size))
    result[:, rows, columns] = result[:, columns, rows] = found.T
    return result[0], result[1], result[2]


def _least_squares(matrix: Complex, wanted: Complex) -> Array:
    """Real x (e, q) for which matrix (e, l, q) times x is nearest to wanted (e, l)."""
    real = np.concatenate([matrix.real, matrix.imag], axis=1)
    size = np.linalg.norm(real, axis=1)
    size = np.where(size > 0, size, 1.0)
    real = real / size[:, None]
    right = np.swapaxes(real, 1, 2) @ np.concatenate([wanted.real, wanted.imag], axis=1)[..., None]
    product = np.swapaxes(real, 1, 2) @ real + _RIDGE * np.eye(matrix.shape[2])
    return np.asarray(np.linalg.solve(product, right)[..., 0] / size)


def _gradient(system: System, moved: Complex, to_out: Complex, s: Complex, free: Index) -> Complex:
    """(lines, outputs, inputs, free): derivatives of S Z^-1 B from S Z^-1 and Z^-1 B."""
    factors = system.factors
    columns = factors.columns(free)
    vectors, owner = factors.vectors[:, columns], factors.owner[columns]
    weight = factors.weight[columns] * s[:, None] ** factors.power[columns]
    left, right = -(to_out @ vectors) * weight[:, None, :], np.swapaxes(vectors.T @ moved, 1, 2)
    every = left[:, :, None, :] * right[:, None]
    if np.array_equal(owner, free):
        return np.asarray(every)
    result = np.zeros((*every.shape[:3], len(free)), dtype=complex)
    for number, parameter in enumerate(free):
        result[..., number] = every[..., owner == parameter].sum(axis=3)
    return result

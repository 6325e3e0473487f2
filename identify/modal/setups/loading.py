"""What a mass at some points of a structure does to its modes, and which one explains poles that differ.

A sensor of mass m that moves by phi in a mode of unit modal mass lowers it to omega_0 / sqrt(1 + m phi^2):
the more the point moves, the more.  So poles of setups over the squared shape lead back to the mode without a
sensor.  Other modes take part; what they do comes from the eigenvalues of all modes with the mass (structural
modification: Ewins, Modal Testing (2000), 6.2; of sensors' masses: Ashory, Ph.D. thesis, Imperial College
(1999); Cakar and Sanliturk, MSSP 19 (2005) 87-104).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from identify.core.arrays import Array, Complex

_PART = 0.1
"""Of a shift that a model of few modes may leave at first; then it is estimated."""
_LEAST = 1e-3
"""Of a shift that is never believed: shapes are known to per mille at best."""
_TURNS = 12
"""Of lines and of what other modes do to them: each turn takes half of the change, so that all settle."""
MEDIAN = 1.4826
"""From a median of magnitudes to a standard deviation."""


@dataclass(frozen=True)
class Loading:
    """Modes (m,) without the sensors: omega, rad/s, and its standard deviation; load (m,), of the square of a
    shape as it is scaled, and its standard deviation: 1 / omega^2 rises by that part where masses move;
    predicted (m, setups): omega with the sensors of each.
    """

    omega: Array
    omega_std: Array
    load: Array
    load_std: Array
    predicted: Array


def loaded(omega: Array, moved: Sequence[Array]) -> tuple[Array, Array]:
    """Modes (m, setups) with masses on, rad/s, and what each is made of: (setups, m without, m with), of unit
    modal mass; they keep their order.

    moved: of each setup (m, channels), square root of the mass times what a mode of unit modal mass moves.
    """
    mass = np.eye(len(omega)) + np.array([one @ one.T for one in moved])
    value, vectors = np.linalg.eigh(mass / np.outer(omega, omega))  # 1 / omega^2, rising
    place = len(omega) - 1 - np.argsort(np.argsort(omega))
    there, vectors = 1 / np.sqrt(value[:, place]), vectors[:, :, place]
    made = vectors * there[:, None, :] / omega[:, None]
    sign = np.where(np.einsum("kmm->km", made) < 0, -1.0, 1.0)
    return there.T, made * sign[:, None, :]


def explained(
    omega: Array,
    std: Array,
    shapes: Sequence[Array],
    prior: tuple[Array, Array] | None = None,
    mixed: bool = True,
) -> Loading:
    """The loads that explain poles best; omega, std (m, setups), NaN where a setup does not show a mode.

    shapes: (m, channels) of the roved sensors of each setup, real; prior: loads (m,) known otherwise, NaN
    where not, and their standard deviations.  Without one a load is 0, give or take the largest of all modes.
    mixed: whether a mass mixes modes, or each is by itself.  What a mode's poles are off by, which is the
    error of a model of few modes, counts in full for the one without masses: it is alike in all setups.
    """
    known = np.isfinite(omega)
    std = np.where(known, std, 1.0)
    moved = np.array([np.sum(shape**2, axis=1) for shape in shapes]).T
    unit = np.maximum(np.max(moved, axis=1), np.finfo(float).tiny)
    moved = moved / unit[:, None]
    base = np.nanmax(omega, axis=1)
    part = np.where(known, (base[:, None] / np.where(known, omega, 1.0)) ** 2 - 1, 0.0)
    most = max(float(np.max(part)), 1e-9)
    stated = np.zeros(len(base)), np.full(len(base), most)
    if prior is not None:
        has = prior[0] * unit < 2 * most
        stated = np.where(has, prior[0] * unit, stated[0]), np.where(has, prior[1] * unit, stated[1])
    load, error, beside = stated[0], _PART, np.ones(omega.shape)
    for _ in range(_TURNS):
        alone = base[:, None] / np.sqrt(1 + load[:, None] * moved)
        shift = np.maximum(base[:, None] - alone, 0.1 * np.max(base[:, None] - alone, axis=1, keepdims=True))
        wide = np.hypot(std, error * shift)
        seen = np.where(known, omega * beside, 1.0)
        weight = known / np.sqrt(1 + ((seen - alone) / wide) ** 2)  # what is far off counts little
        base, load, spread = _lines(seen, wide, weight, moved, stated)
        load = np.minimum(load, 2 * most)
        root = np.sqrt(load / unit)[:, None]
        there = alone = base[:, None] / np.sqrt(1 + load[:, None] * moved)
        if mixed:
            there = loaded(base, [root * shape for shape in shapes])[0]
        beside = (beside + alone / there) / 2
        rest = np.abs((omega - there) / wide)[known]
        error = float(np.clip(error * MEDIAN * np.median(rest), _LEAST, _PART))
    count = known.sum(axis=1)
    off = np.sum(np.where(known, omega - there, 0.0) ** 2, axis=1)
    rest = np.sqrt(off / np.maximum(count - 2, 1))
    return Loading(base, np.hypot(spread[0], rest), load / unit, spread[1] / unit, there)


def _lines(
    omega: Array, wide: Array, weight: Array, moved: Array, stated: tuple[Array, Array]
) -> tuple[Array, Array, tuple[Array, Array]]:
    """Each mode's omega at rest and load, (m,) each, and their standard deviations: the line 1 / omega^2 =
    (1 + load x moved) / omega_0^2 through all setups, with loads (m,) known to a standard deviation.
    """
    top = np.max(np.where(weight > 0, omega, 0.0), axis=1)
    value = (top[:, None] / omega) ** 2
    sure = weight / (2 * value * wide / omega) ** 2
    rows = np.stack([np.ones(omega.shape), moved], axis=2)
    normal = np.einsum("rk,rki,rkj->rij", sure, rows, rows)
    right = np.einsum("rk,rki,rk->ri", sure, rows, value)
    of_load = (
        np.stack([-stated[0], np.ones(len(top))], axis=1) / stated[1][:, None]
    )  # slope - load x intercept
    normal = normal + of_load[:, :, None] * of_load[:, None, :]
    inverse = np.linalg.inv(normal)
    rest, slope = np.einsum("rij,rj->ri", inverse, right).T
    flat = (slope < 0) | (rest <= 0)
    rest = np.where(flat, np.sum(sure * value, axis=1) / np.sum(sure, axis=1), rest)
    load = np.where(flat, 0.0, slope / rest)
    base = top / np.sqrt(rest)
    return base, load, (base * np.sqrt(inverse[:, 0, 0]) / (2 * rest), np.sqrt(inverse[:, 1, 1]) / rest)


def without(product: Complex, shape: Complex, participation: Complex, load: Array, made: Array) -> Complex:
    """Products of shapes and participations of modes with masses on, (m, outputs, inputs), less what the
    masses did to them.

    shape (m, outputs), participation (m, inputs): of the modes without masses; made (m, m): of `loaded`.
    """
    size = np.sqrt(np.where(load > 0, load, 1.0))[:, None]
    mixed_shape, mixed_participation = made.T @ (size * shape), made.T @ (participation / size)
    there = np.einsum("mo,mi->moi", mixed_shape, mixed_participation)
    return np.asarray(product - there + np.einsum("mo,mi->moi", shape, participation))

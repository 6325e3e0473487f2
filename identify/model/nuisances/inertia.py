"""The inertia of a link that is not quite as told: ten numbers, whatever they are a body with positive
energy.

A link's mass matrix is linear in its mass, first moments and second moments about its frame
(`identify.model.effects.rigid_body`).  Mass and principal moments are positive because their logarithms
change,
and products of inertia stay below half the mean of two moments, so that the inertia tensor is positive
definite.
That the largest moment is less than the sum of the others is left to what was stated, as for descriptions,
many of which miss it by some per cent.
"""

from __future__ import annotations

from itertools import combinations_with_replacement

import numpy as np

from identify.core.arrays import Array
from identify.robot.description import Link

CHANGES = (
    "mass",
    *(f"centre_{x}" for x in "xyz"),
    *(f"inertia_{number}" for number in (1, 2, 3)),
    *(f"product_{pair}" for pair in ("12", "13", "23")),
)
"""What may change: ln mass; centre of mass, m; ln of each principal moment, the smallest first; products of
inertia over the geometric mean of two principal moments."""
_PAIRS = tuple(combinations_with_replacement(range(3), 2))
_OFF = ((0, 1), (0, 2), (1, 2))
_MOST = 0.5
"""Products stay below this part of the mean of their moments: three of them then leave a positive tensor."""


def moments(link: Link, change: Array) -> tuple[Array, Array]:
    """Mass, first moments (3) and second moments xx, xy, xz, yy, yz, zz of a link about its frame, (10,), and
    their derivatives (10, 10) with respect to the changes (10,) in the order of `CHANGES`.
    """
    mass, centre = link.mass * np.exp(change[0]), link.centre + change[1:4]
    inertia, inertia_slopes = _inertia(link.inertia, change[4:])
    full = _second(inertia) + mass * np.outer(centre, centre)
    values = np.concatenate([[mass], mass * centre, _upper(full)])
    slopes = np.zeros((10, 10))
    slopes[:, 0] = mass * np.concatenate([[1.0], centre, _upper(np.outer(centre, centre))])
    for number, axis in enumerate(np.eye(3), start=1):
        slopes[1:4, number] = mass * axis
        slopes[4:, number] = mass * _upper(np.outer(axis, centre) + np.outer(centre, axis))
    slopes[4:, 4:] = np.array([_upper(_second(slope)) for slope in inertia_slopes]).T
    return values, slopes


def changed(link: Link, change: Array) -> Link:
    """The link with these changes (10,)."""
    mass, centre = link.mass * float(np.exp(change[0])), link.centre + change[1:4]
    return Link(link.name, mass, centre, _inertia(link.inertia, change[4:])[0])


def _inertia(told: Array, change: Array) -> tuple[Array, list[Array]]:
    """Inertia (3, 3) about the centre, and its derivatives with respect to the six changes (6,) of it."""
    principal, axes = np.linalg.eigh(told)
    grown = principal * np.exp(change[:3])
    local, root = np.diag(grown), np.sqrt(np.outer(grown, grown))
    for (i, j), amount in zip(_OFF, change[3:], strict=True):
        local[i, j] = local[j, i] = _MOST * np.tanh(amount / _MOST) * root[i, j]
    slopes = []
    for half in 0.5 * np.eye(3):  # every entry grows with the roots of its two moments
        slopes.append(local * (half[:, None] + half))
    for (i, j), amount in zip(_OFF, change[3:], strict=True):
        unit = np.zeros((3, 3))
        unit[i, j] = unit[j, i] = root[i, j] / np.cosh(amount / _MOST) ** 2
        slopes.append(unit)
    return np.asarray(axes @ local @ axes.T), [np.asarray(axes @ slope @ axes.T) for slope in slopes]


def _second(inertia: Array) -> Array:
    """Second moments (3, 3) of an inertia about the same point."""
    return np.asarray(0.5 * np.trace(inertia) * np.eye(3) - inertia)


def _upper(matrix: Array) -> Array:
    """xx, xy, xz, yy, yz, zz of a symmetric matrix (3, 3)."""
    return np.array([matrix[i, j] for i, j in _PAIRS])

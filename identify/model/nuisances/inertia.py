"""The inertia of a link that is not quite as stated: ten numbers, whatever they are a body with positive
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

from collections.abc import Sequence

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
_ROWS, _COLUMNS = np.triu_indices(3)
_OFF = ((0, 1), (0, 2), (1, 2))
_MOST = 0.5
"""Products stay below this part of the mean of their moments: three of them then leave a positive tensor."""


def moments(links: Sequence[Link], changes: Array) -> tuple[Array, Array]:
    """Mass, first moments (3) and second moments xx, xy, xz, yy, yz, zz of links about their frames,
    (links, 10), and their derivatives (links, 10, 10) with respect to the changes (links, 10) in the order of
    `CHANGES`.
    """
    mass = np.array([link.mass for link in links]) * np.exp(changes[:, 0])
    centre = np.array([link.centre for link in links]).reshape(-1, 3) + changes[:, 1:4]
    inertia, slopes_of_inertia = _inertia(_nominal(links), changes[:, 4:])
    square, heavy = _outer(centre, centre), mass[:, None, None]
    full = _second(inertia) + heavy * square
    values = np.concatenate([mass[:, None], mass[:, None] * centre, _upper(full)], axis=1)
    slopes = np.zeros((len(links), 10, 10))
    unit = np.ones((len(links), 1))
    slopes[:, :, 0] = mass[:, None] * np.concatenate([unit, centre, _upper(square)], axis=1)
    slopes[:, 1:4, 1:4] = heavy * np.eye(3)
    for number, axis in enumerate(np.eye(3), start=1):
        slopes[:, 4:, number] = mass[:, None] * _upper(_outer(axis, centre) + _outer(centre, axis))
    slopes[:, 4:, 4:] = np.swapaxes(_upper(_second(slopes_of_inertia)), 1, 2)
    return values, slopes


def changed(link: Link, change: Array) -> Link:
    """The link with these changes (10,)."""
    mass, centre = link.mass * float(np.exp(change[0])), link.centre + change[1:4]
    return Link(link.name, mass, centre, _inertia(_nominal([link]), change[None, 4:])[0][0])


def _nominal(links: Sequence[Link]) -> Array:
    """(links, 3, 3): inertia about the centres as stated."""
    return np.array([link.inertia for link in links]).reshape(-1, 3, 3)


def _inertia(nominal: Array, changes: Array) -> tuple[Array, Array]:
    """Inertia (links, 3, 3) about the centres, and its derivatives (links, 6, 3, 3) with respect to the six
    changes (links, 6) of it.
    """
    principal, axes = np.linalg.eigh(nominal)
    grown = principal * np.exp(changes[:, :3])
    root = np.sqrt(_outer(grown, grown))
    local, slopes = grown[:, :, None] * np.eye(3), np.zeros((len(nominal), 6, 3, 3))
    for number, (i, j) in enumerate(_OFF, start=3):
        amount = changes[:, number] / _MOST
        local[:, i, j] = local[:, j, i] = _MOST * np.tanh(amount) * root[:, i, j]
        slopes[:, number, i, j] = slopes[:, number, j, i] = root[:, i, j] / np.cosh(amount) ** 2
    for number, half in enumerate(0.5 * np.eye(3)):  # every entry grows with the roots of its two moments
        slopes[:, number] = local * (half[:, None] + half)
    back = np.swapaxes(axes, 1, 2)
    return axes @ local @ back, axes[:, None] @ slopes @ back[:, None]


def _outer(a: Array, b: Array) -> Array:
    """(..., 3, 3)."""
    return np.asarray(a[..., :, None] * b[..., None, :])


def _second(inertia: Array) -> Array:
    """Second moments (..., 3, 3) of inertias about the same points."""
    return np.asarray(0.5 * np.trace(inertia, axis1=-2, axis2=-1)[..., None, None] * np.eye(3) - inertia)


def _upper(matrix: Array) -> Array:
    """(..., 6): xx, xy, xz, yy, yz, zz of symmetric matrices (..., 3, 3)."""
    return np.asarray(matrix[..., _ROWS, _COLUMNS])

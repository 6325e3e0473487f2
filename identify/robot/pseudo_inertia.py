"""The pseudo-inertia of a rigid body: a 4 x 4 matrix, linear in mass, first moments and inertia, that is
positive definite where, and only where, some distribution of mass has them (Traversaro, Brossette, Escande
and Nori, IROS 2016; Wensing, Kim and Slotine, IEEE RA-L 3-1, 2018, Eq. 9).

    P = [[S, h], [h', m]],   S = tr(I)/2 1 - I,   h = m c,   I about the frame's origin
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from identify.core.arrays import Array
from identify.robot.description import Link

_LEAST = 1e-3
"""Least second moment about the centre, over their sum, that a body is given whose stated ones are none."""

_ROUNDING = 1e-9


def pseudo_inertia(link: Link) -> Array:
    """(4, 4): second moments, kg m^2, first moments, kg m, and mass, kg, in the link's frame."""
    first = link.mass * link.centre
    second = np.trace(link.inertia) / 2 * np.eye(3) - link.inertia + np.outer(link.centre, first)
    return np.block([[second, first[:, None]], [first[None, :], np.array([[link.mass]])]])


def body_of(matrix: Array, name: str = "") -> Link:
    """The body with a pseudo-inertia (4, 4); also of a complex one, for derivatives by complex steps."""
    mass, centre = matrix[3, 3], matrix[:3, 3] / matrix[3, 3]
    second = matrix[:3, :3] - mass * np.outer(centre, centre)
    return Link(name, mass, centre, np.trace(second) * np.eye(3) - second)


def consistent(link: Link) -> tuple[Array, bool]:
    """The pseudo-inertia (4, 4) of a stated body, and whether its inertia was changed for it: where the
    largest moment is not less than the sum of the others, the second moments are raised to positive ones.
    """
    second = np.trace(link.inertia) / 2 * np.eye(3) - link.inertia
    sizes, axes = np.linalg.eigh(second)
    least = _LEAST * float(np.abs(sizes).sum())
    if sizes[0] >= least:
        return pseudo_inertia(link), False
    raised = axes * np.maximum(sizes, least) @ axes.T
    inertia = np.trace(raised) * np.eye(3) - raised
    return pseudo_inertia(Link(link.name, link.mass, link.centre, inertia)), True


def tidied(body: Link) -> Link:
    """Without what rounding left where symmetry has zeros."""
    small = _ROUNDING * float(np.trace(body.inertia))
    near = float(np.sqrt(_ROUNDING * small / body.mass))
    return replace(
        body,
        centre=np.where(np.abs(body.centre) < near, 0.0, body.centre),
        inertia=np.where(np.abs(body.inertia) < small, 0.0, body.inertia),
    )

"""A robot that is not quite as stated, at postures that were not measured: what a fit found of its links and
lengths, what that leaves uncertain, and joint angles that are uncertain anew at every posture.

The inertia of links and the places of joints are the robot's own and go along; the errors of joint angles
belong to a posture, so that at another one only what was stated of them is known.  How errors of lengths and
angles turn the tool itself is left out of bands: they change its compliance by their size, some parts in a
hundred at most.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from identify.core.arrays import Array
from identify.core.errors import InputError
from identify.model.nuisances.basis import WEIGHTED, Basis, basis, moved, reduced
from identify.model.nuisances.inertia import CHANGES, changed, moments
from identify.model.system import Change, Factors, System, factored
from identify.results.fit import StatedUncertainty
from identify.robot.description import Link, Robot

_ORIGIN = tuple(f"origin_{axis}" for axis in "xyz")


@dataclass(frozen=True)
class Off:
    """Nuisance parameters of a robot.

    of_parameters (f, u): rows of a root of the joint covariance that belong to the free parameters on their
    search scale; links: as stated; inertia (links, 10): the fitted changes, in the order of `CHANGES`;
    spread_inertia (links, 10, u), spread_origin (joints, 3, u): rows of that root in SI units; angle_std,
    rad.
    """

    of_parameters: Array
    links: tuple[Link, ...]
    inertia: Array
    spread_inertia: Array
    spread_origin: Array
    angle_std: float

    @cached_property
    def slopes(self) -> Array:
        """(links, 10, 10): derivatives of the inertial parameters by the changes, see `moments`."""
        return moments(self.links, self.inertia)[1]


def corrected(robot: Robot, stated: StatedUncertainty, where: str) -> tuple[Robot, Off]:
    """The robot as a fit found it, and what is left uncertain of it; InputError for a result without the
    covariance of what was stated.
    """
    if stated.root is None:
        found = "without the covariance of what was stated"
        raise InputError(where, found, "a result of this version", "run the fit again")
    first = len(stated.root) - len(stated.shift)
    links = tuple(link for link in robot.links if link.mass > 0)
    names, joints = [link.name for link in links], [f"joint{n}" for n in range(1, len(robot.joints) + 1)]
    size = len(stated.root)
    inertia, spread_inertia = np.zeros((len(links), 10)), np.zeros((len(links), 10, size))
    origin, spread_origin = np.zeros((len(joints), 3)), np.zeros((len(joints), 3, size))
    angle = 0.0
    for row, (place, change) in enumerate(zip(stated.place, stated.change, strict=True)):
        std, own = stated.stated[row], stated.root[first + row]
        if change in CHANGES:
            at = names.index(place), CHANGES.index(change)
            inertia[at], spread_inertia[at] = std * stated.shift[row], std * own
        elif change in _ORIGIN:
            at = joints.index(place), _ORIGIN.index(change)
            origin[at], spread_origin[at] = std * stated.shift[row], std * own
        elif change in joints:
            angle = max(angle, float(std))
    off = Off(stated.root[:first], links, inertia, spread_inertia, spread_origin, angle)
    return _corrected(robot, off, origin), off


def _corrected(robot: Robot, off: Off, origin: Array) -> Robot:
    """With other inertias and places of joints (joints, 3), m, in their parent links."""
    others = {link.name: changed(link, change) for link, change in zip(off.links, off.inertia, strict=True)}
    found = replace(robot, links=tuple(others.get(link.name, link) for link in robot.links))
    for joint, amounts in enumerate(origin):
        for axis, amount in enumerate(amounts):
            found = moved(found, joint, axis, float(amount)) if amount else found
    return found


def with_errors(
    off: Off, robot: Robot, system: System, posture: Array, spread: Array
) -> tuple[Factors, Array]:
    """Factors of a system at a posture (joints,), rad, with columns for what was stated; and a root (o, v) of
    the covariance of their owners, from that of the parameters, `spread` (p, u).
    """
    angles, lengths = off.angle_std > 0, bool(np.any(off.spread_origin))
    there = basis(robot, posture, [], None, angles=angles, lengths=lengths)
    there = reduced(there, system.site.shapes[:, system.free])
    changes = _of_inertia(off, there)
    lasting = [*off.spread_inertia.reshape(-1, spread.shape[1])]
    geometry = list(there.geometry)
    own = geometry[: len(posture)] if angles else []
    if lengths:
        changes += [(one.mass, one.stiffness) for one in geometry[len(own) :]]
        lasting += [*off.spread_origin.reshape(-1, spread.shape[1])]
    rows = np.concatenate([spread, np.array(lasting)])
    both = np.zeros((len(rows) + len(own), rows.shape[1] + len(own)))
    both[: len(rows), : rows.shape[1]] = rows
    both[len(rows) :, rows.shape[1] :] = off.angle_std * np.eye(len(own))
    changes += [(one.mass, one.stiffness) for one in own]
    return _extended(system.factors, changes, len(spread)), both


def _of_inertia(off: Off, there: Basis) -> list[tuple[Array, Array]]:
    """Changes of M and K_g per unit of each change of each link, one after the other."""
    found = []
    for number, slopes in enumerate(off.slopes):
        mass = np.tensordot(slopes.T, there.mass[number], axes=1)
        weight = np.tensordot(slopes[:WEIGHTED].T, there.weight[number], axes=1)
        found += list(zip(mass, weight, strict=True))
    return found


def _extended(factors: Factors, changes: Sequence[tuple[Array, Array]], first: int) -> Factors:
    """With columns that belong to owners from `first` on; each change of M and K is symmetric."""
    more = factored(
        (
            Change(0.5 * (matrix + matrix.T), power, number)
            for number, (mass, stiffness) in enumerate(changes, start=first)
            for power, matrix in ((2, mass), (0, stiffness))
        ),
        len(factors.vectors),
    )
    return Factors(
        np.concatenate([factors.vectors, more.vectors], axis=1),
        np.concatenate([factors.power, more.power]),
        np.concatenate([factors.weight, more.weight]).astype(complex),
        np.concatenate([factors.owner, more.owner]),
    )

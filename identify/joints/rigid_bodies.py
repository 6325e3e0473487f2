"""The rigid bodies of an arm out of the torques of its motion: such as bodies can be, and as the robot's
description says where torques do not tell (`identify.joints.consistent`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from pydantic import Field

from identify.core.arrays import Array, Index
from identify.core.correlated import correlation_time
from identify.core.thresholds import SIGMAS_95
from identify.joints.arm_motion import ArmMotion, ArmRegression
from identify.joints.base_set import all_names, parameters_of, pseudo_inertia_basis
from identify.joints.consistent import ConsistentFit, covariances
from identify.joints.data import JointTestData
from identify.joints.intervals import AS_DESCRIBED, DETERMINED, symmetric, table
from identify.results.joints import CurveResult, JointValues
from identify.robot.description import Link, Robot
from identify.robot.pseudo_inertia import body_of, consistent, tidied
from identify.robot.rewrite import with_bodies

_PARTS = {"mass": "kg"} | {f"centre_{axis}": "m" for axis in "xyz"}
_PARTS |= {f"inertia_{pair}": "kg m^2" for pair in ("xx", "xy", "xz", "yy", "yz", "zz")}
_TOLD = 0.5
"""Part of the description's standard deviation to which torques must narrow a value to determine it."""
_CHANGED = (
    "{} is described with a moment of inertia that exceeds the sum of the others; the nearest possible one"
    " is used"
)
_STEP = 1e-30
"""Of derivatives by complex steps, which have no rounding to be weighed against."""


class RigidBodies(ArmMotion):
    """Masses, centres and inertias of all links, which written back make a better robot."""

    kind: Literal["rigid-bodies"]
    uncertainty_percent: float = Field(
        30.0,
        gt=0,
        le=1000,
        description="standard deviation of what the robot's description says of masses and second moments;"
        " centres by 0.7 of it, of the radius of gyration",
    )

    def identify(self, bench: JointTestData) -> CurveResult:
        """The bodies, with what torques and description together say of each number."""
        arm, own = self.regression(bench), bench.own_bodies(self.label)
        names = all_names(arm.robot, arm.rows, bench.coupling)
        bodies = _Bodies.of(own, arm.robot, names)
        fit, seen = _problem(arm, bodies, self.uncertainty_percent / 100)
        values = fit.solve(_start(arm, bodies, fit, seen))
        base = arm.chosen.regrouping[:, seen] @ (values + bodies.carried[seen])
        found = [
            tidied(body_of(matrix, link.name))
            for matrix, link in zip(fit.pseudo_inertias(values), own.links[1:], strict=True)
        ]
        return CurveResult(
            "Rigid bodies",
            self.kind,
            "N m",
            arm.rms(base),
            int(arm.used.sum()),
            _values(fit, values, own, found),
            arm.panels(base),
            (_said(arm, base, fit, values), *arm.said(base)),
            (*bodies.notes, *arm.notes(base, bench.coupling is not None)),
            robot="" if bench.settings is None else with_bodies(bench.settings, bench.folder, own, found),
        )


@dataclass(frozen=True)
class _Bodies:
    """places (links, 10) of each link's parameters among all; values (parameters,) as described, zero for
    those of joints; carried (parameters,): what payloads add; described: pseudo-inertias (links, 4, 4).
    """

    places: Index
    values: Array
    carried: Array
    described: Array
    notes: tuple[str, ...]

    @classmethod
    def of(cls, own: Robot, whole: Robot, names: Sequence[str]) -> _Bodies:
        """Of a robot without payloads and with them."""
        places, values, carried, described, notes = [], np.zeros(len(names)), np.zeros(len(names)), [], []
        for link, with_payload in zip(own.links[1:], whole.links[1:], strict=True):
            matrix, changed = consistent(link)
            stated = body_of(matrix, link.name)
            rows = [names.index(name) for name in parameters_of(stated)]
            values[rows] = _numbers(stated)
            carried[rows] = _numbers(with_payload) - _numbers(link)
            places.append(rows)
            described.append(matrix)
            if changed:
                notes.append(_CHANGED.format(link.name))
        return cls(np.array(places), values, carried, np.array(described), tuple(notes))


def _numbers(link: Link) -> Array:
    return np.array(list(parameters_of(link).values()))


def _problem(arm: ArmRegression, bodies: _Bodies, share: float) -> tuple[ConsistentFit, Index]:
    """What is solved, and the numbers of the parameters that have a part in it.

    Torques of a joint weigh by the scatter that base parameters alone leave, and by how many samples are
    worth one.
    """
    act = np.any(arm.chosen.regrouping != 0, axis=0)
    act[bodies.places.ravel()] = True
    seen = np.flatnonzero(act)
    left, counts = arm.left(arm.values), arm.used.sum(axis=0)
    spans = [correlation_time(left[:, n], arm.used[:, n]) for n in range(len(counts))]
    weights = 1 / np.sqrt(np.maximum((left**2).sum(axis=0) / counts * spans, 1e-24))
    rows = (arm.columns * weights[:, None])[arm.used] @ arm.chosen.regrouping[:, seen]
    information = rows.T @ rows
    score = rows.T @ (arm.torque * weights)[arm.used] - information @ bodies.carried[seen]
    rotors = [place for place, n in enumerate(seen) if arm.chosen.names[n].endswith(".ia")]
    return ConsistentFit(
        information,
        score,
        np.searchsorted(seen, bodies.places),
        pseudo_inertia_basis(),
        bodies.described,
        np.array(rotors, dtype=np.intp),
        share,
    ), seen


def _start(arm: ArmRegression, bodies: _Bodies, fit: ConsistentFit, seen: Index) -> Array:
    """Bodies as described, with what the joints then have, as least squares finds it; rotors inside."""
    start = bodies.values[seen]
    joints = np.setdiff1d(np.arange(len(seen)), fit.bodies.ravel())
    rest = (fit.score - fit.information @ start)[joints]
    start[joints] = np.linalg.lstsq(fit.information[np.ix_(joints, joints)], rest, rcond=1e-12)[0]
    rotors = start[fit.positive]
    start[fit.positive] = np.maximum(rotors, 0.01 * np.abs(rotors) + 1e-6)
    return start


def _quantities(fit: ConsistentFit, values: Array, link: int) -> Array:
    """(10,): mass, centre and inertia about it of a link, of parameters (n,) that may be complex."""
    return _listed(body_of(np.tensordot(values[fit.bodies[link]], fit.basis, axes=1)))


def _listed(body: Link) -> Array:
    return np.array([body.mass, *body.centre, *body.inertia[np.triu_indices(3)]])


def _values(fit: ConsistentFit, values: Array, own: Robot, bodies: Sequence[Link]) -> JointValues:
    """A row for each number of each body, with its interval and how much of it the torques say."""
    both, alone = covariances(fit, values)
    rows, part = [], []
    for link, described in enumerate(own.links[1:]):
        slopes = np.zeros((10, 10))
        for k, place in enumerate(fit.bodies[link]):
            step = np.zeros(len(values), dtype=complex)
            step[place] = 1j * _STEP
            slopes[:, k] = _quantities(fit, values + step, link).imag / _STEP
        here, at = fit.bodies[link], np.arange(10 * link, 10 * link + 10)
        std, before = (
            np.sqrt(np.einsum("qk,kl,ql->q", slopes, c, slopes))
            for c in (both[np.ix_(here, here)], alone[np.ix_(at, at)])
        )
        part += list(std / before)
        rows += [
            symmetric(f"{described.name}.{name}", unit, value, SIGMAS_95 * one, expected=stated_value)
            for (name, unit), value, one, stated_value in zip(
                _PARTS.items(), _listed(bodies[link]), std, _listed(described), strict=True
            )
        ]
    found = table(rows)
    status = [DETERMINED if one <= _TOLD else AS_DESCRIBED for one in part]
    meaning = [f"interval {100 * one:.3g} % as wide as by the description alone" for one in part]
    return replace(found, status=tuple(status), meaning=tuple(meaning))


def _said(arm: ArmRegression, base: Array, fit: ConsistentFit, values: Array) -> str:
    """How well bodies that can be explain the torques, beside base parameters that need not be any."""
    sizes = np.linalg.eigvalsh(fit.pseudo_inertias(values))
    told = 100 * (arm.rms(base) / arm.rms(arm.values) - 1)
    return (
        f"RMS residual {arm.rms(base):.4g} N m, {told:.2g} % more than of base parameters that need"
        f" not be those of bodies ({arm.rms(arm.values):.4g} N m); every pseudo-inertia is positive definite,"
        f" its least eigenvalue over its largest at least {float((sizes[:, 0] / sizes[:, -1]).min()):.2g}"
    )

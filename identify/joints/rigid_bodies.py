"""The rigid bodies of an arm out of the torques of its motion: such as bodies can be, and as the robot's
description says where torques do not tell.

Rigid bodies that torques and a description agree on, each with a positive definite pseudo-inertia.

What is made least is convex and smooth, and infinite where a body is none, so that Newton's method needs no
constraint:

    1/2 x'N x - d'x + g sum_links [tr(P0^-1 P) - ln det(P P0^-1) - 4] - b sum_rotors ln x

x: ten inertial parameters of each link, and those of the joints; N, d: information and score of the torques;
P, linear in x: pseudo-inertia of a link, P0: that of its description.  The bracket is the log-det divergence
(Lee, Wensing and Park, IEEE T-RO 36-1, 2020, Eq. 19), the same in every frame and unit; near P0 it is half
the squared relative change of P, so that g = 1/u^2 stands for a description that is uncertain by the share u
of its mass and second moments.  What torques do not determine stays as described; b keeps inertias of rotors
positive.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import scipy
from pydantic import Field

from identify.core.arrays import Array, Index
from identify.core.correlated import correlation_time
from identify.core.errors import InputError
from identify.core.thresholds import SIGMAS_95
from identify.joints.arm_motion import ArmMotion, ArmRegression
from identify.joints.base_set import all_names, parameters_of, pseudo_inertia_basis
from identify.joints.data import JointTestData
from identify.joints.intervals import AS_DESCRIBED, DETERMINED, symmetric, table
from identify.results.joints import CurveResult, JointValues
from identify.robot.description import Link, Robot
from identify.robot.pseudo_inertia import body_of, consistent, tidied
from identify.robot.rewrite import with_bodies

_STEPS, _HALVINGS = 200, 60
_DONE, _NEAR = 1e-9, 0.1
"""Newton decrement, squared, at which the search ends: a part of one standard deviation, squared; and at
which the barrier may fall on, per barrier.
"""
_FALL = 4.0
_ROTOR = 0.01
"""b: prices an inertia of zero, and moves others by a hundredth of their variance over their value."""


@dataclass(frozen=True)
class ConsistentFit:
    """information (n, n) and score (n,) of the torques about all parameters; bodies (links, 10): their
    places among them, basis (10, 4, 4): pseudo-inertia per unit of each; described (links, 4, 4); positive:
    places of inertias of rotors; uncertainty: u.
    """

    information: Array
    score: Array
    bodies: Index
    basis: Array
    described: Array
    positive: Index
    uncertainty: float

    def pseudo_inertias(self, values: Array) -> Array:
        """(links, 4, 4) of parameters (n,)."""
        return np.asarray(np.einsum("lk,kij->lij", values[self.bodies], self.basis))

    def inside(self, values: Array) -> bool:
        """Whether every link is a body and every rotor's inertia positive."""
        sizes = np.linalg.eigvalsh(self.pseudo_inertias(values))
        return bool((sizes > 0).all() and (values[self.positive] > 0).all())

    def gradient(self, values: Array, barrier: float = 1.0) -> Array:
        """(n,); barrier: how many times g and b count."""
        slopes = self.information @ values - self.score
        pull = np.linalg.inv(self.described) - np.linalg.inv(self.pseudo_inertias(values))
        weight = barrier / self.uncertainty**2
        slopes[self.bodies] += weight * np.einsum("lij,kij->lk", pull, self.basis)
        slopes[self.positive] -= barrier * _ROTOR / values[self.positive]
        return np.asarray(slopes)

    def described_information(self, values: Array) -> Array:
        """(n, n): what the description, rather than the torques, says there: its curvature."""
        found = np.zeros_like(self.information)
        inverses = np.linalg.inv(self.pseudo_inertias(values))
        for rows, inverse in zip(self.bodies, inverses, strict=True):
            turned = inverse @ self.basis
            found[np.ix_(rows, rows)] = np.einsum("kij,lji->kl", turned, turned) / self.uncertainty**2
        found[self.positive, self.positive] += _ROTOR / values[self.positive] ** 2
        return found

    def solve(self, start: Array) -> Array:
        """The parameters (n,) at the minimum, from a start inside: along the path on which the barrier falls
        to what it is, so that torques that contradict the description do not drive a body to its edge first.
        """
        _, decrement = self._step(start, 1.0)
        rounds = int(np.ceil(np.log(max(decrement, 1.0)) / np.log(_FALL)))
        values = start
        for number in range(rounds, -1, -1):
            values = self._newton(values, _FALL**number, _DONE if number == 0 else _NEAR * _FALL**number)
        return values

    def _newton(self, values: Array, barrier: float, done: float) -> Array:
        for _ in range(_STEPS):
            step, decrement = self._step(values, barrier)
            if decrement < done:
                return values
            values = self._along(values, step, decrement, barrier)
        raise InputError("rigid bodies", "no minimum", "torques and bodies that are finite", "see the record")

    def _step(self, values: Array, barrier: float) -> tuple[Array, float]:
        """Newton's step (n,) and its decrement, squared."""
        slopes = self.gradient(values, barrier)
        curvature = self.information + barrier * self.described_information(values)
        scale = 1 / np.sqrt(np.diag(curvature))
        factor = scipy.linalg.cho_factor(curvature * np.outer(scale, scale), check_finite=False)
        step = -scale * scipy.linalg.cho_solve(factor, scale * slopes, check_finite=False)
        return step, -float(slopes @ step)

    def _along(self, values: Array, step: Array, decrement: float, barrier: float) -> Array:
        """As far along a step as the slope does not turn upwards by much."""
        part = 1.0
        for _ in range(_HALVINGS):
            there = values + part * step
            if self.inside(there) and float(self.gradient(there, barrier) @ step) < 0.1 * decrement:
                return there
            part /= 2
        return values


def covariances(fit: ConsistentFit, values: Array) -> tuple[Array, Array]:
    """(n, n) each: of the parameters by torques and description, and of the bodies by the description
    alone, (10 links, 10 links), both by the curvature at the minimum.
    """
    described = fit.described_information(values)
    rows = fit.bodies.ravel()
    return _inverse(fit.information + described), _inverse(described[np.ix_(rows, rows)])


def _inverse(matrix: Array) -> Array:
    scale = 1 / np.sqrt(np.diag(matrix))
    return np.asarray(np.linalg.inv(matrix * np.outer(scale, scale)) * np.outer(scale, scale))


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
        values = fit.solve(_start(bodies, fit, seen))
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


def _start(bodies: _Bodies, fit: ConsistentFit, seen: Index) -> Array:
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

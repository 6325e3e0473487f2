"""Rigid bodies that torques and a description agree on, each with a positive definite pseudo-inertia.

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

from dataclasses import dataclass

import numpy as np
import scipy

from identify.core.arrays import Array, Index
from identify.core.errors import InputError

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

"""What nonlinear joint torques do after a hammer impact: time steps in modal coordinates, for many
models and impacts at once.

The modes of the linear model advance exactly under forces that are constant within a step.  The torque of a
step is that of its law at a share _AT of the step, solved together with what the torque itself does to the
joint until then: second order at one half, and above one half it damps what alternates from step to step, so
that sticking friction, however stiff, does not ring.

The impact itself is a half-sine of force, in time and in the transform.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from identify.core.arrays import Array, Complex
from identify.model.effects.torque_law import TorqueLaw
from identify.model.modes import state_eigen

_AT = 0.55
_BLOCK = 64
_SWEEPS = 8
"""Rounds over the joints of a step, each joint solved with the torques of the others, from those of the step
before.
"""


@dataclass(frozen=True)
class Models:
    """S linear models: mass, damping, stiffness (S, n, n), force (S, n, inputs), and the impact that each
    gets at each input.
    """

    mass: Array
    damping: Array
    stiffness: Array
    force: Array
    impacts: tuple[Impact, ...]


@dataclass(frozen=True)
class AttachedTorque:
    """A nonlinear torque: the coordinate (S, n) that it turns in each model, its law and own (S, k), the
    law's parameters.
    """

    law: TorqueLaw
    coordinate: Array
    own: Array


@dataclass(frozen=True)
class Response:
    """torque (steps, J, S, inputs) of each of J laws, N m, constant within steps of `step` s; x, v (S, n,
    inputs): motion at the end.
    """

    step: float
    torque: Array
    x: Array
    v: Array

    def of(self, models: slice) -> Response:
        """Some of the models."""
        return Response(self.step, self.torque[:, :, models], self.x[models], self.v[models])

    def over(self, strength: Array) -> Response:
        """Per unit of the impacts' strengths (S, inputs)."""
        return Response(
            self.step, self.torque / strength, self.x / strength[:, None], self.v / strength[:, None]
        )

    def transform(self, s: Complex) -> Complex:
        """(lines, J, S, inputs): Laplace transform of the torques over the record at s (lines,)."""
        steps = len(self.torque)
        waves = _waves(s.tobytes(), self.step, steps)
        flat = waves @ self.torque.reshape(steps, -1)
        return np.asarray(flat[: len(s)] + 1j * flat[len(s) :]).reshape(len(s), *self.torque.shape[1:])


@dataclass(frozen=True)
class _Modal:
    """eigenvalues (S, m); shapes (S, n, m) such that motion is the real part of their sum; left (S, m, n) =
    what forces do to the modes.
    """

    eigenvalues: Complex
    shapes: Complex
    left: Complex


def simulate(models: Models, attached: Sequence[AttachedTorque], record: float, steps: int) -> Response:
    """All models from rest through the impact to the end of the record (s); a model that grows without bound
    gives NaN.
    """
    step, inputs = record / steps, models.force.shape[2]
    modal = _modal(models)
    count, size = modal.eigenvalues.shape
    loop = _Loop(modal, models, attached, step)
    impacts = np.repeat(
        np.stack([impact.means(step, steps) for impact in models.impacts], axis=1), inputs, axis=1
    )
    during = int(np.flatnonzero(impacts.any(axis=1)).max(initial=-1)) + 1
    torque = np.zeros((steps, len(attached), count * inputs))
    for number in range(steps):
        loop.advance(torque[number], torque[number - 1], impacts[number] if number < during else None)
    moved = np.moveaxis(loop.state.reshape(size, count, inputs), 0, 1)
    x = (modal.shapes @ moved).real
    v = (modal.shapes @ (modal.eigenvalues[:, :, None] * moved)).real
    return Response(step, torque.reshape(steps, len(attached), count, inputs), x, v)


def _modal(models: Models) -> _Modal:
    """Half of the conjugate pairs where all eigenvalues come in pairs (twice the real part), or else all
    eigenvalues.

    With hysteretic damping those with Im > 0 are physical; the others stand for negative frequencies and are
    mirrored.
    """
    values, shapes = state_eigen(models.mass, models.damping, models.stiffness)
    count, n = len(values), models.mass.shape[1]
    upper = values.imag > 0
    weight = 1.0
    if np.all(upper.sum(axis=1) == n):
        values, weight = values[upper].reshape(count, n), 2.0
        shapes = np.swapaxes(np.swapaxes(shapes, 1, 2)[upper].reshape(count, n, n), 1, 2)
    norm = np.sum(shapes * (2 * values[:, None] * (models.mass @ shapes) + models.damping @ shapes), axis=1)
    return _Modal(values, shapes, weight * np.swapaxes(shapes, 1, 2) / norm[:, :, None])


class _Loop:
    """Time steps from rest; columns are models by inputs, side by side: `state` (modes, columns)."""

    def __init__(
        self, modal: _Modal, models: Models, attached: Sequence[AttachedTorque], step: float
    ) -> None:
        inputs = models.force.shape[2]
        rate = np.repeat(modal.eigenvalues.T, inputs, axis=1)
        self.decay, full, part = np.exp(rate * step), _growth(rate, step), _growth(rate, _AT * step)
        hit = np.moveaxis(modal.left @ models.force, 1, 0).reshape(len(rate), -1)
        self.hit = full * hit
        self.state = np.zeros_like(full)
        self._both, self._twice = _interleaved(self.state), np.empty(2 * full.shape[1])
        owns = [np.repeat(one.own.T, inputs, axis=1) for one in attached]
        turned = [np.einsum("smn,sn->ms", modal.left, one.coordinate) for one in attached]
        pushes = [np.repeat(push, inputs, axis=1) for push in turned]
        self.push = [_interleaved(-full * push) for push in pushes]
        self.rows, self.kick, self.gain = [], [], []
        self.torques: list[Callable[[Array], Array]] = []
        for number, (one, own) in enumerate(zip(attached, owns, strict=True)):
            seen = np.repeat(np.einsum("snm,sn->ms", modal.shapes, one.coordinate), inputs, axis=1)
            angle, speed, acceleration = one.law.probe(own)
            row = seen * (angle + rate * (speed + rate * acceleration))
            self.rows.append(_interleaved(np.conj(row * np.exp(rate * _AT * step))))
            at_once = seen * rate * acceleration  # forces act on the acceleration without delay
            self.kick.append(np.sum((row * part + at_once) * hit, axis=0).real)
            self.gain.append([np.sum((row * part + at_once) * push, axis=0).real for push in pushes])
            self.torques.append(one.law.solver(self.gain[number][number], own))

    def advance(self, torque: Array, before: Array, impact: Array | None) -> None:
        """The state a step later; torque (J, columns) of the step is filled in; before: that of the last
        step.
        """
        both, twice = self._both, self._twice
        free = [_pairs(np.einsum("mk,mk->k", row, both)) for row in self.rows]
        if impact is not None:
            free = [one + kick * impact for one, kick in zip(free, self.kick, strict=True)]
        if len(free) == 1:
            torque[0] = self.torques[0](free[0])
        else:
            torque[:] = before
            for _ in range(_SWEEPS):
                for j, solved in enumerate(self.torques):
                    others = [gain * torque[other] for other, gain in enumerate(self.gain[j]) if other != j]
                    torque[j] = solved(free[j] - sum(others))
        self.state *= self.decay
        for push, one in zip(self.push, torque, strict=True):
            twice[::2] = twice[1::2] = one
            both += push * twice
        if impact is not None:
            self.state += self.hit * impact


@lru_cache(maxsize=2)
def _waves(lines: bytes, step: float, steps: int) -> Array:
    """(2 lines, steps): integrals of e^(-s t) over each step, real parts above imaginary ones; kept, because
    a fit asks for the same again and again.  lines: the bytes of s (lines,).
    """
    s = np.frombuffer(lines, complex)
    coarse = np.exp(-np.outer(s, step * np.arange(0, steps, _BLOCK)))
    fine = np.exp(-np.outer(s, step * np.arange(_BLOCK))) * (-np.expm1(-s * step) / s)[:, None]
    waves = (coarse[:, :, None] * fine[:, None, :]).reshape(len(s), -1)[:, :steps]
    return np.concatenate([waves.real, waves.imag])


def _interleaved(values: Complex) -> Array:
    """(m, 2 c): real and imaginary parts of complex numbers (m, c) side by side, in the same memory."""
    return np.ascontiguousarray(values).view(float)


def _pairs(values: Array) -> Array:
    """(c,): sums of neighbours of (2 c,); with conj(a) and b interleaved, Re(a b) of sums of products."""
    sums: Array = values[::2] + values[1::2]
    return sums


def _growth(rate: Complex, time: float) -> Complex:
    """The integral of e^(rate t) over `time`; `time` itself at a rate of zero."""
    limit = np.abs(rate * time) < 1e-12
    return np.asarray(np.where(limit, time, np.expm1(rate * time) / np.where(limit, 1.0, rate)))


@dataclass(frozen=True)
class Impact:
    """A half-sine of `peak` N that lasts `width` s and begins a record of `record` s."""

    peak: float
    width: float
    record: float

    def begun(self, middle: float) -> Impact:
        """With what is left of the record where the middle of the impact is that long after its start, s."""
        return replace(self, record=self.record - max(middle - self.width / 2, 0.0))

    def lasting(self, times: float) -> Impact:
        """With so many times its width."""
        return replace(self, width=times * self.width)

    def transform(self, s: Complex) -> Complex:
        """Laplace transform, N s, at s (...), rad/s."""
        pulsation = np.pi / self.width
        return np.asarray(self.peak * pulsation * (1 + np.exp(-s * self.width)) / (s * s + pulsation**2))

    def means(self, step: float, steps: int) -> Array:
        """(steps,): mean force over each time step (s), N, so that no impulse is lost however coarse the
        steps are.
        """
        time = np.minimum(step * np.arange(steps + 1), self.width)
        impulse = self.peak * self.width / np.pi * (1 - np.cos(np.pi * time / self.width))
        return np.asarray(np.diff(impulse) / step)

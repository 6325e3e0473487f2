"""What each FRF of a test would say of the parameters, from exact sensitivities and a model of the noise.

The Fisher information of independent FRFs adds up: over postures q, impacts i and triaxial sensors s,

    F = sum_q sum_i sum_s F_qis,   F_qis = sum_lines sum_axes (Re g Re g' + Im g Im g') / sigma^2,

g the derivatives of a FRF by the parameters on their search scale, and sigma^2 = floor^2 + (relative |H|)^2
the variance of its real and of its imaginary part.  This sum serves the choice; what the chosen test promises
follows from all lines and what their noise has in common (`identify.planning.after_test`).

Two models are told apart by a last unknown: what part of the difference d of their FRFs is there.  With the
derivatives of both, F has the columns [g, g', d], and the information on that part when both are fitted anew
is d' V^-1 d, V the covariance of noise and of what is uncertain of either (Box and Hill 1967, Technometrics
9; with the parameters of one of them free, T-optimality of Atkinson and Fedorov 1975, Biometrika 62).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from identify.core.arrays import Array, Complex, Index
from identify.core.interruption import check
from identify.model.frf import frf_and_gradient
from identify.model.system import System
from identify.planning.candidates import Candidates
from identify.vibration.fitted_model import FittedModel

_LINES = 60


@dataclass(frozen=True)
class TestNoise:
    """Standard deviation of the real and of the imaginary part of an accelerance: floor, m/s^2/N, and the
    part relative to its size, which comes from the force and is shared by all responses of an impact; decay
    of the exponential window on both, 1/s; growth: coefficients, highest power of f / 100 Hz first, of the
    logarithm of how much larger both are at a frequency, as the spectrum of an impact falls.
    """

    __test__ = False
    floor: float
    relative: float = 0.0
    decay_per_s: float = 0.0
    growth: tuple[float, ...] = ()

    def over(self, g: Complex, s: Complex) -> Complex:
        """Derivatives g (lines, ...) at s (lines,) over how much larger the noise is there."""
        larger = self.larger(s.imag / (2 * np.pi))
        return np.asarray(g / larger.reshape(-1, *[1] * (g.ndim - 1)))

    def larger(self, line_hz: Array) -> Array:
        """(lines,): how many times larger the noise is at each line than `floor` and `relative` say."""
        return np.asarray(np.exp(np.polyval(np.array(self.growth), line_hz / 100)))

    def sigma(self, h: Complex) -> Array:
        """Of FRFs, together."""
        return np.asarray(np.sqrt(self.floor**2 + (self.relative * np.abs(h)) ** 2))

    def scaled(self, h: Complex, g: Complex) -> tuple[Complex, Complex, Complex]:
        """Derivatives g (..., u) of FRFs h (...) over the noise, J; and conj J times the part of the noise
        that each response has alone, and times that which comes from the force.
        """
        sigma = self.sigma(h)[..., None]
        j = np.asarray(g / sigma, dtype=complex)
        alone = np.conj(j) * (self.floor / sigma)
        return j, alone, self.relative * np.conj(j) * (h[..., None] / sigma)


@dataclass(frozen=True)
class FreeModel:
    """A model with its free parameters (p): their numbers, and the derivative of their values by the search
    scale.
    """

    model: FittedModel
    free: Index
    step: Array


@dataclass(frozen=True)
class Measurable:
    """Information F (postures, impacts, sensors, u, u) about the unknowns, and the RMS level of each FRF over
    the band (postures, impacts, sensors), m/s^2/N.
    """

    information: Array
    level: Array


def measurable(models: Sequence[FreeModel], among: Candidates, noise: TestNoise, band: Array) -> Measurable:
    """What the candidates would say of the parameters of a model, or of two and their difference; band (3,):
    lowest, highest frequency and resolution, Hz.
    """
    line_hz, weight = standing_lines(band)
    parts = []
    for posture in among.postures:
        check()
        systems = [one.model.system(posture) for one in models]
        s = s_of(line_hz, noise)
        h, g = slopes(models, systems, among.sensors, among.impacts, s)
        parts.append(_summed(h, noise.over(g, s) / noise.sigma(h)[..., None]))
    information = weight * np.array([part[0] for part in parts])
    return Measurable(information, np.array([part[1] for part in parts]))


def standing_lines(band: Array) -> tuple[Array, float]:
    """Lines (l,), Hz, that stand for all of a test, and for how many each."""
    low, high, resolution = band
    return np.linspace(low, high, _LINES), max((high - low) / resolution + 1, 1.0) / _LINES


def s_of(line_hz: Array, noise: TestNoise) -> Complex:
    """(lines,): where FRFs under the window are those of the model."""
    return np.asarray(noise.decay_per_s + 2j * np.pi * line_hz, dtype=complex)


def slopes(
    models: Sequence[FreeModel],
    systems: Sequence[System],
    sensors: Sequence[int],
    impacts: Sequence[tuple[int, int]],
    s: Complex,
) -> tuple[Complex, Complex]:
    """FRFs (lines, 3 sensors, impacts) of the first model at s (lines,), and their derivatives by the
    unknowns (..., u); systems: of the models at the same posture.
    """
    pairs = zip(models, systems, strict=True)
    found = [_of_one(one, system, sensors, impacts, s) for one, system in pairs]
    first, columns = found[0][0], [g for _, g in found]
    columns += [(h - first)[..., None] for h, _ in found[1:]]
    return first, np.concatenate(columns, axis=-1)


def _of_one(
    one: FreeModel,
    system: System,
    sensors: Sequence[int],
    impacts: Sequence[tuple[int, int]],
    s: Complex,
) -> tuple[Complex, Complex]:
    model = one.model
    struck = {node for node, _ in impacts}
    rows = {
        node: model.points[node].axes
        @ system.jacobian(model.points[node].link, model.points[node].position)[:3]
        for node in {*sensors, *struck}
    }
    out = np.concatenate([rows[node] for node in sensors])
    force = np.stack([rows[node][axis] for node, axis in impacts], axis=1)
    matrices = system.matrices(model.values)
    h, gradient = frf_and_gradient(matrices, system.factors, s, out, force, 2, one.free)
    return h, gradient * one.step


def _summed(h: Complex, g: Complex) -> tuple[Array, Array]:
    """Information (impacts, sensors, u, u) of a line each, and levels (impacts, sensors)."""
    lines, count, hits = h.shape
    unknowns = g.shape[-1]
    g = g.reshape(lines, count // 3, 3, hits, unknowns).transpose(3, 1, 0, 2, 4)
    g = g.reshape(hits, count // 3, 3 * lines, unknowns)
    real = np.concatenate([g.real, g.imag], axis=2)
    level = np.sqrt(np.mean(np.abs(h.reshape(lines, count // 3, 3, hits)) ** 2, axis=(0, 2))).T
    return np.swapaxes(real, -1, -2) @ real, level

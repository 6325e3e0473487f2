"""What each FRF of a test would say of the parameters, from exact sensitivities and a model of the noise.

The Fisher information of independent FRFs adds up: over postures q, impacts i and triaxial sensors s,

    F = sum_q sum_i sum_s F_qis,   F_qis = sum_lines sum_axes (Re g Re g' + Im g Im g') / sigma^2,

g the derivatives of a FRF by the parameters on their search scale, and sigma^2 = floor^2 + (relative |H|)^2
the variance of its real and of its imaginary part.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identify.core.arrays import Array, Index
from identify.core.interruption import check
from identify.model.frf import frf_and_gradient
from identify.model.system import System
from identify.planning.candidates import Candidates
from identify.vibration.fitted_model import FittedModel

_LINES = 60


@dataclass(frozen=True)
class TestNoise:
    """Standard deviation of the real and of the imaginary part of an accelerance: floor, m/s^2/N, and the
    part relative to its size.
    """

    __test__ = False
    floor: float
    relative: float = 0.0


@dataclass(frozen=True)
class Measurable:
    """Information F (postures, impacts, sensors, p, p) about the free parameters on their search scale, and
    the RMS level of each FRF over the band (postures, impacts, sensors), m/s^2/N.
    """

    information: Array
    level: Array


def measurable(
    model: FittedModel, among: Candidates, free: Index, step: Array, noise: TestNoise, band: Array
) -> Measurable:
    """What the candidates would say; free (p,): numbers of the parameters, step (p,): derivative of their
    values by the search scale; band (3,): lowest, highest frequency and resolution, Hz.
    """
    low, high, resolution = band
    line_hz = np.linspace(low, high, _LINES)
    weight = max((high - low) / resolution + 1, 1.0) / _LINES
    parts = []
    for posture in among.postures:
        check()
        parts.append(_at(model, model.system(posture), among, free, step, noise, line_hz))
    information = weight * np.array([part[0] for part in parts])
    return Measurable(information, np.array([part[1] for part in parts]))


def _at(
    model: FittedModel,
    system: System,
    among: Candidates,
    free: Index,
    step: Array,
    noise: TestNoise,
    line_hz: Array,
) -> tuple[Array, Array]:
    rows = {
        node: model.points[node].axes
        @ system.jacobian(model.points[node].link, model.points[node].position)[:3]
        for node in among.sensors
    }
    out = np.concatenate(list(rows.values()))
    force = np.stack([rows[node][axis] for node, axis in among.impacts], axis=1)
    s = np.asarray(2j * np.pi * line_hz, dtype=complex)
    matrices = system.matrices(model.values)
    h, gradient = frf_and_gradient(matrices, system.factors, s, out, force, 2, free)
    g = gradient * step / np.sqrt(noise.floor**2 + (noise.relative * np.abs(h)) ** 2)[..., None]
    lines, count, hits = h.shape
    g = g.reshape(lines, count // 3, 3, hits, len(free)).transpose(3, 1, 0, 2, 4)
    g = g.reshape(hits, count // 3, 3 * lines, len(free))
    real = np.concatenate([g.real, g.imag], axis=2)
    level = np.sqrt(np.mean(np.abs(h.reshape(lines, count // 3, 3, hits)) ** 2, axis=(0, 2))).T
    return np.swapaxes(real, -1, -2) @ real, level

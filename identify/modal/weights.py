"""What is left of the FRFs beside a modal model: its size line by line, and its correlation over lines.

Both rule what a mode must explain to be one (`required`), the weights of the refinement and the intervals.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy

from identify.core.arrays import Array, Complex
from identify.modal.refine import Equations, Fit

CHANCE = 1e-8
"""Chance that noise alone explains as much as a mode must: poles are sought at thousands of places."""
_LEAST_LINES = 64
_MODEL_ERROR = 4.0
"""How much more than errors that are correlated give on average a mode must explain."""


def reweighted(found: Fit) -> Equations:
    """The same equations weighted by the noise that the fit leaves.

    The variance of an FRF at a line is a product of a response's, a reference's and a line's; the line's is a
    sum of a constant, a part that grows with the magnitude and one with its square (of the model, pooled),
    corrected by what is left around each line (a tenth of the band).
    """
    equations = found.equations
    model = found.model()
    scale = equations.line[:, None, None] * equations.reference[:, None] * equations.response
    model, error = np.abs(model / scale), np.abs((equations.weighted - model) / scale) ** 2
    line, tiny = np.ones(len(error)), np.finfo(float).tiny
    response, reference = equations.response, equations.reference
    for _ in range(2):
        share = error / line[:, None, None] + tiny
        reference = 1 / np.sqrt(np.mean(share * response**2, axis=(0, 2)))
        response = 1 / np.sqrt(np.mean(share * reference[:, None] ** 2, axis=(0, 1)))
        both = reference[:, None] * response
        line = _line_variance(
            np.mean(error * both**2, axis=(1, 2)),
            np.mean(model * both, axis=(1, 2)),
            np.mean((model * both) ** 2, axis=(1, 2)),
        )
    return replace(equations, line=1 / np.sqrt(line), reference=reference, response=response)


def _line_variance(error: Array, first: Array, second: Array) -> Array:
    """Variance at every line (L,) from squared errors (L,) beside magnitudes and their squares (L,)."""
    parts = np.stack([np.ones(len(error)), first, second], axis=1)
    size = np.maximum(parts.max(axis=0), np.finfo(float).tiny)
    reach = max(9, len(error) // 10)
    variance = scipy.ndimage.uniform_filter1d(error, reach, mode="nearest")
    floor = 1e-20 * np.max(second) + 1e-6 * np.max(variance) + np.finfo(float).tiny
    for _ in range(3):
        row = 1 / (variance + floor)
        factor, _ = scipy.optimize.nnls(parts / size * row[:, None], error * row)
        variance = parts / size @ factor
    variance = variance + floor
    return np.asarray(
        variance * scipy.ndimage.uniform_filter1d(error / variance, reach, mode="nearest") + floor
    )


def residual(found: Fit) -> Complex:
    """Weighted FRFs minus the model's, (L, references, responses)."""
    return np.asarray(found.equations.weighted - found.model())


def local_variance(found: Fit) -> tuple[Array, Array]:
    """Variance of a real weighted equation around every mode, and the factor by which a mode's unknowns are
    less sure because errors are correlated over lines, both (m,).

    Around: within five half-power bandwidths, at least 64 lines.  The factor is the variance of sums over a
    half-power bandwidth, over that of as many independent lines; what chance may give counts as 1.
    """
    error = residual(found).reshape(len(found.equations.s), -1)
    sums = np.cumsum(np.concatenate([np.zeros((1, error.shape[1])), error]), axis=0)
    power = np.append(0.0, np.cumsum(np.mean(np.abs(error) ** 2, axis=1)))
    lines, spacing = len(error), (found.equations.s[-1].imag - found.equations.s[0].imag) / (len(error) - 1)
    lost = 2 * error.size / max(2 * error.size - found.unknowns, 1)
    variance, factor = np.ones(len(found.poles)), np.ones(len(found.poles))
    for r, pole in enumerate(found.poles):
        width = 2 * (found.equations.s[0].real - pole.real) / spacing
        count = int(np.clip(5 * width, min(_LEAST_LINES, lines), lines))
        centre = int(np.clip(round((abs(pole) - found.equations.s[0].imag) / spacing), 0, lines))
        first = int(np.clip(centre - count // 2, 0, lines - count))
        level = (power[first + count] - power[first]) / count
        variance[r] = lost * level / 2
        block = int(np.clip(round(width), 1, count // 8))
        steps = (
            sums[first + block : first + count + 1 : block] - sums[first : first + count + 1 - block : block]
        )
        grown = float(np.mean(np.abs(steps) ** 2)) / max(block * level, np.finfo(float).tiny)
        factor[r] = grown if grown > 1 + 3 / np.sqrt(steps.size) else 1.0
    return variance, factor


def independent(error: Complex) -> Array:
    """Variance of noise that is independent from line to line, (L,), of errors (L, FRFs): from second
    differences, so that slow errors do not count.
    """
    bend = np.mean(np.abs(error[2:] - 2 * error[1:-1] + error[:-2]) ** 2, axis=1) / 6
    reach = min(max(31, len(error) // 10), len(error))
    smooth = scipy.ndimage.median_filter(np.pad(bend, 1, mode="edge"), reach, mode="nearest")
    return np.asarray(smooth + np.finfo(float).tiny)


def leftover(found: Fit) -> tuple[Array, Array]:
    """How well the FRFs within a half-power bandwidth of each mode are explained, (m,) each: what is left
    over independent noise (1: noise alone); what only the mode explains over all that was measured there.
    """
    weighted = found.equations.weighted
    error = (weighted - found.model()).reshape(len(weighted), -1)
    floor = 1e-20 * np.mean(np.abs(weighted) ** 2)
    noise = np.append(0.0, np.cumsum((independent(error) + floor) * error.shape[1]))
    left, energy = (
        np.append(0.0, np.cumsum(np.sum(np.abs(v.reshape(len(v), -1)) ** 2, axis=1)))
        for v in (error, weighted)
    )
    s = found.equations.s
    spacing = (s[-1].imag - s[0].imag) / (len(s) - 1)
    half = np.maximum(s[0].real - found.poles.real, 2 * spacing)
    first = np.clip(np.round((found.poles.imag - 2 * half - s[0].imag) / spacing).astype(int), 0, len(s) - 4)
    last = np.clip(
        np.round((found.poles.imag + 2 * half - s[0].imag) / spacing).astype(int), first + 4, len(s)
    )
    left, energy, noise = (v[last] - v[first] for v in (left, energy, noise))
    rises = found.rises()
    return left / noise, rises / np.maximum(energy, np.finfo(float).tiny)


def over_noise(found: Fit) -> float:
    """Power of what is left over that of independent noise in it, over all lines or around the middle one of
    the modes, whichever is more; 1 where nothing else is left.
    """
    error = residual(found).reshape(len(found.equations.s), -1)
    floor = 1e-20 * found.moments.energy / error.size
    everywhere = float(np.mean(np.abs(error) ** 2) / (np.mean(independent(error)) + floor))
    if not len(found.poles):
        return everywhere
    return max(everywhere, float(np.median(leftover(found)[0])))


def required(found: Fit) -> Array:
    """The rise of the cost that a mode must cause when it is left out, (m,): less could be chance."""
    variance, factor = local_variance(found)
    freedom = 2 * found.solution.shape[1] + 2 * found.participation.shape[1]
    floor = 1e-24 * found.moments.energy + np.finfo(float).tiny
    # Correlated errors are errors of the model, and poles are drawn to the largest of them.
    margin = 1 + _MODEL_ERROR * (1 - 1 / factor)
    return np.asarray(variance * factor * margin * scipy.special.chdtri(freedom, CHANCE) + floor)

"""What is left of the FRFs beside a modal model: its size line by line, and its correlation over lines.

Both rule what a mode must explain to be one (`required`), the weights of the refinement and the intervals.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy

from identify.core.arrays import Array
from identify.modal.lines import place, spacing
from identify.modal.refine import Equations, Fit, squared

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
    old = found.equations
    lines, refs, responses = len(old.s), len(old.reference), len(old.response)
    second, error = (squared(v).reshape(lines, refs, responses) for v in (found.model, found.residual))
    first, tiny = np.sqrt(second), np.finfo(float).tiny
    # They bear the old weights; `undo` takes that of the line away, the ratios those of the others.
    undo, line = 1 / old.line, np.ones(lines)
    reference, response = old.reference, old.response
    for _ in range(2):
        share = (undo**2 / line) @ (error @ (response / old.response) ** 2) / old.reference**2
        reference = 1 / np.sqrt(share / (lines * responses) + tiny * np.mean(response**2))
        row = np.outer(undo**2 / line, (reference / old.reference) ** 2).ravel()
        share = row @ error.reshape(-1, responses) / old.response**2
        response = 1 / np.sqrt(share / (lines * refs) + tiny * np.mean(reference**2))
        a, b = reference / old.reference, response / old.response
        line = _line_variance(
            *(
                undo**power * (values @ b**power @ a**power) / (refs * responses)
                for values, power in ((error, 2), (first, 1), (second, 2))
            )
        )
    return replace(old, line=1 / np.sqrt(line), reference=reference, response=response)


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


def local_variance(found: Fit) -> tuple[Array, Array]:
    """Variance of a real weighted equation around every mode, and the factor by which a mode's unknowns are
    less sure because errors are correlated over lines, both (m,).

    Around: within five half-power bandwidths, at least 64 lines.  The factor is the variance of sums over a
    half-power bandwidth, over that of as many independent lines; what chance may give counts as 1.
    """
    lines, frfs = len(found.equations.s), found.residual.shape[1]
    error = found.residual.reshape(2, lines, frfs)
    power = np.append(0.0, np.cumsum(found.left / frfs))
    at = found.equations.s.imag
    lost = 2 * lines * frfs / max(2 * lines * frfs - found.unknowns, 1)
    variance, factor = np.ones(len(found.poles)), np.ones(len(found.poles))
    for r, pole in enumerate(found.poles):
        width = 2 * (found.equations.s[0].real - pole.real) / float(spacing(at, abs(pole)))
        count = int(np.clip(5 * width, min(_LEAST_LINES, lines), lines))
        centre = int(np.clip(np.round(place(at, abs(pole))), 0, lines))
        first = int(np.clip(centre - count // 2, 0, lines - count))
        level = (power[first + count] - power[first]) / count
        variance[r] = lost * level / 2
        block = int(np.clip(round(width), 1, count // 8))
        blocks = error[:, first : first + count // block * block].reshape(2, -1, block, frfs)
        sums = np.einsum("pnbk->pnk", blocks).ravel()
        grown = 2 * float(sums @ sums) / sums.size / max(block * level, np.finfo(float).tiny)
        factor[r] = grown if grown > 1 + 3 / np.sqrt(sums.size / 2) else 1.0
    return variance, factor


def leftover(found: Fit) -> tuple[Array, Array]:
    """How well the FRFs within a half-power bandwidth of each mode are explained, (m,) each: what is left
    over independent noise (1: noise alone); what only the mode explains over all that was measured there.
    """
    equations, s = found.equations, found.equations.s
    floor = 1e-20 * equations.energy / equations.count
    noise = np.append(0.0, np.cumsum((found.noise + floor) * found.residual.shape[1]))
    left, energy = (
        np.append(0.0, np.cumsum(v)) for v in (found.left, equations.line**2 * equations.each_line)
    )
    half = np.maximum(s[0].real - found.poles.real, 2 * spacing(s.imag, found.poles.imag))
    first, last = (np.round(place(s.imag, found.poles.imag + side * half)).astype(int) for side in (-2, 2))
    first = np.clip(first, 0, len(s) - 4)
    last = np.clip(last, first + 4, len(s))
    left, energy, noise = (v[last] - v[first] for v in (left, energy, noise))
    rises = found.rises()
    return left / noise, rises / np.maximum(energy, np.finfo(float).tiny)


def over_noise(found: Fit) -> float:
    """Power of what is left over that of independent noise in it, over all lines or around the middle one of
    the modes, whichever is more; 1 where nothing else is left.
    """
    everywhere = 1 + excess(found)
    if not len(found.poles):
        return everywhere
    return max(everywhere, float(np.median(leftover(found)[0])))


def excess(found: Fit) -> float:
    """Power of what is left beyond independent noise, over that of the noise, over all lines; about 0 where
    nothing else is left.
    """
    count = found.equations.count
    floor = 1e-20 * found.moments.energy / count
    return float(np.sum(found.left) / count / (np.mean(found.noise) + floor)) - 1


def required(found: Fit) -> Array:
    """The rise of the cost that a mode must cause when it is left out, (m,): less could be chance."""
    variance, factor = local_variance(found)
    freedom = 2 * found.solution.shape[1] + 2 * found.participation.shape[1]
    floor = 1e-24 * found.moments.energy + np.finfo(float).tiny
    # Correlated errors are errors of the model, and poles are drawn to the largest of them.
    margin = 1 + _MODEL_ERROR * (1 - 1 / factor)
    return np.asarray(variance * factor * margin * scipy.special.chdtri(freedom, CHANCE) + floor)

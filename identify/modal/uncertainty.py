"""How sure refined poles are, from the noise that the fit leaves in the FRFs.

At the maximum-likelihood optimum the covariance is the inverse of the Gauss-Newton matrix times the noise's
variance (Pintelon, Guillaume and Schoukens, MSSP 21 (2007) 2359-2373).  The noise is that of the FRFs and
lines that tell a mode, and of what is left there the unknowns took a part (leverages; Hoaglin and Welsch, The
American Statistician 32 (1978) 17-22).
"""

from __future__ import annotations

import numpy as np

from identify.core.arrays import Array
from identify.modal.gram import written_out
from identify.modal.refine import Fit, over_responses, slope, squared, weighted_shapes
from identify.modal.weights import local_variance

_COLLINEAR = 1e6
"""How much more than alone a linear unknown may scatter beside the others for products of columns to do."""
_MOST = 0.95
"""Part of a value that the unknowns may take at most."""


def covariance(found: Fit) -> Array:
    """Covariance (m, 2, 2) of the real and the imaginary part of each pole, (rad/s)^2; zero for a pole that
    is held.
    """
    result = np.zeros((len(found.poles), 2, 2))
    if not found.free.any():
        return result
    normal = information(found)
    diagonal = np.diag(normal)
    scale = np.sqrt(np.maximum(diagonal, 1e-30 * np.max(diagonal)) + np.finfo(float).tiny)
    values, vectors = np.linalg.eigh(normal / np.outer(scale, scale))
    # What rounding leaves of a direction that the data do not tell is little known, not well known.
    values = np.maximum(values, np.finfo(float).eps * len(values) * values[-1])
    inverse = (vectors / values) @ vectors.T / np.outer(scale, scale)
    factor = local_variance(found)[1]
    variance = noise_variance(found)
    q = 2 * found.participation.shape[1]
    for k, r in enumerate(np.flatnonzero(found.free)):
        block = slice(k * q, k * q + 2)
        result[r] = inverse[block, block] * variance[k] * factor[r]
    return result


def information(found: Fit) -> Array:
    """Gauss-Newton matrix over the free modes, as of `slope`, without the rounding of products of columns."""
    if np.max(np.diag(found.inverse), initial=0.0) < _COLLINEAR:
        return slope(found)[1]
    equations = found.equations
    functions = equations.functions(found.poles, found.poles[found.free])
    basis = written_out(functions, equations.basis(found.participation))
    columns = written_out(functions, equations.derivatives(found.participation, found.free))
    basis, columns = (c.reshape(-1, c.shape[2]) for c in (basis, columns))
    known = np.linalg.qr(basis / found.size)[0]
    for _ in range(2):  # twice is enough
        columns -= known @ (known.T @ columns)
    return over_responses(columns.T @ columns, weighted_shapes(found))


def noise_variance(found: Fit) -> Array:
    """Variance of a real weighted equation of the FRFs and lines where each free mode is large, (free,)."""
    equations, free = found.equations, found.free
    lines, refs = len(equations.s), len(equations.reference)
    near = (equations.line * np.abs(equations.s) ** equations.power)[:, None]
    line = (near / np.abs(equations.s[:, None] - found.poles[free])) ** 2
    reference = np.abs(found.participation[free] * equations.reference).T ** 2
    response = np.sum(weighted_shapes(found) ** 2, axis=1).T
    left = squared(found.residual).reshape(lines * refs, -1) @ response
    known = 2 - np.minimum(leverage(found), 2 * _MOST)
    energy = np.einsum("ljm,lm,jm->m", left.reshape(lines, refs, -1), line, reference)
    count = np.einsum("lj,lm,jm->m", known, line, reference) * response.sum(axis=0)
    return np.asarray(energy / np.maximum(count, np.finfo(float).tiny))


def leverage(found: Fit) -> Array:
    """What the unknowns take of the two real equations of an FRF at a line, (L, references): 0 to 2, the
    same for every response.
    """
    equations = found.equations
    functions = equations.functions(found.poles, found.poles[:0])
    columns = written_out(functions, equations.basis(found.participation)) / found.size
    taken = np.sum((columns @ found.inverse) * columns, axis=2)
    taken = taken.reshape(2, len(equations.s), -1).sum(axis=0)
    # Poles and participation stand at the same lines as the shapes.
    return np.asarray(taken * found.unknowns / found.solution.size)

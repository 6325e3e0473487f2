"""How sure refined poles are, from the noise that the fit leaves in the FRFs.

At the maximum-likelihood optimum the covariance is that of the Gauss-Newton matrix N: N^-1 M N^-1, where M is
the scatter of the gradient under the noise there is (sandwich; Pintelon, Guillaume and Schoukens, MSSP 21
(2007) 2359-2373, Doehler and Mevel, MSSP 38 (2013) 346-366).
"""

from __future__ import annotations

import numpy as np

from identify.core.arrays import Array
from identify.modal.refine import Fit, slope
from identify.modal.weights import local_variance


def covariance(found: Fit) -> Array:
    """Covariance (m, 2, 2) of the real and the imaginary part of each pole, (rad/s)^2; zero for a pole that
    is held.
    """
    result = np.zeros((len(found.poles), 2, 2))
    if not found.free.any():
        return result
    _, normal = slope(found)
    diagonal = np.diag(normal)
    scale = np.sqrt(np.maximum(diagonal, 1e-30 * np.max(diagonal)) + np.finfo(float).tiny)
    values, vectors = np.linalg.eigh(normal / np.outer(scale, scale))
    # What rounding leaves of a direction that the data do not tell is little known, not well known.
    values = np.maximum(values, np.finfo(float).eps * len(values) * values[-1])
    inverse = (vectors / values) @ vectors.T / np.outer(scale, scale)
    variance, factor = local_variance(found)
    q = 2 * found.participation.shape[1]
    for k, r in enumerate(np.flatnonzero(found.free)):
        block = slice(k * q, k * q + 2)
        result[r] = inverse[block, block] * variance[r] * factor[r]
    return result

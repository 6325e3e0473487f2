"""Poly-reference least-squares complex frequency estimator (pLSCF, known as PolyMAX).

Source: Peeters, Van der Auweraer, Guillaume and Leuridan, Shock and Vibration 11 (2004) 395-409; fast normal
equations after Guillaume, Verboven, Vanlanduit, Van der Auweraer and Peeters, IMAC 21 (2003).
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import scipy

from identify.core.arrays import Complex
from identify.modal.poles import moments

_RIDGE = 1e-12
"""Relative to the mean diagonal: without noise the normal equations of a high order are singular."""


def denominators(frf: Complex, orders: range) -> Iterator[Complex]:
    """Denominator coefficients beta (p + 1, references, references), beta_0 = 1, of every order p, from frf
    (L, responses, references).

    On the unit circle the numerators are eliminated exactly: the reduced normal matrix is block Toeplitz (H^H
    H) minus a sum of outer products of Fourier coefficients, which grows with the order; one pass serves all
    orders.
    """
    refs, top = frf.shape[2], orders[-1]
    h = moments(frf, top)
    power = moments(np.matmul(frf.conj().transpose(0, 2, 1), frf), top)
    lag = np.arange(top + 1)[:, None] - np.arange(top + 1)[None, :] + top
    full = power[lag].transpose(0, 2, 1, 3).reshape((top + 1) * refs, (top + 1) * refs)
    taken = np.zeros_like(full)
    row = 0
    for order in orders:
        while row <= order:
            block = h[row : row + top + 1][::-1].transpose(1, 0, 2).reshape(frf.shape[1], -1)
            taken += block.conj().T @ block
            row += 1
        size = (order + 1) * refs
        yield solve_denominator(full[:size, :size] - taken[:size, :size], refs)


def solve_denominator(normal: Complex, refs: int) -> Complex:
    """The beta, with beta_0 = 1, that minimise beta^H normal beta; normal ((p + 1) refs, (p + 1) refs) -> (p
    + 1, refs, refs).

    Fixing the lowest coefficient gives the least biased poles; the stable computational poles it leaves
    scatter over orders and have complex shapes, so the selection sees them (Cauberghe, Guillaume, Verboven,
    Vanlanduit and Parloo, MSSP 19 (2005)).
    """
    inner = normal[refs:, refs:]
    ridge = _RIDGE * np.trace(normal).real / len(normal)
    factor = scipy.linalg.cho_factor(inner + ridge * np.eye(len(inner)), lower=True)
    rest = scipy.linalg.cho_solve(factor, -normal[refs:, :refs])
    return np.concatenate([np.eye(refs, dtype=complex), rest]).reshape(-1, refs, refs)

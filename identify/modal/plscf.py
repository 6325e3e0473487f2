"""Poly-reference least-squares complex frequency estimator (pLSCF, known as PolyMAX).

Source: Peeters, Van der Auweraer, Guillaume and Leuridan, Shock and Vibration 11 (2004) 395-409; fast normal
equations after Guillaume, Verboven, Vanlanduit, Van der Auweraer and Peeters, IMAC 21 (2003).

Least-squares complex exponential estimator on impulse responses, poly-reference (LSCE, PRCE), as UMONS
used.

Source: Brown, Allemang, Zimmerman and Mergeay, SAE 790221 (1979); Vold, Kundrat, Rocklin and Russell, SAE
820194 (1982). The impulse responses are the inverse Fourier transform of the band, so they are complex and
sampled at its width.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import scipy

from identify.core.arrays import Complex
from identify.modal.poles import Places, moments

_RIDGE = 1e-12
"""Relative to the mean diagonal: without noise the normal equations of a high order are singular."""


def denominators(frf: Complex, orders: range, places: Places | None = None) -> Iterator[Complex]:
    """Denominator coefficients beta (p + 1, references, references), beta_0 = 1, of every order p, from frf
    (L, responses, references).

    On the unit circle the numerators are eliminated exactly: the reduced normal matrix is block Toeplitz (H^H
    H) minus a sum of outer products of Fourier coefficients, which grows with the order; one pass serves all
    orders.  On lines that are not evenly spaced (places) the basis is made orthogonal first, from low degrees
    up, which keeps that.
    """
    refs, top = frf.shape[2], orders[-1]
    h = moments(frf, top, places)
    power = moments(np.matmul(frf.conj().transpose(0, 2, 1), frf), top, places)
    lag = np.arange(top + 1)[:, None] - np.arange(top + 1)[None, :] + top
    full = power[lag].transpose(0, 2, 1, 3).reshape((top + 1) * refs, (top + 1) * refs)
    taken = np.zeros_like(full)
    rows = _numerators(h, top, places)
    row = 0
    for order in orders:
        while row <= order:
            block = next(rows)
            taken += block.conj().T @ block
            row += 1
        size = (order + 1) * refs
        yield solve_denominator(full[:size, :size] - taken[:size, :size], refs)


def _numerators(h: Complex, top: int, places: Places | None) -> Iterator[Complex]:
    """Inner products of the FRFs times every power with the numerators' basis, degree by degree: (responses,
    (top + 1) x references).
    """
    blocks = (h[row : row + top + 1][::-1].transpose(1, 0, 2) for row in range(top + 1))
    flat = (block.reshape(block.shape[0], -1) for block in blocks)
    if places is None:
        yield from flat
        return
    stacked = np.array(list(flat))
    ones = moments(np.ones(len(places.turn), dtype=complex), top, places)
    lag = np.arange(top + 1)[None, :] - np.arange(top + 1)[:, None] + top
    basis = ones[lag] + _RIDGE * np.eye(top + 1)
    factor = np.linalg.cholesky(basis.conj())
    yield from scipy.linalg.solve_triangular(factor, stacked.reshape(top + 1, -1), lower=True).reshape(
        stacked.shape
    )


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


def lsce_denominators(frf: Complex, orders: range) -> Iterator[Complex]:
    """Denominator coefficients beta (p + 1, references, references), beta_0 = 1, of every order p, from frf
    (L, responses, references).

    The impulse response h obeys sum_b h[n - b] beta_b = 0 for n > p.  Half of the record is used: its end
    holds the wrap-around of band edges and residuals; every order starts as early as it can, where the signal
    is.
    """
    lines, responses, refs = frf.shape
    top = orders[-1]
    impulse = np.fft.ifft(frf, axis=0)
    padded = np.concatenate([np.zeros((top, responses, refs), dtype=complex), impulse])
    last = min(max(lines // 2, 2 * top + 2), lines)
    normal = np.zeros(((top + 1) * refs,) * 2, dtype=complex)
    grown: dict[int, Complex] = {}
    for n in range(last - 1, orders[0], -1):
        row = padded[n : n + top + 1][::-1].transpose(1, 0, 2).reshape(responses, -1)
        normal += row.conj().T @ row
        if n - 1 in orders:
            size = n * refs
            grown[n - 1] = normal[:size, :size].copy()
    for order in orders:
        yield solve_denominator(grown[order], refs)

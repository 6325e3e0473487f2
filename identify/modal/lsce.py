"""Least-squares complex exponential estimator on impulse responses, poly-reference (LSCE, PRCE), as UMONS
used.

Source: Brown, Allemang, Zimmerman and Mergeay, SAE 790221 (1979); Vold, Kundrat, Rocklin and Russell, SAE
820194 (1982). The impulse responses are the inverse Fourier transform of the band, so they are complex and
sampled at its width.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from identify.core.arrays import Complex
from identify.modal.plscf import solve_denominator


def denominators(frf: Complex, orders: range) -> Iterator[Complex]:
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

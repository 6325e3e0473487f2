"""Least-squares complex exponential estimator on impulse responses, poly-reference (LSCE, PRCE), as UMONS used.

Source: Brown, Allemang, Zimmerman and Mergeay, SAE 790221 (1979); Vold, Kundrat, Rocklin and Russell, SAE 820194 (1982).
The impulse responses are the inverse Fourier transform of the band, so they are complex and sampled at its width.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from identify.modal.plscf import solve_denominator

Complex = NDArray[np.complex128]


def denominators(frf: Complex, orders: range) -> Iterator[Complex]:
    """Denominator coefficients beta (p + 1, references, references), beta_0 = 1, of every order p, from frf (L, responses, references).

    The impulse response h obeys sum_b h[n - b] beta_b = 0 for n > p.  Half of the record is used: its end holds the
    band edges' and the residuals' wrap-around; so are the first samples left out.
    """
    lines, responses, refs = frf.shape
    top = orders[-1]
    impulse = np.fft.ifft(frf, axis=0)
    last = max(lines // 2, 2 * top + 2)
    rows = np.arange(top + 1, min(last, lines))
    normal = np.zeros(((top + 1) * refs,) * 2, dtype=complex)
    for response in range(responses):
        block = impulse[rows[:, None] - np.arange(top + 1)[None, :], response].reshape(len(rows), -1)
        normal += block.conj().T @ block
    for order in orders:
        size = (order + 1) * refs
        yield solve_denominator(normal[:size, :size], refs)

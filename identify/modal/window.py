"""Exponential windows: what they do to poles.

A window e^{-sigma t} on force and response measures H(sigma + j omega), so every pole appears shifted by
-sigma: lambda_seen = lambda - sigma.  Both the damping and, slightly, the frequency |lambda| / 2 pi are
corrected.
"""

from __future__ import annotations

import numpy as np

from identify.core.arrays import Array, Complex


def seen_through(poles: Complex, decay: float) -> Complex:
    """Poles (m,) as they appear in FRFs measured with the window; add the decay to correct."""
    return poles - decay


def frequency_and_damping(poles: Complex) -> tuple[Array, Array]:
    """|lambda| / 2 pi (Hz) and -Re lambda / |lambda| of poles (m,), rad/s."""
    size = np.abs(poles)
    return size / (2 * np.pi), np.asarray(-poles.real / size)

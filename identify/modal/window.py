"""Exponential windows: what they do to poles, and their decay from the way instruments state it.

A window e^{-sigma t} on force and response measures H(sigma + j omega), so every pole appears shifted by
-sigma: lambda_seen = lambda - sigma.  Both the damping and, slightly, the frequency |lambda| / 2 pi are
corrected.
"""

from __future__ import annotations

import numpy as np

from identify.core.arrays import Array, Complex


def decay_per_s(final: float, duration_s: float) -> float:
    """Decay sigma of a window that has fallen to `final` (0.329 for the 32.9 % of UMONS) at the end of the
    record.
    """
    if not 0 < final <= 1:
        raise ValueError(f"an exponential window ends between 0 and 1, not at {final:g}")
    if duration_s <= 0:
        raise ValueError(f"the record lasts {duration_s:g} s")
    return -float(np.log(final)) / duration_s


def seen_through(poles: Complex, decay: float) -> Complex:
    """Poles (m,) as they appear in FRFs measured with the window; add the decay to correct."""
    return poles - decay


def frequency_and_damping(poles: Complex) -> tuple[Array, Array]:
    """|lambda| / 2 pi (Hz) and -Re lambda / |lambda| of poles (m,), rad/s."""
    size = np.abs(poles)
    return size / (2 * np.pi), np.asarray(-poles.real / size)

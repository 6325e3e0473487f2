"""A coherence that was rounded, or set to one: what of it is still sure."""

from __future__ import annotations

import numpy as np

from identify.core.arrays import Array

_SINGLE = 2e-7
"""What single precision makes of a number up to one."""
_COARSE = 5
"""Decimals of a coherence from which more say nothing more of the noise."""
_STEPS = 10
"""Steps that most of a rounded coherence lacks of one, up to which it does not tell the noise alone."""


def rounding(coherence: Array) -> float:
    """The step of which every coherence is a multiple: 1 where all are 0 or 1, 0.001 of three decimals; 0
    where there are more than five.
    """
    known = coherence[~np.isnan(coherence)]
    for decimals in range(_COARSE + 1):
        if np.all(np.abs(known - np.round(known, decimals)) <= _SINGLE):
            return float(10.0**-decimals)
    return 0.0


def in_words(step: float) -> str:
    """What is the matter with a coherence of such a step."""
    return (
        "is 1 at every line, which no measured one is"
        if step == 1
        else f"is rounded to {step:.5f}".rstrip("0")
    )


def remark(coherence: Array) -> str:
    """A sentence without its stop where most of a coherence is rounded to what does not tell the noise;
    empty elsewhere.
    """
    step = rounding(coherence)
    if not step or np.nanmedian(1 - coherence) >= _STEPS * step:
        return ""
    return (
        f"the coherence {in_words(step)}: the noise is taken from the scatter between neighbouring lines, as"
        " far as the coherence allows"
    )

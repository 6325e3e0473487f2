"""Where frequencies stand among lines that may be evenly spaced on a linear or on a logarithmic axis."""

from __future__ import annotations

import numpy as np

from identify.core.arrays import Array


def place(lines: Array, at: Array) -> Array:
    """Numbers of lines (L,), rising, at which values stand, with their fractions; beyond the ends the last
    spacing goes on.
    """
    number = np.interp(at, lines, np.arange(len(lines)))
    below = np.minimum(at - lines[0], 0) / (lines[1] - lines[0])
    above = np.maximum(at - lines[-1], 0) / (lines[-1] - lines[-2])
    return np.asarray(number + below + above)


def spacing(lines: Array, at: Array) -> Array:
    """Distance of the lines around values; of the nearest ones beyond the ends."""
    return np.asarray(np.interp(at, (lines[1:] + lines[:-1]) / 2, np.diff(lines)))


def is_even(lines: Array, part: float) -> bool:
    """Whether no step differs by more than this part from their mean."""
    steps = np.diff(lines)
    return bool(np.max(np.abs(steps / np.mean(steps) - 1)) <= part)

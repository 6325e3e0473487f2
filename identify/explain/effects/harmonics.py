"""Waves over an angle: the columns, and which order a residual shows."""

from __future__ import annotations

import numpy as np
from numpy.polynomial.legendre import legfit, legval

from identify.core.arrays import Array
from identify.explain.effects.base import NonlinearParameter
from identify.explain.recorded_motion import RecordedMotion
from identify.model.laws.gear import harmonic

_ORDERS = 2
_SLOW = 12
"""Degree of the polynomial that takes out what is slow, before waves are looked for."""
_LAG = 0.01
LAG = NonlinearParameter("lag", "s", -_LAG, _LAG)
"""How much later the harmonic was read than the angle."""


def lags(count: int) -> list[float]:
    """Lags (s) to search from."""
    return [float(lag) for lag in np.linspace(-0.8 * _LAG, 0.8 * _LAG, count)]


def late(scene: RecordedMotion, joint: int, lag: float) -> Array:
    """Angle (samples,) of a joint (from 0) a lag (s) before each sample."""
    return np.asarray(scene.position[:, joint] - lag * scene.velocity[:, joint])


def cosine_and_sine(angle: Array, order: float) -> tuple[Array, Array]:
    """Cosine and sine of that order of an angle (samples,)."""
    return harmonic(angle, order)


def strongest_orders(angle: Array, residual: Array, lower: float, upper: float) -> list[float]:
    """The orders (waves per turn) whose waves explain most of a residual (samples,), strongest first; none
    for a joint that stood.

    What is slow is taken out first.
    The grid is fine against the resolution 2 pi / travel, so that a search from there stays on the same peak.
    """
    travel = float(np.ptp(angle))
    if travel == 0 or not upper > lower:
        return []
    orders = np.arange(lower, upper, 1.0 / travel)
    time = np.linspace(-1.0, 1.0, len(residual))
    centred = residual - legval(time, legfit(time, residual, _SLOW))
    # Waves of all orders are those of every so many, times those of the few between.
    between = int(np.sqrt(len(orders))) + 1
    fine = np.exp(1j * np.outer(angle, (orders - lower)[:between]))
    coarse = np.exp(1j * np.outer(orders[::between], angle)) * centred
    power = np.abs(coarse @ fine).ravel()[: len(orders)]
    found: list[float] = []
    while len(found) < _ORDERS and power.max() > 0:
        peak = int(np.argmax(power))
        found.append(float(orders[peak]))
        power[np.abs(orders - orders[peak]) < 4 * np.pi / travel] = 0.0
    return found

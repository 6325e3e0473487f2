"""Start values for what an effect adds: a coarse grid over each quantity, because least squares is local."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np

from identify.core.arrays import Array, Mask
from identify.core.parameters import Parameter

Quantity = Literal["stiffness", "damping", "mass"]
"""What a parameter scales; one that scales none of them, or is zero to begin with, has no quantity."""
_STIFFER = np.geomspace(0.01, 1e3, 11)
_HEAVIER = np.array([-10.0, 0.1, 0.3, 1.0, 3.0, 10.0])
_SHARES, _FREQUENCIES = (0.1, 1.0, 5.0), 9
_ACROSS = np.linspace(0.05, 0.95, 10)


def start_grid(
    parameters: Sequence[Parameter], quantities: Sequence[Quantity | None], band_hz: tuple[float, float]
) -> Array:
    """(m, parameters): the given start first, then the grid; a body on a spring of its own is tuned over the
    band.
    """
    initial = np.array([p.initial for p in parameters])
    stiffness, damping, mass = (
        np.array([one == quantity for one in quantities], dtype=bool)
        for quantity in ("stiffness", "damping", "mass")
    )
    if stiffness.any() and mass.any():
        rows = _tuned(initial, stiffness, damping, mass, band_hz)
    elif stiffness.any():
        rows = [
            np.where(stiffness, initial * f, np.where(damping, initial * np.sqrt(f), initial))
            for f in _STIFFER
        ]
    elif mass.any():
        rows = [np.where(mass, initial * f, initial) for f in _HEAVIER]
    else:
        rows = _across(parameters, initial)
    lower, upper = np.array([p.lower for p in parameters]), np.array([p.upper for p in parameters])
    return np.asarray(np.clip(np.array([initial, *rows]), lower, upper))


def _tuned(
    initial: Array, stiffness: Mask, damping: Mask, mass: Mask, band: tuple[float, float]
) -> list[Array]:
    """Masses of several sizes, each tuned to frequencies over the band with the damping ratio of the given
    start.
    """
    rows = []
    ratio = initial[damping].sum() / np.sqrt(initial[stiffness][0] * initial[mass][0])
    for share in _SHARES:
        for frequency in np.geomspace(*band, _FREQUENCIES):
            m = initial[mass][0] * share
            k = m * (2 * np.pi * frequency) ** 2
            row = initial.copy()
            row[mass], row[stiffness], row[damping] = m, k, ratio * np.sqrt(k * m)
            rows.append(row)
    return rows


def _across(parameters: Sequence[Parameter], initial: Array) -> list[Array]:
    """Each parameter alone across its bounds."""
    rows = []
    for number, p in enumerate(parameters):
        low, high = (np.log(p.lower), np.log(p.upper)) if p.log else (p.lower, p.upper)
        for part in _ACROSS:
            row = initial.copy()
            at = low + part * (high - low)
            row[number] = np.exp(at) if p.log else at
            rows.append(row)
    return rows

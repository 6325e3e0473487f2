"""FRFs from samples of a force or torque that is held from one sample to the next, as controllers command it.

Held over T, a force drives H through (1 - e^-sT) / (sT), and what it has about multiples of the sample rate
moves the structure too, where samples fold it back.  Up there a motor feels its own inertia J alone: of
1 / (J s^2), 1 / (J s) and 1 / J the samples' answer is known exactly, and so are the images in it,

    T^2 (z + 1) / (2 J (z - 1)^2),   T / (J (z - 1)),   1 / J,   z = e^sT,

less what is driven.  What is not at the motor itself moves far less at such frequencies: it has no images.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from identify.core.arrays import Array, Complex
from identify.measured.frf_set import POWER, FrfSet, Quantity

_SURE, _PART = 0.1, 10
"""Relative noise up to which a line tells the inertia; of these lines, the highest tenth does."""


def unheld(frf_set: FrfSet, rate_hz: float) -> FrfSet:
    """The set without what the hold between samples, so many a second, made of it."""
    st = frf_set.s / rate_hz
    through = (1 - np.exp(-st)) / st
    images = _of_inertia(st, frf_set.quantity) - through
    frf = frf_set.frf.copy()
    for i, output in enumerate(frf_set.outputs):
        for j, force in enumerate(frf_set.inputs):
            if output.motor is not None and output.motor == force.motor:
                sign = output.sign * force.sign
                rest = frf_set.s ** (POWER[frf_set.quantity] - 2)
                noise = None if frf_set.noise is None else frf_set.noise[:, i, j]
                inverse = _inverse_inertia(
                    sign * frf[:, i, j] / (images + through) / rest, noise, frf[:, i, j]
                )
                frf[:, i, j] -= sign * inverse * images * rest
    size = np.abs(through)[:, None, None]
    noise = None if frf_set.noise is None else frf_set.noise / size
    return replace(frf_set, frf=frf / through[:, None, None], noise=noise)


def _of_inertia(st: Complex, quantity: Quantity) -> Complex:
    """(lines,): the samples' answer of an inertia over its own."""
    z = np.exp(st)
    if quantity == "receptance":
        return np.asarray(st**2 * (z + 1) / (2 * (z - 1) ** 2))
    return np.asarray(st / (z - 1)) if quantity == "mobility" else np.ones_like(st)


def _inverse_inertia(scaled: Complex, noise: Array | None, measured: Complex) -> float:
    """1 / J by FRFs over those of a unit inertia (lines,), where they are highest and sure; 0 of none."""
    sure = np.ones(len(scaled), dtype=bool) if noise is None else noise < _SURE * np.abs(measured)
    values = scaled.real[sure]
    return max(0.0, float(np.median(values[-max(1, len(values) // _PART) :]))) if values.size else 0.0

"""Channels that tell nothing of the structure: zero or constant at every line, or nothing but noise."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

import numpy as np

from identify.core.arrays import Array, Mask
from identify.core.coded import Coded
from identify.core.errors import InputError
from identify.measured.channel import Channel
from identify.measured.finding import listing
from identify.measured.frf_set import FrfSet
from identify.measured.scatter import scatter

LEFT_OUT = "left out"
"""Code of a note on channels that are left out."""
_ROUGH = 0.1
"""Mean square of the steps from line to line, over that of the FRF, below which it is not all noise, whose is
2, or with an exponential window at least 0.4."""
_ROUNDING = 1e-12
"""Part of a set's largest value below which steps are those of double precision."""
_SIGMAS = 3.0
"""A response is distinguished from noise where its energy exceeds that of the noise by as many standard
deviations.
"""


def dead(frf_set: FrfSet) -> tuple[tuple[Channel, ...], tuple[Channel, ...]]:
    """Outputs and inputs that were measured and are zero or constant at every line, but for rounding."""
    if len(frf_set.frequency_hz) < 2:
        return (), ()
    largest = float(np.nanmax(np.abs(frf_set.frf), initial=0.0))
    return _both(frf_set, _steps(frf_set).max(axis=0) <= _ROUNDING * largest)


def noise_alone(frf_set: FrfSet) -> tuple[tuple[Channel, ...], tuple[Channel, ...]]:
    """Outputs and inputs that were measured and have no more energy than the scatter between lines makes;
    none where that is not known.
    """
    if len(frf_set.frequency_hz) < 2:
        return (), ()
    energy = np.where(frf_set.measured, np.abs(frf_set.frf) ** 2, 0.0)
    rough = np.mean(_steps(frf_set) ** 2, axis=0) >= _ROUGH * np.mean(energy, axis=0)
    if not any(_both(frf_set, rough)):
        return (), ()
    variance = scatter(frf_set)
    if variance is None:
        return (), ()
    outputs, inputs = _both(frf_set, rough)
    alone = [_quiet(energy, np.nan_to_num(variance), axis) for axis in (1, 0)]
    return (
        tuple(c for c, quiet in zip(frf_set.outputs, alone[0], strict=True) if quiet and c in outputs),
        tuple(c for c, quiet in zip(frf_set.inputs, alone[1], strict=True) if quiet and c in inputs),
    )


def without(
    frf_set: FrfSet, outputs: Collection[Channel], inputs: Collection[Channel], reason: str
) -> FrfSet:
    """The set without some channels, which its notes name with the reason; InputError where none is left."""
    if not outputs and not inputs:
        return frf_set
    kept = [n for n, c in enumerate(frf_set.outputs) if c not in outputs]
    forces = [n for n, c in enumerate(frf_set.inputs) if c not in inputs]
    several = (("output", list(outputs)), ("input", list(inputs)))
    named = " and ".join(f"{kind} {listing(some)}" for kind, some in several if some)
    if not kept or not forces:
        raise InputError(frf_set.source, f"{named}, which are all, {reason}", "channels that were connected")
    note = Coded(f"{named} {reason}, and left out", LEFT_OUT)
    return replace(frf_set.pairs(kept, forces), notes=(*frf_set.notes, note))


def connected(frf_set: FrfSet) -> FrfSet:
    """The set without dead channels, as `without` says."""
    return without(frf_set, *dead(frf_set), "is zero or constant at every line, as of an open cable")


def _steps(frf_set: FrfSet) -> Array:
    """(lines - 1, outputs, inputs): sizes of the steps from line to line; 0 of what was not measured."""
    return np.asarray(np.nan_to_num(np.abs(np.diff(frf_set.frf, axis=0))))


def _both(frf_set: FrfSet, which: Mask) -> tuple[tuple[Channel, ...], tuple[Channel, ...]]:
    """Outputs and inputs with FRFs of which all (outputs, inputs) are so."""
    measured = frf_set.measured
    found = [np.asarray((which | ~measured).all(axis) & measured.any(axis)) for axis in (1, 0)]
    return (
        tuple(c for c, so in zip(frf_set.outputs, found[0], strict=True) if so),
        tuple(c for c, so in zip(frf_set.inputs, found[1], strict=True) if so),
    )


def _quiet(energy: Array, variance: Array, axis: int) -> Array:
    """Which channels have no more energy (lines, outputs, inputs), in units of the noise of each FRF, than
    noise has.
    """
    noise = np.mean(variance, axis=0)
    units = np.divide(energy, noise, out=np.zeros_like(energy), where=noise > 0).sum(axis=(0, 1 + axis))
    numbers = len(energy) * np.count_nonzero(noise, axis=axis)
    return np.asarray(units - numbers < _SIGMAS * np.sqrt(2 * numbers))

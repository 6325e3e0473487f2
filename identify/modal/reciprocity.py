"""Reciprocity: is H_ij = H_ji where both were measured (Maxwell-Betti, UMONS Eq. 1)?  A wrong sign or swapped
channel shows here.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identify.core.arrays import Complex
from identify.measured.channel import Channel
from identify.measured.frf_set import FrfSet
from identify.modal.mac import frac


@dataclass(frozen=True)
class ReciprocityCheck:
    """Two channels measured both ways.  frac: correlation over the lines, blind to level and sign; level:
    least-squares factor H_ab / H_ba, about 1, and negative for a wrong sign; error: RMS difference over RMS
    of both.
    """

    a: Channel
    b: Channel
    frac: float
    level: float
    error: float


def reciprocity(frf_set: FrfSet) -> tuple[ReciprocityCheck, ...]:
    """Every pair of different channels that has both H_ab and H_ba, with the signs of the channels taken into
    account.
    """
    outputs = {(c.node, abs(c.direction)): i for i, c in enumerate(frf_set.outputs)}
    inputs = {(c.node, abs(c.direction)): j for j, c in enumerate(frf_set.inputs)}
    both = sorted(outputs.keys() & inputs.keys())
    found = []
    for n, first in enumerate(both):
        for second in both[n + 1 :]:
            one = _signed(frf_set, outputs[first], inputs[second])
            other = _signed(frf_set, outputs[second], inputs[first])
            lines = np.isfinite(one) & np.isfinite(other)
            if lines.any():
                found.append(_check(Channel(*first), Channel(*second), one[lines], other[lines]))
    return tuple(found)


def _signed(frf_set: FrfSet, i: int, j: int) -> Complex:
    return np.asarray(frf_set.frf[:, i, j] * frf_set.outputs[i].sign * frf_set.inputs[j].sign)


def _check(a: Channel, b: Channel, one: Complex, other: Complex) -> ReciprocityCheck:
    power = np.sum(np.abs(other) ** 2)
    both = np.sqrt((np.sum(np.abs(one) ** 2) + power) / 2)
    return ReciprocityCheck(
        a=a,
        b=b,
        frac=float(frac(one, other)),
        level=float(np.sum(other.conj() * one).real / power) if power > 0 else np.nan,
        error=float(np.linalg.norm(one - other) / both) if both > 0 else 0.0,
    )

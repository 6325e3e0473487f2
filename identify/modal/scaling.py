"""Scaling of shapes: to unit modal mass where a drive point was measured, to unit largest component where
none was.

With reciprocity the residue of a mode is psi psi^T / a, so at channels that are both response and reference
the participation is proportional to the shape; with unit modal mass a = 2j omega_d. Source: Ewins, Modal
Testing (2000), 5.2; Heylen, Lammens and Sas, Modal Analysis Theory and Testing (1997), A.1.

Reciprocity: is H_ij = H_ji where both were measured (Maxwell-Betti, UMONS Eq. 1)?  A wrong sign or swapped
channel shows here.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identify.core.arrays import Array, Complex
from identify.measured.channel import Channel
from identify.measured.frf_set import FrfSet
from identify.modal.layout import Layout
from identify.modal.lsfd import ModalModel
from identify.modal.mac import as_real, frac


def scale(model: ModalModel, layout: Layout) -> tuple[Complex, bool]:
    """Shapes (m, responses) of every mode, and whether they are of unit modal mass (kg^-1/2): else of unit
    largest component.
    """
    response, reference, sign = _drive_points(layout)
    if len(response) == 0:
        return _unit(model.shapes), False
    shape, participation = model.shapes[:, response], model.participation[:, reference] * sign
    factor = np.sum(shape.conj() * participation, axis=1) / np.sum(np.abs(shape) ** 2, axis=1)
    # The residue must be a negative imaginary number at a drive point; half its phase error turns the shape.
    return _upright(np.sqrt(factor * (2j * model.poles.imag))[:, None] * model.shapes), True


def _drive_points(layout: Layout) -> tuple[list[int], list[int], Array]:
    """Positions among responses and references of channels that are both, and the product of their signs."""
    where = {c.place: i for i, c in enumerate(layout.responses)}
    pairs = [(where[c.place], j) for j, c in enumerate(layout.references) if c.place in where]
    sign = [layout.responses[i].sign * layout.references[j].sign for i, j in pairs]
    return [i for i, _ in pairs], [j for _, j in pairs], np.array(sign, dtype=np.float64)


def _unit(shapes: Complex) -> Complex:
    """Largest component 1 and, as far as the shape allows, all real."""
    turned = as_real(shapes)
    return _upright(turned / np.max(np.abs(turned), axis=1, initial=0.0)[:, None])


def _upright(shapes: Complex) -> Complex:
    """Sign such that the largest component has a positive real part."""
    largest = np.argmax(np.abs(shapes), axis=1) if len(shapes) else np.zeros(0, dtype=int)
    real = shapes[np.arange(len(shapes)), largest].real
    return np.asarray(shapes * np.where(real < 0, -1, 1)[:, None])


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

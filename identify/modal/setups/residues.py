"""Residues of modes between all channels of several setups: one matrix a mode, of rank one.

A setup knows the residues between its own channels.  Where setups share force channels (sensors roved) or
response channels (forces roved), the products shape x participation of all together are one matrix with
gaps, whose factors are found by turns.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from identify.core.arrays import Array, Complex, Mask
from identify.measured.channel import Channel
from identify.measured.frf_set import FrfSet
from identify.modal.analysis import ModalAnalysis
from identify.modal.lsfd import MORE_RESIDUALS, regressors, targets, unit_participation

_APART = 1e-3
"""Part of the largest singular value below which two poles are the same for these lines."""
_NEAR = 3.0
"""Half-bandwidths from where a mode may be to a resonance at the edge of the band that is it."""
_TURNS = 50
"""Of the factors; with force channels in common to all setups two are enough."""


def side(
    parts: Sequence[Sequence[Channel]],
) -> tuple[tuple[Channel, ...], tuple[Array, ...], tuple[Array, ...]]:
    """The channels of several setups, each once as the first has it, by place; of every setup where its own
    stand among them, and their signs there.
    """
    every = {c.place: c for one in reversed(parts) for c in reversed(one)}
    every = dict(sorted(every.items()))
    at = {place: n for n, place in enumerate(every)}
    return (
        tuple(every.values()),
        tuple(np.array([at[c.place] for c in one]) for one in parts),
        tuple(np.array([float(c.sign * every[c.place].sign) for c in one]) for one in parts),
    )


@dataclass(frozen=True)
class Grid:
    """All channels of several setups: outputs and inputs, each once whatever its sign in a setup; rows,
    columns: where those of each setup stand; turn: the sign that a setup's FRFs have there.
    """

    outputs: tuple[Channel, ...]
    inputs: tuple[Channel, ...]
    rows: tuple[Array, ...]
    columns: tuple[Array, ...]
    turn: tuple[Array, ...]

    @classmethod
    def of(cls, sets: Sequence[FrfSet]) -> Grid:
        """Those of these sets."""
        outputs, rows, turned = side([one.outputs for one in sets])
        inputs, columns, struck = side([one.inputs for one in sets])
        turn = tuple(np.outer(out, force) for out, force in zip(turned, struck, strict=True))
        return cls(outputs, inputs, rows, columns, turn)

    def spread(self, k: int, values: Complex) -> Complex:
        """Values (..., outputs, inputs) of setup k on all channels, NaN elsewhere."""
        whole = np.full((*values.shape[:-2], len(self.outputs), len(self.inputs)), np.nan, dtype=complex)
        whole[..., self.rows[k][:, None], self.columns[k]] = values * self.turn[k]
        return whole


def residues(found: ModalAnalysis, poles: Complex) -> tuple[Complex, Complex]:
    """Receptance residues (outputs, inputs) of the modes of a setup, (m, outputs, inputs), and those of
    further poles (n,) that it does not show by themselves, (n, outputs, inputs).
    """
    own = np.einsum("mo,mi->moi", found.model.shapes, found.model.participation)
    more = _further(found, poles) if len(poles) else np.zeros((0, *own.shape[1:]), dtype=complex)
    if found.layout.transposed:
        return own.transpose(0, 2, 1), more.transpose(0, 2, 1)
    return own, more


def _further(found: ModalAnalysis, poles: Complex) -> Complex:
    """Residues of poles beside those of a setup, with any participation, by linear least squares; of two
    poles that the band does not tell apart each has a part.  A resonance beyond the band that was fitted is
    taken as it is.
    """
    layout, refs = found.layout, len(found.layout.references)
    known = [found.model.poles, found.outside.poles]
    several = np.concatenate([*known, np.repeat(poles, refs)])
    unit = np.tile(np.eye(refs, dtype=complex), (len(poles), 1))
    participation = np.concatenate([found.model.participation, found.outside.participation, unit])
    kinds = tuple(found.model.residuals) or (*found.settings.residuals, *MORE_RESIDUALS[0])
    matrix = regressors(layout, several, unit_participation(participation), kinds)
    size = np.linalg.norm(matrix, axis=0)
    frf = np.where(np.isfinite(layout.frf), layout.frf, 0.0)
    solution = np.linalg.lstsq(matrix / size, targets(frf), rcond=_APART)[0] / size[:, None]
    own = solution[2 * (len(several) - len(unit)) : 2 * len(several)]
    free = (own[0::2] + 1j * own[1::2]).reshape(len(poles), refs, -1).transpose(0, 2, 1)
    beyond = found.outside
    for n, pole in enumerate(poles):
        far = np.abs(beyond.poles - pole) / -pole.real
        if len(far) and np.min(far) < _NEAR:
            r = int(np.argmin(far))
            free[n] = np.outer(beyond.shapes[r], beyond.participation[r])
    return np.asarray(free)


def factors(matrix: Complex, weight: Array) -> tuple[Complex, Complex]:
    """Shape (outputs,) and participation (inputs,), largest component 1, whose product fits a matrix best;
    NaN where it has gaps; weight (outputs, inputs): one over the variance of its values.
    """
    known = np.where(np.isfinite(matrix), weight, 0.0)
    values = np.where(known > 0, matrix, 0.0)
    best = int(np.argmax(np.sum(known * np.abs(values) ** 2, axis=0)))
    right = np.zeros(matrix.shape[1], dtype=complex)
    right[best] = 1.0
    left = right[:0]
    for _ in range(_TURNS):
        left = _solved(known * values, known, right.conj(), right)
        last, right = right, _solved((known * values).T, known.T, left.conj(), left)
        right = right / right[np.argmax(np.abs(right))]
        if np.allclose(last, right, rtol=1e-9, atol=1e-12):
            break
    return left, right


def _solved(weighted: Complex, weight: Array, turned: Complex, other: Complex) -> Complex:
    """One factor where the other is known; 0 where no value tells it yet."""
    size = weight @ np.abs(other) ** 2
    return np.asarray(
        np.divide(weighted @ turned, size, out=np.zeros(len(size), dtype=complex), where=size > 0)
    )


def is_joined(mask: Mask) -> bool:
    """Whether pairs (outputs, inputs) that were measured hang together: from each channel there is a way to
    every other along pairs.
    """
    outputs, inputs = np.zeros(len(mask), dtype=bool), np.zeros(mask.shape[1], dtype=bool)
    inputs[0] = True
    while True:
        reached = outputs | mask[:, inputs].any(axis=1)
        inputs = inputs | mask[reached].any(axis=0)
        if np.array_equal(reached, outputs):
            return bool(outputs.all() and inputs.all())
        outputs = reached

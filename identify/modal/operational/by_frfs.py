"""Modal masses of modes from responses alone by FRFs of the same structure, between channels of the records.

The residue of the receptance between two channels is psi_i psi_j / (2j omega_d m) (Ewins, Modal Testing
(2000), 5.2).  Its errors are those of the noise in the FRFs, given the poles, and those of the poles, which
are independent of them: the noise of the first lies in the span of the regressors, that of the second across
it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identify.core.arrays import Array, Complex, Index
from identify.modal.analysis import ModalAnalysis
from identify.modal.operational.analysis import OperationalModes
from identify.modal.operational.masses import MassesByMode, ModalMasses
from identify.modal.pairing import PairSettings, common_channels, pair

_SAME = PairSettings(max_frequency_error=0.25, min_mac=0.7)
"""How far a mode may move, and its shape turn, until it is the same mode no longer."""
_BY_FREQUENCY = PairSettings(max_frequency_error=0.03)
"""How far a mode may move where there are no shapes to tell whether it is the same."""
_TURNED = np.pi / 4
"""Largest angle between a residue and that of a mode."""


@dataclass(frozen=True)
class _Pairs:
    """FRFs between channels of the records: positions of response and reference in the FRFs and in the
    records, and the product of their signs; each (pairs,).
    """

    response: Index
    reference: Index
    first: Index
    second: Index
    sign: Array


def by_frfs(found: OperationalModes, forced: ModalAnalysis) -> ModalMasses:
    """Modal masses by the modes of FRFs between channels of the records; none without such FRFs."""
    pairs = _pairs(found, forced)
    alike = len(common_channels(found.table, forced.table)[0]) >= 2
    same = pair(found.table, forced.table, _SAME if alike else _BY_FREQUENCY)
    rows = MassesByMode(len(found.frequency_hz), "no mode of the FRFs is like it")
    if not len(pairs.sign):
        return rows.masses
    for r, k in zip(same.a, same.b, strict=True):
        _tell(rows, (int(r), int(k)), found, forced, pairs)
    return rows.masses


def _pairs(found: OperationalModes, forced: ModalAnalysis) -> _Pairs:
    layout, channels = forced.layout, found.records.channels
    where = {c.place: n for n, c in enumerate(channels)}
    measured = np.isfinite(layout.frf).all(axis=0)
    rows = []
    for i, j in zip(*np.nonzero(measured), strict=True):
        ends = layout.responses[i], layout.references[j]
        at = [where.get(c.place) for c in ends]
        if at[0] is not None and at[1] is not None:
            sign = ends[0].sign * ends[1].sign * channels[at[0]].sign * channels[at[1]].sign
            rows.append((i, j, at[0], at[1], sign))
    table = np.array(rows, dtype=int).reshape(-1, 5).T
    return _Pairs(table[0], table[1], table[2], table[3], table[4].astype(float))


def _tell(
    rows: MassesByMode, which: tuple[int, int], found: OperationalModes, forced: ModalAnalysis, pairs: _Pairs
) -> None:
    """Least squares over all pairs for one mode (row of the records, row of the FRFs)."""
    (r, k), model = which, forced.model
    psi, psi_std, hz = found.shapes[r], found.scatter.shapes[r], forced.table.frequency_hz[k]
    damped = 2j * model.poles[k].imag
    own = damped * model.shapes[k, pairs.response] * model.participation[k, pairs.reference]
    product = pairs.sign * psi[pairs.first] * psi[pairs.second]
    size = float(np.sum(np.abs(product) ** 2))
    whole = complex(np.sum(product.conj() * own)) / max(size, np.finfo(float).tiny)
    if not abs(np.angle(whole)) < _TURNED:
        turn = f"{np.degrees(np.angle(whole)):.0f} degrees"
        rows.refuse(r, hz, f"the residue of the FRFs is turned by {turn} against it: signs, or another mode?")
        return
    weight = product.conj() / size * (abs(whole) / whole)
    # A channel too large by a part e makes its products larger by e, and their squares by 2 e.
    change = (weight * own).real - 2 * abs(whole) * np.abs(product) ** 2 / size
    each = np.zeros(len(psi))
    np.add.at(each, pairs.first, change)
    np.add.at(each, pairs.second, change)
    of_shape = each * psi_std / np.maximum(np.abs(psi), np.finfo(float).tiny)
    variance = np.sum(of_shape**2) + _noise(forced, k, pairs, weight * damped)
    rows.add(r, hz, abs(whole), float(np.sqrt(variance)))


def _noise(forced: ModalAnalysis, k: int, pairs: _Pairs, weight: Complex) -> float:
    """Variance of the real part of a weighted sum of the residues of a mode over pairs."""
    layout, models = forced.layout, (forced.model, forced.outside)
    s, scale = layout.s, layout.s**layout.power
    poles = np.concatenate([m.poles for m in models])
    shapes = np.concatenate([m.shapes[:, pairs.response] for m in models])
    all_residues = shapes * np.concatenate([m.participation[:, pairs.reference] for m in models])
    basis = scale[:, None] * np.column_stack([1 / (s[:, None] - poles), np.ones_like(s), s**-2])
    basis_size = np.linalg.norm(basis, axis=0)
    solve = np.linalg.pinv(basis / basis_size)[k] / basis_size[k]
    left = (layout.frf - forced.synthesised)[:, pairs.response, pairs.reference]
    near = np.abs(solve) ** 2
    error = near @ np.abs(left) ** 2  # the variance of a residue, of real and imaginary part together
    of_pairs = np.sum(np.abs(weight) ** 2 * error) / 2
    moved = (solve * scale) @ (1 / (s[:, None] - forced.model.poles) ** 2)
    slope = -moved * (all_residues[: len(forced.model.poles)] @ weight)
    damping, std = forced.table.damping_ratio, (forced.table.frequency_std_hz, forced.table.damping_std)
    assert std[0] is not None and std[1] is not None
    imag_std, size = 2 * np.pi * std[0], 2 * np.pi * forced.table.frequency_hz
    real_std = np.hypot(size * std[1], damping * imag_std)
    of_poles = np.sum((slope.real * real_std) ** 2 + (slope.imag * imag_std) ** 2)
    return float(of_pairs + of_poles)

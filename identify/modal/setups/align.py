"""Which mode of each setup is which: modes paired setup by setup, at most one of each in a mode of all."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from identify.core.arrays import Array, Index
from identify.measured.modal_tables import ModalTable
from identify.modal.mac import macx
from identify.modal.pairing import assign, common_channels

_FARTHEST = 0.1
"""Logarithm of frequencies beyond which two modes are not the same with a sensor more or less on it."""
_LEFT = 0.05
"""What it costs to leave a mode of each side alone, beside the logarithm of frequencies and as 1 - MAC."""

_REACH = 3.0
"""Half-bandwidths, about, that a mode may be from where the mass of a sensor puts it."""


def align(tables: Sequence[ModalTable]) -> Index:
    """Row of every setup's table for each mode of all, (modes, setups), -1 where a setup did not show it.

    Tables are compared in frequency and, at two or more channels in common, by MAC (conjugate-invariant); a
    mode of all is as far from one of a setup as its members are on average.  A mass leaves the order of modes
    as it is (interlacing of eigenvalues), and lowers them by few per cent.
    """
    order = sorted(range(len(tables)), key=lambda k: -len(tables[k]))
    rows: list[dict[int, int]] = []
    for k in order:
        far = np.array([_distance(row, k, tables) for row in rows]).reshape(len(rows), len(tables[k]))
        found, others = assign(far, far < _FARTHEST, _LEFT)
        for r, j in zip(found, others, strict=True):
            rows[r][k] = int(j)
        rows += [{k: int(j)} for j in np.setdiff1d(np.arange(len(tables[k])), others)]
    return _member(rows, len(tables))


def nearest(tables: Sequence[ModalTable], expected_hz: Array, damping_ratio: Array, member: Index) -> Index:
    """The same once it is known where modes (m,) of these damping ratios are in each setup, (m, setups): the
    mode of a setup nearest to it, in half-bandwidths and in the logarithm of damping; what is left over stays
    with those that it was with.
    """
    rows: list[dict[int, int]] = [{} for _ in expected_hz]
    rest: dict[int, dict[int, int]] = {}
    for k, table in enumerate(tables):
        far = np.abs(np.log(table.frequency_hz / expected_hz[:, [k]])) / damping_ratio[:, None]
        far = far + np.abs(np.log(table.damping_ratio / damping_ratio[:, None]))
        found, others = assign(far, far < _REACH, _REACH)
        for r, j in zip(found, others, strict=True):
            rows[r][k] = int(j)
        for j in np.setdiff1d(np.arange(len(table)), others):
            rest.setdefault(int(np.flatnonzero(member[:, k] == j)[0]), {})[k] = int(j)
    return _member([row for row in (*rows, *rest.values()) if row], len(tables))


def _member(rows: Sequence[dict[int, int]], setups: int) -> Index:
    member = np.full((len(rows), setups), -1)
    for r, row in enumerate(rows):
        member[r, list(row)] = list(row.values())
    return member


def _distance(row: dict[int, int], k: int, tables: Sequence[ModalTable]) -> Array:
    """From a mode of all to every mode of setup k, (m,)."""
    return np.asarray(np.mean([_between(tables[other], j, tables[k]) for other, j in row.items()], axis=0))


def _between(a: ModalTable, j: int, b: ModalTable) -> Array:
    far = np.abs(np.log(b.frequency_hz / a.frequency_hz[j]))
    in_a, in_b, sign = common_channels(a, b)
    if a.shapes is None or b.shapes is None or len(in_a) < 2:
        return np.asarray(far)
    return np.asarray(far + _LEFT * (1 - macx(a.shapes[[j]][:, in_a], b.shapes[:, in_b] * sign)[0]))

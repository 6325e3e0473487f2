"""Which mode of one table is which mode of another: a one-to-one assignment on MAC, frequency and damping."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from identify.core.arrays import Array, Index
from identify.measured.channel import Channel
from identify.measured.modal_tables import ModalTable
from identify.modal.mac import macx


@dataclass(frozen=True)
class PairSettings:
    """What may be a pair.  max_frequency_error: largest f_b/f_a - 1 (or f_a/f_b - 1); min_mac: least MAC,
    where shapes are known; damping_weight: what a factor e between damping ratios costs, in units of MAC
    (little: damping is the least certain); unpaired: what leaving one mode of each table unpaired costs, in
    the same units.
    """

    max_frequency_error: float = 0.5
    min_mac: float = 0.3
    damping_weight: float = 0.05
    unpaired: float = 2.0


@dataclass(frozen=True)
class Pairing:
    """Pairs sorted by the mode of a.  a, b (p,): row of each table; mac (p,): conjugate-invariant MAC, NaN
    without shapes; frequency_error (p,): f_b/f_a - 1; damping_error (p,): zeta_b/zeta_a - 1, NaN where
    unknown; unpaired_a, unpaired_b: the other rows; mac_matrix (m, n) on the common channels, None without
    shapes.
    """

    a: Index
    b: Index
    mac: Array
    frequency_error: Array
    damping_error: Array
    unpaired_a: Index
    unpaired_b: Index
    mac_matrix: Array | None
    channels: tuple[Channel, ...]

    def __len__(self) -> int:
        return len(self.a)


def pair(a: ModalTable, b: ModalTable, settings: PairSettings | None = None) -> Pairing:
    """Pair the modes of two tables; shapes are compared on the common channels, with their signs.

    Without shapes in both tables, or with fewer than two common channels, frequency and damping decide; the
    cost is convex in frequency then, so the order of the modes is kept.  A pair costs (1 - MAC) + |ln
    f_b/f_a| + damping_weight |ln zeta_b/zeta_a|; the assignment of least total cost is taken (Kuhn 1955, by
    scipy).
    """
    settings = settings or PairSettings()
    in_a, in_b, sign = common_channels(a, b)
    matrix = None
    if a.shapes is not None and b.shapes is not None and len(in_a) >= 2:
        matrix = macx(a.shapes[:, in_a], b.shapes[:, in_b] * sign)
    rows, columns = assign(*_cost(a, b, matrix, settings), settings.unpaired)
    damping_a, damping_b = a.damping_ratio[rows], b.damping_ratio[columns]
    return Pairing(
        a=rows,
        b=columns,
        mac=np.full(len(rows), np.nan) if matrix is None else matrix[rows, columns],
        frequency_error=_relative(a.frequency_hz[rows], b.frequency_hz[columns]),
        damping_error=_relative(damping_a, damping_b),
        unpaired_a=np.setdiff1d(np.arange(len(a)), rows),
        unpaired_b=np.setdiff1d(np.arange(len(b)), columns),
        mac_matrix=matrix,
        channels=() if matrix is None else tuple(a.channels[i] for i in in_a),
    )


def common_channels(a: ModalTable, b: ModalTable) -> tuple[Index, Index, Array]:
    """Positions in a and in b of the channels both have, and the sign that turns b's channel into a's, each
    (c,).

    `12:+Z` and `12:-Z` are the same channel with opposite sign.  Channels with an unknown (NaN) value are
    left out.
    """
    known_a, known_b = _known(a), _known(b)
    where = {(c.node, abs(c.direction)): j for j, c in reversed(list(enumerate(b.channels))) if known_b[j]}
    keys = [(c.node, abs(c.direction)) for c in a.channels]
    first = {key: i for i, key in reversed(list(enumerate(keys))) if known_a[i] and key in where}
    in_a = sorted(first.values())
    in_b = [where[keys[i]] for i in in_a]
    sign = [a.channels[i].sign * b.channels[j].sign for i, j in zip(in_a, in_b, strict=True)]
    return np.array(in_a, dtype=np.intp), np.array(in_b, dtype=np.intp), np.array(sign, dtype=np.float64)


def _known(table: ModalTable) -> NDArray[np.bool_]:
    if table.shapes is None:
        return np.ones(len(table.channels), dtype=bool)
    return np.asarray(np.isfinite(table.shapes).all(axis=0))


def _cost(
    a: ModalTable, b: ModalTable, matrix: Array | None, settings: PairSettings
) -> tuple[Array, NDArray[np.bool_]]:
    """Cost of every pair (m, n), and whether it may be a pair at all."""
    frequency = _log_distance(a.frequency_hz, b.frequency_hz)
    damping = np.nan_to_num(_log_distance(a.damping_ratio, b.damping_ratio), nan=0.0, posinf=0.0)
    allowed = frequency <= np.log1p(settings.max_frequency_error)
    cost = frequency + settings.damping_weight * damping
    if matrix is not None:
        allowed &= matrix >= settings.min_mac
        cost = cost + 1 - matrix
    return cost, allowed


def _log_distance(a: Array, b: Array) -> Array:
    """|ln(b/a)| of every pair; a value that is not positive is taken as unknown (NaN), two equal ones as no
    distance.
    """
    log_a, log_b = (np.log(np.where(x > 0, x, np.nan)) for x in (a, b))
    distance = np.abs(log_b[None, :] - log_a[:, None])
    return np.where(a[:, None] == b[None, :], 0.0, distance)


def assign(cost: Array, allowed: NDArray[np.bool_], unpaired: float) -> tuple[Index, Index]:
    """Assignment of least cost in which leaving one mode on each side out costs `unpaired`."""
    m, n = cost.shape
    forbidden = 1e6 * (1 + unpaired)
    square = np.full((m + n, m + n), forbidden)
    square[:m, :n] = np.where(allowed, cost, forbidden)
    square[np.arange(m), n + np.arange(m)] = unpaired / 2
    square[m + np.arange(n), np.arange(n)] = unpaired / 2
    square[m:, n:] = 0.0
    rows, columns = scipy.optimize.linear_sum_assignment(square)
    real = (rows < m) & (columns < n)
    return rows[real], columns[real]


def _relative(a: Array, b: Array) -> Array:
    return np.asarray(np.divide(b - a, a, out=np.full(len(a), np.nan), where=a > 0))

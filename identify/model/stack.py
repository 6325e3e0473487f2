"""Matrices by parameter, of which few entries are not zero: what a spring adds touches one or two of a
hundred coordinates.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse

from identify.core.arrays import Array, Index, Mask


@dataclass(frozen=True)
class Stack:
    """Matrices (count, n, n).

    place (entries,): of each entry that is not zero, in its matrix row by row; owner (entries,): the matrix's
    number; value (entries,); size: n.
    """

    place: Index
    owner: Index
    value: Array
    count: int
    size: int

    @classmethod
    def of(cls, matrices: Iterable[tuple[int, Array]], count: int, size: int) -> Stack:
        """Matrices (n, n) with their numbers, each at most once; those that are not given are zero."""
        found = [(number, np.ascontiguousarray(matrix).ravel()) for number, matrix in matrices]
        at = [np.flatnonzero(flat) for _, flat in found]
        owner = np.repeat([number for number, _ in found], [len(one) for one in at]).astype(int)
        values = [flat[one] for (_, flat), one in zip(found, at, strict=True)]
        rows, data = (np.concatenate([np.zeros(0), *some]) for some in (at, values))
        return cls(rows.astype(int), owner, data, count, size)

    def __len__(self) -> int:
        return self.count

    @cached_property
    def _columns(self) -> scipy.sparse.csr_array:
        """(n n, count): each matrix as a column."""
        shape = self.size**2, self.count
        found = scipy.sparse.csr_array((self.value, (self.place, self.owner)), shape=shape)
        found.sort_indices()  # so that what is symmetric is summed alike on both sides
        return found

    def __getitem__(self, numbers: int | slice | Index | Mask) -> Array:
        """Some of the matrices (..., n, n), dense."""
        chosen = np.arange(self.count)[numbers]
        found = self._columns[:, chosen.ravel()].toarray().T
        return np.asarray(found.reshape(*chosen.shape, self.size, self.size))

    def any(self) -> bool:
        """Whether there is an entry that is not zero."""
        return len(self.value) > 0

    def weighted(self, values: Array) -> Array:
        """Sum over the matrices, each times its value: values (..., count), sum (..., n, n)."""
        shape = *values.shape[:-1], self.size, self.size
        if not self.any():
            return np.zeros(shape)
        found = self._columns @ values.reshape(-1, self.count).T
        return np.ascontiguousarray(found.T).reshape(shape)

    def over(self, chosen: Index) -> Stack:
        """The same over some of the rows and columns."""
        place = np.full(self.size, -1)
        place[chosen] = np.arange(len(chosen))
        row, column = place[self.place // self.size], place[self.place % self.size]
        kept = (row >= 0) & (column >= 0)
        at = row[kept] * len(chosen) + column[kept]
        return Stack(at, self.owner[kept], self.value[kept], self.count, len(chosen))

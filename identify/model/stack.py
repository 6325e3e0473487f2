"""Matrices by parameter, of which few entries are not zero: what a spring adds touches one or two of a
hundred coordinates.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import scipy.sparse

from identify.core.arrays import Array, Index, Mask


@dataclass(frozen=True)
class Stack:
    """Matrices (count, n, n).

    entries (n n, count): those of each as a column, sparse; size: n.
    """

    entries: scipy.sparse.csr_array
    size: int

    @classmethod
    def of(cls, matrices: Iterable[tuple[int, Array]], count: int, size: int) -> Stack:
        """Matrices (n, n) with their numbers, each at most once; those that are not given are zero."""
        found = [(number, np.ascontiguousarray(matrix).ravel()) for number, matrix in matrices]
        at = [np.flatnonzero(flat) for _, flat in found]
        owner = np.repeat([number for number, _ in found], [len(one) for one in at]).astype(int)
        values = [flat[one] for (_, flat), one in zip(found, at, strict=True)]
        rows, data = (np.concatenate([np.zeros(0), *some]) for some in (at, values))
        entries = scipy.sparse.csr_array((data, (rows.astype(int), owner)), shape=(size * size, count))
        entries.sort_indices()  # so that what is symmetric is summed alike on both sides
        return cls(entries, size)

    def __len__(self) -> int:
        return int(self.entries.shape[1])

    def __getitem__(self, numbers: int | slice | Index | Mask) -> Array:
        """Some of the matrices (..., n, n), dense."""
        chosen = np.arange(len(self))[numbers]
        found = self.entries[:, chosen.ravel()].toarray().T
        return np.asarray(found.reshape(*chosen.shape, self.size, self.size))

    def any(self) -> bool:
        """Whether there is an entry that is not zero."""
        return bool(self.entries.nnz)

    def weighted(self, values: Array) -> Array:
        """Sum over the matrices, each times its value: values (..., count), sum (..., n, n)."""
        flat = values.reshape(-1, len(self))
        found = (self.entries @ flat.T).T
        return np.ascontiguousarray(found).reshape(*values.shape[:-1], self.size, self.size)

    def over(self, chosen: Index) -> Stack:
        """The same over some of the rows and columns."""
        rows = chosen[:, None] * self.size + chosen
        return Stack(self.entries[rows.ravel()], len(chosen))

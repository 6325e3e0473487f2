"""One measurement under two names, recognised by what is in it: it would count twice, or be called data that
were not fitted.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations

import numpy as np

from identify.core.arrays import Complex
from identify.core.errors import InputError
from identify.measured.frf_set import FrfSet
from identify.measured.modal_table import ModalTable

_ALIKE = 1e-3
"""RMS of the difference of two FRFs over their own up to which they are one, perhaps written with fewer
digits: two measurements are never as near as that."""


def doubles(given: Sequence[tuple[str, FrfSet | ModalTable]]) -> Iterator[InputError]:
    """An error for each two of these (name, data) that share measured values, whatever they are called."""
    for (one, first), (other, second) in combinations(given, 2):
        if isinstance(first, FrfSet) and isinstance(second, FrfSet):
            same = _frfs_alike(first, second)
            what = f"{same} of the FRFs"
        else:
            same = int(type(first) is type(second) and first.sha256 == second.sha256 and first.sha256 != "")
            what = "the table of modes"
        if same:
            yield InputError(
                other,
                f"{what} are those of {one}" if same > 1 else f"{what} is that of {one}",
                "data of its own in each measurement, or they would count twice",
                "name another file, or take one of the two measurements out of the study",
            )


def _frfs_alike(first: FrfSet, second: FrfSet) -> int:
    """How many FRFs of one set are in the other, under whatever channels."""
    common, here, there = np.intersect1d(
        first.frequency_hz.round(6), second.frequency_hz.round(6), return_indices=True
    )
    if first.quantity != second.quantity or len(common) < 2:
        return 0
    a, b = _columns(first, here), _columns(second, there)
    size, other = (np.sum(np.abs(one) ** 2, axis=0) for one in (a, b))
    apart = size[:, None] + other - 2 * (a.conj().T @ b).real
    return int(np.any((apart <= _ALIKE**2 * size[:, None]) & (size[:, None] > 0), axis=1).sum())


def _columns(data: FrfSet, lines: np.ndarray[tuple[int], np.dtype[np.intp]]) -> Complex:
    """(lines, FRFs) that were measured."""
    return np.asarray(data.frf[lines][:, data.measured])

"""What was made last, of which objects: for things that take long and are asked for again and again."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Hashable
from operator import is_
from typing import Any, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from identify.core.arrays import Array

T = TypeVar("T")


class Latest(Generic[T]):
    """The last few things that were asked for; objects are the same only if they are one, because comparing
    their arrays would take as long.
    """

    def __init__(self, kept: int) -> None:
        self._kept = kept
        self._made: list[tuple[tuple[object, ...], T]] = []

    def of(self, objects: tuple[object, ...], make: Callable[[], T]) -> T:
        """What is made of these objects."""
        known = next((made for of, made in self._made if all(map(is_, of, objects))), None)
        made = make() if known is None else known
        others = [one for one in self._made if one[1] is not made]
        self._made = [(objects, made), *others][: self._kept]
        return made


class LatestAt(Generic[T]):
    """What was made at an array's values the last time, for small arrays, whose equality is seen at once; it
    is left behind where the object that has it goes to another process.
    """

    def __init__(self) -> None:
        self._known: tuple[bytes, T] | None = None

    def of(self, values: Array, make: Callable[[Array], T]) -> T:
        """What is made at these values."""
        known, key = self._known, values.tobytes()
        if known is None or known[0] != key:
            self._known = known = key, make(values)  # at once: several threads may ask
        return known[1]

    def __getstate__(self) -> dict[str, Any]:
        return {"_known": None}


class LatestLike(Generic[T]):
    """The last few things that were made of equal contents, such as what a file holds that is read several
    times in a run: arrays are told by a digest, which takes a hundredth of what is made of them.

    What is made of more than `largest` bytes is not kept, because it would take as much memory again.  What
    is given back is the same object each time: whoever changes its arrays takes copies.
    """

    def __init__(self, kept: int, largest: int = 4_000_000) -> None:
        self._kept, self._largest = kept, largest
        self._made: list[tuple[tuple[Hashable, ...], T]] = []

    def of(self, contents: tuple[Any, ...], make: Callable[[], T], *, size: int | None = None) -> T:
        """What is made of arrays and of what is compared as it is; size: bytes, by default of the arrays."""
        arrays = [one for one in contents if isinstance(one, np.ndarray)]
        if (sum(one.nbytes for one in arrays) if size is None else size) > self._largest:
            return make()
        key = tuple(_digest(one) if isinstance(one, np.ndarray) else one for one in contents)
        known = [one for one in self._made if one[0] == key]
        made = known[0] if known else (key, make())
        self._made = [made, *(one for one in self._made if one[0] != key)][: self._kept]  # several threads
        return made[1]


def _digest(values: NDArray[Any]) -> Hashable:
    return values.dtype.str, values.shape, hashlib.blake2b(values.tobytes()).digest()

"""What was made last, of which objects: for things that take long and are asked for again and again."""

from __future__ import annotations

from collections.abc import Callable
from operator import is_
from typing import Any, Generic, TypeVar

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

"""What a file of arrays holds, in words: for the sentence that says that an array was not found in it."""

from __future__ import annotations

import re
from collections.abc import Iterator

import numpy as np

from identify.core.tree import Group, Unread, Value

_MOST, _LETTERS = 20, 24
_STEP, _START = (
    re.compile(rf"(^|[./_])({words})[^./]*$", re.IGNORECASE)
    for words in ("df|delta|step|increment|resolution", "f0|fmin|start|first")
)
"""What programs call the step and the start of an axis that is evenly spaced."""


def described(content: Group, between: str) -> str:
    """Names, shapes and types of all that is in a tree; between: what stands between the names of groups."""
    found = [f"{name} {_words(value)}" for name, value in _values(content, between)]
    return "it holds " + (_printable(_listing(found)) if found else "nothing")


def suggested(content: Group, between: str) -> str:
    """Keys of `variables` that may be meant: a rising real vector or a step, and complex arrays; empty
    where there is none.
    """
    arrays = {name: value for name, value in _values(content, between) if isinstance(value, np.ndarray)}
    cubes = {name: value.shape for name, value in arrays.items() if value.dtype.kind == "c"}
    for name, value in arrays.items():
        fitting = [cube for cube, shape in cubes.items() if value.size in shape]
        if fitting and _rises(value):
            return _printable(f"{{frequency_hz: {name}, frf: {fitting[0]}}}")
    steps, starts = (
        [name for name, value in arrays.items() if value.size == 1 and words.search(name)]
        for words in (_STEP, _START)
    )
    if steps and cubes:
        start = f"frequency_start_hz: {starts[0]}, " if starts else ""
        return _printable(f"{{{start}frequency_step_hz: {steps[0]}, frf: {next(iter(cubes))}}}")
    return ""


def _printable(text: str) -> str:
    """The same without control characters, which names in a damaged file may have."""
    return "".join(letter if letter.isprintable() else "\N{REPLACEMENT CHARACTER}" for letter in text)


def _listing(found: list[str]) -> str:
    """The first of them, and how many more."""
    more = f" and {len(found) - _MOST} more" if len(found) > _MOST else ""
    return ", ".join(found[:_MOST]) + more


def _values(content: Group, between: str, before: str = "") -> Iterator[tuple[str, Value]]:
    for name, value in content.members.items():
        if isinstance(value, Group):
            yield from _values(value, between, f"{before}{name}{between}")
        else:
            yield f"{before}{name}", value


def _words(value: Value) -> str:
    if isinstance(value, Unread):
        return f"({value.kind})"
    if isinstance(value, (str, tuple)):
        text = value if isinstance(value, str) else ", ".join(value)
        return repr(text if len(text) <= _LETTERS else text[: _LETTERS - 3] + "...")
    if value.size == 1 and value.dtype.kind != "c":
        return f"= {value.reshape(()):g}"
    kind = " complex" if value.dtype.kind == "c" else ""
    return f"({' x '.join(map(str, value.shape))}{kind})"


def _rises(value: np.ndarray[tuple[int, ...], np.dtype[np.generic]]) -> bool:
    """Whether numbers could be frequencies: real, in one row, not negative, rising."""
    flat = value.ravel()
    one_row = flat.size > 2 and max(value.shape) == flat.size and flat.dtype.kind in "fiu"
    return one_row and bool(flat[0] >= 0 and (np.diff(flat.astype(float)) > 0).all())

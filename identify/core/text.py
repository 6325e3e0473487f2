"""Words for people."""

from __future__ import annotations

import math
from collections.abc import Sequence

from identify.core.errors import InputError


def listed(items: Sequence[str]) -> str:
    """`a, b and c`."""
    return " and ".join(filter(None, [", ".join(items[:-1]), *items[-1:]]))


def capital(text: str) -> str:
    """The text with a capital in front; the rest stays as it is."""
    return text[:1].upper() + text[1:]


def count(items: int, word: str) -> str:
    """`1 line`, `124 lines`."""
    return f"{items} {word}" if items == 1 else f"{items} {word}s"


def typed(words: Sequence[object]) -> str:
    """A command as it is typed, in any shell: words with blanks in quotes."""
    return " ".join(f'"{word}"' if " " in str(word) else str(word) for word in words)


def angles_of(text: str | None, option: str = "--at") -> tuple[float, ...]:
    """Angles in degrees of a text such as `0,30,-60,0,45,0`; none of None; InputError for another text."""
    if text is None:
        return ()
    try:
        found = tuple(float(part) for part in text.split(","))
    except ValueError:
        found = (math.nan,)
    if not all(map(math.isfinite, found)):
        raise InputError(option, repr(text), "angles in degrees such as 0,30,-60,0,45,0")
    return found

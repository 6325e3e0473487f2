"""Words for people."""

from __future__ import annotations

from collections.abc import Sequence


def listed(items: Sequence[str]) -> str:
    """`a, b and c`."""
    return " and ".join(filter(None, [", ".join(items[:-1]), *items[-1:]]))


def capital(text: str) -> str:
    """The text with a capital in front; the rest stays as it is."""
    return text[:1].upper() + text[1:]


def count(items: int, word: str) -> str:
    """`1 line`, `124 lines`."""
    return f"{items} {word}" if items == 1 else f"{items} {word}s"

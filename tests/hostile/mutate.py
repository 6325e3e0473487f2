"""Mutations of files: bytes, lines, numbers, headers and structure, each with what of the file it touched."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

NUMBER = re.compile(rb"(?<![\w.])[-+]?\d+\.?\d*(?:[eEdD][-+]?\d+)?(?![\w.])")
ODD_NUMBERS = (
    *(b"0", b"-1", b"1e-300", b"1e300", b"1e999", b"nan", b"inf", b"9" * 400, b"1_0", b"0x", b"1e", b"."),
    *(b"", b"true", b"2026-13-45", b"!!float x", b"!!bool x", b"[[", b"null", b"-0", b"1,5", b"1e-200"),
)
ODD_LINES = (
    *(
        b"\x00",
        b"\xff\xfe",
        b"a: &a {<<: *a}",
        b"- " * 40,
        b"[" * 3000,
        b"x" * 140_000,
        b"%YAML 1.1",
        b"    -1",
    ),
    *(b"# unit: g/N", b"!!python/object:x", b"\xe2\x80\xa8", b"<a>" * 500, b"&x;", b'"', b"'", b"\t", b"---"),
)


@dataclass(frozen=True)
class Mutant:
    """A mutated file: what was done, and the bytes of the original from `first` to `last` that it touched."""

    what: str
    content: bytes
    first: int
    last: int


Draw = np.random.Generator


def _at(draw: Draw, content: bytes) -> int:
    return int(draw.integers(0, max(1, len(content))))


def flipped(draw: Draw, content: bytes) -> Mutant:
    """One bit."""
    at = _at(draw, content)
    changed = bytearray(content)
    changed[at] ^= 1 << int(draw.integers(8))
    return Mutant("bit", bytes(changed), at, at + 1)


def replaced(draw: Draw, content: bytes) -> Mutant:
    """Up to eight bytes by others."""
    at, size = _at(draw, content), int(draw.integers(1, 9))
    return Mutant("bytes", content[:at] + draw.bytes(size) + content[at + size :], at, at + size)


def lost(draw: Draw, content: bytes) -> Mutant:
    """One byte, or a piece."""
    at, size = _at(draw, content), int(draw.choice([1, 1, 1, 2, 13, 200]))
    return Mutant("lost", content[:at] + content[at + size :], at, at + size)


def added(draw: Draw, content: bytes) -> Mutant:
    """Bytes between others."""
    at = _at(draw, content)
    more = [b"\n", b" ", b"7", b"-", b".", b"E", b"\r\n", b"\x00", b"\xff", draw.bytes(3)]
    return Mutant("added", content[:at] + more[int(draw.integers(len(more)))] + content[at:], at, at + 1)


def cut(draw: Draw, content: bytes) -> Mutant:
    """The end of the file."""
    at = _at(draw, content)
    return Mutant("cut", content[:at], at, len(content))


def header(draw: Draw, content: bytes) -> Mutant:
    """A byte among the first."""
    at = int(draw.integers(0, min(len(content), 400)))
    return Mutant("header", content[:at] + draw.bytes(1) + content[at + 1 :], at, at + 1)


def number(draw: Draw, content: bytes) -> Mutant:
    """A number by an odd one, or by one with another digit."""
    found = _near(draw, content, NUMBER)
    if found is None:
        return flipped(draw, content)
    if draw.integers(2):
        new = ODD_NUMBERS[int(draw.integers(len(ODD_NUMBERS)))]
    else:
        digits = [i for i, c in enumerate(found[0]) if chr(c).isdigit()]
        at = digits[int(draw.integers(len(digits)))]
        new = found[0][:at] + str(draw.integers(10)).encode() + found[0][at + 1 :]
    return Mutant(
        "number", content[: found.start()] + new + content[found.end() :], found.start(), found.end()
    )


def _near(draw: Draw, content: bytes, pattern: re.Pattern[bytes]) -> re.Match[bytes] | None:
    return pattern.search(content, _at(draw, content)) or pattern.search(content)


def line(draw: Draw, content: bytes) -> Mutant:
    """A line lost, doubled, exchanged with another, or an odd one in its place."""
    ends = [0, *(m.end() for m in re.finditer(rb"\n", content)), len(content)]
    i, j = (int(draw.integers(len(ends) - 1)) for _ in range(2))
    one, other = content[ends[i] : ends[i + 1]], content[ends[j] : ends[j + 1]]
    odd = ODD_LINES[int(draw.integers(len(ODD_LINES)))] + b"\n"
    new = (b"", one + one, other, odd, one + odd)[int(draw.integers(5))]
    return Mutant("line", content[: ends[i]] + new + content[ends[i + 1] :], ends[i], ends[i + 1])


def structure(draw: Draw, content: bytes) -> Mutant:
    """A piece of the file copied, moved, or zeroed."""
    at, to, size = _at(draw, content), _at(draw, content), int(draw.integers(1, 2000))
    piece = content[at : at + size]
    kind = int(draw.integers(3))
    if kind == 0:
        return Mutant("copied", content[:to] + piece + content[to:], to, to + 1)
    if kind == 1:
        return Mutant("overwritten", content[:to] + piece + content[to + len(piece) :], to, to + size)
    return Mutant("zeroed", content[:at] + b"\x00" * len(piece) + content[at + size :], at, at + size)


BYTES: tuple[Callable[[Draw, bytes], Mutant], ...] = (
    *(flipped, replaced, lost, added, cut, header, structure),
)
TEXT = (*BYTES, number, number, number, line, line)

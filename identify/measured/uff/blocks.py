"""Universal files as a row of datasets of text, with the fixed columns their numbers stand in; binary
functions (58b) are passed over.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from identify.core.arrays import Array
from identify.core.errors import InputError
from identify.core.files import read_bytes
from identify.measured.uff.cursor import EXPORT, Cursor
from identify.measured.uff.values import Form, binary_values


@dataclass
class Block:
    """One dataset: its number, its lines, and where its first line is in the file; `at` is the line to be
    read next.
    """

    number: int
    lines: list[str]
    name: str
    first: int
    at: int = 0

    @property
    def where(self) -> str:
        """File, dataset and the line read last, as errors name them."""
        place = f", line {self.first + max(self.at, 1) - 1}" if self.first else ""
        return f"{self.name}, dataset {self.number}{place}"

    @property
    def done(self) -> bool:
        """Whether only empty lines are left."""
        return not any(line.strip() for line in self.lines[self.at :])

    def line(self) -> str:
        """The next line; InputError where the dataset has ended."""
        if self.at >= len(self.lines):
            raise InputError(self.where, "the dataset ends too early", "further records", EXPORT)
        self.at += 1
        return self.lines[self.at - 1]

    def integers(self, least: int) -> list[int]:
        """Integers I10 of the next line, at least so many."""
        line = self.line().rstrip()
        return [int(field) for field in self._fields(line, 10, r" *[+-]?\d+", least, "I10")]

    def reals(self, count: int, width: int = 13) -> Array:
        """Exactly `count` numbers of that width, over as many lines as needed, (count,)."""
        per_line = 6 if width == 13 else 3
        found: list[str] = []
        while len(found) < count:
            least = min(per_line, count - len(found))
            fields = self._fields(
                self.line().rstrip(), width, r" *[+-]?(\d+\.?\d*|\.\d+)([eEdD][+-]?\d+)?", least, f"E{width}"
            )
            found += fields[:least]
        values = np.array([float(field.upper().replace("D", "E")) for field in found])
        if not np.isfinite(values).all():
            raise InputError(self.where, "a number too large", "finite numbers", EXPORT)
        return values

    def split(self, column: int) -> tuple[Block, Block]:
        """The next line as two blocks, up to that column and from it on."""
        line = self.line()
        place = self.first and self.first + self.at - 1
        return Block(self.number, [line[:column]], self.name, place), Block(
            self.number, [line[column:]], self.name, place
        )

    def _fields(self, line: str, width: int, pattern: str, least: int, form: str) -> list[str]:
        """The fields of a line, right-justified; a lost or added character shifts them, and that is an
        error.
        """
        fields = [line[i : i + width] for i in range(0, len(line), width)]
        if (
            len(fields) < least
            or len(line) % width
            or not all(re.fullmatch(pattern, field) for field in fields)
        ):
            raise InputError(self.where, f"{line[:60]!r}", f"at least {least} numbers {form}", EXPORT)
        return fields


def blocks(path: Path) -> Iterator[Block]:
    """Every dataset of a universal file but 58 and 58b; InputError for a missing, broken or foreign file."""
    return (block for block in _datasets(path) if block is not None)


def has_shapes_alone(path: Path) -> bool:
    """Whether a universal file has mode shapes (55, 2414) and no function (58, 58b); InputError as
    `blocks`.
    """
    numbers = {58 if block is None else block.number for block in _datasets(path)}
    return bool(numbers & {55, 2414}) and 58 not in numbers


def has_functions(path: Path) -> bool:
    """Whether a universal file has functions (58, 58b); InputError as `blocks`."""
    return any(block is None for block in _datasets(path))


def _datasets(path: Path) -> Iterator[Block | None]:
    """Every dataset, None for a function."""
    cursor = Cursor(read_bytes(path, "a universal file"), str(path))
    for number, binary in cursor.datasets():
        if binary:
            _pass_binary(cursor, binary)
            yield None
            continue
        first = cursor.line + 1 if cursor.line else 0
        if number == 58:
            cursor.skip_rest()
            yield None
        else:
            yield Block(number, cursor.rest(), str(path), first)


def _pass_binary(cursor: Cursor, head: str) -> None:
    """Move behind a 58b dataset, whose length is in record 7."""
    header = [cursor.text() for _ in range(11)]
    try:
        kind, count, spacing = (int(header[6][i : i + 10]) for i in (0, 10, 20))
    except ValueError as error:
        raise InputError(
            cursor.where, f"record 7 {header[6][:30]!r} of a binary function", "3I10", EXPORT
        ) from error
    binary_values(cursor, Form(count, kind in (5, 6), kind in (4, 6), spacing == 1), head)

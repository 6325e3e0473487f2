"""The numbers of a dataset 58: ASCII in fixed columns, or binary (58b).

Columns are taken at their word: a lost or added character shifts them, and that is an error here, not another
number.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from itertools import accumulate

import numpy as np
from numpy.typing import NDArray

from identify.core.arrays import Array
from identify.core.errors import InputError
from identify.measured.uff.cursor import EXPORT, Cursor

_BINARY_END = re.compile(rb"(\r\n|\r|\n)?    -1 *(?:\r\n|\r|\n|\Z)")
_ALLOWED = np.isin(np.arange(256), np.frombuffer(b" 0123456789+-.eEdD", np.uint8))
_NO_NUMBER = re.compile(rb" *[+-]?(nan|inf)(?![a-z])", re.IGNORECASE)
_EXPONENT = bytes.maketrans(b"Dd", b"Ee")


@dataclass(frozen=True)
class Form:
    """What record 7 announces: count points of a real or complex function, in single or double precision,
    even or uneven.
    """

    count: int
    complex: bool
    double: bool
    even: bool

    @property
    def columns(self) -> int:
        """Numbers stored for each point."""
        return (1 - self.even) + (1 + self.complex)

    def layouts(self) -> list[tuple[int, ...]]:
        """Widths of the numbers on a line: that of the standard (record 12) first, then what some writers use
        for double uneven data.
        """
        if not self.double:
            return [(13,) * 6]
        if self.even:
            return [(20,) * 4]
        return [(13, 20, 20) if self.complex else (13, 20, 13, 20), (20,) * 4, (20,) * self.columns]

    def dtypes(self, order: str) -> list[np.dtype[np.void]]:
        """One binary point: all numbers alike or, with double uneven data of some writers, a single-precision
        abscissa.
        """
        real = order + ("f8" if self.double else "f4")
        heads = [real, order + "f4"] if self.double and not self.even else [real]
        return [
            np.dtype([(f"c{i}", head if i == 0 else real) for i in range(self.columns)]) for head in heads
        ]


def binary_values(cursor: Cursor, form: Form, head: str) -> Array:
    """The values behind a 58b header as (count, columns); head is its dataset line.

    The number of bytes is computed and compared with the one announced, of which some writers count one
    number for every point, or a line end behind it. Which of several layouts it is shows by where the closing
    -1 stands; InputError where it stands nowhere, and where a line end in front of it may be data or not.
    """
    fields = head[7:].split()[:3]
    if fields not in (["1", "2", "11"], ["2", "2", "11"]):
        found = f"58b with byte order, number format and header lines {fields}"
        raise InputError(
            cursor.where, found, "order 1 or 2, format 2 (IEEE 754), 11 lines", "export the file as ASCII"
        )
    for dtype in form.dtypes("<" if fields[0] == "1" else ">"):
        end = _BINARY_END.match(cursor.data, cursor.at + form.count * dtype.itemsize)
        if end is not None:
            _check_length(cursor, form, head, (form.count * dtype.itemsize, end[1] or b""))
            raw = np.frombuffer(cursor.data, dtype, form.count, cursor.at)
            with np.errstate(invalid="ignore"):  # of a signalling NaN, which is refused like any other
                table = np.stack([raw[name].astype(float) for name in dtype.names or ()], axis=1)
            good = np.isfinite(table).all(axis=1)
            good[:1] |= form.even or np.isfinite(table[0, 0])  # an FRF may be no number at 0 Hz
            if not good.all():
                raise InputError(
                    cursor.where, f"value {int(np.argmin(good)) + 1} is not finite", "a number", EXPORT
                )
            cursor.skip_binary(end.end())
            table[0, ~np.isfinite(table[0])] = np.nan
            return table
    found = f"{form.count} binary values are not followed by -1"
    raise InputError(
        cursor.where, found, "that many values", "transfer the file in binary mode or export it again"
    )


def _check_length(cursor: Cursor, form: Form, head: str, found: tuple[int, bytes]) -> None:
    """Raise an InputError where the bytes of a 58b record, and the line end behind them, are not those that
    its header and the records before it lead to expect.

    A line end that is the last byte of the data may stand behind data of which a byte was lost: it passes
    only where earlier records have shown that this file writes none there.
    """
    length, line_end = found
    fields = head[7:].split()
    announced = int(fields[3]) if len(fields) > 3 and fields[3].isdecimal() else -1
    if announced not in (
        length,
        length + len(line_end),
        length + 1,
        length + 2,
        form.count * (8 if form.double else 4),
    ):
        wrong = f"{fields[3:4]} bytes announced, {length} in the record"
        raise InputError(cursor.where, wrong, "the same number", EXPORT)
    before, cursor.binary_end = cursor.binary_end, line_end
    if before is not None and before != line_end:
        wrong = f"binary data that end with {line_end!r} where those before end with {before!r}"
        raise InputError(cursor.where, wrong, "the same throughout: a byte is lost or added", EXPORT)
    last = cursor.data[cursor.at + length - 1 :][:1]
    if before is None and (last, line_end) in ((b"\n", b""), (b"\r", b""), (b"\r", b"\n")):
        wrong = "binary data whose last byte is a line end: a byte before it may be lost"
        raise InputError(cursor.where, wrong, "all values", "transfer it again or export it as ASCII")


def ascii_values(cursor: Cursor, form: Form) -> Array:
    """The values of record 12 as (count, columns); InputError naming the line where they are not in their
    columns; the first point may be no number, as an FRF at 0 Hz, and is NaN then.
    """
    total, first_line = form.count * form.columns, cursor.line + 1
    start = cursor.at
    first = cursor.next().rstrip()
    layout = next(
        (widths for widths in form.layouts() if sum(widths[:total]) == len(first)), form.layouts()[0]
    )
    point = slice(0 if form.even else layout[0], sum(layout[: form.columns]))
    no_number = _NO_NUMBER.search(first[point]) is not None
    first = first[: point.start] + _NO_NUMBER.sub(_zero, first[point]) + first[point.stop :]
    rows = -(-total // len(layout))
    most = cursor.alike(start, rows - 2) if rows > 2 else []
    lines = [first, *most, *(cursor.next().rstrip() for _ in range(rows - 1 - len(most)))]
    last = total - (rows - 1) * len(layout)
    for i, line in enumerate(lines):
        expected = sum(layout if i < rows - 1 else layout[:last])
        if line.strip() == b"-1":
            found = f"the dataset ends before its {form.count} values"
            raise InputError(_at(cursor, first_line + i), found, f"{rows} lines of values", EXPORT)
        if len(line) != expected:
            found = f"values in {len(line)} columns, shifted or missing"
            raise InputError(_at(cursor, first_line + i), found, f"{expected} columns", EXPORT)
    lines[-1] = lines[-1].ljust(sum(layout))
    block = np.frombuffer(b"".join(lines), np.uint8).reshape(rows, -1)
    table = _table(cursor, block, layout, (total, first_line)).reshape(form.count, form.columns)
    if no_number:
        table[0, 1 - form.even :] = np.nan
    return table


def _zero(found: re.Match[bytes]) -> bytes:
    """A 0 in the columns of what is no number."""
    return b"0".rjust(len(found[0]))


def _table(
    cursor: Cursor, block: NDArray[np.uint8], layout: tuple[int, ...], extent: tuple[int, int]
) -> Array:
    """The first `total` numbers of a block of characters (rows, width), row by row; extent: total and number
    of the first line.
    """
    total, first_line = extent
    if len(set(layout)) == 1:
        return numbers(cursor, block.reshape(-1, layout[0])[:total], first_line, len(layout))
    table = np.zeros((len(block), len(layout)))
    for i, (end, width) in enumerate(zip(accumulate(layout), layout, strict=True)):
        present = -(-(total - i) // len(layout))
        table[:present, i] = numbers(cursor, block[:present, end - width : end], first_line)
    return table.reshape(-1)[:total]


def numbers(cursor: Cursor, fields: NDArray[np.uint8], first_line: int, per_line: int = 1) -> Array:
    """Numbers (n,) from right-justified characters (n, width), exponents with E or D.

    per_line of them stand on a line; InputError naming the line of the first that is no number.
    """
    blank = fields == ord(" ")
    bad = ~_ALLOWED[fields].all(axis=1) | (blank[:, 1:] & ~blank[:, :-1]).any(axis=1) | blank[:, -1]
    texts = np.frombuffer(np.ascontiguousarray(fields).tobytes().translate(_EXPONENT), f"S{fields.shape[1]}")
    if not bad.any():
        try:
            return np.asarray(texts.astype(np.float64))
        except ValueError:
            bad = np.array(
                [
                    re.fullmatch(rb" *[+-]?(\d+\.?\d*|\.\d+)(E[+-]?\d+)?", text.upper()) is None
                    for text in texts
                ]
            )
    index = int(np.argmax(bad))
    found = f"{texts[index].decode('latin-1')!r} in the columns of a number"
    raise InputError(
        _at(cursor, first_line + index // per_line),
        found,
        "a right-justified number",
        f"{EXPORT}, without NaN",
    )


def _at(cursor: Cursor, line: int) -> str:
    """Where a line before the cursor is."""
    return f"{cursor.name}, dataset {cursor.dataset}" + (f", line {line}" if cursor.line else "")

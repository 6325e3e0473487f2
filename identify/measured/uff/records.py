"""Datasets 58, 58b and 164 of universal files, taken apart; what they mean is said in `read`, how numbers
stand there in `values`.

Formats: SDRC universal dataset 58 (23-Apr-1993), 58b (UC-SDRL) and 164 (19-Aug-1987).  pyuff is not used for
them because it takes a short record for a whole one, loses a last set without its end, and cuts binary data
at a chance `    -1`; the tests read the same files by both.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from itertools import accumulate, pairwise
from pathlib import Path

import numpy as np

from identify.core.arrays import Array, Complex
from identify.core.errors import InputError
from identify.core.files import read_bytes
from identify.measured.channel import Channel
from identify.measured.uff.cursor import EXPORT, Cursor
from identify.measured.uff.values import Form, ascii_values, binary_values, numbers
from identify.measured.units import Foreign

_INTEGER = re.compile(r" *-?\d+")
_HEADER_LINES = 11
_LONGEST_NAMES = 200
"""Letters beyond their columns that two names may have."""


@dataclass(frozen=True)
class Axis:
    """Specific data type code and unit label ("" where NONE) of an abscissa, ordinate or denominator."""

    code: int
    unit: str


@dataclass(frozen=True)
class Record58:
    """One function at nodal degrees of freedom in the file's units: x (n,), values (n,) real or complex;
    where names it in the file; ends: node and direction code of response and reference, as they stand there.
    """

    where: str
    function: int
    ends: tuple[int, int, int, int]
    x: Array
    values: Array | Complex
    abscissa: Axis
    ordinate: Axis
    denominator: Axis

    @property
    def response(self) -> Channel:
        """Where the response was measured; InputError for a place that no structure has."""
        return _channel(*self.ends[:2], self.where)

    @property
    def reference(self) -> Channel:
        """Where the force acted; InputError as `response`."""
        return _channel(*self.ends[2:], self.where)


@dataclass(frozen=True)
class UffFile:
    """The records of type 58 in the order of the file, and what one unit of length (m) and force (N) is by
    dataset 164, or None; others: the numbers of datasets of other types.
    """

    records: list[Record58]
    length: float | None = None
    force: float | None = None
    others: tuple[int, ...] = ()


def read_records(path: Path) -> UffFile:
    """All records of type 58 and the units of dataset 164; other datasets are passed over.

    InputError, naming dataset and line, for what is truncated, shifted, not a number or not a universal file.
    """
    cursor = Cursor(read_bytes(path, "a universal file"), str(path))
    records: list[Record58] = []
    length = force = None
    others: list[int] = []
    for number, binary in cursor.datasets(whole=True):
        if number == 58:
            records.append(_record58(cursor, binary))
            continue
        lines = cursor.rest()
        others.append(number)
        if number != 164:
            continue
        found = _units164(lines, cursor.where)
        if length is not None and force is not None and not np.allclose(found, (length, force), rtol=1e-9):
            said = "1 m = {:g} and 1 N = {:g} of the file, {:g} and {:g} before".format(
                *(1 / np.array([*found, length, force]))
            )
            raise InputError(cursor.where, said, "one dataset 164", "remove the wrong one")
        length, force = found
    return UffFile(records, length, force, tuple(others))


def _units164(lines: list[str], where: str) -> tuple[float, float]:
    """One unit of length in m and of force in N: `to convert from universal file units to SI divide by` what
    stands in record 2.
    """
    try:
        length, force = (float(lines[1][i : i + 25].upper().replace("D", "E")) for i in (0, 25))
    except (IndexError, ValueError) as error:
        raise InputError(
            where, "units (dataset 164) that cannot be read", "3D25.17 in the second line", EXPORT
        ) from error
    if not (0 < length < np.inf and 0 < force < np.inf):
        raise InputError(
            where, f"unit factors {length:g} and {force:g} in dataset 164", "positive numbers", EXPORT
        )
    return 1 / length, 1 / force


def _record58(cursor: Cursor, binary_head: str) -> Record58:
    """The dataset behind its number line, up to and with the closing -1; binary_head is that line, or "" for
    ASCII.
    """
    where = cursor.where
    header = [cursor.text() for _ in range(_HEADER_LINES)]
    function, ends = _dofs(header[5], where)
    form = _form(header[6], where)
    if binary_head:
        table = binary_values(cursor, form, binary_head)
    else:
        table = ascii_values(cursor, form)
        if cursor.next().strip() != b"-1":
            raise InputError(
                cursor.where,
                f"more than the announced {form.count} values, or no -1 behind them",
                "-1",
                EXPORT,
            )
    if form.even:
        start, step = _start_and_step(cursor, header[6][30:].rstrip(), where)
        x: Array = start + step * np.arange(form.count, dtype=np.float64)
    else:
        x, table = table[:, 0].copy(), table[:, 1:]
    if not np.isfinite(table[0]).all() and (x[0] != 0 or function == 1):
        raise InputError(where, "value 1 is not finite", "a number", EXPORT)
    return Record58(
        where=where,
        function=function,
        ends=ends,
        x=x,
        values=table[:, 0] + 1j * table[:, 1] if form.complex else table[:, 0].copy(),
        abscissa=_axis(header[7], where),
        ordinate=_axis(header[8], where),
        denominator=_axis(header[9], where),
    )


def _form(line: str, where: str) -> Form:
    """Fields 1 to 3 of record 7, 3I10."""
    kind, count, spacing = (_integer(line[i : i + 10], where, 10) for i in (0, 10, 20))
    if kind not in (2, 4, 5, 6) or spacing not in (0, 1) or count < 1:
        found = f"ordinate type {kind}, {count} values, spacing {spacing} in record 7"
        raise InputError(where, found, "type 2, 4, 5 or 6, at least one value, spacing 0 or 1", EXPORT)
    return Form(count, kind in (5, 6), kind in (4, 6), spacing == 1)


def _start_and_step(cursor: Cursor, text: str, where: str) -> tuple[float, float]:
    """First abscissa and its step from the end of record 7, 3E13.5; the last field, which is not used, shows
    that nothing is shifted.
    """
    try:
        fields = np.frombuffer(text.encode("ascii"), np.uint8).reshape(-1, 13)
        start, step, *rest = numbers(cursor, fields, 0).tolist()
    except (InputError, ValueError) as error:
        raise InputError(where, f"{text!r} for the abscissa in record 7", "3E13.5", EXPORT) from error
    if len(rest) > 1:
        raise InputError(where, f"{text!r} for the abscissa in record 7", "3E13.5", EXPORT)
    return start, step


def _integer(field: str, where: str, width: int) -> int:
    """A right-justified integer that fills its columns."""
    if len(field) != width or _INTEGER.fullmatch(field) is None:
        raise InputError(
            where, f"{field!r} in the header", f"an integer that ends in the last of {width} columns", EXPORT
        )
    return int(field)


def _dofs(line: str, where: str) -> tuple[int, tuple[int, int, int, int]]:
    """Function type, node and direction of response and reference of record 6, 2(I5,I10),2(1X,10A1,I10,I4);
    names beyond ten letters shift what follows.
    """
    line = line.rstrip()
    extra = len(line) - 80
    for first in range(min(extra, _LONGEST_NAMES) + 1):
        widths = (5, 10, 5, 10, 1, 10 + first, 10, 4, 1, 10 + extra - first, 10, 4)
        fields = [line[a:b] for a, b in pairwise(accumulate(widths, initial=0))]
        names_fit = all(len(name) == 10 or name == name.strip() for name in (fields[5], fields[9]))
        integers = [fields[i] for i in (0, 1, 2, 3, 6, 7, 10, 11)]
        if (
            names_fit
            and fields[4] == fields[8] == " "
            and all(_INTEGER.fullmatch(field) for field in integers)
        ):
            node, direction, reference, along = map(int, integers[4:])
            return int(integers[0]), (node, direction, reference, along)
    raise InputError(where, f"record 6 {line!r} is not in its columns", "2(I5,I10),2(1X,10A1,I10,I4)", EXPORT)


def _channel(node: int, direction: int, where: str) -> Channel:
    """Node and direction code; Foreign for a node below 0, which exporters give to what stands elsewhere."""
    found = f"node {node} with direction {direction}"
    if abs(direction) > 6:
        raise InputError(where, found, "a direction from -6 to 6")
    if node < 0:
        raise Foreign(where, found, "a node of 0 or more", "number its place, or export without it")
    return Channel(node, direction)


def _axis(line: str, where: str) -> Axis:
    """Records 8 to 10, I10,3I5,2(1X,20A1)."""
    code = _integer(line[:10], where, 10)
    if line[25:26].strip() or line[46:47].strip():
        raise InputError(
            where, f"axis record {line.rstrip()!r} is not in its columns", "I10,3I5,2(1X,20A1)", EXPORT
        )
    unit = line[47:67].strip()
    return Axis(code, "" if unit.upper() == "NONE" else unit)

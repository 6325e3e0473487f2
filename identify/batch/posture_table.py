"""Tables of postures: CSV files with a line per posture, angles in the columns joint1_deg, joint2_deg, ..."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from identify.core.arrays import Array
from identify.core.errors import InputError
from identify.core.text_input import read_csv
from identify.core.yaml_input import parse_yaml, plain

ANGLE = re.compile(r"joint(\d+)_deg")
"""The name of a column of joint angles."""
Row = dict[str, Any]


def read_table(path: Path) -> list[tuple[int, Row]]:
    """The rows of a CSV file with their lines: cells are read as in YAML (numbers, texts, [lists]), empty
    ones are left out.

    Raises InputError for a file that cannot be read, or a row of another length than the header.
    """
    rows = [
        (number, cells)
        for number, _, cells in read_csv(path, "a CSV file with a header", skip_space=True)
        if cells
    ]
    if len(rows) < 2:
        raise InputError(str(path), "no rows", "a header and a line per posture")
    (first, header), found = rows[0], []
    twice = next((key for key in header if header.count(key) > 1), None)
    if twice is not None:
        raise InputError(f"{path} line {first}", f"two columns {twice!r}", "each column once")
    for number, cells in rows[1:]:
        where = f"{path} line {number}"
        if len(cells) != len(header):
            raise InputError(where, f"{len(cells)} cells", f"{len(header)}, as in the header")
        read = {
            key: plain(parse_yaml(cell, f"{where}, {key}", "numbers or plain text"))
            for key, cell in zip(header, cells, strict=True)
            if cell
        }
        found.append((number, read))
    return found


def posture_of(row: Row) -> list[Any]:
    """The joint angles of a table's row, deg, in the order of the joints; empty where it has no such
    columns.
    """
    return [angle for _, angle in sorted(_angles(row).items())]


def read_postures(path: Path, joints: int, more: Sequence[str] = ()) -> tuple[list[str], Array, Array]:
    """Names, postures (n, joints), rad, and the columns `more` (n, more) of a table; `name` may be left out.

    InputError where an angle of the robot or a number of those columns is missing, or there are others.
    """
    expected = ", ".join([f"numbers in the columns joint1_deg to joint{joints}_deg", *more])
    names, found = [], []
    for line, row in read_table(path):
        numbers = [*posture_of(row), *(row.get(key) for key in more)]
        if set(_angles(row)) != set(range(1, joints + 1)) or not all(_number(value) for value in numbers):
            said = ", ".join(f"{key} {value}" for key, value in row.items() if key != "name")
            raise InputError(f"{path} line {line}", said or "no angles", expected)
        names.append(str(row.get("name", f"line{line}")))
        found.append(numbers)
    columns = np.array(found, dtype=float)
    return names, np.deg2rad(columns[:, :joints]), columns[:, joints:]


def _angles(row: Row) -> dict[int, Any]:
    """The angles of a row by the number of the joint."""
    return {int(match[1]): value for key, value in row.items() if (match := ANGLE.fullmatch(key))}


def _number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and bool(np.isfinite(value))

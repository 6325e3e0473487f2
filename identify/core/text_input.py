"""The border for text: UTF-8 without control characters, of a stated size; CSV cells with their lines."""

from __future__ import annotations

import csv
import io
import math
import re
from collections.abc import Iterable
from pathlib import Path

from identify.core.errors import InputError
from identify.core.files import MEBIBYTE, read_bytes

_FORBIDDEN = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\u2028\u2029\ufffe\uffff]")
_NUMBER = re.compile(r"[+-]?(\d+[.,]?\d*|[.,]\d+)([eE][+-]?\d+)?|[+-]?(nan|inf)", re.IGNORECASE)
_SEPARATOR_LINE = re.compile(r"\s*sep=.\s*", re.IGNORECASE)
"""What Excel writes first where the separator is not that of its language."""
LARGEST_CSV = 1024 * MEBIBYTE
LARGEST = 1e60
"""Of numbers from outside: products of a few larger ones are none any more."""


def read_text(path: Path, expected: str, largest: int = MEBIBYTE, fix: str = "check the path") -> str:
    """The text of a file, lines ending in LF, without a byte order mark; InputError as `read_bytes`, and with
    the line for what is not UTF-8 and for control characters.
    """
    content = read_bytes(path, expected, largest, fix)
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        found = f"byte 0x{content[error.start]:02x}, which is not UTF-8: the file cannot be read"
        raise InputError(f"{path} line {line}", found, f"{expected} in UTF-8", "save it as UTF-8") from error
    text = text.replace("\r\n", "\n").replace("\r", "\n")
    found_at = _FORBIDDEN.search(text)
    if found_at is not None:
        line = text.count("\n", 0, found_at.start()) + 1
        raise InputError(
            f"{path} line {line}", control(found_at[0]), f"{expected} in plain text", "remove it"
        )
    return text


def has_control(text: str) -> str:
    """What is said of the first control character in a piece of text, line ends included; empty where it has
    none.
    """
    found = _FORBIDDEN.search(text.replace("\n", "\x00").replace("\r", "\x00"))
    return control(found[0]) if found else ""


def control(character: str) -> str:
    """A control character in words."""
    return f"the control character U+{ord(character):04X}"


def read_csv(path: Path, expected: str, *, skip_space: bool = False) -> list[tuple[int, str, list[str]]]:
    """Number, text and cells of every line of a CSV file that is not blank; a line that begins with # has no
    cells; InputError as `read_text`, and for a cell beyond the limit of the csv module.

    Cells are separated by what the first line of them shows: semicolons or tabs, between which numbers may
    have decimal commas, spaces between numbers, or else commas.  Text and numbers are returned as with
    commas and decimal points.
    """
    lines = read_text(path, expected, LARGEST_CSV).split("\n")
    separator = _separator(next((line for line in lines if _has_cells(line)), ""))
    rows = []
    for number, line in enumerate(lines, start=1):
        if line.strip() and not _SEPARATOR_LINE.fullmatch(line):
            cells = _cells(f"{path} line {number}", line, separator, skip_space)
            rows.append((number, line if separator == "," or not cells else joined(cells), cells))
    return rows


def joined(cells: list[str]) -> str:
    """Cells as a line of a CSV file with commas."""
    return csv_text([cells]).removesuffix("\n")


def csv_text(rows: Iterable[Iterable[object]]) -> str:
    """Rows as the text of a CSV file with commas."""
    stream = io.StringIO()
    csv.writer(stream, lineterminator="\n").writerows(rows)
    return stream.getvalue()


def is_number(text: str) -> bool:
    """Whether a cell is a number, of any size, as spreadsheets and programs write it."""
    return _NUMBER.fullmatch(text) is not None


def finite(where: str, column: str, text: str) -> float:
    """The number of a cell; InputError for none, and for one that is too large."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not abs(value) < LARGEST:
        raise InputError(where, f"{column} is {text!r}", "a finite number")
    return value


def node_number(where: str, text: str) -> int:
    """The number of a node; InputError for anything else."""
    if not (text.isascii() and text.isdigit() and len(text) <= 10 and int(text) > 0):
        raise InputError(where, f"node {text!r}", "a positive whole number of at most ten digits")
    return int(text)


def _has_cells(line: str) -> bool:
    return bool(line.strip()) and not line.startswith("#") and not _SEPARATOR_LINE.fullmatch(line)


def _separator(line: str) -> str:
    """Of the first line with cells; a space stands for any white space."""
    words = line.split()
    if len(words) > 1 and "\t" not in line and all(map(is_number, words)):
        return " "
    return next((one for one in ";\t" if one in line), ",")


def _cells(where: str, line: str, separator: str, skip_space: bool) -> list[str]:
    if line.startswith("#"):
        return []
    if separator == " ":
        cells = line.split()
    else:
        try:
            cells = next(csv.reader([line], delimiter=separator, skipinitialspace=skip_space))
        except csv.Error as error:
            found = f"cells that cannot be read ({error})"
            raise InputError(where, found, "cells separated by commas", "export the file again") from error
    cells = [cell.strip() for cell in cells]
    return cells if separator == "," else [_with_point(cell) for cell in cells]


def _with_point(cell: str) -> str:
    """A number with a decimal comma as one with a point; any other cell as it is."""
    return cell.replace(",", ".") if "," in cell and is_number(cell) else cell

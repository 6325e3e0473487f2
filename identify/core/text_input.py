"""The border for text: UTF-8 without control characters, of a stated size; CSV cells with their lines."""

from __future__ import annotations

import csv
import re
from pathlib import Path

from identify.core.errors import InputError
from identify.core.files import MEBIBYTE, read_bytes

_FORBIDDEN = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\u2028\u2029\ufffe\uffff]")
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
    """
    text = read_text(path, expected, LARGEST_CSV)
    rows = []
    for number, line in enumerate(text.split("\n"), start=1):
        if line.strip():
            rows.append((number, line, _cells(f"{path} line {number}", line, skip_space)))
    return rows


def _cells(where: str, line: str, skip_space: bool) -> list[str]:
    if line.startswith("#"):
        return []
    try:
        return [cell.strip() for cell in next(csv.reader([line], skipinitialspace=skip_space))]
    except csv.Error as error:
        found = f"cells that cannot be read ({error})"
        raise InputError(where, found, "cells separated by commas", "export the file again") from error

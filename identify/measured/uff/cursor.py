"""A place in the bytes of a universal file: lines, the `-1` between datasets, and where in the file an error
is.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from identify.core.errors import InputError

_LINE = re.compile(rb"([^\r\n]*)(?:\r\n|\r|\n|\Z)")
_CLOSING = re.compile(rb"[\r\n][ \t]*-1[ \t]*(?:\r\n|\r|\n|\Z)")
EXPORT = "export the file again as UFF 58"
"""What to do about a damaged universal file."""


class Cursor:
    """Reads `data` forward; dataset counts datasets from 1, line lines, and is 0 once binary data made
    counting them pointless; binary_end is what stands between binary data and their -1 in this file.
    """

    def __init__(self, data: bytes, name: str) -> None:
        self.data, self.name = data.removeprefix(b"\xef\xbb\xbf"), name
        self.at = self.line = self.dataset = 0
        self._counting = True
        self.binary_end: bytes | None = None

    @property
    def where(self) -> str:
        """File, dataset and line as errors name them."""
        dataset = f", dataset {self.dataset}" if self.dataset else ""
        return self.name + dataset + (f", line {self.line}" if self.line else "")

    def next(self) -> bytes:
        """The next line without its end (LF, CR LF or CR); InputError at the end of the file."""
        match = _LINE.match(self.data, self.at)
        if match is None or self.at >= len(self.data):
            raise InputError(
                self.where,
                "the file ends inside a dataset",
                "a dataset closed by -1",
                "transfer or export it again",
            )
        self.at = match.end()
        self.line += self._counting
        return match[1]

    def text(self) -> str:
        """The next line as text; vendors write UTF-8 or Latin-1."""
        line = self.next()
        try:
            return line.decode()
        except UnicodeDecodeError:
            return line.decode("latin-1")

    def skip_binary(self, end: int) -> None:
        """Move to byte `end`, beyond data that have no lines."""
        self.at, self.line, self._counting = end, 0, False

    def opens_dataset(self) -> bool:
        """Move behind the next opening `-1`; False at the end of the file; InputError where anything else
        stands there.
        """
        while self.at < len(self.data):
            line = self.next().strip(b" \t\x1a\x00")
            if line == b"-1":
                self.dataset += 1
                return True
            if line:
                raise InputError(
                    self.where,
                    f"{line[:40].decode('latin-1')!r} between datasets",
                    "-1, which opens a dataset",
                    EXPORT,
                )
        return False

    def datasets(self, whole: bool = False) -> Iterator[tuple[int, str]]:
        """Number of each dataset, and its first line where binary data follow, else nothing; the cursor
        stands behind that line.  whole: whether the number must fill its columns.
        """
        while self.opens_dataset():
            head = self.text()
            match = re.match(r"( {0,5}\d{1,6})(b?)(?= |$)", head, re.IGNORECASE)
            if match is None or (whole and len(match[1]) != 6):
                raise InputError(
                    self.where,
                    f"{head[:20]!r} in place of a dataset number",
                    "a number in columns 1 to 6",
                    EXPORT,
                )
            yield int(match[1]), head if match[2] else ""
        if self.dataset == 0:
            raise InputError(self.name, "no dataset in the file", "a universal file (UFF)")

    def alike(self, start: int, count: int) -> list[bytes]:
        """The next lines at once, without their ends, where they are as long as the line from byte `start` up
        to here, end like it and in no blank; none, and no step, where they do not.
        """
        line = self.data[start : self.at]
        size, width = len(line.rstrip(b"\r\n")), len(line)
        found = self.data[self.at : self.at + count * width]
        rows = [found[first : first + width] for first in range(0, len(found), max(width, 1))]
        ends = found.count(b"\r") + found.count(b"\n")
        if size == 0 or len(found) < count * width or ends != count * (width - size):
            return []
        if any(row[size:] != line[size:] or row[size - 1 : size].isspace() for row in rows):
            return []
        if found.endswith(b"\r") and self.data.startswith(b"\n", self.at + len(found)):
            return []
        self.at += len(found)
        self.line += self._counting * count
        return [row[:size] for row in rows]

    def skip_rest(self) -> None:
        """Move behind the `-1` that closes the dataset, as `rest` does."""
        closing = _CLOSING.search(self.data, max(self.at - 1, 0))
        if closing is None:
            self.rest()  # which says what is wrong
            return
        passed = self.data[self.at : closing.end()]
        ends = passed.count(b"\n") + passed.count(b"\r") - passed.count(b"\r\n")
        self.line += self._counting * (ends + (not passed.endswith((b"\n", b"\r"))))
        self.at = closing.end()

    def rest(self) -> list[str]:
        """The lines up to the `-1` that closes the dataset; the cursor stands behind it."""
        lines: list[str] = []
        while (line := self.text()).strip() != "-1":
            lines.append(line)
        return lines

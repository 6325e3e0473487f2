"""The file beside an output that keeps what a run has done so far: `x.h5.part` beside `x.h5`.

It only grows, a record at a time, each with a checksum over itself and all before it.  So whatever ends the
run, and whatever is done to the file, the records up to the first damage are known to be those of the run;
what follows is dropped, and said.

Layout: the magic, then records: length (4 bytes, little endian), checksum (16), content.  The first is the
key of the run.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import struct
import time
import warnings
from pathlib import Path

from identify.core.errors import InputError

_MAGIC = b"identify-part/1\n"
_LENGTH = struct.Struct("<I")
_CHECKSUM = 16
_EVERY_S = 1.0
_FIX = "make room and resume with `--resume`; what was computed until now is kept"


class DamagedPart(UserWarning):
    """The end of a part file was damaged and is dropped."""


class PartFile:
    """What a run of `key` has done so far, in `records`; on disk from the first flush on."""

    def __init__(self, path: Path, key: str) -> None:
        self.path, self.key = path, key
        self.records: list[bytes] = []
        self._marks: list[tuple[int, bytes]] = []  # where each entry ends, and the checksum up to there
        self._waiting = bytearray(_MAGIC)
        self._on_disk, self._saved = 0, time.monotonic()
        self._enter(key.encode())

    @classmethod
    def read(cls, path: Path) -> PartFile | None:
        """The part file at `path` up to its first damage; None where there is none, or not even its key is
        whole.  Warns of what is left out.
        """
        try:
            found = path.read_bytes()
        except FileNotFoundError:
            return None
        except OSError as error:
            raise InputError(str(path), f"cannot be read ({error})", "the part file of a run") from error
        entries, whole = _entries(found)
        if whole < len(found):
            kept = f"the {max(len(entries) - 1, 0)} records before them are kept"
            said = f"{path}: the last {len(found) - whole} of {len(found)} bytes are damaged; {kept}"
            warnings.warn(said, DamagedPart, stacklevel=2)
        if not entries:
            return None
        part = cls(path, entries[0].decode())
        for record in entries[1:]:
            part._enter(record)
        part.records = entries[1:]
        part._waiting.clear()
        part._on_disk = whole
        return part

    def append(self, record: bytes) -> None:
        """Keep a record, on disk within about a second; InputError where the disk is full."""
        self._enter(record)
        self.records.append(record)
        if time.monotonic() - self._saved > _EVERY_S:
            self.flush()

    def keep(self, count: int) -> None:
        """Forget all but the first `count` records."""
        end, _ = self._marks[count]
        del self.records[count:], self._marks[count + 1 :]
        del self._waiting[max(end - self._on_disk, 0) :]
        self._on_disk = min(self._on_disk, end)

    def flush(self) -> None:
        """Put on disk what is not there yet; where that fails, the file ends with its last whole record."""
        self._saved = time.monotonic()
        if not self._waiting:
            return
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            with self.path.open("r+b" if self._on_disk else "wb", buffering=0) as file:
                file.truncate(self._on_disk)  # the torn end of a write that failed
                file.seek(self._on_disk)
                left = memoryview(bytes(self._waiting))
                while left:
                    left = left[file.write(left) :]
                os.fsync(file.fileno())
        except OSError as error:
            with contextlib.suppress(OSError):
                os.truncate(self.path, self._on_disk)
            raise InputError(
                str(self.path), f"cannot be written ({error})", "room on the disk", _FIX
            ) from error
        self._on_disk += len(self._waiting)
        self._waiting.clear()

    def remove(self) -> None:
        """Take the file away: its run is finished, or nobody wants to resume it."""
        with contextlib.suppress(FileNotFoundError):
            self.path.unlink()

    def _enter(self, content: bytes) -> None:
        end, before = self._marks[-1] if self._marks else (len(_MAGIC), b"")
        checksum = _checksum(before, content)
        self._waiting += _LENGTH.pack(len(content)) + checksum + content
        self._marks.append((end + _LENGTH.size + _CHECKSUM + len(content), checksum))


def _checksum(before: bytes, content: bytes) -> bytes:
    """Of a record and, through the checksum before it, of all before it."""
    return hashlib.blake2b(before + content, digest_size=_CHECKSUM).digest()


def _entries(found: bytes) -> tuple[list[bytes], int]:
    """The key and the records of a part file up to the first damage, and where that is."""
    if not found.startswith(_MAGIC):
        return [], 0
    entries: list[bytes] = []
    at, before = len(_MAGIC), b""
    while at + _LENGTH.size + _CHECKSUM <= len(found):
        first = at + _LENGTH.size + _CHECKSUM
        length = _LENGTH.unpack_from(found, at)[0]
        content = found[first : first + length]
        before = _checksum(before, content)
        if len(content) != length or found[at + _LENGTH.size : first] != before:
            break
        entries.append(content)
        at = first + len(content)
    return entries, at if entries else 0

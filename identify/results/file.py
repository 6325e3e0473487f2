"""Result files: one HDF5 layout for all kinds of results, whole at every moment.

Arrays and texts are datasets, numbers attributes, `None` is left out, nested classes are groups.  The root's
attribute `checksum` is over all of them (`identify.results.checksum`).
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

import h5py
import numpy as np

from identify.core import atomic, binary_input
from identify.core.analyses import OF_KIND
from identify.core.errors import InputError
from identify.core.hdf5_tree import tree_of
from identify.core.tree import Group, Unread
from identify.results.checksum import CHECKSUM, checksum
from identify.results.names import ENCODED, group_name
from identify.results.record import record_of

LAYOUT = 1
UNFINISHED = "unfinished"
SUFFIXES = (".h5", ".hdf5")
_A_RESULT = "a result file written by `identify fit`"
_KINDS = {
    **{kind: analysis.holds for kind, analysis in OF_KIND.items()},
    "map-part": "part of a map",
    UNFINISHED: "an interrupted run of an older version",
}
"""What a file of each kind holds, in words."""
T = TypeVar("T")


def check_new(path: Path, what: str, inputs: Iterable[Path], beside: Iterable[Path] = ()) -> None:
    """Raise an InputError where `path` is no place for a result (what: such as "a map"), or where it, a
    report, or another file that is written beside it would take the place of an input.
    """
    if path.suffix not in SUFFIXES:
        raise InputError(
            str(path), f"suffix {path.suffix!r}: not a file for {what}", "a new file in .h5", atomic.ELSEWHERE
        )
    read = {one.resolve() for one in inputs}
    for new in (path, path.with_suffix(".html"), path.with_suffix(".pdf"), *beside):
        if new.resolve() in read:
            found = f"not a file for {what}: an input, which would be overwritten"
            raise InputError(str(new), found, "a new file", atomic.ELSEWHERE)


def check_writable(path: Path) -> None:
    """Raise an InputError where a result cannot be written; what is at `path` stays."""
    atomic.check_writable(path)


def write(result: Any, path: Path) -> None:
    """Write a result whole, with a checksum over all of it.  Raises InputError where it cannot be written.

    It is made in memory and only its bytes go to the disk: where that is full, the HDF5 library takes the
    process down with it.
    """
    with h5py.File(path.name, "w", driver="core", backing_store=False) as file:
        _write_group(file, result)
        file.attrs[CHECKSUM] = checksum(tree_of(file))
        file.flush()
        image = file.id.get_file_image()
    atomic.write_atomically(path, partial(Path.write_bytes, data=image))
    binary_input.wrote(path)


def read(path: Path, kind: type[T]) -> T:
    """Read a result; raises InputError for a file that is none, is damaged, or is one of another layout."""
    tree = binary_input.read_hdf5(path, expected=_A_RESULT)
    layout = tree.attributes.get("layout")
    if layout is None or isinstance(layout, (str, tuple, Unread)) or layout.size != 1 or layout != LAYOUT:
        found = "not a result of identify" if layout is None else f"layout {layout}"
        expected = f"a result file of layout {LAYOUT}"
        raise InputError(str(path), found, expected, "run the fit again with this version")
    stored, wanted = tree.members.get("kind"), kind.KIND  # type: ignore[attr-defined]
    if stored != wanted:
        fix = "see `identify fit --resume`" if UNFINISHED in (stored, wanted) else ""
        what = _KINDS.get(stored, repr(stored)) if isinstance(stored, str) else "no kind of result"
        raise InputError(str(path), f"holds {what}", _KINDS[wanted], fix)
    _check(tree, path)
    return record_of(tree, kind, str(path))


def _check(tree: Group, path: Path) -> None:
    """Raise an InputError where what a file holds is not what was written; files from before there was a
    checksum pass.
    """
    written = tree.attributes.get(CHECKSUM)
    if written is not None and (not isinstance(written, str) or written != checksum(tree)):
        fix = "take it from a copy, or run the study again"
        found = "its content was changed or damaged after it was written"
        raise InputError(str(path), found, "the result", fix)


def kind_of(path: Path) -> str:
    """What a result file holds: `fit`, `modes`, `unfinished`; empty for a file that is no result."""
    try:
        kind = binary_input.read_hdf5(path, ["kind"], _A_RESULT).members.get("kind")
    except InputError:
        return ""
    return kind if isinstance(kind, str) else ""


def _write_group(group: h5py.Group, item: Any) -> None:
    entries = (
        item.items()
        if isinstance(item, dict)
        else ((f.name, getattr(item, f.name)) for f in dataclasses.fields(item))
    )
    for key, value in entries:
        name = group_name(key)
        if value is None:
            continue
        if dataclasses.is_dataclass(value) or isinstance(value, dict):
            inner = group.create_group(name, track_order=True)
            if name != key:
                inner.attrs[ENCODED] = True
            _write_group(inner, value)
        elif isinstance(value, tuple):
            group.create_dataset(
                name, data=np.array(value, dtype=object), dtype=h5py.string_dtype(), shape=(len(value),)
            )
        elif isinstance(value, (np.ndarray, str)):
            group.create_dataset(name, data=value)
        else:
            group.attrs[name] = value

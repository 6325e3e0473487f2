"""Result files: one HDF5 layout for all kinds of results, whole at every moment.

Arrays and texts are datasets, numbers attributes, `None` is left out, nested classes are groups.  The root's
attribute `checksum` is over all of them (`identify.results.checksum`).
"""

from __future__ import annotations

import dataclasses
import types
import typing
from functools import partial
from pathlib import Path
from typing import Any, TypeVar, Union

import h5py
import numpy as np

from identify.core import atomic as whole
from identify.core.analyses import OF_KIND
from identify.core.errors import InputError
from identify.results.checksum import CHECKSUM, checksum
from identify.results.names import ENCODED, group_name, key_of

LAYOUT = 1
UNFINISHED = "unfinished"
_ELSEWHERE = "choose another with `--out`"
_KINDS = {
    **{kind: analysis.holds for kind, analysis in OF_KIND.items()},
    "map-part": "part of a map",
    UNFINISHED: "an interrupted run of an older version",
}
"""What a file of each kind holds, in words."""
T = TypeVar("T")


def check_writable(path: Path) -> None:
    """Raise an InputError where a result cannot be written; what is at `path` stays."""
    whole.check_writable(path, _ELSEWHERE)


def write(result: Any, path: Path) -> None:
    """Write a result whole, with a checksum over all of it.  Raises InputError where it cannot be written.

    It is made in memory and only its bytes go to the disk: where that is full, the HDF5 library takes the
    process down with it.
    """
    with h5py.File(path.name, "w", driver="core", backing_store=False) as file:
        _write_group(file, result)
        file.attrs[CHECKSUM] = checksum(file)
        file.flush()
        image = file.id.get_file_image()
    whole.write_whole(path, partial(Path.write_bytes, data=image), _ELSEWHERE)


def read(path: Path, kind: type[T]) -> T:
    """Read a result; raises InputError for a file that is none, or one of another layout."""
    try:
        with h5py.File(path, "r") as file:
            layout = file.attrs.get("layout")
            if layout != LAYOUT:
                found = "not a result of identify" if layout is None else f"layout {layout}"
                raise InputError(
                    str(path),
                    found,
                    f"a result file of layout {LAYOUT}",
                    "run the fit again with this version",
                )
            stored, wanted = file["kind"][()].decode(), kind.KIND  # type: ignore[attr-defined]
            if stored != wanted:
                fix = "see `identify fit --resume`" if UNFINISHED in (stored, wanted) else ""
                raise InputError(str(path), f"holds {_KINDS.get(stored, stored)}", _KINDS[wanted], fix)
            _check(file, path)
            return _read_group(file, kind)
    except OSError as error:
        raise InputError(
            str(path), f"cannot be read as HDF5 ({error})", "a result file written by `identify fit`"
        ) from error


def _check(file: h5py.File, path: Path) -> None:
    """Raise an InputError where what a file holds is not what was written; files from before there was a
    checksum pass.
    """
    written = file.attrs.get(CHECKSUM)
    if written is not None and written != checksum(file):
        fix = "take it from a copy, or run the study again"
        raise InputError(
            str(path), "its content was changed or damaged after it was written", "the result", fix
        )


def kind_of(path: Path) -> str:
    """What a result file holds: `fit`, `modes`, `unfinished`; empty for a file that is no result."""
    try:
        with h5py.File(path, "r") as file:
            return file["kind"][()].decode() if "kind" in file else ""
    except OSError:
        return ""


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


def _read_group(group: h5py.Group, kind: type[T]) -> T:
    hints = typing.get_type_hints(kind)
    names = [field.name for field in dataclasses.fields(kind)]  # type: ignore[arg-type]
    return kind(**{name: _read_value(group, name, hints[name]) for name in names})


def _read_value(group: h5py.Group, name: str, hint: Any) -> Any:
    if typing.get_origin(hint) in (Union, types.UnionType):
        if name not in group and name not in group.attrs:
            return None
        hint = next(option for option in typing.get_args(hint) if option is not type(None))
    if typing.get_origin(hint) is dict:
        inner = typing.get_args(hint)[1]
        return {
            key_of(key, ENCODED in member.attrs): _read_group(member, inner)
            for key, member in group[name].items()
        }
    if typing.get_origin(hint) is tuple:
        return tuple(text.decode() for text in group[name][()])
    if dataclasses.is_dataclass(hint):
        return _read_group(group[name], typing.cast(type, hint))
    if hint in (int, float, bool):
        return hint(group.attrs[name])
    value = group[name][()]
    return value.decode() if hint is str else value

"""Result files: one HDF5 layout for all kinds of results, whole at every moment.

Arrays and texts are datasets, numbers attributes, `None` is left out, nested classes are groups."""

from __future__ import annotations

import dataclasses
import types
import typing
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, TypeVar, Union

import h5py
import numpy as np

from identify.core import atomic as whole
from identify.core.arrays import Array
from identify.core.errors import InputError

LAYOUT = 1
UNFINISHED = "unfinished"
_ELSEWHERE = "choose another with `--out`"
_KINDS = {
    "fit": "a finished fit",
    "modes": "a modal analysis",
    "discovery": "a search for missing effects",
    "batch": "a batch",
    "map": "a map",
    "map-part": "part of a map",
    "motion": "a simulated or fitted motion",
    "explained": "an explained motion",
    "joints": "identified joints",
    UNFINISHED: "an interrupted run",
}
T = TypeVar("T")


@dataclass(frozen=True)
class Unfinished:
    """A run that is under way or was interrupted: what it would be a run of, and all costs in order
    (`identify.fitting.journal`).
    """

    KIND: ClassVar[str] = UNFINISHED
    layout: int
    kind: str
    key: str
    costs: Array


def unfinished(key: str, costs: Array) -> Unfinished:
    """What is on disk while a run goes on."""
    return Unfinished(LAYOUT, UNFINISHED, key, costs)


def check_writable(path: Path) -> None:
    """Raise an InputError where a result cannot be written; what is at `path` stays."""
    whole.check_writable(path, _ELSEWHERE)


def write(result: Any, path: Path) -> None:
    """Write a result whole.  Raises InputError where the folder cannot be written."""

    def fill(aside: Path) -> None:
        with h5py.File(aside, "w") as file:
            _write_group(file, result)

    whole.write_whole(path, fill, _ELSEWHERE)


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
            return _read_group(file, kind)
    except OSError as error:
        raise InputError(
            str(path), f"cannot be read as HDF5 ({error})", "a result file written by `identify fit`"
        ) from error


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
    for name, value in entries:
        if value is None:
            continue
        if dataclasses.is_dataclass(value) or isinstance(value, dict):
            _write_group(group.create_group(name, track_order=True), value)
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
        return {key: _read_group(member, inner) for key, member in group[name].items()}
    if typing.get_origin(hint) is tuple:
        return tuple(text.decode() for text in group[name][()])
    if dataclasses.is_dataclass(hint):
        return _read_group(group[name], typing.cast(type, hint))
    if hint in (int, float, bool):
        return hint(group.attrs[name])
    value = group[name][()]
    return value.decode() if hint is str else value

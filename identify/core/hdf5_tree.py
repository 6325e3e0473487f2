"""HDF5 files as trees of plain values.  What leads out of the file, does not fit into it or is no number
or text is refused by its name before data are read.

Used in the child process of `binary_input`, and in this process only for files that it has just written.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from identify.core.tree import Group, Unread, Value, numbers, texts

_DEPTH, _OBJECTS, _HOPS = 16, 100_000, 8
_UNPACKING = 1100
"""How much smaller than the data a chunk can be: deflate packs 1032 to 1 at best."""


class Refused(Exception):
    """Where in a file something stands that is not read, and what it is."""

    def __init__(self, place: str, found: str) -> None:
        super().__init__(f"{place}: {found}")
        self.place, self.found = place, found


def read_tree(path: Path, names: Sequence[str] | None = None) -> Group:
    """Everything in a file, or the datasets (or else attributes of the root) of these names, those that are
    there; Refused as above, and whatever h5py raises on damaged files.
    """
    with h5py.File(path, "r") as file:
        size = path.stat().st_size
        if names is None:
            return _Walk(size).group(file, "", 0)
        found: dict[str, Group | Value] = {}
        for name in names:
            item = _at(file, name)
            if isinstance(item, h5py.Dataset):
                found[name] = _dataset(item, name, size)
            elif item is None and name in file.attrs:
                found[name] = _attribute(file, name, name)
        return Group(found)


def tree_of(file: h5py.File) -> Group:
    """Everything in an open file that this process made."""
    return _Walk(sys.maxsize).group(file, "", 0)


def check_tree(path: Path) -> None:
    """Refused where anything in a file leads out of it or does not fit into it."""
    with h5py.File(path, "r") as file:
        _Walk(path.stat().st_size, values=False).group(file, "", 0)


class _Walk:
    """Goes through all groups of a file and counts what it meets."""

    def __init__(self, size: int, *, values: bool = True) -> None:
        self.size, self.values, self.met = size, values, 0

    def group(self, group: h5py.Group, place: str, depth: int) -> Group:
        """A group as a tree; without values only its checks are made."""
        if depth > _DEPTH:
            raise Refused(place, f"groups nested deeper than {_DEPTH} levels, or within themselves")
        members: dict[str, Group | Value] = {}
        for name in group:
            inner = f"{place}/{name}" if place else str(name)
            self.met += 1
            if self.met > _OBJECTS:
                raise Refused(inner, f"more than {_OBJECTS} objects")
            item = _at(group, name, inner)
            if isinstance(item, h5py.Group):
                members[name] = self.group(item, inner, depth + 1)
            elif isinstance(item, h5py.Dataset):
                members[name] = self._value(item, inner)
        attributes = {name: _attribute(group, name, place) for name in group.attrs} if self.values else {}
        return Group(members, attributes)

    def _value(self, dataset: h5py.Dataset, place: str) -> Value:
        if self.values:
            return _dataset(dataset, place, self.size)
        _check_storage(dataset, place, self.size)
        return Unread("")


def _at(group: h5py.Group, name: str, place: str = "", hops: int = 0) -> h5py.Group | h5py.Dataset | None:
    """The object at a path, link by link; None where nothing is."""
    if hops > _HOPS:
        raise Refused(place or name, "links that lead to each other")
    here: Any = group
    for part in filter(None, name.split("/")):
        link = here.get(part, getlink=True) if isinstance(here, h5py.Group) else None
        if link is None:
            return None
        if isinstance(link, h5py.ExternalLink):
            raise Refused(place or name, f"a link into another file ({link.filename})")
        if isinstance(link, h5py.SoftLink):
            start = here.file if link.path.startswith("/") else here
            here = _at(start, link.path, place or name, hops + 1)
        else:
            here = here[part]
    return here if isinstance(here, (h5py.Group, h5py.Dataset)) else None


def _check_storage(dataset: h5py.Dataset, place: str, size: int) -> None:
    """Refused for data that stand elsewhere, or that the file cannot hold."""
    if dataset.is_virtual:
        raise Refused(place, "a virtual dataset, which reads other files")
    if dataset.external:
        raise Refused(place, "data in another file (external storage)")
    stored, wanted = dataset.id.get_storage_size(), dataset.nbytes if dataset.shape is not None else 0
    if stored > size or wanted > _UNPACKING * stored + 4096:
        held = f"{wanted:,} bytes, where the file holds {min(stored, size):,}"
        found = f"shape {dataset.shape} of {dataset.dtype}, {held}"
        raise Refused(place, found)


def _dataset(dataset: h5py.Dataset, place: str, size: int) -> Value:
    """The values of a dataset."""
    _check_storage(dataset, place, size)
    text = _check_type(dataset.dtype, dataset.shape, place)
    return _plain(dataset[()], text, place)


def _attribute(item: h5py.Group, name: str, place: str) -> Value:
    """The value of an attribute."""
    where = f"{place} attribute {name}".strip()
    found = item.attrs.get_id(name)
    text = _check_type(
        found.dtype, None if found.get_space().get_simple_extent_type() == h5py.h5s.NULL else (), where
    )
    return _plain(item.attrs[name], text, where)


def _check_type(dtype: np.dtype[Any], shape: tuple[int, ...] | None, place: str) -> bool:
    """Whether it is text; Refused where it is neither text nor numbers nor pairs of them (complex)."""
    if shape is None:
        raise Refused(place, "an empty value")
    text = h5py.check_string_dtype(dtype) is not None
    pair = dtype.names is not None and len(dtype.names) == 2 and all(dtype[i].kind in "fiu" for i in (0, 1))
    if not text and not pair and (dtype.names is not None or dtype.kind not in "biufc"):
        kind = "references" if h5py.check_ref_dtype(dtype) else f"type {dtype}"
        raise Refused(place, f"values of {kind}, neither numbers nor text")
    return text


def _plain(value: Any, text: bool, place: str) -> Value:
    if not text:
        array = np.asarray(value)
        if array.dtype.names is not None:
            array = array[array.dtype.names[0]] + 1j * array[array.dtype.names[1]]
        return numbers(array)
    try:
        if isinstance(value, (bytes, str)):
            return texts([value])[0]
        return texts(np.ravel(np.asarray(value, dtype=object)).tolist())
    except UnicodeDecodeError as error:
        raise Refused(place, "text that is not UTF-8") from error

"""Result files: one HDF5 layout for all kinds of results, whole at every moment.

Every value is a dataset with its unit as attribute `units`, nested classes are groups, `None` is left out;
dimensions have scales, as netCDF wants them (`identify.results.labels` says which).  Attributes describe:
the root's `layout`, and `checksum` over all values.

In layout 1, which is still read, numbers are attributes of their groups and nothing has units or scales.

A checksum over all that an HDF5 file holds: names, types, shapes and values of datasets, and attributes of
groups; not the units and scales of datasets, which no reader of ours relies on.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Iterator, Mapping
from functools import partial
from operator import itemgetter
from pathlib import Path
from typing import Any, TypeVar

import h5py
import numpy as np

from identify.core import atomic, binary_input
from identify.core.analyses import OF_KIND
from identify.core.errors import InputError
from identify.core.hdf5_tree import tree_of
from identify.core.tree import Group, Value
from identify.results.labels import Labelled, Level, level
from identify.results.record import ENCODED, group_name, record_of

LAYOUT = 2
_READ = (1, LAYOUT)
UNFINISHED = "unfinished"
SUFFIXES = (".h5", ".hdf5")
_A_RESULT = "a result file written by `identify fit`"
_KINDS = {
    **{kind: analysis.holds for kind, analysis in OF_KIND.items()},
    "map-part": "part of a map",
    UNFINISHED: "an interrupted run of an older version",
}
"""What a file of each kind holds, in words."""
_NO_VARIABLE = "This is a netCDF dimension but not a netCDF variable."
"""What netCDF calls the scale of a dimension without labels."""
T = TypeVar("T")
CHECKSUM = "checksum"
"""The root's attribute that holds it, and is not part of it."""


def check_new(path: Path, what: str, inputs: Iterable[Path], beside: Iterable[Path] = ()) -> None:
    """Raise an InputError where `path` is no place for a result (what: such as "a map"), or where it, a
    report, or another file that is written beside it would take the place of an input, or (`check_alone`)
    of something else.
    """
    if path.suffix not in SUFFIXES:
        raise InputError(
            str(path), f"suffix {path.suffix!r}: not a file for {what}", "a new file in .h5", atomic.ELSEWHERE
        )
    beside = list(beside)
    read = {one.resolve() for one in inputs}
    for new in (path, path.with_suffix(".html"), path.with_suffix(".pdf"), *beside):
        if new.resolve() in read:
            found = f"not a file for {what}: an input, which would be overwritten"
            raise InputError(str(new), found, "a new file", atomic.ELSEWHERE)
    check_alone(path, beside)


def check_alone(path: Path, beside: Iterable[Path]) -> None:
    """Raise an InputError where a file that is written beside a new result is there: it is of something
    else.
    """
    other = next((one for one in beside if one.exists() and not path.exists()), None)
    if other is not None:
        found = f"is there without {path.name}, beside which it would be written"
        raise InputError(str(other), found, "a new file", f"{atomic.ELSEWHERE}, or remove it")


def check_writable(path: Path) -> None:
    """Raise an InputError where a result cannot be written; what is at `path` stays."""
    atomic.check_writable(path)


def write(result: Any, path: Path) -> None:
    """Write a result whole, with a checksum over all of it.  Raises InputError where it cannot be written.

    It is made in memory and only its bytes go to the disk: where that is full, the HDF5 library takes the
    process down with it.
    """
    with h5py.File(path.name, "w", driver="core", backing_store=False) as file:
        file.attrs["layout"] = LAYOUT
        _write_group(file, level(result), {})
        file.attrs[CHECKSUM] = checksum(tree_of(file))
        file.flush()
        image = file.id.get_file_image()
    atomic.write_atomically(path, partial(Path.write_bytes, data=image))
    binary_input.wrote(path)


def read(path: Path, kind: type[T]) -> T:
    """Read a result; raises InputError for a file that is none, is damaged, or is one of another layout."""
    tree = binary_input.read_hdf5(path, expected=_A_RESULT)
    layout = tree.attributes.get("layout")
    known = isinstance(layout, np.ndarray) and layout.size == 1 and layout.item() in _READ
    if not known:
        found = "not a result of identify" if layout is None else f"layout {layout}"
        expected = f"a result file of layout {LAYOUT} or older"
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


def _write_group(group: h5py.Group, own: Level, scales: Mapping[str, h5py.Dataset]) -> None:
    """Write the fields of a group; scales: of the dimensions of the groups around it."""
    made: dict[str, h5py.Dataset] = {}
    for field in own.fields:
        if not field.is_group and field.name != "layout":
            made[field.name] = _dataset(group, field)
    scales = {**scales, **_new_scales(group, own, made, scales)}
    for field in own.fields:
        if field.dims and field.dims != (field.name,):
            for dim, name in zip(made[field.name].dims, field.dims, strict=True):
                dim.attach_scale(scales[name])
    for field in own.fields:
        if field.is_group:
            name = group_name(field.name)
            inner = group.create_group(name, track_order=True)
            if name != field.name:
                inner.attrs[ENCODED] = True
            _write_group(inner, level(field.value, own), scales)


def _dataset(group: h5py.Group, field: Labelled) -> h5py.Dataset:
    if isinstance(field.value, tuple):
        texts = np.array(field.value, dtype=object)
        made = group.create_dataset(field.name, data=texts, dtype=h5py.string_dtype(), shape=field.shape)
    else:
        made = group.create_dataset(field.name, data=field.value)
    made.attrs["units"] = field.unit
    return made


def _new_scales(
    group: h5py.Group, own: Level, made: Mapping[str, h5py.Dataset], known: Mapping[str, h5py.Dataset]
) -> dict[str, h5py.Dataset]:
    """Scales of dimensions that the groups around do not have: the field with their labels, or a dataset of
    their own.
    """
    found = {}
    for name, (size, labels) in own.labels(known).items():
        if name in made:
            scale = made[name]
        else:
            unlabelled = np.zeros(size, dtype=np.int8)
            scale = _dataset(group, Labelled(name, unlabelled if labels is None else labels, (name,), ""))
        scale.make_scale(name if labels is not None else f"{_NO_VARIABLE}{size:10d}")
        found[name] = scale
    return found


def checksum(tree: Group) -> str:
    """The sha256 of the content as hexadecimal digits, however the file lays it out on the disk."""
    digest = hashlib.sha256()
    for name, item in sorted(_objects("", tree), key=itemgetter(0)):
        _take(digest, f"object {name or '/'}", None)
        if not isinstance(item, Group):
            _take(digest, "data", item)
            continue
        for key in sorted(item.attributes):
            if (name, key) != ("", CHECKSUM):
                _take(digest, f"attribute {key}", item.attributes[key])
    return digest.hexdigest()


def _objects(name: str, item: Group | Value) -> Iterator[tuple[str, Group | Value]]:
    """A group and all in it, by path."""
    yield name, item
    for key, member in item.members.items() if isinstance(item, Group) else ():
        yield from _objects(f"{name}/{key}" if name else key, member)


def _take(digest: Any, name: str, value: Any) -> None:
    """Put a named value into the digest, each part after its length, so that none can run into the next."""
    array = np.array(value, dtype=object) if isinstance(value, tuple) else np.asarray(value)
    if array.dtype.kind in "OUS":
        parts = [str(array.shape).encode(), *(_text(one) for one in array.ravel().tolist())]
    else:
        little = array.astype(array.dtype.newbyteorder("<"))
        parts = [f"{little.dtype.str} {array.shape}".encode(), little.tobytes()]
    for part in (name.encode(errors="surrogateescape"), *parts):
        digest.update(len(part).to_bytes(8, "little") + part)


def _text(value: Any) -> bytes:
    return value if isinstance(value, bytes) else str(value).encode(errors="surrogateescape")

"""A checksum over all that an HDF5 file holds: names, types, shapes and values of datasets, and attributes of
groups; not the units and scales of datasets, which no reader of ours relies on.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from operator import itemgetter
from typing import Any

import numpy as np

from identify.core.tree import Group, Value

CHECKSUM = "checksum"
"""The root's attribute that holds it, and is not part of it."""


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

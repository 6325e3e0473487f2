"""A checksum over all that an HDF5 file holds: names, types, shapes and values of data and attributes."""

from __future__ import annotations

import hashlib
from typing import Any

import h5py
import numpy as np

CHECKSUM = "checksum"
"""The root's attribute that holds it, and is not part of it."""


def checksum(file: h5py.File) -> str:
    """The sha256 of the content as hexadecimal digits, however the file lays it out on the disk."""
    digest = hashlib.sha256()

    def take(name: str, item: h5py.Group | h5py.Dataset) -> None:
        _take(digest, f"object {name}", None)
        for key in sorted(item.attrs):
            if (name, key) != ("/", CHECKSUM):
                _take(digest, f"attribute {key}", item.attrs[key])
        if isinstance(item, h5py.Dataset):
            _take(digest, "data", item[()])

    take("/", file)
    names: list[str] = []
    file.visit(names.append)
    for name in sorted(names):
        take(name, file[name])
    return digest.hexdigest()


def _take(digest: Any, name: str, value: Any) -> None:
    """Put a named value into the digest, each part after its length, so that none can run into the next."""
    array = np.asarray(value)
    if array.dtype.kind in "OUS":
        parts = [str(array.shape).encode(), *(_text(one) for one in array.ravel().tolist())]
    else:
        little = array.astype(array.dtype.newbyteorder("<"))
        parts = [f"{little.dtype.str} {array.shape}".encode(), little.tobytes()]
    for part in (name.encode(errors="surrogateescape"), *parts):
        digest.update(len(part).to_bytes(8, "little") + part)


def _text(value: Any) -> bytes:
    return value if isinstance(value, bytes) else str(value).encode(errors="surrogateescape")

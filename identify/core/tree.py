"""What binary files hold, as plain values (groups of arrays and texts), and how it goes through a pipe.

Packed, it is a JSON description and the arrays' bytes behind it, never a pickle.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

_HEAD = struct.Struct("<Q")
_KINDS = "biufc"


@dataclass(frozen=True)
class Unread:
    """Something that is neither numbers nor text: its type in words."""

    kind: str


Value = NDArray[Any] | str | tuple[str, ...] | Unread
"""Numbers of any shape (a single one has none), a text, a list of texts, or neither."""


@dataclass(frozen=True)
class Group:
    """Values and groups by name, and the attributes of the group itself."""

    members: dict[str, Group | Value] = field(default_factory=dict)
    attributes: dict[str, Value] = field(default_factory=dict)

    def value(self, name: str) -> Value | None:
        """The member of that name, or None where there is none or it is a group."""
        found = self.members.get(name)
        return None if isinstance(found, Group) else found


def numbers(array: NDArray[Any]) -> NDArray[Any] | Unread:
    """An array of numbers in a type that every platform has."""
    if array.dtype.kind not in _KINDS:
        return Unread(f"values of type {array.dtype}")
    if array.dtype.itemsize > (16 if array.dtype.kind == "c" else 8):
        array = array.astype(complex if array.dtype.kind == "c" else float)
    return np.asarray(array, order="C")


def pack(answer: dict[str, Any], tree: Group | None = None) -> Iterator[bytes | memoryview]:
    """An answer with a tree as pieces to be written one after the other."""
    arrays: list[NDArray[Any]] = []
    head = json.dumps({**answer, "tree": None if tree is None else _described(tree, arrays)}).encode()
    yield _HEAD.pack(len(head))
    yield head
    for array in arrays:
        yield array.reshape(-1).view(np.uint8).data


def unpack(source: BinaryIO) -> tuple[dict[str, Any], Group | None] | None:
    """What `pack` made, read to its last byte; None where it ends before."""
    size = _exactly(source, _HEAD.size)
    head = None if size is None else _exactly(source, _HEAD.unpack(size)[0])
    if head is None:
        return None
    answer = json.loads(bytes(head))
    described = answer.pop("tree")
    try:
        tree = None if described is None else _rebuilt(described, source)
    except EOFError:
        return None
    return answer, tree


def _described(item: Group | Value, arrays: list[NDArray[Any]]) -> Any:
    if isinstance(item, Group):
        parts = (
            {name: _described(value, arrays) for name, value in values.items()}
            for values in (item.members, item.attributes)
        )
        return {"group": list(parts)}
    if isinstance(item, Unread):
        return {"unread": item.kind}
    if isinstance(item, (str, tuple)):
        return {"text": item} if isinstance(item, str) else {"texts": list(item)}
    arrays.append(item)
    return {"array": [item.dtype.str, list(item.shape)]}


def _rebuilt(described: Any, source: BinaryIO) -> Any:
    """The item; arrays stand in the source in the order in which they are described."""
    ((kind, content),) = described.items()
    if kind == "group":
        members, attributes = (
            {name: _rebuilt(value, source) for name, value in values.items()} for values in content
        )
        return Group(members, attributes)
    if kind == "array":
        dtype = np.dtype(content[0])
        shape = tuple(content[1])
        raw = _exactly(source, dtype.itemsize * int(np.prod(shape, dtype=object)))
        if raw is None or dtype.kind not in _KINDS:
            raise EOFError
        return np.frombuffer(raw, dtype).reshape(shape)
    if kind == "unread":
        return Unread(content)
    return tuple(content) if kind == "texts" else content


def _exactly(source: BinaryIO, count: int) -> bytearray | None:
    """So many bytes, or None where the source ends before."""
    buffer = bytearray(count)
    view, at = memoryview(buffer), 0
    while at < count:
        got = source.readinto(view[at:])  # type: ignore[attr-defined]
        if not got:
            return None
        at += got
    return buffer


def texts(items: Iterable[Any]) -> tuple[str, ...]:
    """Texts of bytes or of text, UTF-8; UnicodeDecodeError where they are not."""
    return tuple(item.decode() if isinstance(item, bytes) else str(item) for item in items)

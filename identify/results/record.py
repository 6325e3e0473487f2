"""A result made of what its file holds: every field of its class has the type that the class says, or the
file is damaged.  Names that users give are names of groups in HDF5, without blanks: `day1/posture 1` is
one, no path.
"""

from __future__ import annotations

import dataclasses
import types
import typing
from typing import Any, TypeVar, Union
from urllib.parse import quote, unquote

import numpy as np

from identify.core.errors import InputError
from identify.core.tree import Group, Unread

T = TypeVar("T")
_EXPECTED = "a whole result file"
_FIX = "transfer it again, or run the fit again"
ENCODED = "name_encoded"
"""Attribute of a group whose name stands for another one; files from before have none."""


def record_of(group: Group, kind: type[T], where: str) -> T:
    """The dataclass `kind` from a group; InputError, with the field, where something is missing or of another
    type.

    FORMERLY of a class says under which name, and in which unit of the present one, older files have a field;
    a field that they have not at all has its default.
    """
    hints = typing.get_type_hints(kind)
    values, formerly = {}, getattr(kind, "FORMERLY", {})
    for field in dataclasses.fields(kind):  # type: ignore[arg-type]
        name, (old, factor) = field.name, formerly.get(field.name, (field.name, 1.0))
        if name in group.members or name in group.attributes or not (old in group.members or _default(field)):
            values[name] = _value(group, name, hints[name], f"{where}, {name}")
        elif old in group.members:
            values[name] = factor * _value(group, old, hints[name], f"{where}, {old}")
    try:
        return kind(**values)
    except ValueError as error:
        raise InputError(where, f"values that do not fit together ({error})", _EXPECTED, _FIX) from error


def _default(field: dataclasses.Field[Any]) -> bool:
    return not (field.default is dataclasses.MISSING and field.default_factory is dataclasses.MISSING)


def _value(group: Group, name: str, hint: Any, where: str) -> Any:
    if typing.get_origin(hint) in (Union, types.UnionType):
        there = name in group.members or name in group.attributes
        return _value(group, name, _present(hint), where) if there else None
    found = group.members.get(name, group.attributes.get(name))
    if dataclasses.is_dataclass(hint) or typing.get_origin(hint) is dict:
        return _nested(_typed(found, Group, "a group", where), hint, where)
    if typing.get_origin(hint) is tuple:
        none = isinstance(found, np.ndarray) and not found.size
        return () if none else _typed(found, tuple, "a list of texts", where)
    if hint is str:
        return _typed(found, str, "a text", where)
    array = _typed(found, np.ndarray, "numbers", where)
    return array if hint not in (int, float, bool) else _number(array, hint, where)


def _present(optional: Any) -> Any:
    """The kind of value that an optional field holds where it is not None."""
    return next(option for option in typing.get_args(optional) if option is not type(None))


def _nested(group: Group, hint: Any, where: str) -> Any:
    """A dataclass of its own, or one for every member."""
    if dataclasses.is_dataclass(hint):
        return record_of(group, typing.cast(type, hint), where)
    inner = typing.get_args(hint)[1]
    members = {key: _typed(item, Group, "a group", f"{where}/{key}") for key, item in group.members.items()}
    return {
        key_of(key, ENCODED in member.attributes): record_of(member, inner, f"{where}/{key}")
        for key, member in members.items()
    }


def _number(array: np.ndarray[Any, Any], hint: Any, where: str) -> Any:
    """One number, which a whole number or a truth must really be."""
    kinds = {int: "iu", float: "iuf", bool: "b"}[hint]
    if array.size != 1 or array.dtype.kind not in kinds:
        found = f"values of type {array.dtype} and shape {array.shape}"
        raise InputError(where, found, f"one {hint.__name__}", _FIX)
    return hint(array.item())


def _typed(found: Any, kind: Any, words: str, where: str) -> Any:
    if isinstance(found, kind):
        return found
    held = "nothing" if found is None else found.kind if isinstance(found, Unread) else type(found).__name__
    raise InputError(where, f"holds {held}", words, _FIX)


def group_name(key: str) -> str:
    """The name of the group for a key: itself, or percent-encoded where it has blanks or would be a path; no
    two keys have the same.
    """
    plain = key.isprintable() and not set(key) & set("/% ") and key not in ("", ".", "..")
    return key if plain else quote(key, safe="").replace(".", "%2E") or "%"


def key_of(name: str, encoded: bool) -> str:
    """The key that a group's name stands for."""
    return unquote(name) if encoded and name != "%" else "" if encoded else name

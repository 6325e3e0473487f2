"""What the arrays of results stand over and in which unit: the labels of result files, of `to_xarray` and of
the documentation.

A field of a result says them in its type, `Annotated[Array, "frequency_hz pair", "$unit"]`: the dimensions,
and the unit where its name does not end with it; `$unit`: as the field `unit` says.  A dimension is named by
the field that holds its labels, where there is one: `value (name)` stands over the texts of `name`, `measured
(frequency_hz, pair)` over the lines.

`to_xarray` makes of a result the tree of xarray that `xarray.open_datatree` makes of its file.
"""

from __future__ import annotations

import dataclasses
import typing
from collections.abc import Mapping, Sequence
from functools import cache
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import numpy as np

from identify.core.errors import InputError
from identify.results.record import group_name

if TYPE_CHECKING:
    from xarray import DataTree

FIXED = dict.fromkeys(("axis", "response", "force"), ("x", "y", "z"))
"""Labels of dimensions that no field holds, by name: the base's axes, or those of what a class says."""
_BY_NAME = {
    "_m_per_n": "m/N",
    "_per_rad": "1/rad",
    "_per_s": "1/s",
    "rpm": "1/min",
    "_hz": "Hz",
    "_deg": "deg",
    "_m": "m",
    "_n": "N",
    "_kg": "kg",
    "_s": "s",
    "seconds": "s",
}
"""Units that names of fields end with."""


class Labelled(NamedTuple):
    """A field of a result: its value, the names of its dimensions (none of a number, a text or a group), and
    its unit: `1` of plain numbers, empty of texts, `see unit` where it differs by row.
    """

    name: str
    value: Any
    dims: tuple[str, ...] = ()
    unit: str = ""

    @property
    def is_group(self) -> bool:
        """Whether it has fields or members of its own."""
        return dataclasses.is_dataclass(self.value) or isinstance(self.value, dict)

    @property
    def shape(self) -> tuple[int, ...]:
        """Of an array, or of a list of texts."""
        return _shape(self.value)


class Level(NamedTuple):
    """The fields of one group, and of what it is in: the objects, outermost first, and the sizes of all
    dimensions.
    """

    fields: tuple[Labelled, ...]
    objects: tuple[Any, ...] = ()
    sizes: Mapping[str, int] = {}

    def labels(self, known: Mapping[str, Any]) -> dict[str, tuple[int, Any]]:
        """Size and labels (texts, numbers, or None where there are none) of the dimensions of this group that
        are not among the known ones of those around it.
        """
        columns = {one.name: one.value for one in self.fields if one.dims == (one.name,)}
        sizes = {d: n for one in self.fields for d, n in zip(one.dims, one.shape, strict=True)}
        fixed = {d: labels for d, labels in FIXED.items() if sizes.get(d) == len(labels)}
        return {
            d: (n, {**fixed, **columns}.get(d)) for d, n in sizes.items() if d in columns or d not in known
        }


def level(item: Any, above: Level | None = None) -> Level:
    """The fields of a dataclass or the members of a mapping, without those that are None.

    An array that is not as its class says, and one that has no dimensions, stand over
    dimensions of their own.
    """
    around, sizes = (above.objects, dict(above.sizes)) if above else ((), {})
    if isinstance(item, Mapping):
        return Level(tuple(Labelled(key, value) for key, value in item.items()), around, sizes)
    kind: type = type(item)
    said, fields, objects = declared(kind), [], (*around, item)
    for field in dataclasses.fields(item):
        name, value = field.name, getattr(item, field.name)
        if value is None:
            continue
        dims, unit = said.get(name, ((), unit_of_name(name)))
        shape = _shape(value)
        if len(dims) != len(shape) or any(sizes.get(d, n) != n for d, n in zip(dims, shape, strict=True)):
            dims = tuple(_new(f"{name}_{axis}", n, sizes) for axis, n in enumerate(shape))
        sizes |= dict(zip(dims, shape, strict=True))
        fields.append(Labelled(name, value, dims, "" if _is_text(value) else _in_words(unit, objects)))
    return Level(tuple(fields), objects, sizes)


@cache
def declared(kind: type) -> dict[str, tuple[tuple[str, ...], str]]:
    """Dimensions and unit of the fields of a class, as their annotations say; `$field` for a unit that a
    field says.
    """
    found = {}
    for name, hint in typing.get_type_hints(kind, include_extras=True).items():
        if typing.get_origin(hint) is Annotated:
            dims, *unit = hint.__metadata__
            found[name] = tuple(dims.split()), unit[0] if unit else unit_of_name(name)
    return found


def unit_of_name(name: str) -> str:
    """The unit that the name of a field ends with, 1 where it ends with none."""
    return next((unit for end, unit in _BY_NAME.items() if name.endswith(end)), "1")


def _new(name: str, size: int, sizes: Mapping[str, int]) -> str:
    """A name that no dimension of another size has."""
    while sizes.get(name, size) != size:
        name += "_"
    return name


def _in_words(unit: str, objects: Sequence[Any]) -> str:
    """A unit; of one that a field says, that of the innermost object that has it."""
    if not unit.startswith("$"):
        return unit
    said = next((getattr(one, unit[1:]) for one in reversed(objects) if hasattr(one, unit[1:])), "")
    return said if isinstance(said, str) else f"see {unit[1:]}"


def _shape(value: Any) -> tuple[int, ...]:
    return value.shape if isinstance(value, np.ndarray) else (len(value),) if isinstance(value, tuple) else ()


def _is_text(value: Any) -> bool:
    return isinstance(value, (str, tuple))


def tree_of(result: Any) -> DataTree:
    """Groups, dimensions, labels and units of a result; InputError where xarray is not installed."""
    try:
        from xarray import DataTree  # noqa: PLC0415  an extra, which the command line never needs
    except ImportError as error:
        fix = "install the extra: `python -m pip install xarray`, or `.[notebook]` in place of `.`"
        raise InputError("to_xarray", "no xarray in this Python", "xarray", fix) from error
    groups: dict[str, Any] = {}
    _collect(level(result), "/", {}, groups)
    tree: DataTree = DataTree.from_dict(groups, name=result.name)
    tree.attrs["layout"] = result.layout
    return tree


def _collect(own: Level, path: str, known: Mapping[str, Any], groups: dict[str, Any]) -> None:
    """The group at a path and all in it as datasets; known: the dimensions of the groups around it."""
    from xarray import Dataset  # noqa: PLC0415

    labels = own.labels(known)
    held = [Labelled(name, found, (name,)) for name, (_, found) in labels.items() if found is not None]
    held += [one for one in own.fields if not one.is_group and one.name != "layout"]
    groups[path] = Dataset({one.name: (one.dims, np.asarray(one.value), {"units": one.unit}) for one in held})
    for one in own.fields:
        if one.is_group:
            inner = f"{path.rstrip('/')}/{group_name(one.name)}"
            _collect(level(one.value, own), inner, {**known, **labels}, groups)

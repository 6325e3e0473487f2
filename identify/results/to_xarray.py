"""A result as labelled arrays, a tree of xarray, as `xarray.open_datatree` makes of its file."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from identify.core.errors import InputError
from identify.results.labels import Labelled, Level, level
from identify.results.record import group_name

if TYPE_CHECKING:
    from xarray import DataTree


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

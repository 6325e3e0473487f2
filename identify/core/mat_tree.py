"""MATLAB files (v5, v7.3) as trees of plain values; used in the child process of `binary_input`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import h5py
import numpy as np
from pymatreader import read_mat

from identify.core.hdf5_tree import check_tree
from identify.core.tree import Group, Unread, Value, numbers

_DEPTH = 16


def read_mat_tree(path: Path) -> Group:
    """All variables of a file; whatever scipy, h5py and pymatreader raise on damaged ones."""
    if h5py.is_hdf5(path):
        check_tree(path)
    content = read_mat(str(path))
    return Group({name: _plain(value, 0) for name, value in content.items() if not name.startswith("__")})


def _plain(value: Any, depth: int) -> Group | Value:
    if isinstance(value, dict) and depth <= _DEPTH:
        return Group({str(name): _plain(inner, depth + 1) for name, inner in value.items()})
    if isinstance(value, np.ndarray) and value.dtype.kind in "OUS":
        value = value.tolist()
    if isinstance(value, str):
        return value
    if isinstance(value, list):
        return _listed(value)
    if isinstance(value, (np.ndarray, np.generic, bool, int, float, complex)):
        return numbers(np.asarray(value))
    return Unread(f"values of type {type(value).__name__}")


def _listed(items: list[Any]) -> Value:
    """A list of texts, or of numbers alike."""
    if items and all(isinstance(item, str) for item in items):
        return tuple(items)
    try:
        return numbers(np.asarray(items))
    except ValueError:  # lists of different lengths
        return Unread("lists of different lengths")

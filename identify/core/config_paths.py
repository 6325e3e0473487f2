"""Paths in configs, which are relative to the folder of the config: made to mean the same files from another
folder.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, get_args

from pydantic import BaseModel

from identify.core.yaml_input import YAML_SUFFIXES


def relocated(path: str | Path, old: Path, new: Path) -> str:
    """A path that was relative to one folder, relative to another; absolute ones stay, as do those on another
    drive.
    """
    if Path(path).is_absolute():
        return Path(path).as_posix()
    try:
        return Path(os.path.relpath(old / path, new)).as_posix()
    except ValueError:  # another drive
        return (old / path).resolve().as_posix()


def relocate(kind: type[BaseModel], data: Any, old: Path, new: Path) -> None:
    """Change in place the paths in data of settings of a kind, as they stand in a file: what was relative to
    one folder is relative to another, wherever a field of the kind, or of what is in it, is a path.
    """
    _relocated(kind, data, partial(relocated, old=old, new=new), set())


def _relocated(hint: Any, data: Any, moved: Callable[[str], str], done: set[int]) -> Any:
    """Data of a type; done: mappings and lists that were changed, which several keys of YAML may share."""
    if isinstance(data, str):
        return moved(data) if Path in _types(hint) else data
    keys: dict[Any, Any] = {}
    if isinstance(data, list):
        keys = dict.fromkeys(range(len(data)), hint)
    elif isinstance(data, dict):
        fields = [field for kind in _types(hint) for field in getattr(kind, "model_fields", {}).items()]
        keys = {field.alias or name: field.annotation for name, field in fields}
    if id(data) not in done:
        done.add(id(data))
        for key in [key for key in keys if isinstance(data, list) or key in data]:
            data[key] = _relocated(keys[key], data[key], moved, done)
    return data


def _types(hint: Any) -> list[Any]:
    """A type and all that it is made of."""
    return [hint, *(inner for part in get_args(hint) for inner in _types(part))]


def robot_key(file: Path) -> str:
    """The key of `robot:` that names a file: `dh` for a table in YAML, else `urdf`."""
    return "dh" if file.suffix in YAML_SUFFIXES else "urdf"

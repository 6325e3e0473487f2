"""Paths in configs, which are relative to the folder of the config: made to mean the same files from another
folder.
"""

from __future__ import annotations

import os
from collections.abc import MutableMapping
from pathlib import Path
from typing import Any

from identify.core.yaml_input import YAML_SUFFIXES

_MEASURED = ("file", "modes", "shapes")


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


def relocate_measurement(one: MutableMapping[str, Any], old: Path, new: Path) -> None:
    """Change the paths of a measurement in place."""
    for key in _MEASURED:
        if key in one and not isinstance(one[key], list):
            one[key] = relocated(str(one[key]), old, new)
    for key in ("file", "repeats"):
        if isinstance(one.get(key), list):
            one[key] = [relocated(str(file), old, new) for file in one[key]]


def robot_key(file: Path) -> str:
    """The key of `robot:` that names a file: `dh` for a table in YAML, else `urdf`."""
    return "dh" if file.suffix in YAML_SUFFIXES else "urdf"

"""Where the packages of ROS are that descriptions name: beside the description, or where ROS has them."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from pathlib import Path

_NAME = re.compile(rb"<name>\s*([^<\s]+)\s*</name>")


def package_folder(name: str, folder: Path) -> Path | None:
    """The folder of a package that a file in `folder` names, or None.

    It is looked for as what holds the file (by its `package.xml` or its own name), beside that, one level
    deeper beside that, and so on upwards, then in the places that ROS names in the environment.
    """
    return next((place for place in _places(name, folder.resolve()) if place.is_dir()), None)


def _places(name: str, folder: Path) -> Iterator[Path]:
    for above in (folder, *folder.parents):
        if name in (above.name, _named(above / "package.xml")):
            yield above
        yield above / name
        yield from _below(above, name)
    for prefix in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep):
        yield Path(prefix, "share", name)
    for place in os.environ.get("ROS_PACKAGE_PATH", "").split(os.pathsep):
        yield Path(place, name)


def _below(above: Path, name: str) -> Iterator[Path]:
    """`above/*/name`; folders that must not be read hold nothing."""
    try:
        found = [Path(entry.path, name) for entry in os.scandir(above) if entry.is_dir()]
    except OSError:
        return
    yield from sorted(found)


def _named(manifest: Path) -> str:
    """The name that a `package.xml` gives its folder."""
    try:
        found = _NAME.search(manifest.read_bytes()[:65536]) if manifest.is_file() else None
    except OSError:
        return ""
    return found[1].decode(errors="replace") if found else ""

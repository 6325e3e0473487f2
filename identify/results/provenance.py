"""Where a result comes from: versions, time, what was asked, and the input files with their hashes."""

from __future__ import annotations

import hashlib
import platform
import sys
from collections.abc import Sequence
from datetime import UTC, datetime
from functools import cache
from importlib.metadata import version
from pathlib import Path

from identify.core.files import sha256_of
from identify.core.registry import plug_ins
from identify.core.version import VERSION
from identify.results import tables

_PACKAGES = ("numpy", "scipy", "mujoco", "h5py", "pymoo", "pyswarms")
"""What computes: a run resumed with another version of any of these, or of a plug-in, would not be the same
run.
"""


def provenance(
    name: str, text: str, inputs: Sequence[tuple[str, str]], settings: tables.SettingTable | None = None
) -> tables.Provenance:
    """Provenance now; name and text of what was asked (no name where there was no config file), inputs:
    (file, sha256).
    """
    return tables.Provenance(
        identify=VERSION,
        python=sys.version.split()[0],
        platform=f"{platform.system()} {platform.machine()}",
        packages=computing()[1:],
        written=datetime.now(UTC).isoformat(timespec="seconds"),
        config_path=name,
        config_sha256=hashlib.sha256(text.encode()).hexdigest(),
        config=text,
        input_files=tuple(file for file, _ in inputs),
        input_sha256=tuple(digest for _, digest in inputs),
        settings=settings,
    )


@cache
def computing() -> tuple[str, ...]:
    """What computes in this process, each with its version: identify, packages, plug-ins."""
    packages = (f"{package} {version(package)}" for package in _PACKAGES)
    return (f"identify {VERSION}", *packages, *plug_ins())


def differing(one: tuple[str, ...], other: tuple[str, ...]) -> str:
    """What one has that the other has not, in words."""
    return ", ".join(each for each in one if each not in other) or "nothing else"


def sha256(path: Path) -> str:
    """The sha256 of a file, as hexadecimal digits."""
    return sha256_of(path, "an input file")

"""The one place that finds test material kept beside the repository, and skips, saying so, where it is
absent.
"""

from __future__ import annotations

import os
from pathlib import Path

import pytest

ROOT = Path(os.environ.get("IDENTIFY_SHARED", Path(__file__).parents[2] / "shared"))


def shared(*parts: str) -> Path:
    """Path of a shared file or folder; skips the calling test where it is absent."""
    path = ROOT.joinpath(*parts)
    if not path.exists():
        pytest.skip(f"shared test material {'/'.join(parts)} is not here (set IDENTIFY_SHARED to its folder)")
    return path

"""Reading a PDF in tests, by poppler's tools; the test is skipped, saying so, where they are not
installed.
"""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest


def poppler(tool: str, *arguments: str) -> str:
    """The output of one of poppler's tools (pdftotext, pdffonts, pdfinfo)."""
    if shutil.which(tool) is None:
        pytest.skip(
            f"{tool} (package poppler-utils; `make browser` installs it on Debian) is not here: the PDF is"
            " not read"
        )
    return subprocess.run(
        [tool, *arguments], check=True, capture_output=True, text=True, encoding="utf-8"
    ).stdout


def lines(path: Path) -> list[str]:
    """The lines of a PDF as they stand on its pages, columns separated by blanks."""
    return poppler("pdftotext", "-layout", "-enc", "UTF-8", str(path), "-").splitlines()

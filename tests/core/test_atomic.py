"""Files that are written whole or not at all: their names and the ends of their lines."""

from __future__ import annotations

from pathlib import Path

import pytest

from identify.core.atomic import check_name, check_writable, write_text
from identify.core.errors import InputError


@pytest.mark.parametrize("name", ["arm: test.h5", "what?.h5", "a|b.h5", "arm.", "arm "])
def test_names_that_windows_does_not_take(name: str) -> None:
    with pytest.raises(InputError, match="no name of a file on Windows"):
        check_name(name, "nt")
    check_name(name, "posix")
    check_name("arm_1 (µm).h5", "nt")


def test_lines_end_alike_everywhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("os.linesep", "\r\n")
    write_text(tmp_path / "µ.csv", "a\nµ\n")
    assert (tmp_path / "µ.csv").read_bytes() == "a\nµ\n".encode()
    check_writable(tmp_path / "µ.csv")
    assert (tmp_path / "µ.csv").read_bytes() == "a\nµ\n".encode()

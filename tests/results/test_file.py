"""Result files: under a checksum, whatever they hold is named, older ones are read."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import ClassVar

import h5py
import numpy as np
import pytest

from identify.core.arrays import Array
from identify.core.errors import InputError
from identify.results import file as result_file
from identify.results.file import CHECKSUM
from identify.results.record import group_name

NAMES = ("plain", "day1/posture 1", ".", "..", "", "a%2Fb", "a/b", "/", "é ü", "tab\t", "a.b")


@dataclass(frozen=True)
class Part:
    """A member."""

    values: Array


@dataclass(frozen=True)
class Result:
    """A small result with one of everything."""

    KIND: ClassVar[str] = "fit"
    parts: dict[str, Part]
    texts: tuple[str, ...] = ("one", "two")
    cost: float = 0.834
    layout: int = result_file.LAYOUT
    kind: str = "fit"
    none: Array | None = None
    shapes: Array = field(default_factory=lambda: np.array([[1 + 2j, 0], [3, 4]]))


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """A result file with every kind of name."""
    parts = {name: Part(np.arange(3.0) + n) for n, name in enumerate(NAMES)}
    result_file.write(Result(parts), tmp_path / "x.h5")
    return tmp_path / "x.h5"


def test_names_are_names(path: Path) -> None:
    again = result_file.read(path, Result)
    assert tuple(again.parts) == NAMES
    for number, part in enumerate(again.parts.values()):
        assert part.values.tolist() == [number, number + 1, number + 2]
    assert len({group_name(name) for name in NAMES}) == len(NAMES)


@pytest.mark.parametrize("what", ["number", "array", "text", "name", "more", "less"])
def test_an_altered_result_is_refused(path: Path, what: str) -> None:
    result_file.read(path, Result)
    with h5py.File(path, "r+") as file:
        if what == "number":
            file["cost"][()] = 0.835
        elif what == "array":
            file["parts/plain/values"][1] = np.nextafter(1.0, 2.0)
        elif what == "text":
            file["texts"][0] = "on"
        elif what == "name":
            file["parts"].move("plain", "simple")
        elif what == "more":
            file["parts/plain/new"] = 1.0
        else:
            del file["parts/a.b"]
    with pytest.raises(InputError, match="changed or damaged after it was written"):
        result_file.read(path, Result)


def test_a_result_from_before_checksums_is_read(path: Path) -> None:
    with h5py.File(path, "r+") as file:
        del file.attrs[CHECKSUM]
        file["cost"][()] = 11.5
    assert result_file.read(path, Result).cost == 11.5


def test_it_is_made_without_the_library_touching_the_disk(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On a full disk the HDF5 library would end the process; here it is a sentence, and the file stays."""
    before = path.read_bytes()

    def full(self: Path, data: bytes) -> int:
        self.touch()
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(InputError, match="No space left on device"):
        result_file.write(Result({}), path)
    assert path.read_bytes() == before
    assert [one.name for one in path.parent.iterdir()] == ["x.h5"]

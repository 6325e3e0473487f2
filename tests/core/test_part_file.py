"""Part files: what a run has done, up to the first damage and no further."""

from __future__ import annotations

import errno
from pathlib import Path

import numpy as np
import pytest

from identify.core.atomic import locked, remove_asides, write_atomically
from identify.core.errors import InputError
from identify.core.part_file import DamagedPart, PartFile
from identify.fitting.memory import Journal, Memory

RECORDS = [b"first", b"", b"third " * 50, b"last"]


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """A part file with four records."""
    part = PartFile(tmp_path / "x.h5.part", "key")
    for record in RECORDS:
        part.append(record)
    part.flush()
    return part.path


def _read(path: Path) -> PartFile:
    part = PartFile.read(path)
    assert part is not None
    return part


def test_what_was_put_in_comes_out_and_grows(path: Path) -> None:
    part = _read(path)
    assert (part.key, part.records) == ("key", RECORDS)
    part.append(b"more")
    part.flush()
    assert _read(path).records == [*RECORDS, b"more"]


def test_every_byte_is_under_the_checksum(path: Path) -> None:
    """Whichever byte is altered, no record is other than it was, and those before the damage are kept."""
    whole = path.read_bytes()
    for at in range(0, len(whole), 3):
        path.write_bytes(whole[:at] + bytes([whole[at] ^ 0x10]) + whole[at + 1 :])
        with pytest.warns(DamagedPart, match="damaged"):
            part = PartFile.read(path)
        records = [] if part is None else part.records
        assert records == RECORDS[: len(records)] and len(records) < len(RECORDS), at


def test_a_torn_tail_is_left_out_and_written_over(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-2])
    with pytest.warns(DamagedPart, match="the 3 records before them are kept"):
        part = _read(path)
    part.append(b"another")
    part.flush()
    assert _read(path).records == [*RECORDS[:3], b"another"]


def test_a_record_cannot_be_moved_or_left_out(tmp_path: Path) -> None:
    one, other = PartFile(tmp_path / "one", "key"), PartFile(tmp_path / "other", "key")
    for part, records in ((one, (b"aa", b"bb")), (other, (b"bb", b"aa"))):
        for record in records:
            part.append(record)
        part.flush()
    ends = one.path.read_bytes(), other.path.read_bytes()
    size = 4 + 16 + 2
    one.path.write_bytes(ends[0][:-size] + ends[1][-2 * size : -size])  # "bb" as the first record has it
    with pytest.warns(DamagedPart):
        assert _read(one.path).records == [b"aa"]


@pytest.mark.parametrize("flushed", [True, False])
def test_keep_forgets_the_rest_on_disk_too(tmp_path: Path, flushed: bool) -> None:
    part = PartFile(tmp_path / "x", "key")
    for record in RECORDS:
        part.append(record)
    if flushed:
        part.flush()
    part.keep(2)
    part.append(b"new")
    part.flush()
    assert _read(part.path).records == part.records == [*RECORDS[:2], b"new"]


def test_a_full_disk_loses_no_record(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    part = _read(path)
    part.append(b"does not fit")
    real = Path.open

    def full(self: Path, *words: str, **options: int) -> object:
        file = real(self, *words, **options)  # type: ignore[call-overload]
        with file:
            file.seek(0, 2)
            file.write(b"torn")
        raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(Path, "open", full)
        with pytest.raises(InputError, match=r"No space left.*--resume"):
            part.flush()
    assert _read(path).records == RECORDS
    part.flush()
    assert _read(path).records == [*RECORDS, b"does not fit"]


def test_there_is_none_or_it_is_something_else(tmp_path: Path) -> None:
    assert PartFile.read(tmp_path / "none") is None
    (tmp_path / "other").write_bytes(b"\x89HDF\r\n\x1a\n and so on")
    with pytest.warns(DamagedPart):
        assert PartFile.read(tmp_path / "other") is None


def test_a_journal_takes_no_cost_that_is_not_its_own(tmp_path: Path) -> None:
    part = PartFile(tmp_path / "x", "key")
    journal = Journal(part)
    for costs in ([1.0, np.inf], [np.nan, 3.0], [4.0, 5.0]):
        journal.record(np.array(costs))
    again = Journal(part)
    assert again.replay(2) == pytest.approx([1.0, np.inf])
    with pytest.warns(DamagedPart, match="record 2 is not of this run"):
        assert again.replay(2) is None
    assert len(part.records) == 1 and again.replayed == 1


def test_a_memory_is_there_again(tmp_path: Path) -> None:
    memory = Memory(PartFile(tmp_path / "x", "key"))
    memory["a"] = [0.1 + 0.2, float("inf"), "text"]
    memory["b"] = {}
    assert memory._part is not None
    memory._part.flush()
    again = Memory(_read(tmp_path / "x"))
    assert len(again) == 2 and "c" not in again
    assert again["a"] == [0.1 + 0.2, float("inf"), "text"]


def test_an_output_has_one_run(tmp_path: Path) -> None:
    out = tmp_path / "new" / "x.h5"
    with (
        locked(out, "wait"),
        pytest.raises(InputError, match="another run is writing it"),
        locked(out, "wait"),
    ):
        raise AssertionError
    with locked(out, "wait"):
        pass
    assert list(out.parent.iterdir()) == []


def test_leftovers_of_this_output_only_are_taken_away(tmp_path: Path) -> None:
    names = [".x.12.h5", ".x.345.html", ".y.12.h5", ".x.y.12.h5", "x.12.h5", ".x.h5"]
    for name in names:
        (tmp_path / name).touch()
    remove_asides(tmp_path / "x.h5")
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(names[2:])


def test_what_cannot_be_written_leaves_what_was_there(tmp_path: Path) -> None:
    path = tmp_path / "x.h5"
    path.write_text("before")

    def fails(aside: Path) -> None:
        aside.write_text("half")
        raise OSError(errno.ENOSPC, "No space left on device")

    with pytest.raises(InputError, match="No space left"):
        write_atomically(path, fails, "make room")
    assert [one.name for one in tmp_path.iterdir()] == ["x.h5"]
    assert path.read_text() == "before"

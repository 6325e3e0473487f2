"""Which reader takes which file, and what is said of files that none can take."""

from __future__ import annotations

import hashlib
from pathlib import Path

import numpy as np
import pytest

from identify.core.errors import InputError
from identify.measured.channel import Channel
from identify.measured.frf_records import FrfRecord, FrfRecords
from identify.measured.loaders import (
    FORMAT_OF_SUFFIX,
    LOADERS,
    FrfFileOptions,
    load_frf_set,
    load_time_history,
)
from identify.measured.uff.write import write_uff58
from tests.frf_files import write_hdf5
from tests.measured.frf_sets import assert_same, some_set


def test_every_format_of_a_suffix_is_registered() -> None:
    assert set(FORMAT_OF_SUFFIX.values()) == {"uff", "csv", "hdf5", "mat"} <= set(LOADERS.names())


@pytest.mark.parametrize("name", ["x.uff", "x.UNV", "x.58"])
def test_the_suffix_decides_in_any_case(tmp_path: Path, name: str) -> None:
    write_uff58(tmp_path / name, some_set())
    assert_same(load_frf_set(tmp_path / name), some_set(), rtol=1e-12)


def test_the_key_format_decides_where_the_suffix_does_not(tmp_path: Path) -> None:
    path = tmp_path / "x.dat"
    write_hdf5(path, some_set())
    with pytest.raises(InputError, match=r"suffix '\.dat'; expected one of \.uff.*add the key format"):
        load_frf_set(path)
    read = load_frf_set(path, FrfFileOptions(format="hdf5"))
    assert_same(read, some_set())
    assert read.source == str(path) and read.sha256 == hashlib.sha256(path.read_bytes()).hexdigest()
    with pytest.raises(
        InputError, match="unknown FRF file format 'xls'; expected one of csv, hdf5, mat, uff"
    ):
        load_frf_set(path, FrfFileOptions(format="xls"))


@pytest.mark.parametrize("suffix", [".uff", ".csv", ".h5", ".mat"])
def test_a_missing_file_and_a_folder_are_refused(tmp_path: Path, suffix: str) -> None:
    (tmp_path / f"folder{suffix}").mkdir()
    for name in ("missing", "folder"):
        with pytest.raises(InputError, match=r"the file cannot be read|a folder without any file of FRFs"):
            load_frf_set(tmp_path / f"{name}{suffix}")
    if suffix in (".uff", ".csv"):
        with pytest.raises(InputError, match="the file cannot be read"):
            load_time_history(tmp_path / f"missing{suffix}")


def test_a_third_party_reader_comes_through_the_same_door(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def read(path: Path, options: FrfFileOptions) -> FrfRecords:
        return FrfRecords(
            np.array([1.0, 2.0]), [FrfRecord(Channel(1, 1), Channel(2, 1), np.array([1j, 2j]), str(path))]
        )

    monkeypatch.setattr(LOADERS, "added", {})
    LOADERS.add("mine", read)
    (tmp_path / "x.txt").write_text("")
    assert load_frf_set(tmp_path / "x.txt", FrfFileOptions(format="mine", unit="mm/N")).frf[1, 0, 0] == 2e-3j

"""What every result file says first, whatever its kind; the layout that others read."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import h5py
import pytest

from identify.core.errors import InputError
from identify.results.file import LAYOUT, read, write
from identify.results.header import Header, KeyedHeader
from identify.results.joints import JointsResult
from tests.reports.discovery_sample import discovery_result
from tests.reports.explain_sample import explain_result
from tests.reports.joints_sample import joints_result
from tests.reports.modes_sample import modes_result
from tests.reports.motion_sample import motion_result
from tests.reports.posture_sample import batch_result, map_result
from tests.reports.sample import frf_result

RESULTS = [
    batch_result,
    discovery_result,
    explain_result,
    frf_result,
    joints_result,
    map_result,
    modes_result,
    motion_result,
]


@pytest.mark.parametrize("made", RESULTS, ids=lambda made: made.__name__)
def test_every_result_file_begins_with_the_same_header(made: Any, tmp_path: Path) -> None:
    result, path = made(), tmp_path / "result.h5"
    assert isinstance(result, Header)
    write(result, path)
    with h5py.File(path) as file:
        assert file.attrs["layout"] == LAYOUT
        assert file["seconds"][()] == result.seconds
        assert file["kind"].asstr()[()] == type(result).KIND
        assert file["name"].asstr()[()] == result.name
        assert tuple(file["verdict"].asstr()[()]) == result.verdict
        assert tuple(file["notes"].asstr()[()]) == result.notes
        assert file["provenance/identify"].asstr()[()] == result.provenance.identify
        assert ("key" in file) == isinstance(result, KeyedHeader)
    back = read(path, type(result))
    names = ("layout", "kind", "name", "verdict", "notes", "seconds")
    assert [getattr(back, name) for name in names] == [getattr(result, name) for name in names]


def test_a_result_of_another_kind_is_refused(tmp_path: Path) -> None:
    write(modes_result(), tmp_path / "modes.h5")
    with pytest.raises(InputError, match="holds a modal analysis; expected identified joints"):
        read(tmp_path / "modes.h5", JointsResult)

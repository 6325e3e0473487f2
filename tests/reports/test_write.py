"""Both reports from the result file alone, with the numbers of the result file."""

from __future__ import annotations

import dataclasses
import os
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path

import h5py
import numpy as np
import pytest

from identify.core.errors import InputError
from identify.reports.kit.cells import NONE
from identify.reports.write import write_reports
from identify.results import file as result_file
from identify.results.fit import FitResult
from tests.reports.sample import frf_result, modal_result


class Tables(HTMLParser):
    """All table rows of a page."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.rows: list[list[str]] = []
        self._cell = False
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag == "tr":
            self.rows.append([])
        elif tag == "td":
            self.rows[-1].append("")
            self._cell = True

    def handle_endtag(self, tag: str) -> None:
        self._cell = self._cell and tag != "td"

    def handle_data(self, data: str) -> None:
        if self._cell:
            self.rows[-1][-1] += data


@pytest.fixture(scope="module", params=["frf", "modal"])
def run(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("run") / "arm.study.h5"
    result_file.write(frf_result(12, 3) if request.param == "frf" else modal_result(), path)
    assert write_reports(path) == [path.with_name("arm.study.html"), path.with_name("arm.study.pdf")]
    return path


def test_numbers_are_those_of_the_file(run: Path) -> None:
    rows = {
        row[0]: row
        for row in Tables(run.with_suffix(".html").read_text("utf-8")).rows
        if row and "." in row[0] and len(row) == 10
    }
    with h5py.File(run) as file:
        table = file["parameters"]
        names = [name.decode() for name in table["name"][()]]
        assert set(rows) == set(names)
        for column, key in (
            (1, "value"),
            (3, "low_95"),
            (4, "high_95"),
            (6, "initial"),
            (7, "lower"),
            (8, "upper"),
        ):
            for name, value in zip(names, table[key][()], strict=True):
                text = rows[name][column]
                assert text == NONE if np.isnan(value) else float(text) == pytest.approx(value, rel=5.001e-4)


def test_reports_again_are_the_same_bytes(run: Path) -> None:
    """In another process, which orders its sets otherwise and lives in another time zone."""
    before = [run.with_suffix(suffix).read_bytes() for suffix in (".html", ".pdf")]
    script = (
        "import sys, pathlib; from identify.reports.write import write_reports;"
        " write_reports(pathlib.Path(sys.argv[1]))"
    )
    elsewhere = {**os.environ, "PYTHONHASHSEED": "7", "TZ": "Asia/Tokyo"}
    subprocess.run(
        [sys.executable, "-c", script, str(run)], check=True, env=elsewhere, cwd=Path(__file__).parents[2]
    )
    assert [run.with_suffix(suffix).read_bytes() for suffix in (".html", ".pdf")] == before
    assert sorted(path.name for path in run.parent.iterdir()) == [
        "arm.study.h5",
        "arm.study.html",
        "arm.study.pdf",
    ]


def test_another_result_gives_other_bytes(run: Path, tmp_path: Path) -> None:
    """Negative control of the test above."""
    other = tmp_path / run.name
    result_file.write(dataclasses.replace(result_file.read(run, FitResult), seed=4), other)
    for written in write_reports(other):
        assert written.read_bytes() != (run.parent / written.name).read_bytes()


def test_a_file_that_is_no_result(tmp_path: Path) -> None:
    path = tmp_path / "other.h5"
    path.write_bytes(b"not HDF5")
    with pytest.raises(InputError, match=r"other\.h5"):
        write_reports(path)
    assert not path.with_suffix(".html").exists()


def test_a_report_that_cannot_be_written(tmp_path: Path) -> None:
    path = tmp_path / "run.h5"
    result_file.write(modal_result(), path)
    path.with_suffix(".html").mkdir()
    with pytest.raises(InputError, match=r"run\.html: is a folder"):
        write_reports(path)
    assert sorted(entry.name for entry in tmp_path.iterdir()) == ["run.h5", "run.html"]


def test_a_result_without_points_or_shapes(tmp_path: Path) -> None:
    """Frequencies alone were measured: nothing to hang a shape on but the skeleton."""
    result = modal_result()
    m = result.measurements["table"]
    assert m.pairs is not None
    geometry = dataclasses.replace(
        m.geometry, nodes=np.zeros(0, int), point_names=(), point_links=(), points=np.zeros((0, 3))
    )
    modes = dataclasses.replace(m.modes, point_shapes=np.zeros((4, 0, 3), complex))
    pairs = dataclasses.replace(m.pairs, mac=np.full(2, np.nan), mac_matrix=None, measured_shapes=None)
    bare = dataclasses.replace(m, geometry=geometry, modes=modes, pairs=pairs)
    path = tmp_path / "bare.h5"
    result_file.write(
        dataclasses.replace(result, measurements={"table": bare}, profiles={}, published=None), path
    )
    page, document = write_reports(path)
    assert "MAC NaN" not in page.read_text("utf-8")
    assert document.read_bytes().startswith(b"%PDF")

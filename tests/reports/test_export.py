"""Exported figures and data: complete, not rounded, and readable again."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from identify.core.errors import InputError
from identify.measured.frf_records import FrfFileOptions
from identify.measured.loaders import load_frf_set
from identify.reports.kit import figures
from identify.reports.kit.document import Document
from identify.reports.shared import data
from identify.reports.write import contents, write_reports
from identify.results import file as result_file
from tests.reports.sample import frf_result, modal_result


def test_exported_frfs_are_read_back_as_measurements(tmp_path: Path) -> None:
    frf = frf_result(30, 3).measurements["posture1"].frf
    assert frf is not None
    made = Document()
    with figures.style():
        made.figure(Figure((1, 1)), "", *data.frfs(frf))
    files = dict(contents(made))
    path = tmp_path / "measured.csv"
    path.write_bytes(files["figure01_overview_measured.csv"])
    again = load_frf_set(path, FrfFileOptions(averages=4))
    assert again.quantity == "accelerance"
    assert again.window_decay_per_s == pytest.approx(frf.window_decay_per_s)
    for pair, (output, channel) in enumerate(zip(frf.output, frf.input, strict=True)):
        row, column = list(map(str, again.outputs)).index(output), list(map(str, again.inputs)).index(channel)
        assert again.frf[:, row, column] == pytest.approx(frf.measured[:, pair], rel=1e-8)
        assert again.coherence is not None and frf.coherence is not None
        assert again.coherence[:, row, column] == pytest.approx(frf.coherence[:, pair], rel=1e-8)


def test_alike_titles_do_not_overwrite_each_other() -> None:
    made, table = Document(), data.geometry("a b", frf_result(5, 2).measurements["posture1"].geometry)
    with figures.style():
        made.figure(Figure((1, 1)), "", table, table)
    assert [name for name, _ in contents(made)] == [
        *(
            f"figure01_overview{ending}"
            for ending in (".svg", ".png", "_points_a_b_1.csv", "_points_a_b_2.csv")
        )
    ]


def test_without_export_nothing_else_is_written(tmp_path: Path) -> None:
    result_file.write(modal_result(), tmp_path / "run.h5")
    write_reports(tmp_path / "run.h5")
    assert sorted(file.name for file in tmp_path.iterdir()) == ["run.h5", "run.html", "run.pdf"]


def test_a_folder_that_cannot_be_written(tmp_path: Path) -> None:
    result_file.write(modal_result(), tmp_path / "run.h5")
    (tmp_path / "figures").write_text("a file")
    with pytest.raises(InputError, match="--export"):
        write_reports(tmp_path / "run.h5", export=tmp_path / "figures")
    assert sorted(file.name for file in tmp_path.iterdir()) == ["figures", "run.h5"], "no page before that"


def test_arrows_point_where_the_channels_look() -> None:
    from identify.reports.shared.pick import ways

    g = frf_result(5, 3).measurements["posture1"].geometry
    found = list(ways(g, ["2:+X", "2:-Y", "3:+RZ", "9:+X", "2:+X"]).values())
    assert [row for row, _ in found] == [1, 1], "each once, translations of known points only"
    assert np.array([way for _, way in found]) == pytest.approx(np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0]]))

"""batch.yaml: lists, patterns, tables, whole studies; and what is wrong with it, in a sentence."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from identify.batch.posture_table import posture_of, read_postures, read_table
from identify.batch.settings import read_batch
from identify.batch.work import derived
from identify.core.errors import InputError, InputErrors
from tests.batch import planar

HEAD = "schema: identify-batch/1\n"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    planar.write_study(tmp_path / "base", planar.postures(3))
    (tmp_path / "base" / "p9.csv").write_text("x")
    return tmp_path


def _batch(folder: Path, text: str) -> Path:
    path = folder / "batch.yaml"
    path.write_text(HEAD + text)
    return path


def test_lists_patterns_tables_and_studies(folder: Path) -> None:
    text = (
        "study: base/study.yaml\ntable: base/postures.csv\njoint: true\neach: {averages: 4}\nstudies:"
        " ['base/*.yaml']\nmeasurements:\n"
    )
    text += "  - {file: 'base/p[19].csv', posture_deg: [1, 2, 3]}\n"
    text += "  - {name: a b, file: base/p2.csv, posture_deg: [1, 2, 3], averages: 8, use: validate}\n"
    batch = read_batch(_batch(folder, text))
    assert [item.name for item in batch.items] == ["p1", "p9", "a_b", "p1_2", "p2", "p3", "study"]
    assert [item.measurements is None for item in batch.items] == [False] * 6 + [True]
    own = {item.name: item.measurements[0] for item in batch.items if item.measurements}
    assert own["p9"] == {"averages": 4, "file": "p9.csv", "posture_deg": [1, 2, 3], "use": "fit"}
    assert own["a_b"]["averages"] == 8
    assert own["a_b"]["use"] == "fit", "on its own every measurement is fitted"
    assert own["p2"]["posture_deg"] == pytest.approx(
        list(map(float, (folder / "base/postures.csv").read_text().splitlines()[2].split(",")[1:]))
    )
    assert batch.joint is not None and batch.joint.measurements is not None
    assert [one.get("use") for one in batch.joint.measurements] == [None, None, "validate", None, None, None]


def test_several_files_of_one_measurement_stay_together(folder: Path) -> None:
    text = "study: base/study.yaml\nmeasurements:\n  - {file: [base/p1.csv, base/p9.csv], posture_deg: [1]}\n"
    [item] = read_batch(_batch(folder, text)).items
    assert item.measurements is not None
    assert (item.name, item.measurements[0]["file"]) == ("p1", ["p1.csv", "p9.csv"])


def test_the_measurements_of_the_study_itself(folder: Path) -> None:
    base = folder / "base" / "study.yaml"
    base.write_text(
        base.read_text()
        + "measurements:\n  - {file: p1.csv, posture_deg: [1, 2, 3], use: validate}\n  - {file: p2.csv,"
        " posture_deg: [1, 2, 3]}\n"
    )
    batch = read_batch(_batch(folder, "study: base/study.yaml\n"))
    assert [item.name for item in batch.items] == ["p1", "p2"]
    assert batch.joint is None


def test_a_derived_study_keeps_the_rest_of_its_base(folder: Path) -> None:
    file = derived(folder / "base" / "study.yaml", "p1", [{"file": "p1.csv", "posture_deg": [1.0, 2.0, 3.0]}])
    assert file.study.name == "p1"
    assert file.study.measurements[0].posture_deg == [1.0, 2.0, 3.0]
    assert "# the base of a batch" in file.text, "comments stay"
    assert file.resolve(file.study.points or Path()) == folder / "base" / "points.csv"
    again = derived(
        folder / "base" / "study.yaml", "p1", [{"file": "p1.csv", "posture_deg": [1.0, 2.0, 3.0]}]
    )
    assert again.sha256 == file.sha256


@pytest.mark.parametrize(
    ("text", "match"),
    [
        ("name: x\n", "give a base `study`, or `studies`"),
        ("studies: [a.yaml]\neach: {averages: 4}\n", "need the base `study`"),
        ("study: base/study.yaml\neach: {averages: 4}\n", "`each` is of `measurements` and `table`"),
        ("studies: ['base/*.yaml', base/../base/study.yaml]\n", "study.yaml twice; expected each study once"),
        ("studies: [a.yaml]\njoint: {common: [a]}\n", "common"),
        ("study: base/study.yaml\n", "no measurements, and the batch has none"),
        ("study: base/study.yaml\ntabel: t.csv\n", r"line 3: tabel: unknown key.*did you mean `table`"),
        ("study: base/nothing.yaml\n", "nothing.yaml: the file cannot be read"),
        ("study: base/study.yaml\ntable: none.csv\n", "none.csv: the file cannot be read"),
        ("study: base/study.yaml\ntime_limit_s: 0\n", "time_limit_s"),
    ],
)
def test_what_is_wrong_with_a_batch(folder: Path, text: str, match: str) -> None:
    with pytest.raises((InputError, InputErrors), match=match):
        read_batch(_batch(folder, text))


def test_tables(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    path.write_text(
        "name, joint2_deg, joint1_deg, outputs\na, 2.5, 1, '[1:+X]'\nb, , 1,\n".replace(
            "'[1:+X]'", '"[1:+X, 1:+Y]"'
        )
    )
    rows = read_table(path)
    assert rows[0] == (2, {"name": "a", "joint2_deg": 2.5, "joint1_deg": 1, "outputs": ["1:+X", "1:+Y"]})
    assert posture_of(rows[0][1]) == [1, 2.5]
    assert rows[1][1] == {"name": "b", "joint1_deg": 1}
    path.write_text("name,joint1_deg\na\n")
    with pytest.raises(InputError, match=r"t\.csv line 2: 1 cells; expected 2"):
        read_table(path)
    path.write_text("joint1_deg,joint1_deg\n1,2\n")
    with pytest.raises(InputError, match=r"t\.csv line 1: two columns 'joint1_deg'"):
        read_table(path)


def test_tables_of_postures_of_a_robot(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    path.write_text("joint2_deg,joint1_deg,name,f_n\n180,90,a,7\n0,-45,b,8\n")
    names, postures, forces = read_postures(path, 2, ["f_n"])
    assert names == ["a", "b"] and forces.tolist() == [[7], [8]]
    assert postures == pytest.approx(np.pi * np.array([[0.5, 1], [-0.25, 0]]))
    for text in (
        "joint1_deg,joint3_deg\n1,2\n",
        "joint1_deg,joint2_deg,joint3_deg\n1,2,3\n",
        "joint1_deg,joint2_deg\n1,.inf\n",
        "joint1_deg,joint2_deg\n1,true\n",
        "name,joint1_deg\na,1\n",
    ):
        path.write_text(text)
        with pytest.raises(
            InputError, match=r"line 2.*expected numbers in the columns joint1_deg to joint2_deg"
        ):
            read_postures(path, 2)

"""What `check`, `fit` and `discover` say of a set-up, and the corrected study that is written beside."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from identify.cli import app
from identify.core.errors import InputError
from identify.measured.correction import Correction
from identify.measured.finding import STUDY
from identify.measured.frf_set import FrfSet
from identify.measured.uff.write import write_uff58
from identify.robot.read import read_robot
from identify.robot.settings import RobotSettings
from identify.setup import check as setup_of_check
from identify.setup import fit as setup_of_fit
from identify.setup.apply import write_corrected
from identify.setup.bounds import no_phases, placeholders
from identify.setup.check import run_checks
from identify.setup.diagnosis import Looked, look
from identify.setup.edits import Edit, OnLink, in_words
from identify.setup.fit import advise, check_set_up
from identify.vibration.far_places import far_notes
from identify.vibration.problem import load_problem
from identify.vibration.study import read_study
from tests.setup import studies


@pytest.fixture(scope="module")
def tenfold(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A study of files in which all FRFs are ten times too large."""
    folder = tmp_path_factory.mktemp("tenfold")
    return studies.written(
        folder, studies.config(measurements=studies.misread(folder, Correction(factor=10.0)))
    )


@pytest.fixture(scope="module")
def looked(tenfold: Path) -> Looked:
    """What a look at it found."""
    return look(load_problem(read_study(tenfold)))


def test_check_names_it_and_writes_the_corrected_study_beside(
    tenfold: Path, looked: Looked, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = tenfold.read_bytes()
    with monkeypatch.context() as patch:
        patch.setattr(setup_of_check, "look", lambda _: looked)
        done = CliRunner().invoke(app, ["check", str(tenfold), "--apply"])
    assert done.exit_code == 0, done.output
    said = " ".join(done.output.split())
    assert "All FRFs are 10 times what they should be" in said
    assert "measurements.correct.factor: 0.1" in said
    assert "kg, of which" in said, "the total mass"
    assert tenfold.read_bytes() == before
    corrected = tenfold.with_name("arm_corrected.yaml")
    found = read_study(corrected).study
    assert [one.correct.factor for one in found.measurements] == [0.1, 0.1]
    assert not [one for one in run_checks(corrected).findings[STUDY] if one.check == "set-up"]


def test_without_a_mistake_there_is_nothing_to_apply(tmp_path: Path) -> None:
    done = CliRunner().invoke(app, ["check", str(studies.written(tmp_path, studies.config())), "--apply"])
    assert isinstance(done.exception, InputError)
    assert not list(tmp_path.glob("*_corrected*"))


def test_fit_advises_and_discover_does_not_begin(
    tenfold: Path, looked: Looked, monkeypatch: pytest.MonkeyPatch
) -> None:
    problem = load_problem(read_study(tenfold))
    assert advise(problem, 5.0) == [], "no large gap"
    monkeypatch.setattr(setup_of_fit, "look", lambda *_: looked)
    assert "10 times" in advise(problem, 90.0)[0]
    with pytest.raises(InputError, match="--as-stated"):
        check_set_up(problem)


def test_points_on_other_links_go_into_a_file_of_their_own(tmp_path: Path) -> None:
    path = studies.written(tmp_path, studies.config(points="points.csv"))
    text = (studies.DATA / "points.csv").read_text()
    (tmp_path / "points.csv").write_text(text)
    written = write_corrected(read_study(path), [OnLink(9, "link2"), Edit(("seed",), 7)], ["a remark"])
    assert [one.name for one in written] == ["arm_corrected.yaml", "points_corrected.csv"]
    found = read_study(written[0]).study
    assert (found.points, found.seed, found.name) == (Path("points_corrected.csv"), 7, "arm_corrected")
    rows = {line.split(",")[0]: line.split(",")[2] for line in written[1].read_text().splitlines()}
    assert rows["9"] == "link2"
    assert (tmp_path / "points.csv").read_text() == text
    with pytest.raises(InputError, match="the file exists"):
        write_corrected(read_study(path), [], [])


def test_all_files_of_a_measurement_are_looked_at(tmp_path: Path) -> None:
    whole, files = studies.frfs(), []
    channels = [str(channel) for channel in whole.outputs]
    for name, some in (("a", channels[:3]), ("b", channels[3:])):
        write_uff58(tmp_path / f"{name}.uff", whole.chosen(some, None, name))
        files.append(str(tmp_path / f"{name}.uff"))
    first, *rest = studies.each()
    seen = studies.of(tmp_path, studies.config(measurements=[{**first, "file": files}, *rest]))
    assert seen.sets[0].outputs == whole.outputs
    assert np.abs(seen.sets[0].frf).shape[1:] == whole.frf.shape[1:]


def test_edits_in_words() -> None:
    edits = [Edit(("measurements", n, "correct", "factor"), 0.1) for n in range(3)]
    assert in_words(edits) == "`measurements.correct.factor: 0.1`"
    assert in_words([OnLink(5, "link3")]) == "`points: 5 on link3`"


@pytest.mark.parametrize(
    ("change", "check"),
    [(np.abs, "magnitude"), (lambda h: 20 * np.log10(np.abs(h)), "decibels"), (np.real, "real-part")],
)
def test_what_has_no_phase_is_said(change: Callable[[Any], Any], check: str) -> None:
    data = studies.frfs()
    assert list(no_phases(data)) == []
    values = change(data.frf).astype(complex)
    flat = FrfSet(data.frequency_hz, values, data.outputs, data.inputs, data.quantity)
    assert [one.check for one in no_phases(flat)] == [check]


def test_placeholders_are_said(tmp_path: Path) -> None:
    text = (studies.DATA / "robot.urdf").read_text()
    assert not list(placeholders(read_robot(RobotSettings(urdf=studies.DATA / "robot.urdf"), tmp_path)))
    same = 'ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"'
    (tmp_path / "robot.urdf").write_text(re.sub(r'ixx="[^/]*"', same, text))
    [found] = placeholders(read_robot(RobotSettings(urdf=Path("robot.urdf")), tmp_path))
    assert "the same inertia" in found.sentence


def test_beside_what_cannot_be_on_the_robot_no_other_mistake_is_looked_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A point 164 m off, of mm in one coordinate: no fit says anything then."""
    for module in (setup_of_check, setup_of_fit):
        monkeypatch.setattr(module, "look", None)
    text = (studies.DATA / "points.csv").read_text()
    assert "0.164025,0.134683" in text
    (tmp_path / "points.csv").write_text(text.replace("0.164025,0.134683", "164.025,0.134683"))
    path = studies.written(tmp_path, studies.config(points="points.csv"))
    found = [one.check for one in run_checks(path).findings[STUDY] if one.level == "fail"]
    assert found == ["far-point"]
    problem = load_problem(read_study(path))
    assert advise(problem, 90.0) == []
    assert far_notes(problem)[0].startswith("point 10 lies up to 164 m from its link")
    with pytest.raises(InputError, match=r"Point 10 lies up to 164 m .* places on the robot"):
        check_set_up(problem)

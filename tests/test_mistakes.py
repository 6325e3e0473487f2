"""Mistakes of new users (`tests.benchmarks.wrong_inputs`) that were once told wrongly or not at all: what
`check`, or the reader of a file, says of them, and that it says nothing of what is right.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from pydantic import BaseModel, ValidationError

import identify
from identify.core.analyses import checker_of
from identify.core.config import family_of
from identify.core.errors import InputError, InputErrors
from identify.core.parameters import DampingValues
from identify.measured.channel import Channel
from identify.measured.finding import STUDY
from identify.measured.frf_records import FrfFileOptions
from identify.measured.loaders import load_frf_set
from identify.measured.quality_robot import check_robot
from identify.modal.settings import ModalSettings
from identify.modes.setups import read_setups
from identify.reports.kinds import print_findings
from identify.robot.read import read_robot
from identify.robot.settings import RobotSettings
from identify.setup.diagnosis import Looked
from identify.vibration.study import RelativeNoise
from tests.benchmarks import wrong_inputs

ROOT = Path(__file__).parents[1]
CASES = {case.name: case for case in wrong_inputs.cases()}


@pytest.fixture
def no_search(monkeypatch: pytest.MonkeyPatch) -> None:
    """The set-up is not searched for what explains the data, which takes most of the time."""
    monkeypatch.setattr("identify.setup.check.look", lambda _: Looked(1.0))


def said(folder: Path, name: str) -> str:
    """What is said of a mistake by the first of its commands."""
    words = CASES[name].make(folder)[0]
    path = folder / words[-1]
    try:
        if words[0] == "modes":
            return "\n".join(load_frf_set(path).notes)
        checked = checker_of(family_of(path))(path)
    except (InputError, InputErrors) as error:
        return str(error)
    found = [one.sentence for findings in checked.findings.values() for one in findings]
    return "\n".join([*found, *map(str, checked.refused)])


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("tab_indent", "line 6: broken YAML (a tab in the indent)"),
        ("no_break_spaces", "line 6: broken YAML (a no-break or other space U+00A0 in the indent)"),
        ("posture_by_name", "posture_deg: found keys (joint1, joint2); expected a list"),
        ("gravity_a_number", "gravity_m_s2: found 9.81; expected a list"),
        ("gravity_in_mm", "Gravity is 9810 m/s^2: is `gravity_m_s2` in m/s^2?"),
        ("joint_twice", "effects.0.joints: joint 2 twice; expected each joint once"),
        ("noise_in_percent", "noise.relative: found 3; expected less than 1"),
        ("robot_in_mm", "m long from joint to joint: are its lengths in mm?"),
        ("inertia_in_mm", "are inertias in kg mm2?"),
        ("masses_in_g", "would be denser than any metal"),
        ("table_in_mm", "m long from joint to joint: are its lengths in mm?"),
        ("table_in_radians", "turned by 1.571 degrees: are angles in radians where degrees go?"),
        ("copied_line", "are at the same place: was a line copied?"),
        ("workbook", "the file cannot be read (it is a zip archive, such as a workbook"),
        ("pointer", "it is a pointer of Git LFS"),
        ("web_page", "it is a web page"),
        ("compressed", "it is compressed by gzip"),
        ("decibels", "a magnitude below 0; expected magnitudes, not decibels"),
        ("phases_in_radians", "no phase_deg is beyond 3.14: are the phases radians?"),
        ("magnitudes_alone", "FRFs that are real: magnitudes alone?"),
        ("degrees_as_radians", "angles of up to 85 rad: are they degrees?"),
        ("ratio_inverted", "gear_ratio.0: found 0.00556; expected greater than or equal to 1"),
        ("wrong_placeholder", "braces other than {joint} in 'joint{n}.motor_rad'"),
        ("open_brace", "braces other than {joint} in 'joint{joint.motor_rad'"),
        ("truth_as_window", "window_decay_per_s: found 'true'; expected a valid number"),
        ("angle_of_nan", "posture_deg.0: found .nan; expected a number"),
        ("negative_start", "bounds: [-1000, -1e+09]"),
        ("second_mass", "<mass> of <inertial>: a second one; expected one"),
        ("falling", "frequencies that do not rise"),
        ("counts_in_bits", "Encoders of 17 counts a turn have steps of 21.2 degrees: are these bits"),
    ],
)
@pytest.mark.usefixtures("no_search")
def test_a_mistake_is_named(tmp_path: Path, name: str, sentence: str) -> None:
    told = said(tmp_path, name)
    assert sentence in told, told
    assert re.search(CASES[name].cause, told) or name == "counts_in_bits"


def test_points_that_cannot_be_read_are_not_said_to_be_none(tmp_path: Path) -> None:
    assert "No point explains" not in said(tmp_path, "workbook")


def test_a_dead_channel_has_no_part_in_modes(tmp_path: Path) -> None:
    wrong_inputs.dead_channel(tmp_path)
    [(_, data)] = read_setups([tmp_path / "a.csv"], FrfFileOptions(), None, roved=False)
    assert data.outputs == wrong_inputs.frfs().outputs[:1]
    assert re.search(CASES["dead_channel"].cause, data.notes[-1])


def test_a_node_has_the_digits_of_a_universal_file() -> None:
    assert Channel.parse("9999999999:+Z").node == 9999999999
    with pytest.raises(InputError, match="channel '99999999999:"):
        Channel.parse("99999999999:+Z")


@pytest.mark.parametrize("path", sorted((ROOT / "data").glob("*/robot.*")), ids=lambda path: path.parent.name)
def test_of_the_robots_here_nothing_is_said(path: Path) -> None:
    settings = RobotSettings(**{"urdf" if path.suffix == ".urdf" else "dh": path})
    assert [finding.sentence for finding in check_robot(read_robot(settings, path.parent))] == []


def test_phases_in_degrees_are_taken_as_they_are(tmp_path: Path) -> None:
    wrong_inputs.wide(tmp_path, lambda size: size, np.degrees)
    read = load_frf_set(tmp_path / "frfs.csv")
    assert not read.notes
    np.testing.assert_allclose(read.frf, wrong_inputs.frfs().frf, rtol=1e-6)


@pytest.mark.parametrize(
    ("settings", "key"),
    [(RelativeNoise, "relative"), (ModalSettings, "min_contribution"), (DampingValues, "damping_ratio")],
)
def test_a_share_is_no_percentage(settings: type[BaseModel], key: str) -> None:
    with pytest.raises(ValidationError, match="less than 1"):
        settings.model_validate({key: 3})
    settings.model_validate({key: 0.03})


def test_a_study_that_was_not_looked_at_as_a_whole_passes_no_check(
    capsys: pytest.CaptureFixture[str],
) -> None:
    print_findings({"posture1": [], STUDY: []}, whole=False)
    assert capsys.readouterr().out == "posture1: no check failed\n"
    print_findings({"posture1": [], STUDY: []})
    assert "study: no check failed" in capsys.readouterr().out


def test_a_simulation_that_runs_away_is_told_without_a_warning_of_numpy(tmp_path: Path) -> None:
    CASES["period_in_ms"].make(tmp_path)
    done = identify.simulate(tmp_path / "arm.yaml", out=tmp_path / "arm.h5")  # warnings are errors here
    assert any("diverges" in note for note in done.notes)


@pytest.mark.parametrize(
    ("name", "note"),
    [
        ("gravity_in_mm", "gravity is 9810 m/s^2"),
        ("table_in_radians", "neighbouring axes are turned by 1.571 degrees"),
    ],
)
def test_a_fit_without_a_check_says_it_too(tmp_path: Path, name: str, note: str) -> None:
    CASES[name].make(tmp_path)
    fitted = identify.fit(tmp_path / "arm.yaml", out=tmp_path / "arm.h5", report=False)
    assert any(one.startswith(note) for one in fitted.notes), fitted.notes


def test_a_simulation_says_it_too(tmp_path: Path) -> None:
    wrong_inputs.motion(tmp_path)
    study = tmp_path / "arm.yaml"
    study.write_text(study.read_text().replace("robot:\n", "robot:\n  gravity_m_s2: [0, 0, -9810]\n"))
    done = identify.simulate(study, out=tmp_path / "arm.h5", report=False)
    assert done.notes[0].startswith("gravity is 9810 m/s^2")


def test_a_new_study_does_not_take_the_place_of_another(tmp_path: Path) -> None:
    [(_, study, _, out, _)] = wrong_inputs.study_in_the_way(tmp_path)
    with pytest.raises(InputError, match=CASES["study_in_the_way"].cause):
        identify.discover(tmp_path / study, out=tmp_path / out, report=False)
    assert (tmp_path / "other.yaml").read_text() == "precious: true\n"

"""What is carried, how the arm hangs, a window and a brake: mistakes of what the model itself predicts."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from identify.measured.channel import Channel
from identify.measured.quality_robot import check_robot
from identify.setup.brakes import brake, drives
from identify.setup.diagnosis import look
from identify.setup.edits import Edit, in_words
from identify.setup.registry import KINDS
from identify.setup.score import Score, scored
from identify.setup.search import Candidate, refined
from identify.setup.stated import Stated
from identify.vibration.costs.target import FrfTarget
from identify.vibration.problem import load_problem
from identify.vibration.study import read_study
from tests.setup import studies

CENTRE = [0.12, -0.1, 0.05]
AMONG = pytest.mark.parametrize(
    "among",
    [
        pytest.param(("joint-sign", "joint-zero", "window"), id="three kinds"),
        pytest.param(tuple(KINDS), marks=pytest.mark.exam, id="all kinds"),
    ],
)
"""Kinds of mistakes that are asked for: a search through all takes minutes."""


@pytest.fixture
def only(among: tuple[str, ...], monkeypatch: pytest.MonkeyPatch) -> None:
    """No other kind is asked for."""
    for name in KINDS.keys() - {*among}:
        monkeypatch.setitem(KINDS, name, lambda stated, score: iter(()))


def _robot(**keys: Any) -> dict[str, Any]:
    return {**studies.config()["robot"], **keys}


def _payload(centre: list[float]) -> dict[str, Any]:
    return _robot(payload=[{"link": "link6", "mass_kg": 40.0, "centre_m": centre}])


def _told(folder: Path, true: dict[str, Any], told: dict[str, Any]) -> tuple[Stated, Score]:
    measurements = studies.simulated(folder, **true)
    one = studies.of(folder, studies.config(measurements=measurements, **told))
    return one, scored(one.problem())


def _costs(kind: str, told: Stated, plain: Score) -> dict[str, float]:
    """What is left beside each hypothesis at a first look, by what it changes."""
    small = told.glanced()
    return {
        in_words(one.edits): scored(small.changed(one.edits).problem(), plain.values).cost
        for one in KINDS[kind](told, plain)
    }


def test_a_payload_that_is_not_told_is_found_wherever_it_is(tmp_path: Path) -> None:
    told, plain = _told(tmp_path, {"robot": _payload(CENTRE)}, {})
    [best, *_] = refined(Candidate(told, plain), list(KINDS["payload"](told, plain)))
    [edit] = best.hypotheses[-1].settled(best.score)
    assert isinstance(edit, Edit)
    assert edit.key == ("robot", "payload")
    assert edit.value[0]["mass_kg"] == pytest.approx(40.0, rel=0.15)
    assert edit.value[0]["centre_m"] == pytest.approx(CENTRE, abs=0.04)
    assert best.score.cost < 0.25 * plain.cost


def test_a_payload_in_other_axes_is_turned_back(tmp_path: Path) -> None:
    x, y, z = CENTRE
    told, plain = _told(tmp_path, {"robot": _payload(CENTRE)}, {"robot": _payload([y, -x, z])})
    costs = _costs("payload-frame", told, plain)
    assert len(costs) == 47, "all signed orders but the one that is told"
    best = min(costs, key=lambda one: costs[one])
    assert best == f"`robot.payload.0.centre_m: [{x}, {y}, {z}]`"
    assert costs[best] < 0.25 * plain.cost


def test_walls_and_ceiling_are_asked_where_gravity_is_not_stated() -> None:
    told, plain = studies.right()
    found = list(KINDS["gravity"](told, plain))
    pulls = [told.changed(one.edits).robot.gravity for one in found]
    assert len({tuple(pull) for pull in pulls}) == 5
    assert all(np.linalg.norm(pull) == pytest.approx(9.81) for pull in pulls)
    assert "ceiling" in found[0].sentence
    assert pulls[0][2] > 0 > told.robot.gravity[2]
    stated = told.changed(found[0].edits)
    assert not list(KINDS["gravity"](stated, plain))


def test_a_window_that_is_not_told(tmp_path: Path) -> None:
    measurements = studies.simulated(tmp_path, measurements=studies.each(window_decay_per_s=8.0))
    without = [{k: v for k, v in one.items() if k != "window_decay_per_s"} for one in measurements]
    told = studies.of(tmp_path, studies.config(measurements=without))
    plain = scored(told.problem())
    [window] = KINDS["window"](told, plain)
    score = scored(told.changed(window.edits).problem())
    assert score.cost < 0.5 * plain.cost
    settled = [one for one in window.settled(score) if isinstance(one, Edit)]
    assert [one.key for one in settled] == [("measurements", n, "window_decay_per_s") for n in range(2)]
    assert settled[0].value == pytest.approx(8.0, rel=0.05)
    assert not list(KINDS["window"](studies.right()[0], plain)), "it is told"


def test_a_window_that_leaves_a_small_gap_is_named_with_what_puts_it_right(tmp_path: Path) -> None:
    measurements = studies.simulated(tmp_path, measurements=studies.each(window_decay_per_s=8.0))
    without = [{k: v for k, v in one.items() if k != "window_decay_per_s"} for one in measurements]
    path = studies.written(tmp_path, studies.config(measurements=without))
    found = look(load_problem(read_study(path)))
    assert 2 < found.gap < 6
    assert found.diagnosis is not None
    assert found.diagnosis.codes == ("window",)
    assert found.diagnosis.gap_after < 0.1, "what was simulated has no noise"
    told = [one for one in found.diagnosis.edits if isinstance(one, Edit)]
    assert [one.value for one in told] == pytest.approx([8.0, 8.0], rel=0.01)


@AMONG
@pytest.mark.usefixtures("only")
def test_a_window_is_seen_once_a_larger_mistake_is_put_right(tmp_path: Path) -> None:
    measurements = studies.simulated(tmp_path, measurements=studies.each(window_decay_per_s=8.0))
    without = [{k: v for k, v in one.items() if k != "window_decay_per_s"} for one in measurements]
    wrong = {"sign": [1, -1, 1, 1, 1, 1]}
    path = studies.written(tmp_path, studies.config(measurements=without, joint_angles=wrong))
    found = look(load_problem(read_study(path))).diagnosis
    assert found is not None
    assert set(found.codes) == {"joint-sign", "window"}
    assert found.gap_after < 0.1


@pytest.mark.parametrize(("factor", "number"), [(6.0, 1), (1 / 6.0, 0)])
def test_a_brake_is_on_in_one_file(factor: float, number: int, tmp_path: Path) -> None:
    measurements = studies.simulated(tmp_path, {"joint3.rz.stiffness": factor})
    told = studies.of(tmp_path, studies.config(measurements=measurements))
    found = brake(told, scored(told.problem()))
    assert found is not None
    assert (found.joint, found.number) == (3, number), "of two files where it is stiffer"
    assert found.ratio == pytest.approx(6.0, rel=0.1)
    assert found.share < 0.1
    assert f"simulated{number}.uff" in found.sentence(told)
    kept = told.changed([found.edit]).study.measurements
    assert [one.use for one in kept] == ["validate" if n == number else "fit" for n in range(2)]


@AMONG
@pytest.mark.usefixtures("only")
def test_a_brake_is_on_beside_a_mistake_in_all_files(tmp_path: Path) -> None:
    measurements = studies.simulated(tmp_path, {"joint6.rz.stiffness": 6.0})
    wrong = {"sign": [1, -1, 1, 1, 1, 1]}
    path = studies.written(tmp_path, studies.config(measurements=measurements, joint_angles=wrong))
    found = look(load_problem(read_study(path))).diagnosis
    assert found is not None
    assert found.codes == ("joint-sign", "brake")
    assert [edit.key for edit in found.edits if isinstance(edit, Edit)][-1] == ("measurements", 1, "use")
    assert found.gap_after < 1.15


@AMONG
@pytest.mark.usefixtures("only")
def test_what_a_brake_hid_is_asked_of_the_other_files(tmp_path: Path) -> None:
    true = studies.each(window_decay_per_s=8.0)
    measurements = studies.simulated(tmp_path, {"joint6.rz.stiffness": 4.0}, measurements=true)
    without = [{k: v for k, v in one.items() if k != "window_decay_per_s"} for one in measurements]
    path = studies.written(tmp_path, studies.config(measurements=without))
    found = look(load_problem(read_study(path))).diagnosis
    assert found is not None
    assert found.codes == ("brake", "window")
    assert found.gap_after < 0.1


def test_no_brake_where_files_agree_or_there_is_one(tmp_path: Path) -> None:
    assert brake(*studies.right()) is None
    alone = studies.of(tmp_path, studies.config(measurements=studies.each()[:1]))
    assert brake(alone, scored(alone.problem())) is None


def test_a_base_that_turns_about_its_axis_is_no_drive() -> None:
    names = ["joint1.rz.stiffness", "joint1.rz.damping", "joint2.rx.stiffness", "base.rz.stiffness"]
    assert drives([*names, "payload1.rz.stiffness", "joint10.rz.stiffness"]) == [0, 5]


def test_what_only_rounding_moves_does_not_move(tmp_path: Path) -> None:
    """A hypothesis is not lost because a row of zeros is one of rounding in the other study."""
    told = studies.of(tmp_path, studies.config())
    plain, whole = (Candidate(told, scored(told.problem())) for _ in range(2))
    target = plain.score.problem.measurements[0].target
    assert isinstance(target, FrfTarget)
    assert target.out is not None
    place = target.data.outputs.index(Channel.parse("14:+Z", ""))
    target.out[place] *= 1e-17
    assert plain.moving == whole.moving - len(target.data.inputs)


def test_angles_of_a_robot_file_in_degrees_are_named(tmp_path: Path) -> None:
    """They are read as they stand, but no pose is turned by more than once around."""
    text = (studies.DATA / "robot.urdf").read_text()
    in_degrees = re.sub(
        r'rpy="([^"]*)"',
        lambda found: f'rpy="{" ".join(str(np.degrees(float(x))) for x in found[1].split())}"',
        text,
    )
    (tmp_path / "robot.urdf").write_text(in_degrees)
    told = studies.of(tmp_path, studies.config(robot={"urdf": "robot.urdf"}))
    [found] = [one for one in check_robot(told.robot) if one.check == "robot-angles"]
    assert "`robot.units.angle: deg`" in found.sentence and found.level == "warn"
    plain = Score(told.problem(), told.problem().initial, 1.0, 0.0)
    [degrees] = [one for one in KINDS["robot-units"](told, plain) if "degrees" in one.sentence]
    right, settled = studies.right()[0].robot, told.changed(degrees.edits).robot
    assert not list(check_robot(settled)) and not list(check_robot(right))
    for one, other in zip(settled.joints, right.joints, strict=True):
        np.testing.assert_allclose(one.origin, other.origin, atol=1e-8)
    assert not [one for one in KINDS["robot-units"](studies.right()[0], plain) if "degrees" in one.sentence]

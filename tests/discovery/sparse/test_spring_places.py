"""A payload's soft mount and the springs of a bearing are moved to where they act."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from identify.core.arrays import Array, Complex
from identify.core.threads import one_thread
from identify.discovery.decimated import decimated
from identify.discovery.records import timed
from identify.discovery.sparse.dense import with_more
from identify.discovery.sparse.dictionary import Beside
from identify.discovery.sparse.evidence import PAYS
from identify.discovery.sparse.fit import dense_fit, gone_on
from identify.discovery.sparse.objective import Penalised
from identify.discovery.sparse.search import explain
from identify.discovery.sparse.spring_places import at_frames, displaced, located, moved_springs
from identify.discovery.sparse.unknowns import Unknowns
from identify.model.effects.base import Effect, parse_effect
from identify.model.effects.joint_compliance import JointCompliance
from identify.model.effects.link_flexibility import LinkFlexibility
from identify.model.effects.mount_compliance import MountCompliance
from identify.vibration.all_springs import all_springs, usual_springs
from identify.vibration.problem import Problem, load_problem, with_effects
from identify.vibration.study import read_study
from tests.generator.cases import hide
from tests.generator.generate import generate
from tests.generator.makes import MAKES
from tests.generator.spec import TestSpec
from tests.hidden import config_of
from tests.robots_otherwise import Described, with_other_frames

PAYLOAD = {
    "link": "link6",
    "mass_kg": 8.0,
    "centre_m": [0.0, 0.0, 0.15],
    "inertia_kg_m2": [0.1, 0.1, 0.1, 0, 0, 0],
}
SOFT = 2e-5
"""rad/(N m)."""


def _with_payload(folder: Path) -> Problem:
    spec = TestSpec(
        MAKES["compact"](4).at_points([5, 12, 14]), seed=4, averages=2, oversampling=8, linear=True
    )
    generate(replace(spec, case="test"), folder / "test")
    test = json.loads((folder / "test" / "test.json").read_text())
    (folder / "test" / "test.json").write_text(json.dumps({**test, "payload": PAYLOAD}))
    return load_problem(read_study(config_of(folder / "test", folder)))


def _values(model: Problem) -> Array:
    """The study's first guesses, and a mount that tilts."""
    soft = {f"payload1.{axis}.compliance": SOFT for axis in ("rx", "ry")}
    return np.array([soft.get(p.name, p.initial) for p in model.parameters])


def test_what_else_of_a_mount_may_give_way_is_where_it_is(tmp_path: Path) -> None:
    """Springs along and about its axes beside a mount that is there, as what has no name is looked at."""
    mount = MountCompliance(axes=["rx", "ry"], at_m=(0.0, 0.0, 0.03))
    there = with_effects(_with_payload(tmp_path), (mount,), {})
    every = (mount, *usual_springs(there, {"joint1.rz.stiffness": 1e6}))
    found = {p.name for p in with_effects(there, every, {}).of_effects if p.name.startswith("payload1.")}
    axes = ("tx", "ty", "tz", "rz")
    assert {f"payload1.{axis}.compliance" for axis in axes} | {"payload1.rx.stiffness"} <= found


@pytest.mark.parametrize("place", [(0.0, 0.0, 0.03), (0.02, -0.01, 0.05)])
def test_steps_lead_to_where_the_mount_is(tmp_path: Path, place: tuple[float, float, float]) -> None:
    study = _with_payload(tmp_path)
    effects: tuple[Effect, ...] = (MountCompliance(axes=["rx", "ry"], shrink=True),)
    there = with_more(study, [effects[0].model_copy(update={"at_m": place})])
    read = [target.predict(_values(there)) for target in there.targets().frf]
    fitted = [m for m in study.measurements if m.settings.use == "fit"]
    study = replace(study, measurements=tuple(map(_reading, fitted, read)))
    for _ in range(4):
        model = with_more(study, effects)
        unknowns = Unknowns(model, len(study.file.study.effects))
        x = unknowns.to_x(_values(model))
        product = Penalised(unknowns, price=0.0).local(x).product
        [(gain, effects, _)] = moved_springs(study, effects, Beside.of(unknowns, x, product))
        assert gain >= 0
    assert effects[0].at_m == pytest.approx(place, abs=2e-3)  # type: ignore[attr-defined]


def _reading(measurement: Any, frf: Complex) -> Any:
    data = replace(measurement.target.data, frf=frf)
    given = replace(measurement.given, data=data)
    return replace(measurement, given=given, target=replace(measurement.target, data=data))


def _hammered(folder: Path, case: str, along_m: float, make: str = "large") -> Problem:
    """A test with something hidden, two postures fitted, of an arm whose frames are moved along its axes."""
    arm = MAKES[make](5).at_points([5, 9, 12, 14])
    spec = TestSpec(arm, seed=5, postures=2, averages=2, binary=True, oversampling=4, linear=True)
    generate(replace(hide(spec, case), case="test"), folder / "test")
    robot, points = folder / "test" / "robot.urdf", folder / "test" / "points.csv"
    one = Described.of(robot.read_text(), points.read_text(), [])
    with_other_frames(lambda axis: 0 * axis, along_m)(one)
    for path, text in zip((robot, points), one.texts(), strict=True):
        path.write_text(text, encoding="utf-8")
    return decimated(timed(load_problem(read_study(config_of(folder / "test", folder)))))


@pytest.mark.parametrize(
    ("make", "case", "along_m", "wanted"),
    [
        ("compact", "tilt_j2", 0.1, {"tilt compliance of joint 2 (rx, ry), -0.100 m along its axis"}),
        ("large", "tilt_j3", -0.06, {"tilt compliance of joint 3 (rx, ry), 0.060 m along its axis"}),
        ("large", "tilt_j3", 0.0, {"tilt compliance of joint 3 (rx, ry)"}),
        ("large", "base_rocking", 0.1, {"compliance of the base (rx, ry)"}),
        ("large", "none", 0.1, set()),
    ],
)
def test_a_bearing_is_named_where_it_acts(
    tmp_path: Path, make: str, case: str, along_m: float, wanted: set[str]
) -> None:
    """And nothing else, wherever the frames of joints are; the place is in the new study."""
    with one_thread():
        named = explain(_hammered(tmp_path, case, along_m, make)).named
    assert {one.effect.sentence() for one in named} == wanted
    for one in named:
        assert parse_effect(one.effect.model_dump(mode="json")) == one.effect
        if along_m and isinstance(one.effect, JointCompliance):
            assert one.effect.at_m == pytest.approx(-along_m, abs=2e-3)


def test_a_place_that_nothing_asks_for_goes(tmp_path: Path) -> None:
    """Also one that stood for something else, once that is there."""
    study = _hammered(tmp_path, "tilt_j3", 0.0)
    tilt = JointCompliance(joints=[3], axes=["rx", "ry"], shrink=True)
    found = dense_fit(study, (tilt,))
    elsewhere = gone_on(found, (tilt.model_copy(update={"at_m": 0.001}),), {})
    assert elsewhere.unknowns.size == found.unknowns.size + 1
    [back] = at_frames(elsewhere)
    assert back.effects == (tilt,)
    assert not list(at_frames(back))
    assert not list(displaced(back, PAYS * back.price))
    far = gone_on(found, (tilt.model_copy(update={"at_m": 0.15}),), {})
    assert located(far).effects[0].at_m == pytest.approx(0.0, abs=2e-3)  # type: ignore[attr-defined]


def test_a_place_that_the_study_states_stays(tmp_path: Path) -> None:
    study = _hammered(tmp_path, "tilt_j3", 0.1)
    stated = JointCompliance(joints=[3], axes=["tx"], at_m=0.05)
    study = with_effects(study, [*study.file.study.effects, stated], {})
    tilt = JointCompliance(joints=[3], axes=["rx", "ry"], shrink=True)
    assert not list(displaced(dense_fit(study, (tilt,)), 0.0))


def test_a_gripper_on_a_soft_mount_is_found_where_it_turns(tmp_path: Path) -> None:
    """And no drive stands for it; it is told as payload and turns at 13 to 30 Hz."""
    study = _hammered(tmp_path, "gripper", 0.0)
    truth = json.loads((tmp_path / "test.truth.json").read_text())
    [gripper], springs = truth["effects"], all_springs(study, shrink=True)
    with one_thread():
        found = located(
            dense_fit(study, tuple(one for one in springs if not isinstance(one, LinkFlexibility)))
        )
    [mount] = [one for one in found.effects if isinstance(one, MountCompliance)]
    assert mount.at_m == pytest.approx(gripper["position"], abs=3e-3)
    compliances = [found.values[f"payload1.{axis}.compliance"] for axis in ("rx", "ry", "rz")]
    assert compliances == pytest.approx(1 / np.array(gripper["stiffness"]), rel=0.05)
    assert [found.values[f"joint{n}.rz.stiffness"] for n in range(1, 7)] == pytest.approx(
        truth["k"], rel=0.02
    )

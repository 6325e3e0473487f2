"""Springs of a bearing that act elsewhere along its axis than at the frame of its joint."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from identify.core.arrays import Array, Complex
from identify.core.errors import InputError
from identify.model.effects.base import Effect, parse_effect
from identify.model.frf import frf
from identify.model.system import assemble, build_site
from identify.robot.description import Robot
from identify.robot.urdf import read_urdf
from tests.arms import arm
from tests.robot.random_arm import industrial_arm
from tests.robots_otherwise import Described, with_other_frames

POSTURE = np.radians([10.0, 20.0, 40.0, 10.0, 50.0, 30.0])
MOVED = 0.13
SOFT = {"joints": [2, 4], "stiffness": {"initial": 2e5}}
TILT: list[dict[str, Any]] = [{**SOFT, "axes": ["rx", "ry"]}]
BOTH = [*TILT, {**SOFT, "axes": ["tx", "ty"], "joints": [2]}]
COUPLED: list[dict[str, Any]] = [{**SOFT, "axes": ["rx", "ry", "tx", "ty"], "coupled": True}]
BODY = {"kind": "added-mass", "link": "link4", "mass": {"initial": 200.0, "bounds": [0.0, 500.0]}}


def _otherwise(folder: Path) -> tuple[Robot, Array]:
    """The arm with its frames moved along its axes, and where a point of the last link is then."""
    path = folder / "moved.urdf"
    row = {"link": "link6", "x_m": "0.1", "y_m": "0.2", "z_m": "0.3"}
    one = Described.of(industrial_arm(1), ",".join(row) + "\n" + ",".join(row.values()) + "\n", [])
    with_other_frames(lambda axis: 0 * axis, MOVED)(one)
    path.write_text(one.texts()[0], encoding="utf-8")
    [point] = one.points
    return read_urdf(path), np.array([float(point[key]) for key in ("x_m", "y_m", "z_m")])


def _springs(some: list[dict[str, Any]], **more: object) -> list[Effect]:
    joints = [{"kind": "joint-compliance", **one, **more} for one in some]
    return [parse_effect(one) for one in [{"kind": "joint-compliance", "axes": ["rz"]}, *joints]]


def _read(robot: Robot, effects: list[Effect], point: Array) -> tuple[Complex, Array]:
    system = assemble(robot, build_site(robot, POSTURE, effects), effects)
    out = system.base_jacobian("link6", point)
    values = np.array([p.initial + 0.1 * (p.initial == 0) for p in system.parameters])
    matrices = system.matrices(values)
    return frf(*matrices, 2j * np.pi * np.linspace(2, 60, 40), out, out.T, 2), matrices[2]


@pytest.mark.parametrize("some", [TILT, BOTH, COUPLED])
@pytest.mark.parametrize("shrink", [False, True])
def test_a_frame_along_the_axis_says_nothing_where_the_springs_act_at_the_bearing(
    tmp_path: Path, some: list[dict[str, Any]], shrink: bool
) -> None:
    """To the last digits, with all weights, also that of a body without a name of its own."""
    told = {"shrink": True, "coupled": False} if shrink else {}
    heavy = [] if shrink else [parse_effect({**BODY, "at_m": [0.0, 0.0, 0.0]})]
    frfs, stiffness = _read(arm(tmp_path), [*_springs(some, **told), *heavy], np.array([0.1, 0.2, 0.3]))
    robot, point = _otherwise(tmp_path)
    axis = np.eye(3)[2]  # of joint 4, along which the frame of link4 has moved
    heavy = [one.model_copy(update={"at_m": tuple((-MOVED * axis).tolist())}) for one in heavy]
    other, there = _read(robot, [*_springs(some, **told, at_m=-MOVED), *heavy], point)
    assert np.abs(other - frfs).max() < 1e-9 * np.abs(frfs).max()
    assert np.abs(there - stiffness).max() < 1e-9 * np.abs(stiffness).max()
    at_frame, _ = _read(robot, [*_springs(some, **told), *heavy], point)
    assert np.abs(at_frame - frfs).max() > 1e-3 * np.abs(frfs).max()


def test_one_place_holds_for_all_springs_of_a_joint(tmp_path: Path) -> None:
    """Also for those that do not say where they act."""
    robot, point = arm(tmp_path), np.array([0.1, 0.2, 0.3])
    tilt, slide = ({"axes": axes, "joints": [2]} for axes in (["rx", "ry"], ["tx", "ty"]))
    frfs, _ = _read(robot, _springs([tilt, slide], at_m=0.1), point)
    other, _ = _read(robot, _springs([{**tilt, "at_m": 0.1}, slide]), point)
    np.testing.assert_array_equal(other, frfs)


@pytest.mark.parametrize("other", [0.0, 0.05])
def test_two_places_of_one_bearing_are_refused(tmp_path: Path, other: float) -> None:
    tilt, slide = ({"axes": axes, "joints": [2]} for axes in (["rx", "ry"], ["tx", "ty"]))
    effects = _springs([{**tilt, "at_m": 0.1}, {**slide, "at_m": other}])
    with pytest.raises(InputError, match=r"effects.2.at_m: .* elsewhere than in an effect above"):
        build_site(arm(tmp_path), POSTURE, effects)


def test_the_place_is_a_number_and_told() -> None:
    [_, spring] = _springs(TILT, at_m=-0.06)
    assert spring.sentence() == "tilt compliance of joints 2, 4 (rx, ry), -0.060 m along its axis"
    with pytest.raises(ValueError, match="at_m"):
        _springs(TILT, at_m=float("nan"))

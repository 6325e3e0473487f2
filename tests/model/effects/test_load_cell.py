"""A load cell in the force path: what hangs on it swings on its springs, a stiff one is not there, and wrong
places are refused.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from identify.core.errors import InputError
from identify.model.effects.base import parse_effect
from identify.model.effects.load_cell import LoadCell
from identify.model.frf import frf_by_solve
from identify.model.system import build_site
from identify.robot.description import Robot
from identify.robot.points import Point
from tests.arms import arm, initial
from tests.robot.random_arm import random_posture
from tests.targets import model

S = 2j * np.pi * np.linspace(5, 60, 12)
HELD = parse_effect({"kind": "joint-compliance", "stiffness": {"initial": 1e14, "bounds": [1, 1e15]}})
DRIVES = parse_effect({"kind": "joint-compliance"})


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> Robot:
    """One arm for all."""
    return arm(tmp_path_factory.mktemp("arm"))


def _place(robot: Robot, height: float) -> np.ndarray:
    """A point of the last link on the last joint's axis."""
    mount = robot.joints[-1].mount
    return np.asarray(-mount[:3, :3].T @ mount[:3, 3] + height * (mount[:3, :3].T @ robot.joints[-1].axis))


def _cell(robot: Robot, **changes: Any) -> Any:
    centre = tuple(_place(robot, 0.2).tolist())
    settings = {
        "link": "link6",
        "at_m": 0.1,
        "mass": {"initial": 2.0, "bounds": [0.1, 5.0]},
        "centre_m": centre,
    }
    return parse_effect(
        {"kind": "load-cell", **settings, "stiffness": {"initial": [1e5, 2e5, 3e5]}, **changes}
    )


def _receptance(robot: Robot, effects: list[Any], response: float, force: float) -> np.ndarray:
    system, parameters = model(robot, effects)
    out, push = (system.jacobian("link6", _place(robot, height))[:3] for height in (response, force))
    return frf_by_solve(*system.matrices(initial(parameters)), S, out, push.T, 0)


def test_on_a_robot_that_is_held_it_is_a_mass_on_three_springs(robot: Robot) -> None:
    h = _receptance(robot, [HELD, _cell(robot, damping={"initial": 30.0})], 0.25, 0.25)
    for axis, stiffness in enumerate((1e5, 2e5, 3e5)):
        assert h[:, axis, axis] == pytest.approx(1 / (stiffness + 30.0 * S + 2.0 * S**2), rel=1e-4)
    before = _receptance(robot, [HELD, _cell(robot)], 0.05, 0.05)
    assert np.abs(before).max() < 1e-3 * np.abs(h).max(), "what is before the cell stands with the robot"


def test_a_stiff_cell_is_not_there_and_a_soft_one_is(robot: Robot) -> None:
    rigid = _receptance(robot, [DRIVES], 0.05, 0.25)
    stiff = _receptance(robot, [DRIVES, _cell(robot, stiffness={"initial": 1e12})], 0.05, 0.25)
    soft = _receptance(robot, [DRIVES, _cell(robot)], 0.05, 0.25)
    assert stiff == pytest.approx(rigid, rel=1e-5, abs=1e-12)
    assert np.linalg.norm(soft - rigid) > 0.05 * np.linalg.norm(rigid)


def test_places_lie_between_neighbours_on_the_last_link(robot: Robot) -> None:
    heights = {12: 0.08, 14: 0.30}
    points = {
        node: Point(node, str(node), "link6", _place(robot, height), np.eye(3), "")
        for node, height in heights.items()
    }
    assert [place.at_m for place in LoadCell.instances(robot, points)] == pytest.approx([0.04, 0.19])


def test_a_link_between_two_joints_is_refused(robot: Robot) -> None:
    with pytest.raises(InputError, match="link5 carries a further joint; expected the last link, link6"):
        build_site(robot, random_posture(1), [DRIVES, _cell(robot, link="link5")])

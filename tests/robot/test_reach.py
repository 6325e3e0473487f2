"""Postures for places, against the engine and against places of postures that are known."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from identify.robot.description import Robot
from identify.robot.engine import Engine
from identify.robot.posture import at_posture
from identify.robot.reach import about, placed, reached, shortest
from tests.arms import arm
from tests.robot.random_arm import random_posture

POINT = np.array([0.05, -0.02, 0.1])


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> Robot:
    folder: Path = tmp_path_factory.mktemp("arm")
    return arm(folder, 4)


def test_a_place_is_the_engine_s(robot: Robot) -> None:
    posture, link = random_posture(4), robot.links[-1].name
    engine = Engine(at_posture(robot, posture))
    place, axes, motion = placed(robot, posture, link, POINT)
    assert place == pytest.approx(engine.position(link, POINT), abs=1e-12)
    assert axes == pytest.approx(engine.axes(link), abs=1e-12)
    for joint in range(6):
        step = 1e-6 * np.eye(6)[joint]
        up, down = (placed(robot, posture + sign * step, link, POINT) for sign in (1, -1))
        assert (up[0] - down[0]) / 2e-6 == pytest.approx(motion[:3, joint], abs=1e-8)
        spin = (up[1] - down[1]) / 2e-6 @ axes.T
        assert [spin[2, 1], spin[0, 2], spin[1, 0]] == pytest.approx(motion[3:, joint], abs=1e-8)


def test_places_of_known_postures_are_reached(robot: Robot) -> None:
    rng, start, link = np.random.default_rng(2), random_posture(4), robot.links[-1].name
    for _ in range(10):
        place, axes, _ = placed(robot, start + rng.uniform(-0.4, 0.4, 6), link, POINT)
        found = reached(robot, link, POINT, place, axes, [start])
        assert found is not None
        there = placed(robot, found, link, POINT)
        assert there[0] == pytest.approx(place, abs=1e-7)
        assert there[1] == pytest.approx(axes, abs=1e-7)
    assert reached(robot, link, POINT, np.array([50.0, 0.0, 0.0]), np.eye(3), [start]) is None


def test_what_a_turn_of_a_joint_changes_is_that_of_another_posture(robot: Robot) -> None:
    posture, link = random_posture(4), robot.links[-1].name
    engine = Engine(at_posture(robot, posture))
    for joint in (1, 3, 6):
        step = 1e-4 * np.eye(6)[joint - 1]
        mass, motion = engine.turning(joint, link, POINT)
        sides = [Engine(at_posture(robot, posture + sign * step)) for sign in (1, -1)]
        masses = [one.mass_matrix() for one in sides]
        motions = [one.axes(link) @ one.jacobian(link, POINT)[:3] for one in sides]
        expected = (masses[0] - masses[1]) / 2e-4
        assert mass == pytest.approx(expected, abs=1e-5 * max(1.0, np.abs(expected).max()))
        assert motion == pytest.approx((motions[0] - motions[1]) / 2e-4, abs=1e-6)
    assert np.abs(motion).max() > 0.01


def test_the_shortest_turn_takes_one_direction_to_another() -> None:
    for second in ([0.2, -0.5, 1.0], [0.0, 0.0, -1.0], [0.0, 0.0, 2.0]):
        turn = shortest(np.array([0.0, 0.0, 3.0]), np.array(second))
        assert turn @ [0.0, 0.0, 1.0] == pytest.approx(second / np.linalg.norm(second), abs=1e-12)
        assert turn @ turn.T == pytest.approx(np.eye(3), abs=1e-12)
    assert about(np.array([0.0, 0.0, 2.0]), np.pi / 2) @ [1.0, 0.0, 0.0] == pytest.approx(
        [0, 1, 0], abs=1e-12
    )

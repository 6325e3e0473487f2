"""Sensors on one link that cannot move as they say: in a simulated test with one spoilt channel, and in rigid
motions of three sensors.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from identify.measured.channel import Channel
from identify.measured.frf_set import FrfSet
from identify.vibration.check import run_checks
from identify.vibration.problem import Problem, load_problem
from identify.vibration.rigid_links import _finding, _Link, rigid_link_findings
from identify.vibration.study import read_study
from tests.vibration.test_check import changed

ROOT = Path(__file__).parents[2]


def turned_point(data: dict[str, Any], folder: Path) -> None:
    lines = Path(data["points"]).read_text().splitlines()
    turned = [f"{lines[0]},rx_deg,ry_deg,rz_deg"]
    turned += [f"{line},{180 if line.startswith('13,') else 0},0,0" for line in lines[1:]]
    (folder / "points.csv").write_text("\n".join(turned) + "\n")
    data["points"] = str(folder / "points.csv")


@pytest.fixture(scope="module")
def problem() -> Problem:
    return load_problem(read_study(ROOT / "configs" / "arm_hammer_test.yaml"))


def spoilt(problem: Problem, spoil: Callable[[FrfSet], FrfSet]) -> Problem:
    first = problem.measurements[0]
    assert isinstance(first.given.data, FrfSet)
    given = replace(first.given, data=spoil(first.given.data))
    return replace(problem, measurements=(replace(first, given=given),))


def scaled(outputs: list[int], factor: float) -> Callable[[FrfSet], FrfSet]:
    def change(data: FrfSet) -> FrfSet:
        frf = data.frf.copy()
        frf[:, outputs] *= factor
        return replace(data, frf=frf)

    return change


def test_a_clean_test_raises_nothing(problem: Problem) -> None:
    assert list(rigid_link_findings(problem)) == []


@pytest.mark.parametrize(("outputs", "factor"), [([25], -1.0), ([24, 25, 26], 2.0)], ids=["sign", "gain"])
def test_a_sensor_that_contradicts_its_neighbour_is_found(
    problem: Problem, outputs: list[int], factor: float
) -> None:
    found = list(rigid_link_findings(spoilt(problem, scaled(outputs, factor))))
    assert [one.check for _, one in found] == ["rigid-link"]
    assert "points 13, 14 is wrong they cannot tell" in found[0][1].sentence


def three_sensors(spoil: Callable[[np.ndarray], None]) -> _Link:
    """Three triaxial sensors on a body that moves at random, each 3 % and 2 degrees off."""
    rng = np.random.default_rng(8)
    places = np.array([[0.3, 0, 0], [0, 0.4, 0.1], [-0.2, 0.1, 0.5]])
    directions = np.vstack([np.eye(3)] * 3)
    arms = np.repeat(places, 3, axis=0)
    rows = np.hstack([directions, np.cross(arms, directions)])
    motion = rng.normal(size=(6, 100)) + 1j * rng.normal(size=(6, 100))
    turned = directions + 0.035 * rng.normal(size=directions.shape)
    readings = (1 + 0.03 * rng.normal(size=(9, 1))) * (np.hstack([turned, np.cross(arms, turned)]) @ motion)
    spoil(readings)
    channels = tuple(Channel(node, axis) for node in (1, 2, 3) for axis in (1, 2, 3))
    own = np.mean(np.abs(readings) ** 2, axis=1)
    return _Link("link3", channels, rows, readings, np.zeros(9), np.repeat(own.reshape(3, 3).sum(1), 3))


def turned_over(readings: np.ndarray) -> None:
    readings[4] *= -1


def doubled_sensor(readings: np.ndarray) -> None:
    readings[3:6] *= 2.0


def as_it_is(readings: np.ndarray) -> None:
    """Nothing is spoilt."""


def test_careless_hands_are_no_fault() -> None:
    assert three_sensors(as_it_is).misfit() < 1.5


def test_check_tells_it_before_what_is_no_fault(tmp_path: Path) -> None:
    """With the sensor at point 13 turned over in `points.csv`, in place of in the data."""
    config = changed(tmp_path, turned_point)
    told = [one.check for one in run_checks(config).findings["posture1"]]
    assert told.index("rigid-link") < told.index("coherence")


def test_of_three_sensors_the_wrong_channel_is_named() -> None:
    link = three_sensors(turned_over)
    found = _finding(link, link.misfit())
    assert found.channels == (Channel(2, 2),)
    assert "without 2:+Y they would" in found.sentence


def test_of_three_sensors_the_wrong_one_is_named() -> None:
    link = three_sensors(doubled_sensor)
    found = _finding(link, link.misfit())
    assert {channel.node for channel in found.channels} == {2}

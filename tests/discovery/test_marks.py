"""Where effects are marked on the robot: joints, points and links at a posture, in the base's axes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from identify.discovery.marks import marks
from identify.model.effects.base import parse_effect
from identify.vibration.problem import Problem, load_problem
from identify.vibration.study import read_study

CONFIG = Path(__file__).parents[2] / "configs" / "arm_hammer_test.yaml"


@pytest.fixture(scope="module")
def problem() -> Problem:
    return load_problem(read_study(CONFIG))


def test_a_joint_that_tilts_is_marked_at_its_origin_with_both_axes(problem: Problem) -> None:
    found = marks(problem, [parse_effect({"kind": "joint-compliance", "joints": [2], "axes": ["rx", "ry"]})])
    engine = problem.measurements[0].system.site.engine
    rigid, names = engine.jacobian("link2", np.zeros(3)), engine.mechanism.coordinates
    assert found.at_m == pytest.approx(np.tile(engine.position("link2", np.zeros(3)), (2, 1)), abs=1e-9)
    turned = np.array([rigid[3:, names.index(f"joint2.{axis}")] for axis in ("rx", "ry")])
    assert found.along == pytest.approx(turned @ engine.axes("link2").T, abs=1e-9)
    third = marks(problem, [parse_effect({"kind": "joint-compliance", "joints": [3], "axes": ["rx"]})])
    assert np.linalg.norm(third.at_m[0] - found.at_m[0]) > 0.1


def test_a_channel_is_marked_at_its_point_and_a_delay_nowhere(problem: Problem) -> None:
    node, point = next(iter(problem.points.items()))
    polarity = parse_effect({"kind": "channel-polarity", "channel": f"{node}:+X"})
    found = marks(problem, [polarity, parse_effect({"kind": "time-delay"})])
    engine = problem.measurements[0].system.site.engine
    assert found.sentence == (polarity.sentence(),)
    assert found.at_m == pytest.approx(engine.position(point.link, point.position)[None])
    assert np.isnan(found.along).all()
    assert marks(problem, []).at_m.shape == (0, 3)

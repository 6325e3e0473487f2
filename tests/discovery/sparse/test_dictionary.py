"""What the catalogue offers beside a dense fit."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from identify.discovery.sparse.dictionary import _shapes, _there
from identify.model.effects.appended_resonator import AppendedResonator
from identify.model.effects.geared import RotorInertia
from identify.vibration.problem import load_problem, systems_with
from identify.vibration.study import read_study

KOBE = Path(__file__).parents[3] / "configs" / "kobe_36dof_defaults.yaml"


@pytest.mark.parametrize("link", ["link2", "link4"])
def test_a_body_on_a_spring_is_one_where_its_link_was_taken_off_for_the_first_test(link: str) -> None:
    """Link 4 is off in the first: without a spring, what it brings in the second has no stiffness."""
    problem = load_problem(read_study(KOBE))
    systems = systems_with(problem, [AppendedResonator(link=link, axis="x")])
    shape = _shapes(systems, problem, -1)
    names = [p.name.rsplit(".", 1)[1] for p in shape.parameters]
    assert not shape.adding
    assert np.all(shape.starts[:, [names.index("mass"), names.index("stiffness")]] > 0)
    assert not _there(shape, problem)


def test_a_rotor_that_a_servo_has_is_not_offered_again() -> None:
    problem = load_problem(read_study(KOBE))
    rotor = next(one for one in RotorInertia.instances(problem.robot, problem.points) if one.joints == [5])
    assert _there(_shapes(systems_with(problem, [rotor]), problem, -1), problem)

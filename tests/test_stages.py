"""Stages of a fit that move some parameters only, on some measurements only."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from identify.core.errors import InputError
from identify.fitting.fit import fit
from identify.vibration.plan import fit_plan
from identify.vibration.problem import Problem, load_problem
from identify.vibration.study import read_study

CONFIG = Path(__file__).parents[1] / "configs" / "arm_hammer_test.yaml"


@pytest.fixture(scope="module")
def shipped() -> Problem:
    """The shipped example with its data, which no optimizer changes."""
    return load_problem(read_study(CONFIG))


Made = Callable[[str], Problem]


@pytest.fixture
def problem_with(shipped: Problem, tmp_path: Path) -> Made:
    """The example with an optimizer and one start."""

    def made(optimizer: str) -> Problem:
        text = CONFIG.read_text().replace("../data", str(CONFIG.parents[1] / "data"))
        (tmp_path / "config.yaml").write_text(
            text.replace("starts: 10", "starts: 1") + f"\noptimizer: {optimizer}\n"
        )
        return replace(shipped, file=read_study(tmp_path / "config.yaml"))

    return made


def test_a_stage_moves_what_it_names_and_the_next_goes_on_from_there(problem_with: Made) -> None:
    first = (
        "{kind: gauss-newton, evaluations: 4, parameters: ['joint1.*', 'joint2.rz.stiffness'], measurements:"
        " [posture1]}"
    )
    problem = problem_with(f"[{first}]")
    names = [parameter.name for parameter in problem.parameters]
    initial = np.array([parameter.initial for parameter in problem.parameters])
    one = fit(fit_plan(problem))
    moved = {
        name
        for name, before, after in zip(names, initial, one.values, strict=True)
        if before != pytest.approx(after, rel=1e-9)
    }
    assert moved == {"joint1.rz.stiffness", "joint1.rz.damping", "joint2.rz.stiffness"}
    second = "{kind: gauss-newton, evaluations: 8, parameters: [joint4.*]}"
    both = fit(fit_plan(problem_with(f"[{first}, {second}]")))
    assert both.values[:4] == pytest.approx(one.values[:4], rel=1e-12), "what the first stage found stays"
    assert names[6].startswith("joint4") and both.values[6] != pytest.approx(initial[6], rel=1e-9)


@pytest.mark.parametrize(
    ("kind", "ended", "said"),
    [
        (
            "genetic-algorithm",
            True,
            "the budget of 60 evaluations is spent; this optimizer ends in no other way",
        ),
        ("cma-es", False, "the best start did not converge: the budget of 60 evaluations is spent"),
    ],
)
def test_a_spent_budget_is_the_end_of_an_optimizer_that_has_no_other(
    kind: str, ended: bool, said: str, problem_with: Made
) -> None:
    found = fit(fit_plan(problem_with(f"{{kind: {kind}, evaluations: 60, population: 20}}")))
    [note] = found.end_note
    assert found.best.converged == ended and found.best.spent and note.startswith(said)


def test_a_stage_compares_only_its_measurements(problem_with: Made) -> None:
    stage = "{kind: gauss-newton, evaluations: 5, measurements: [%s]}"
    one, two = (fit(fit_plan(problem_with(f"[{stage % name}]"))) for name in ("posture1", "posture2"))
    assert one.values != pytest.approx(two.values, rel=1e-6)


@pytest.mark.parametrize(
    ("option", "sentence"),
    [
        (
            "measurements: [posture3]",
            "no measurement 'posture3' is fitted; expected one of posture1, posture2",
        ),
        ("parameters: [joint9.*]", r"no free parameter is called joint9\.\*"),
    ],
)
def test_names_that_mean_nothing_are_refused(problem_with: Made, option: str, sentence: str) -> None:
    problem = problem_with(f"[{{kind: gauss-newton, {option}}}]")
    with pytest.raises(InputError, match=sentence):
        fit(fit_plan(problem))

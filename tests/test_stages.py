"""Stages of a fit that move some parameters only, on some measurements only."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from identify.core.errors import InputError
from identify.fitting.fit import fit
from identify.vibration.plan import fit_plan
from identify.vibration.problem import Problem, load_problem
from identify.vibration.study import read_study

CONFIG = Path(__file__).parents[1] / "configs" / "arm_hammer_test.yaml"


def _problem(folder: Path, optimizer: str) -> Problem:
    text = CONFIG.read_text().replace("../data", str(CONFIG.parents[1] / "data"))
    (folder / "config.yaml").write_text(
        text.replace("starts: 10", "starts: 1") + f"\noptimizer: {optimizer}\n"
    )
    return load_problem(read_study(folder / "config.yaml"))


def test_a_stage_moves_what_it_names_and_the_next_goes_on_from_there(tmp_path: Path) -> None:
    first = (
        "{kind: gauss-newton, evaluations: 4, parameters: ['joint1.*', 'joint2.rz.stiffness'], measurements:"
        " [posture1]}"
    )
    names = [parameter.name for parameter in _problem(tmp_path, f"[{first}]").parameters]
    initial = np.array([parameter.initial for parameter in _problem(tmp_path, f"[{first}]").parameters])
    one = fit(fit_plan(_problem(tmp_path, f"[{first}]")))
    moved = {
        name
        for name, before, after in zip(names, initial, one.values, strict=True)
        if before != pytest.approx(after, rel=1e-9)
    }
    assert moved == {"joint1.rz.stiffness", "joint1.rz.damping", "joint2.rz.stiffness"}
    second = "{kind: gauss-newton, evaluations: 8, parameters: [joint4.*]}"
    both = fit(fit_plan(_problem(tmp_path, f"[{first}, {second}]")))
    assert both.values[:4] == pytest.approx(one.values[:4], rel=1e-12), "what the first stage found stays"
    assert names[6].startswith("joint4") and both.values[6] != pytest.approx(initial[6], rel=1e-9)


@pytest.mark.parametrize(
    ("kind", "ended", "said"),
    [
        (
            "genetic-algorithm",
            True,
            "the budget of 60 evaluations is spent, the only end that the optimizer has",
        ),
        ("cma-es", False, "the best start did not converge: the budget of 60 evaluations is spent"),
    ],
)
def test_a_spent_budget_is_the_end_of_an_optimizer_that_has_no_other(
    kind: str, ended: bool, said: str, tmp_path: Path
) -> None:
    found = fit(fit_plan(_problem(tmp_path, f"{{kind: {kind}, evaluations: 60, population: 20}}")))
    [note] = found.end_note
    assert found.best.converged == ended and found.best.spent and note.startswith(said)


def test_a_stage_compares_only_its_measurements(tmp_path: Path) -> None:
    stage = "{kind: gauss-newton, evaluations: 5, measurements: [%s]}"
    one, two = (fit(fit_plan(_problem(tmp_path, f"[{stage % name}]"))) for name in ("posture1", "posture2"))
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
def test_names_that_mean_nothing_are_refused(tmp_path: Path, option: str, sentence: str) -> None:
    problem = _problem(tmp_path, f"[{{kind: gauss-newton, {option}}}]")
    with pytest.raises(InputError, match=sentence):
        fit(fit_plan(problem))

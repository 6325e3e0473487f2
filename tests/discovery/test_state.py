"""What stands in the end: what a refit confirms, how probable it is, and what is beyond belief."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from identify.core.text import listed
from identify.discovery import loop
from identify.discovery.decimated import decimated
from identify.discovery.importance import ranked
from identify.discovery.loop import _confirmed
from identify.discovery.sentences import most_important
from identify.discovery.sparse.evidence import believable
from identify.discovery.sparse.objective import Penalised, Point
from identify.discovery.sparse.unknowns import Unknowns
from identify.discovery.state import Added, Rival, State
from identify.discovery.task import Task, Trial
from identify.discovery.workers import Workers
from identify.fitting.selection.workbench import Story
from identify.model.effects.base import Effect, parse_effect
from identify.vibration.costs import information
from identify.vibration.costs.information import by_lines
from identify.vibration.nuisances.settings import FORMS_ALONE
from identify.vibration.problem import Problem, load_problem, with_effects, with_uncertainty
from identify.vibration.study import read_study
from identify.vibration.uncertainty import gap

CONFIG = Path(__file__).parents[2] / "configs" / "arm_hammer_test.yaml"
DELAY = parse_effect({"kind": "time-delay"})
TILT = parse_effect({"kind": "joint-compliance", "joints": [2], "axes": ["rx", "ry"]})


@pytest.fixture(scope="module")
def problem() -> Problem:
    """The shipped example with its data."""
    return load_problem(read_study(CONFIG))


def test_a_probability_is_shared_with_rivals() -> None:
    trial = Trial(Task((), (), {}), {}, 1.0, 1)
    alone = Added(TILT, 3.0)
    assert alone.probability == pytest.approx(1 / (1 + np.exp(-3)))
    beside = replace(alone, evidence=1e4, rivals=(Rival(DELAY, trial, 0.0), Rival(DELAY, trial, np.log(0.5))))
    assert beside.probability == pytest.approx(1 / 2.5)


def test_what_a_refit_on_all_lines_does_not_support_is_taken_out(monkeypatch: pytest.MonkeyPatch) -> None:
    """A gain that few lines spoke for beside a tilt and a delay; what is better supported is not asked, and
    what few lines spoke against has the odds of all lines.  The ends of links are built once for a model.
    """
    built, over_ends = list[State](), loop._over_ends
    monkeypatch.setattr(loop, "_over_ends", lambda state: built.append(state) or over_ends(state))
    problem = load_problem(read_study(CONFIG.with_name("hidden_effects.yaml")))
    known, said = tuple(problem.file.study.effects), list[str]()
    [node, *_] = problem.points
    gain = parse_effect({"kind": "channel-gain", "channel": f"{node}:+X"})
    values = {p.name: p.initial for p in problem.parameters}
    with Workers(problem, 1) as workers:
        [model] = workers.run([Task(known, (TILT, DELAY, gain), values, whole=True)])
        state = State(problem, model, (Added(TILT, -90.0), Added(DELAY, 50.0), Added(gain, 8.0)))
        found = _confirmed(workers, state, Story(say=said.append))
    assert [one.effect for one in found.added] == [TILT, DELAY]
    assert gain not in found.effects
    assert [[one.effect for one in state.added] for state in built] == [[TILT, DELAY, gain], [TILT, DELAY]]
    assert found.added[0].evidence > 20 and found.added[1].evidence == 50.0
    assert len(said) == 1 and said[0].startswith("Not confirmed: gain of channel")
    order = ranked(found).added
    assert [one.effect for one in order] == sorted((TILT, DELAY), key=lambda one: -_gap_without(found, one))
    for one in order:
        assert one.gap_without == pytest.approx(_gap_without(found, one.effect), rel=0.1)
        assert one.gap_without > found.model.gap + 1


def test_a_verdict_names_the_most_important_effects_and_counts_the_others() -> None:
    names = [f"effect {n}" for n in range(1, 12)]
    assert most_important(names[:9]).endswith(", effect 8 and effect 9")
    assert most_important(names) == listed([*names[:8], "3 less important ones"])


def _gap_without(state: State, effect: Effect) -> float:
    model = with_effects(state.problem, state.without(effect), state.model.values)
    return gap(model.targets(), model.initial)


def test_errors_that_are_far_out_are_not_believed_but_forms_are(tmp_path: Path) -> None:
    text = CONFIG.read_text(encoding="utf-8").replace("../data", str(CONFIG.parents[1] / "data"))
    for level, far in (("careful", False), ("", True)):
        (tmp_path / "a.yaml").write_text(text + (f"\nuncertainty: {level}\n" if level else ""))
        stated = load_problem(read_study(tmp_path / "a.yaml"))
        link = parse_effect({"kind": "link-flexibility", "link": stated.robot.links[2].name})
        if not level:
            stated = with_uncertainty(
                with_effects(stated, [*stated.file.study.effects, link], {}), FORMS_ALONE
            )
        values = {p.name: p.initial for p in stated.parameters}
        assert believable(stated, values)
        [first, *_] = stated.nuisances.entries
        assert believable(stated, values | {first.name: 14.0}) is far


def test_sums_over_lines_are_those_of_parts_of_them(
    problem: Problem, monkeypatch: pytest.MonkeyPatch
) -> None:
    targets, values = problem.targets().frf, problem.initial
    free = np.array([n for n, p in enumerate(problem.parameters) if p.free])
    whole = information.information(targets, values, free)
    monkeypatch.setattr(information, "_MOST_BYTES", 300_000)
    assert len(by_lines(targets, len(free))) > 2 * len(targets)
    parts = information.information(targets, values, free)
    np.testing.assert_allclose(parts.product, whole.product, rtol=1e-9, atol=1e-6 * whole.product.max())
    assert parts.count == whole.count


def test_after_the_time_few_steps_are_taken(problem: Problem) -> None:
    thin = decimated(problem)
    unknowns = Unknowns(thin, len(thin.file.study.effects))
    x = unknowns.reference + 0.5
    fit = Penalised(unknowns, price=0.0)
    assert fit.minimise(Point(x), 30, until=0.0).steps <= 3 < fit.minimise(Point(x), 30).steps

"""Other forms of what was found: neighbours, a strut for springs in any direction, laws about a misaligned
axis.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from identify.discovery import forms
from identify.discovery.decimated import decimated
from identify.discovery.forms import in_other_forms
from identify.discovery.misalignment import may_be_misaligned, misaligned_task
from identify.discovery.neighbours import neighbours
from identify.discovery.state import Added, State
from identify.discovery.strut import _Strut, strut_task
from identify.discovery.task import Task, Trial
from identify.discovery.trial import TrialRunner
from identify.discovery.workers import Workers
from identify.fitting.selection.workbench import Story
from identify.model.effects.appended_resonator import AppendedResonator
from identify.model.effects.base import Effect, parse_effect
from identify.model.effects.joint_compliance import JointCompliance
from identify.model.effects.measured_impedance import MeasuredImpedance
from identify.model.effects.spring_to_ground import SpringToGround
from identify.vibration.given import Given
from identify.vibration.problem import Measurement, Problem, load_problem, with_effects
from identify.vibration.study import read_study

CONFIG = Path(__file__).parents[2] / "configs" / "arm_hammer_test.yaml"
TILT = {"kind": "joint-compliance", "axes": ["rx", "ry"]}


@pytest.fixture(scope="module")
def problem() -> Problem:
    """The shipped example with its data."""
    return load_problem(read_study(CONFIG))


def test_neighbours_are_of_the_same_kind_right_beside(problem: Problem) -> None:
    """Springs of bearings are in the dense model already, all of them."""
    springs = list(SpringToGround.instances(problem.robot, problem.points))
    beside = neighbours(problem, springs[4])
    own = getattr(springs[4], "link", "")
    names = [one.name for one in problem.robot.links]
    at = names.index(own)
    links = {one.link for one in beside if isinstance(one, SpringToGround)}
    assert links <= {names[n] for n in (at - 1, at, at + 1) if n < len(names)}
    assert names[at - 1] in links
    for other in ({"kind": "joint-compliance", "joints": [2], "axes": ["rx", "ry"]}, {"kind": "time-delay"}):
        assert not neighbours(problem, parse_effect(other))


def _measured(problem: Problem, model: Problem) -> Problem:
    """The problem with what a model predicts, and some noise, in place of its data."""
    rng = np.random.default_rng(1)

    def other(m: Measurement, told: Measurement) -> Measurement:
        frf = told.target.predict(model.initial)  # type: ignore[union-attr]
        noise = 0.001 * (np.abs(frf) + np.abs(frf).mean())
        frf = frf + noise * (rng.normal(size=frf.shape) + 1j * rng.normal(size=frf.shape)) / np.sqrt(2)
        given: Given = replace(m.given, data=replace(m.given.data, frf=frf, noise=noise / np.sqrt(2)))
        return replace(m, given=given)

    pairs = zip(problem.measurements, model.measurements, strict=True)
    measured = replace(problem, measurements=tuple(other(m, told) for m, told in pairs))
    return with_effects(measured, problem.file.study.effects, {})


def test_a_strut_is_found_in_springs_in_any_direction(problem: Problem) -> None:
    """With its direction, stiffness and four parameters in place of twelve; and not where much is left."""
    known, true = tuple(problem.file.study.effects), np.array([0.6, -0.48, 0.64])
    thin = decimated(problem)
    link = thin.robot.links[3].name
    strut = {"kind": "spring-to-ground", "link": link, "at_m": [0.1, -0.2, 0.3]}
    own = {f"{link}.strut.stiffness": 3e5, f"{link}.strut.damping": 300.0}
    told = with_effects(thin, (*known, parse_effect(strut | {"direction": true.tolist()})), own)
    measured = _measured(thin, told)
    springs, runner = parse_effect(strut | {"cross_coupling": True}), TrialRunner(measured)
    values = {p.name: p.initial for p in measured.parameters}
    trial = runner.run(Task(known, (springs,), values, whole=True))
    assert trial.gap < 1.05
    starts = np.array(
        [y[-4:-1] for y in _Strut(with_effects(measured, trial.task.effects, trial.values)).starts()]
    )
    along = np.abs(starts @ true) / np.linalg.norm(starts, axis=1)
    assert along.max() > np.cos(np.radians(2.0)), "a linear step from the springs knows the direction"
    task = strut_task(measured, trial)
    assert task is not None
    [found] = task.new
    assert isinstance(found, SpringToGround)
    assert np.allclose(found.direction or 0.0, true, atol=0.03)
    state = State(measured, trial, (Added(springs, 100.0),))
    with Workers(measured, 1) as workers:
        turned = in_other_forms(workers, state, Story())
    [one], end = turned.added, turned.model
    assert one.effect == found and one.evidence > 100
    assert found in end.task.effects
    assert end.values[f"{link}.strut.stiffness"] == pytest.approx(3e5, rel=0.03)
    assert end.gap == pytest.approx(trial.gap, abs=0.01)
    assert trial.free - end.free == 8
    assert strut_task(measured, replace(trial, squares=4 * trial.squares)) is None


def test_a_body_fixed_to_a_link_is_not_left_a_resonator(problem: Problem) -> None:
    """One that is tuned far above the band says nearly the same, with two parameters more."""
    last = problem.robot.links[-1].name
    body = parse_effect({"kind": "added-mass", "link": last, "mass": {"initial": 2.5}})
    measured = _measured(problem, with_effects(problem, [*problem.file.study.effects, body], {}))
    resonator = AppendedResonator(link=last, axis="z", extent="body")
    known = tuple(measured.file.study.effects)
    with Workers(measured, 1) as workers:
        values = {p.name: p.initial for p in measured.parameters}
        [model] = workers.run([Task(known, (resonator,), values, whole=True)])
        found = in_other_forms(workers, State(measured, model, (Added(resonator, 100.0),)), Story())
    assert found.added[0].effect.sentence() == f"added body (mass, centre, inertia) on {last}"
    assert found.model.values[f"{last}.mass"] == pytest.approx(2.5, rel=0.05)


@pytest.mark.parametrize(("share", "rounds"), [(0.999, 1), (0.7, 5)])
def test_another_form_is_tried_as_long_as_the_last_one_helped(
    share: float, rounds: int, problem: Problem, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where much is open and nothing closes it there is always one more, with overwhelming odds."""
    asked = list[float]()

    def better(workers: Workers, state: State, others: object) -> State | None:
        asked.append(state.model.gap)
        return replace(state, model=replace(state.model, squares=share * state.model.squares))

    body = parse_effect({"kind": "added-mass", "link": problem.robot.links[-1].name})
    monkeypatch.setattr(forms, "_exchanged", lambda *a: None if len(asked) == 5 else better(*a))
    monkeypatch.setattr(forms, "_turned", lambda workers, state: state)
    monkeypatch.setattr(forms, "_beside_rivals", lambda workers, state: state)
    model = Trial(Task((), (body,), {}), {}, 400.0, 100)
    with Workers(problem, 1) as workers:
        found = in_other_forms(workers, State(problem, model, (Added(body, 100.0),)), Story())
    assert len(asked) == rounds
    assert found.model.squares == pytest.approx(400 * share**rounds)


@pytest.mark.parametrize("misalignment", [0.03, 0.0])
def test_a_measured_law_leans_where_the_data_show_it(problem: Problem, misalignment: float) -> None:
    """And only there: a law about the coordinate stays as it is."""
    known, thin = tuple(problem.file.study.effects), decimated(problem)
    straight = {"kind": "measured-impedance", "at": ["joint2.rx"], "branches": 0}
    own = {"joint2.rx.stiffness": 1e6, "joint2.rx.damping": 1e3}
    turned = straight | ({"misalignment": {"joint2.ry": misalignment}} if misalignment else {})
    measured = _measured(thin, with_effects(thin, (*known, parse_effect(turned)), own))
    law, runner = parse_effect(straight), TrialRunner(measured)
    values = {**{p.name: p.initial for p in measured.parameters}, **own}
    trial = runner.run(Task(known, (law,), values, whole=True))
    task = misaligned_task(measured, trial)
    if not misalignment:
        assert task is None
        return
    assert task is not None
    [found] = task.new
    assert isinstance(found, MeasuredImpedance)
    assert found.misalignment["joint2.ry"] == pytest.approx(misalignment, rel=0.1)
    with Workers(measured, 1) as workers:
        end = in_other_forms(workers, State(measured, trial, (Added(law, 100.0),)), Story()).model
    assert found in end.task.effects
    assert end.gap < 1.05 < trial.gap
    assert end.values["joint2.rx.stiffness"] == pytest.approx(1e6, rel=0.02)
    assert end.free == trial.free + 1


def test_what_an_axis_may_lean_towards() -> None:
    """The other coordinates of its kind, and only of a single one."""
    one = {"kind": "measured-impedance", "at": ["joint2.rx"]}
    assert may_be_misaligned(parse_effect(one))
    assert not may_be_misaligned(parse_effect(one | {"at": ["joint2.rx", "joint2.ry"]}))
    assert not may_be_misaligned(parse_effect(one | {"misalignment": {"joint2.ry": 0.1}}))
    for misalignment in ({"joint2.tx": 0.1}, {"joint3.ry": 0.1}, {"joint2.rx": 0.1}):
        with pytest.raises(ValueError, match="misalignment"):
            parse_effect(one | {"misalignment": misalignment})


def test_what_has_other_places_is_looked_at_behind_what_has_none() -> None:
    """Bearings, which come first by their odds, sit where they are; a resonator may sit elsewhere."""
    bearings = [JointCompliance(joints=[number], axes=["tz"]) for number in range(1, 6)]
    resonator = AppendedResonator(link="link3", axis="y")
    added = tuple(Added(one, 100.0) for one in (*bearings, resonator))
    state: State = State(None, None, added)  # type: ignore[arg-type]

    def elsewhere(_state: State, effect: Effect) -> Iterator[Task]:
        yield from [Task((), (effect,), {})] if effect is resonator else []

    assert [effect for effect, _ in forms._looked(state, elsewhere)] == [resonator]

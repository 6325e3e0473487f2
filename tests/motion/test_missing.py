"""What is missing from a study of motion is found without a list: of records by `tests.generator`."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from identify.core.errors import InputError, InputErrors
from identify.core.yaml_input import parse_yaml
from identify.fitting.fit import Fit, Progress
from identify.fitting.selection.gain import Gain
from identify.fitting.selection.prune import exchange
from identify.fitting.selection.workbench import Option, Story
from identify.motion.changed import with_effects, with_numbers
from identify.motion.judging import FittedMotion, judging
from identify.motion.missing import screen, springs
from identify.motion.missing.bench import MissingBench
from identify.motion.missing.catalogue import Kind, kinds
from identify.motion.missing.linear import effect_of
from identify.motion.missing.long_steps import LongSteps, changed
from identify.motion.missing.new_config import study_text
from identify.motion.missing.noise import with_noise
from identify.motion.missing.run import run_motion_discover
from identify.motion.missing.screen import promises
from identify.motion.missing.worth import needed
from identify.motion.numbers import JointNumber
from identify.motion.plan import fitted_objective
from identify.motion.problem import MotionProblem, load_motion
from identify.motion.run import run_motion_fit
from identify.motion.study import MotionCandidate, read_motion_study
from identify.motion.trajectory import TrajectoryObjective
from identify.motion.trajectory_fit import _trials, with_missing
from tests.generator import hidden_motion
from tests.generator.hidden_motion import Case, Link
from tests.motion import arms

NONE = np.zeros(1)


def one_joint(**more: Any) -> Case:
    """An arm of one link in a vertical plane, nothing hidden."""
    link = Link((0, 0, 0.4), (0, 1, 0), 20.0, (0.25, 0, 0), (0.1, 0.6, 0.6))
    own = {
        "heavier": NONE,
        "rotor": np.array([1.2e-4]),
        "position_gain": np.array([12.0]),
        "velocity_gain": np.array([250.0]),
        "integral": np.array([6.0]),
        "feedforward": 0.0,
        "coulomb": np.array([3.0]),
        "viscous": np.array([3.0]),
        "gain": np.ones(1),
        "balancer": np.zeros((2, 1)),
        "delay_s": NONE,
    }
    return Case([link], np.radians([-40.0]), **{**own, **more})


@pytest.fixture(autouse=True)
def short(monkeypatch: pytest.MonkeyPatch) -> None:
    """Records of a second, in few steps."""
    monkeypatch.setattr(hidden_motion, "DURATION_S", 1.0)
    monkeypatch.setattr(hidden_motion, "PARTS", 3)
    moved = [
        {"joint": 1, "start_s": 0.05, "by_deg": 14.0, "speed_deg_s": 70.0, "acceleration_deg_s2": 600.0},
        {"joint": 1, "start_s": 0.55, "by_deg": -8.0, "speed_deg_s": 30.0, "acceleration_deg_s2": 600.0},
    ]

    def moves(rng: np.random.Generator, joints: int) -> list[dict[str, Any]]:
        sign = float(rng.choice([-1.0, 1.0]))
        own = [{**one, "by_deg": sign * one["by_deg"], "smoothing_s": 0.06} for one in moved]
        return [{**one, "joint": joint} for one in own for joint in range(1, joints + 1)]

    monkeypatch.setattr(hidden_motion, "moves", moves)


def problem_of(case: Case, folder: Path, *names: str) -> MotionProblem:
    """Of all records, or of those of these names."""
    hidden_motion.write(case, folder, np.random.default_rng(7), names or hidden_motion.RECORDS)
    return with_noise(load_motion(read_motion_study(folder / "motion.yaml")))[0]


def as_it_is(problem: MotionProblem) -> FittedMotion:
    return FittedMotion(problem, Fit(problem.initial, 1.0, (), np.zeros((0, 5)), 0.0))


@pytest.mark.usefixtures("no_springs")
def test_the_catalogue_promises_what_is_missing_most(tmp_path: Path) -> None:
    problem = problem_of(one_joint(delay_s=np.array([2e-3])), tmp_path, "one")
    found = promises(as_it_is(problem))
    assert found[0].effect.name == "delay of the controller of joint 1"
    assert found[0].starts["joint1.servo.latency"] == pytest.approx(2e-3, rel=0.3)


@pytest.mark.usefixtures("no_springs")
def test_what_is_searched_of_some_joints_makes_room_for_what_is_missing(tmp_path: Path) -> None:
    """A gain of one of two joints that is off is moved back in what is simulated with a heavier body."""
    rng = np.random.default_rng(11)
    case = hidden_motion.drawn(rng, "", False)
    case.heavier = np.array([0.0, 0.3])
    problem = problem_of(case, tmp_path, "one", "two")
    off = JointNumber(initial=(case.position_gain * [1.0, 1.1]).tolist(), bounds=(1.0, 100.0), joints=[2])
    begun = as_it_is(with_numbers(problem, {"servo.position_gain": off}, {}))
    [promise] = [p for p in promises(begun) if p.effect.name.startswith("mass beyond the description")]
    there = with_numbers(with_numbers(begun.problem, promise.effect.numbers, {}), {}, promise.starts)
    gap = float(fitted_objective(there).costs(there.initial[None])[0])
    sight = screen._sight(begun, 2)
    ratio = np.linalg.norm(sight.residual) / np.sqrt(begun.objective.count) / gap
    assert ratio > 2
    assert promise.log_odds == pytest.approx(sight.independent * np.log(ratio), rel=0.15)  # less the price


@pytest.fixture
def no_springs(monkeypatch: pytest.MonkeyPatch) -> None:
    """Springs are not looked at, which takes most of the time."""
    monkeypatch.setattr(springs, "_groups", lambda problem, values: [])


AMONG = pytest.mark.parametrize(
    "words",
    [
        pytest.param(("rotor", "friction", "delay", "velocity gain"), id="few"),
        pytest.param(("",), marks=pytest.mark.exam, id="all"),
    ],
)
"""Words of the kinds of numbers that may be missing."""


@pytest.fixture
def few(words: tuple[str, ...], monkeypatch: pytest.MonkeyPatch) -> None:
    """No kind without one of the words is looked at."""

    def chosen(problem: MotionProblem, values: np.ndarray) -> list[Kind]:
        return [kind for kind in kinds(problem, values) if any(word in kind.name for word in words)]

    monkeypatch.setattr(screen, "kinds", chosen)


@pytest.mark.usefixtures("no_springs")
def test_nothing_is_named_where_nothing_is_missing(tmp_path: Path) -> None:
    hidden_motion.write(one_joint(), tmp_path, np.random.default_rng(7), ["one", "three"])
    result, written = run_motion_discover(tmp_path / "motion.yaml", tmp_path / "found.h5", {}, Story())
    assert result.verdict[0].startswith("The records show no missing effect.")
    assert written == [tmp_path / "found.h5"]


@AMONG
@pytest.mark.usefixtures("no_springs", "few")
def test_the_controller_computes_with_the_rotor_that_it_was_told(tmp_path: Path) -> None:
    """A rotor that is heavier than stated moves the arm, not the feed-forward; the better study says so."""
    stated = np.array([1.2e-4])
    case = one_joint(rotor=2.2 * stated, feedforward=1.0, told={"rotor": stated})
    hidden_motion.write(case, tmp_path, np.random.default_rng(3), ["one", "three"])
    result, written = run_motion_discover(tmp_path / "motion.yaml", tmp_path / "found.h5", {}, Story())
    assert result.trials is not None and result.gap < 1.1 and result.gap_validation < 1.1
    kept = [name for name, kept in zip(result.trials.name, result.trials.kept, strict=True) if kept]
    assert kept[1:] == ["motor rotor inertia of joint 1 not as stated"]
    better = load_motion(read_motion_study(written[1]))
    assert better.told["motor.rotor_inertia"] == pytest.approx(stated)
    assert fitted_objective(better).costs(better.initial[None])[0] < 1.1


def test_what_the_controller_was_told_is_a_number_of_its_motors(tmp_path: Path) -> None:
    hidden_motion.write(one_joint(), tmp_path, np.random.default_rng(7), ["one"])
    for told, found in (
        ({"inertia": [1.0]}, "unknown number 'inertia'"),
        ({"rotor_inertia": [1, 2]}, "2 values"),
    ):
        study = json.loads((tmp_path / "motion.yaml").read_text())
        study["servo"]["told"] = told
        (tmp_path / "told.yaml").write_text(json.dumps(study))
        with pytest.raises(InputError, match=found):
            load_motion(read_motion_study(tmp_path / "told.yaml"))


@AMONG
@pytest.mark.usefixtures("no_springs", "few")
def test_what_stands_for_something_else_is_exchanged_for_it(tmp_path: Path) -> None:
    """A gain that was named for a delay, beside friction that is true: the delay takes its place."""
    case = one_joint(delay_s=np.array([2e-3]), told={"viscous": NONE})
    problem = problem_of(case, tmp_path, "one", "three")
    bench = MissingBench(problem, Progress())
    first = bench.begin()
    kinds_of = {kind.name: kind for kind in kinds(problem, problem.initial)}
    viscous, gain = (effect_of(kinds_of[name], [0]) for name in ("viscous friction", "velocity gain"))
    bench._known |= {
        effect.name: (kinds_of[name], (0,))
        for name, effect in (("viscous friction", viscous), ("velocity gain", gain))
    }
    wrong = bench._with(first, (viscous, gain))
    assert wrong.gap > 1.2
    options, found = exchange(bench, [], wrong, Story())
    assert [effect.name for effect in found.added] == [
        "viscous friction of joint 1",
        "delay of the controller of joint 1",
    ]
    assert found.gap < 1.1
    assert [option.effect for option in options] == [found.added[-1]]


@pytest.mark.usefixtures("no_springs")
def test_a_balancer_is_found_and_the_better_study_fits(tmp_path: Path) -> None:
    case = one_joint(balancer=np.array([[12.0], [-9.0]]))
    hidden_motion.write(case, tmp_path, np.random.default_rng(3), ["one", "three"])
    result, written = run_motion_discover(tmp_path / "motion.yaml", tmp_path / "found.h5", {}, Story())
    assert result.verdict[0].startswith("Missing: gravity balancer of joint 1 (log odds ")
    assert result.trials is not None and result.trials.gap[0] > 3
    assert result.gap < 1.2 and result.gap_validation < 1.2
    assert result.parameters is not None
    values = dict(zip(result.parameters.name, result.parameters.value, strict=True))
    assert values["joint1.balancer.sine"] == pytest.approx(12.0, rel=0.1)
    rms = result.records["three"].comparisons["motor_position"]
    assert rms.rms_initial is not None and rms.rms[0, 0] < rms.rms_initial[0, 0]
    assert written[1] == tmp_path / "found.yaml"
    again, _ = run_motion_fit(written[1], tmp_path / "again.h5", {})
    assert again.name == "hidden_discovered"
    assert again.gap == pytest.approx(result.gap, rel=1e-2)


def test_springs_are_written_with_what_was_found(tmp_path: Path) -> None:
    case = one_joint(
        stiffness=np.array([2e4]), damping=np.array([20.0]), told={"rigid": True}, link_encoders=True
    )
    problem = problem_of(case, tmp_path, "one")
    [promise] = [p for p in promises(as_it_is(problem)) if "compliance of the gear" in p.effect.name]
    assert promise.effect.name == "compliance of the gear (joint1.rz)"
    assert 1e4 < promise.starts["joint1.rz.stiffness"] < 4e4  # to first order
    softer = with_effects(problem, promise.effect.effects, promise.starts)
    data = parse_yaml(study_text(softer, softer.initial, tmp_path / "elsewhere"), "new")
    assert data["effects"][0]["kind"] == "joint-compliance"
    assert data["effects"][0]["stiffness"]["initial"][0] == pytest.approx(softer.initial[0], rel=1e-5)
    assert data["robot"]["urdf"] == "../robot.urdf"
    assert data["records"][0]["measured"]["file"] == "../one.csv"


def test_noise_is_told_from_records_where_the_study_says_none(tmp_path: Path) -> None:
    noise = problem_of(one_joint(tracker=True), tmp_path, "one").file.study.noise
    assert np.ravel(noise["motor_position"])[0] == pytest.approx(hidden_motion.NOISE_RAD, rel=0.2)
    assert np.ravel(noise["tool_position"]) == pytest.approx([hidden_motion.NOISE_TOOL_M] * 3, rel=0.2)


def test_without_anything_recorded_there_is_nothing_to_discover(tmp_path: Path) -> None:
    hidden_motion.write(one_joint(), tmp_path, np.random.default_rng(3), ["one"])
    data = parse_yaml((tmp_path / "motion.yaml").read_text(), "x")
    for record in data["records"]:
        record.pop("measured")
    (tmp_path / "motion.yaml").write_text(json.dumps(data))
    with pytest.raises(InputError, match=r"nothing was recorded in a record of `use: fit`"):
        run_motion_discover(tmp_path / "motion.yaml", tmp_path / "found.h5", {}, Story())


def test_a_tracker_counts_from_a_place_of_its_own(tmp_path: Path) -> None:
    problem = problem_of(one_joint(tracker=True), tmp_path)
    assert problem.records[2].tool is not None
    moved = [
        replace(r, tool=r.tool + np.array([0.3, -2.0, 0.01])) for r in problem.records if r.tool is not None
    ]
    gaps = [judging(p).costs(p.initial[None])[0] for p in (problem, replace(problem, records=tuple(moved)))]
    assert gaps[0] == pytest.approx(gaps[1], rel=1e-6)
    assert gaps[0] < 1.2


def test_an_effect_that_comes_in_two_joints_one_after_the_other(tmp_path: Path) -> None:
    """Bounds are those of both, and joints too."""
    problem = arms.study(tmp_path, arms.three_links())
    first = {"friction.coulomb": JointNumber(initial=[0.0, 90.0, 0.0], bounds=(0.0, 100.0), joints=[2])}
    second = {"friction.coulomb": JointNumber(initial=[0.5, 90.0, 0.0], bounds=(0.1, 3.0), joints=[1])}
    both = with_numbers(with_numbers(problem, first, {}), second, {})
    assert [(p.name, p.initial) for p in both.parameters] == [
        ("joint1.friction.coulomb", 0.5),
        ("joint2.friction.coulomb", 90.0),
    ]
    assert {(p.lower, p.upper) for p in both.parameters} == {(0.0, 100.0)}


def test_a_joint_whose_amplitude_is_nothing_is_not_needed(tmp_path: Path) -> None:
    rng = np.random.default_rng(11)
    case = hidden_motion.drawn(rng, "", False)
    case.told = {"viscous": np.array([case.viscous[0], 0.0])}
    hidden_motion.write(case, tmp_path, rng, ["one"])
    begun = with_noise(load_motion(read_motion_study(tmp_path / "motion.yaml")))[0]
    present, size = np.array([[case.viscous[0], 0.0]]), np.array([1.0, 1.0])
    kind = Kind("viscous friction", ("friction.viscous",), present, size)
    problem = with_numbers(begun, kind.candidate([1, 2]).numbers, {})
    values = case.viscous.copy()  # the first as the study has it
    model = FittedMotion(problem, Fit(values, 1.2, (), np.zeros((0, 5)), 0.0))
    assert needed(model, kind, (0, 1)) == [1]


def test_a_candidate_of_a_fit_brings_springs(tmp_path: Path) -> None:
    told = {"rigid": True}
    case = one_joint(stiffness=np.array([4e3]), damping=np.array([8.0]), told=told, link_encoders=True)
    hidden_motion.write(case, tmp_path, np.random.default_rng(7), ["one", "three"])
    data = json.loads((tmp_path / "motion.yaml").read_text())
    data["noise"] = {"motor_position": 1e-5, "link_position": 1e-5, "motor_torque": 0.5}
    springs = {"stiffness": {"initial": 6e3, "bounds": [1e2, 1e4]}, "damping": {"initial": 8, "fixed": True}}
    effect = {"kind": "joint-compliance", "axes": ["rz"], **springs}
    data["friction"]["viscous"] = {"initial": 2.5, "bounds": [0.1, 30.0]}
    data["candidates"] = [{"name": "a gear that bends", "effects": [effect]}]
    (tmp_path / "listed.yaml").write_text(json.dumps(data))
    result, _ = run_motion_fit(tmp_path / "listed.yaml", tmp_path / "found.h5", {})
    assert result.trials is not None and list(result.trials.kept) == [1.0, 1.0]
    assert result.records["one"].comparisons["link_position"].initial is not None
    assert result.parameters is not None
    values = dict(zip(result.parameters.name, result.parameters.value, strict=True))
    assert values["joint1.rz.stiffness"] == pytest.approx(4e3, rel=0.02)
    assert result.gap < 0.2 * result.trials.gap[0]


def test_a_candidate_that_brings_nothing_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputErrors, match="has neither numbers nor effects"):
        arms.study(tmp_path, arms.three_links(), candidates=[{"name": "nothing"}])


def test_how_a_joint_creeps_goes_with_its_friction(tmp_path: Path) -> None:
    problem = arms.study(tmp_path, arms.three_links())
    bench = MissingBench(problem, Progress())
    dry = MotionCandidate(name="dry", numbers={"friction.coulomb": JointNumber(initial=1.0, bounds=(0, 9))})
    own = {"friction.creep_velocity": JointNumber(initial=1e-4, bounds=(1e-5, 1e-3))}
    creeps = MotionCandidate(name="creeps", numbers=own)
    assert bench._standing((dry, creeps)) == (dry, creeps)
    assert bench._standing((creeps,)) == ()
    rubs = arms.study(tmp_path / "rubs", arms.three_links(), friction={"coulomb": 2.0})
    assert MissingBench(rubs, Progress())._standing((creeps,)) == (creeps,)


@pytest.mark.usefixtures("no_springs")
def test_what_the_step_gets_wrong_has_no_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """With steps as long as a slow controller's period, a velocity gain would compensate for them."""
    monkeypatch.setattr(hidden_motion, "PERIOD_S", 2e-3)
    monkeypatch.setattr(hidden_motion, "PARTS", 6)
    monkeypatch.setattr(hidden_motion, "EVERY", 2)
    bench = MissingBench(problem_of(one_joint(), tmp_path), Progress())
    assert bench.problem.step_s == pytest.approx(2e-3)
    found = with_missing(bench, Story())
    assert [trial.name for trial in found.trials if trial.kept] == ["the model as it is"]
    assert bench.finished(found).problem.step_s < 2e-3


@pytest.mark.usefixtures("no_springs")
def test_what_the_step_gets_wrong_is_taken_off_the_records(tmp_path: Path) -> None:
    """A model in long steps is as far from the corrected records as it is in short ones from the records."""
    problem = replace(problem_of(one_joint(), tmp_path, "one"), step_s=1e-3)
    steps = LongSteps(problem, problem.initial, 2.5e-4)
    rows = [
        TrajectoryObjective(one, one.records, one.file.study.noise).smooth(one.initial)
        for one in (
            replace(problem, step_s=1e-3 / 32),
            replace(problem, records=steps.records(1e-3)),
            problem,
        )
    ]
    off = [float(np.linalg.norm(row - rows[0])) for row in rows[1:]]
    assert changed(None, steps.error(1e-3)) == pytest.approx(off[1], rel=0.2)
    assert off[0] < 0.2 * off[1]
    assert changed(steps.error(1e-3), steps.error(1e-3)) == 0


@AMONG
@pytest.mark.usefixtures("no_springs", "few")
def test_how_friction_passes_through_zero_is_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(hidden_motion, "CREEP", 0.1)
    case = one_joint(coulomb=np.array([30.0]))
    hidden_motion.write(case, tmp_path, np.random.default_rng(3), ["one", "three"])
    data = json.loads((tmp_path / "motion.yaml").read_text())
    data["friction"]["smoothing"] = "root"
    (tmp_path / "motion.yaml").write_text(json.dumps(data))
    result, written = run_motion_discover(tmp_path / "motion.yaml", tmp_path / "found.h5", {}, Story())
    assert result.verdict[0].startswith("Missing: dry friction as a hyperbolic tangent of speed (log odds ")
    assert result.gap < 1.3
    assert parse_yaml(written[1].read_text(), "new")["friction"]["smoothing"] == "tanh"


def test_what_the_catalogue_found_is_told_beside_candidates_of_the_study() -> None:
    """A study with a list of its own ended in a traceback after all was found."""
    own, found = (MotionCandidate.model_construct(name=name) for name in ("listed", "of the catalogue"))
    model = SimpleNamespace(fit=SimpleNamespace(cost=1.0), gap=2.0)
    options = tuple(Option(one, model, 1, Gain(9.0, 0.5)) for one in (found, own))
    problem: Any = SimpleNamespace(file=SimpleNamespace(study=SimpleNamespace(candidates=[own])))
    step: Any = SimpleNamespace(options=options)
    told = _trials(problem, 1, step, (options[0],), {})
    assert [(one.name, one.kept) for one in told] == [("listed", False), ("of the catalogue", True)]

"""Amplitude-dependent effects in FRFs: their linear limits, derivatives, and what they find in simulated
hammer tests at several levels.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from identify.core.errors import InputError, InputErrors
from identify.discovery.amplitude import level_gap, torque_gaps
from identify.fitting.fit import fit
from identify.model.effects.base import EFFECTS, parse_effect
from identify.model.transient import Impact
from identify.vibration.costs.base import parse_cost
from identify.vibration.costs.make_target import Targets
from identify.vibration.costs.target import FrfTarget
from identify.vibration.nuisances.settings import FORMS_ALONE
from identify.vibration.nuisances.stated import sentence
from identify.vibration.plan import fit_plan
from identify.vibration.problem import Problem, load_problem, with_effects, with_uncertainty
from identify.vibration.study import read_study
from tests.arms import arm, initial
from tests.generator.cases import hide
from tests.generator.generate import generate
from tests.generator.makes import MAKES
from tests.generator.spec import TestSpec
from tests.hidden import fitted, truth
from tests.targets import model, predictor

DRIVES = {"kind": "joint-compliance"}
STAGES = [
    {"kind": "gauss-newton", "tolerance": 1e-3, "cost": {"kind": "frf-least-squares", "residual": "log"}},
    {"kind": "gauss-newton", "tolerance": 1e-4},
]
"""The default stages, content with less."""
FRICTION = {"kind": "joint-friction", "joints": [2], "torque": {"initial": 30.0}}


def _target(
    folder: Path, *effects: dict[str, Any], peak: float = 180.0, top: float = 80.0
) -> tuple[FrfTarget, np.ndarray]:
    """A target of the random arm with its drives elastic, struck with a peak force (N), up to `top` Hz, and
    the initial values.
    """
    system, parameters = model(arm(folder), [parse_effect(effect) for effect in (DRIVES, *effects)])
    target = predictor(system, lines=40, band=(3.0, top))
    if target.simulated is not None:
        target = replace(
            target, simulated=replace(target.simulated, impact=replace(target.simulated.impact, peak=peak))
        )
    return target, initial(parameters)


def _apart(one: np.ndarray, other: np.ndarray) -> float:
    """Largest difference over the largest value."""
    return float(np.abs(one - other).max() / np.abs(other).max())


@pytest.mark.parametrize("angle", [1e-6, 1e-2])
def test_default_bounds_of_a_cubic_spring_hold_those_of_hammers_on_large_arms_and_of_small_ones_in_motion(
    angle: float, tmp_path: Path
) -> None:
    _, parameters = model(
        arm(tmp_path), [parse_effect(DRIVES), parse_effect({"kind": "hardening-stiffness", "joints": [2]})]
    )
    by_name = {p.name: p for p in parameters}
    alike = by_name["joint2.rz.stiffness"].initial / angle**2  # as stiff as the linear spring there
    cubic = by_name["joint2.rz.cubic_stiffness"]
    assert cubic.lower < 0.01 * alike < alike < cubic.upper


@pytest.mark.parametrize(
    ("effect", "lost", "felt"),
    [
        (FRICTION, 1e9, 180.0),
        ({"kind": "hardening-stiffness", "joints": [2], "cubic": {"initial": 1e9}}, 1e-6, 1e6),
    ],
)
def test_an_impact_that_makes_the_torque_negligible_gives_the_linear_frfs(
    effect: dict[str, Any], lost: float, felt: float, tmp_path: Path
) -> None:
    linear, values = _target(tmp_path, {"kind": "window-decay"})
    linear = replace(linear, record=1.0)
    struck, more = _target(tmp_path, {"kind": "window-decay"}, effect, peak=lost)
    assert _apart(struck.predict(more), linear.predict(values)) < 1e-3
    struck, more = _target(tmp_path, {"kind": "window-decay"}, effect, peak=felt)
    assert _apart(struck.predict(more), linear.predict(values)) > 0.1, "the check can fail"


def test_friction_that_never_slips_is_a_damper_and_an_inertia(tmp_path: Path) -> None:
    """T = D v + D tau dv/dt, exactly linear: the whole route through time against the route through
    matrices.
    """
    linear, values = _target(tmp_path)
    own = {
        "torque": {"initial": 1e4},
        "stick_damping": {"initial": 3e3, "bounds": [1, 1e6]},
        "stick_time": {"initial": 0.03},
    }
    stuck = {"kind": "joint-friction", "joints": [2], **own}
    struck, more = _target(tmp_path, stuck, peak=1e-3)
    tau = more[-1]
    mass = linear.system.mass + 3e3 * tau * np.diag([0.0, 1.0, 0.0, 0.0, 0.0, 0.0])
    values = values.copy()
    values[3] += 3e3  # joint2.rz.damping
    expected = replace(linear, system=replace(linear.system, mass=mass), record=1.0).predict(values)
    assert _apart(struck.predict(more), expected) < 5e-3
    assert _apart(linear.predict(values), expected) > 5e-2, "the inertia counts"


@pytest.mark.parametrize(
    "effects",
    [
        [FRICTION],
        [{"kind": "hardening-stiffness", "joints": [1, 3], "cubic": {"initial": [1e13, 3e13]}}],
        [
            FRICTION,
            {"kind": "hardening-stiffness", "joints": [3], "cubic": {"initial": 3e13}},
            {"kind": "window-decay"},
        ],
    ],
)
def test_derivatives_are_those_of_the_prediction(effects: list[dict[str, Any]], tmp_path: Path) -> None:
    target, values = _target(tmp_path, *effects, top=30.0)
    free = np.arange(len(values))[2:]
    h, gradient = target.gradient(values, free)
    assert h == pytest.approx(target.predict(values))
    for column, number in [*enumerate(free)][::2]:
        step = np.zeros(len(values))
        step[number] = 3e-4 * abs(values[number]) or 3e-4
        expected = (target.predict(values + step) - target.predict(values - step)) / (2 * step[number])
        assert _apart(gradient[..., column], expected) < 0.03, number


def test_sets_that_share_a_bench_are_predicted_as_each_alone(tmp_path: Path) -> None:
    target, values = _target(tmp_path, FRICTION)
    assert target.simulated is not None
    harder = replace(target, simulated=replace(target.simulated, impact=Impact(700.0, 6.5e-3, 1.0)))
    noise = np.ones(target.data.frf.shape)
    both = [replace(one, noise=noise) for one in (target, harder)]
    objective = parse_cost("frf-least-squares").objective(Targets(tuple(both)))
    free = np.array([2, 3, 12])
    together, slopes = objective.residuals(values, free)
    alone = [
        parse_cost("frf-least-squares").objective(Targets((one,))).residuals(values, free) for one in both
    ]
    assert together == pytest.approx(np.concatenate([r for r, _ in alone]), rel=1e-9, abs=1e-12)
    assert slopes == pytest.approx(
        np.concatenate([j for _, j in alone]), rel=1e-6, abs=1e-12 * np.abs(slopes).max()
    )
    assert _apart(target.predict(values), harder.predict(values)) > 0.01
    crowd = values * np.exp(0.1 * np.random.default_rng(0).normal(size=(13, len(values))))
    assert objective.costs(crowd) == pytest.approx(
        [float(objective.costs(one[None])[0]) for one in crowd], rel=1e-9
    )


def test_levels_are_needed_by_these_effects_only() -> None:
    needing = {kind for kind in EFFECTS.names() if EFFECTS.get(kind).needs_levels}
    assert needing == {"joint-friction", "hardening-stiffness"}


def test_a_locked_joint_and_an_impact_that_was_not_stated_are_refused(
    tmp_path: Path, tested: Callable[[str], Path]
) -> None:
    system, _ = model(
        arm(tmp_path), [parse_effect({"kind": "joint-compliance", "joints": [1, 3]}), parse_effect(FRICTION)]
    )
    with pytest.raises(InputError, match=r"joint2\.rz, which is locked"):
        predictor(system)
    path = _study(tested("none"), [FRICTION], stated=False)
    with pytest.raises(InputErrors, match="no `impact`, on which a nonlinear effect depends"):
        load_problem(read_study(path))


@pytest.fixture(scope="module")
def tested(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """By what is hidden: a simulated test of few points at one posture at two levels, with the truth beside
    it.
    """

    @cache
    def made(case: str) -> Path:
        folder = tmp_path_factory.mktemp(case)
        spec = TestSpec(
            MAKES["large"](1).at_points([4, 6, 9, 14]),
            seed=3,
            postures=1,
            averages=3,
            binary=True,
            oversampling=8,
        )
        generate(replace(hide(spec, case), levels=(0.3, 3.0)), folder / "test", folder / "truth.json")
        return folder / "test"

    return made


def _study(
    test: Path,
    effects: list[dict[str, Any]],
    stated: bool = True,
    start: Mapping[str, float] | None = None,
) -> Path:
    """A config beside the test; `stated` says whether it tells how hard the impacts were; start: values to
    begin with.
    """
    about = json.loads((test / "test.json").read_text())
    usual = {"averages": about["averages"], "window_decay_per_s": about["exponential_window_decay_per_s"]}
    files = [
        {
            "file": one["file"],
            "posture_deg": one["posture_deg"],
            **usual,
            **({"impact": {"peak_n": one["level_n"]}} if stated else {}),
        }
        for one in about["files"]
    ]
    springs = {**DRIVES, "stiffness": {"initial": about["initial_stiffness_nm_per_rad"]}}
    study = {
        "schema": "identify/1",
        "robot": {"urdf": "robot.urdf"},
        "points": "points.csv",
        "measurements": files,
    }
    study |= {"band_hz": [3, 80], "effects": [springs, *effects], "starts": 1, "optimizer": STAGES}
    study["initial"] = dict(start or {})
    (test / "study.yaml").write_text(json.dumps(study))
    return test / "study.yaml"


def _fitted(
    test: Path, effects: list[dict[str, Any]], start: Mapping[str, float] | None = None
) -> tuple[Problem, dict[str, float], float]:
    problem = load_problem(read_study(_study(test, effects, start=start)))
    found = fit(fit_plan(problem))
    names = (parameter.name for parameter in problem.parameters)
    return problem, dict(zip(names, map(float, found.values), strict=True)), found.cost


@pytest.mark.parametrize(
    ("case", "kind", "parameter", "truth_of", "close"),
    [
        ("friction_j2", "joint-friction", "joint2.rz.friction_torque", "torque_nm", 0.1),
        pytest.param(
            "hardening_j3",
            "hardening-stiffness",
            "joint3.rz.cubic_stiffness",
            "cubic_nm_per_rad3",
            0.3,
            marks=pytest.mark.exam,
        ),
    ],
)
def test_it_is_found_in_a_simulated_test(
    case: str, kind: str, parameter: str, truth_of: str, close: float, tested: Callable[[str], Path]
) -> None:
    """Four impacts within 20 % of their level leave 6 % of their mean open (one sigma), and twice that of a
    cubic stiffness.  Springs begin where they are: it is the torque beside them that is looked for.
    """
    joint = int(case[-1])
    test = tested(case)
    told = json.loads((test.parent / "truth.json").read_text())
    hidden = told["effects"][0][truth_of]
    springs = {f"joint{number}.rz.stiffness": k for number, k in enumerate(told["k"], start=1)}
    problem, linear, before = _fitted(test, [], springs)
    gaps = torque_gaps(problem.targets().frf, np.array(list(linear.values())))
    assert level_gap(problem) > 1.5
    assert min(gaps, key=lambda name: gaps[name]) == f"joint{joint}.rz"
    _, named, after = _fitted(test, [{"kind": kind, "joints": [joint]}], linear)
    assert before > 2
    assert after - 1 < 0.3 * (before - 1)
    assert named[parameter] == pytest.approx(hidden, rel=close)
    wrong = _fitted(test, [{"kind": kind, "joints": [4]}], linear)[2]
    assert wrong - 1 > 0.8 * (before - 1)


@pytest.fixture(scope="module")
def rubbing(tested: Callable[[str], Path]) -> Problem:
    """A test of an arm with friction, two levels, whose impacts were not quite as stated."""
    path = _study(tested("friction_j2"), [FRICTION])
    study = json.loads(path.read_text()) | {"uncertainty": {"impacts": {"strength": 0.3, "duration": 0.2}}}
    for one, factor in zip(study["measurements"], (0.6, 1.4), strict=True):
        one["impact"]["peak_n"] *= factor
    path.write_text(json.dumps(study))
    return load_problem(read_study(path))


def test_errors_of_impacts_are_those_of_the_sets_that_are_simulated(rubbing: Problem) -> None:
    sets = [m.name for m in rubbing.measurements]
    named = {(one.place, one.change) for one in rubbing.nuisances.entries}
    inputs = rubbing.measurements[0].target.data.inputs
    assert named == {
        *((f"{name} {channel}", "strength") for name in sets for channel in inputs),
        ("impacts", "duration"),
    }
    linear = with_effects(rubbing, rubbing.file.study.effects[:1], {})
    assert not linear.nuisances.entries, "no linear model depends on them"


def test_derivatives_by_strength_and_duration_are_those_of_differences(rubbing: Problem) -> None:
    target, values = rubbing.targets().frf[1], rubbing.initial.copy()
    values[rubbing.size :] = 0.3 * np.random.default_rng(0).normal(size=len(values) - rubbing.size)
    _, slopes = target.gradient(values, np.arange(len(values)))
    felt = 0
    for number in range(rubbing.size, len(values)):
        step = np.zeros(len(values))
        step[number] = 3e-3
        expected = (target.predict(values + step) - target.predict(values - step)) / (2 * step[number])
        if target.name in rubbing.parameters[number].name or "duration" in rubbing.parameters[number].name:
            felt += 1
            assert _apart(slopes[..., number], expected) < 0.01, rubbing.parameters[number].name
        else:
            assert not expected.any() and not slopes[..., number].any()
    assert felt == 1 + len(target.data.inputs)


def test_errors_side_by_side_are_predicted_as_each_alone(rubbing: Problem) -> None:
    objective = parse_cost("frf-least-squares").objective(rubbing.targets())
    crowd = np.repeat(rubbing.initial[None], 5, axis=0)
    crowd[:, rubbing.size :] = np.random.default_rng(1).normal(size=(5, crowd.shape[1] - rubbing.size))
    crowd[3, rubbing.size :] = crowd[1, rubbing.size :]
    crowd[3, 0] *= 1.1
    alone = [
        float(parse_cost("frf-least-squares").objective(rubbing.targets()).costs(one[None])[0])
        for one in crowd
    ]
    assert objective.costs(crowd) == pytest.approx(alone, rel=1e-9)
    assert np.ptp(alone) > 0.01
    assert objective.costs(crowd[[4, 0]]) == pytest.approx([alone[4], alone[0]], rel=1e-9)


def test_impacts_that_may_be_off_explain_what_they_leave_and_say_so(rubbing: Problem) -> None:
    told = fit(fit_plan(with_uncertainty(rubbing, FORMS_ALONE))).cost
    found = fit(fit_plan(rubbing))
    off = found.values[rubbing.size :]
    assert told > 1.2
    assert found.cost - 1 < 0.7 * (told - 1)
    assert 0.3 * off.max() == pytest.approx(-np.log(0.6), abs=0.15), "what makes the joint slip at all"
    entries = rubbing.nuisances.entries
    said = [sentence([one], off[[number]]) for number, one in enumerate(entries) if abs(off[number]) > 0.5]
    assert any("stronger than stated" in one or "weaker than stated" in one for one in said), said


def test_levels_agree_where_nothing_depends_on_them(tested: Callable[[str], Path]) -> None:
    problem = load_problem(read_study(_study(tested("none"), [])))
    assert level_gap(problem) == pytest.approx(1.0, abs=0.3)
    assert np.isnan(level_gap(replace(problem, measurements=problem.measurements[:1])))


@pytest.mark.exam
def test_the_nonlinear_response_explains_friction_in_a_test_made_outside_this_project(tmp_path: Path) -> None:
    """At least half of what is above noise must go, on fitted and on validation data; most of it does."""
    gaps, initial = [], {}
    for extra in ("starts: 1\n", "  - {kind: joint-friction, joints: [2]}\nstarts: 1\n"):
        keys = f"{extra}optimizer: {json.dumps(STAGES)}\ninitial: {json.dumps(initial)}"
        found = fitted("friction_j2_101", tmp_path, keys)
        gaps.append((found.gap, found.gap_validation))
        initial = found.values
    assert [initial[f"joint{n}.rz.stiffness"] for n in range(1, 7)] == pytest.approx(
        truth("friction_j2_101")["k"], rel=0.02
    )
    for before, after in zip(*gaps, strict=True):
        assert after - 1 < 0.2 * (before - 1)

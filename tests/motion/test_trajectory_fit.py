"""Fits of motion to records that come from closed forms: values, intervals, effects found and effects not
found.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import expm

from identify.core.errors import InputError
from identify.core.parameters import Scale
from identify.fitting.fit import Progress
from identify.motion.command import Move
from identify.motion.evaluate import evaluate_fit
from identify.motion.problem import MotionProblem
from identify.motion.simulate import SimulatedMotion
from identify.motion.trajectory import TrajectoryObjective, phase_rms
from identify.motion.trajectory_fit import MotionFit, fit_motion
from tests.motion import arms
from tests.motion.test_simulate import DC

Array = NDArray[np.float64]
RATIO, KP, KD, NOISE = 55.0, 350.0, 7.0, {"motor_position": 1e-4, "motor_current": 0.05}
FREE = {"initial": 45.0, "bounds": [20, 120]}
SERVO = {
    "kind": "pid-voltage",
    "position_gain": {"initial": 200.0, "bounds": [50, 2000]},
    "derivative_gain": {"initial": 4.0, "bounds": [1, 40]},
}
STAGE = [{"kind": "gauss-newton", "tolerance": 1e-4}]
TURN, SAMPLES = arms.move(1, 14, 120, start_s=0.02), 40
COULOMB = {"name": "dry friction", "numbers": {"friction.coulomb": {"initial": 1.0, "bounds": [0.01, 100]}}}
INTEGRAL = {
    "name": "integral action",
    "numbers": {"servo.integral_gain": {"initial": 1.0, "bounds": [0.001, 1e4]}},
}


def truth(seconds: float, dry: float = 0.0, ki: float = 0.0) -> tuple[Array, Array]:
    """Angle and current at the ticks (n,) of a sampled PD motor on a link without weight, exact but for dry
    friction, by small steps.
    """
    inertia, parts = arms.ABOUT_JOINT + RATIO**2 * DC["rotor_inertia"], 50 if dry else 1
    a = np.zeros((5, 5))  # angle, velocity, current, voltage, dry friction
    a[0, 1], a[1, 2], a[1, 4] = 1.0, RATIO * DC["torque_constant"] / inertia, -1 / inertia
    a[2, 1:4] = (
        -RATIO * DC["back_emf"] / DC["inductance"],
        -DC["resistance"] / DC["inductance"],
        1 / DC["inductance"],
    )
    hold, state, error, integral, rows = expm(a * 1e-3 / parts), np.zeros(5), 0.0, 0.0, []
    for wanted in Move(**TURN).angle(np.arange(round(seconds * 1000) + 1) * 1e-3):
        rows.append(state[[0, 2]].copy())
        new = wanted - state[0]
        state[3], error, integral = (
            KP * new + KD * (new - error) / 1e-3 + integral,
            new,
            integral + ki * 1e-3 * new,
        )
        for _ in range(parts):
            state[4] = dry * np.tanh(state[1] / 2e-4)
            state = hold @ state
    angle, current = np.array(rows).T
    return angle, current


def record(
    folder: Path, name: str, seed: int, dry: float = 0.0, seconds: float = 0.4, ki: float = 0.0
) -> dict[str, Any]:
    """A record's settings, and its file with noise."""
    folder.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng(seed)
    angle, current = truth(seconds, dry, ki)
    every = len(angle) // SAMPLES
    rows = [
        angle[::every] + rng.normal(scale=1e-4, size=len(angle[::every])),
        current[::every] + rng.normal(scale=0.05, size=len(angle[::every])),
    ]
    time = np.arange(len(rows[0])) * every * 1e-3
    np.savetxt(
        folder / f"{name}.csv",
        np.column_stack([time, *rows]),
        delimiter=",",
        header="time_s,angle_rad,current_A",
        comments="",
    )
    signals = {
        "motor_position": {"at": "angle_rad", "unit": "rad"},
        "motor_current": {"at": "current_A", "unit": "A"},
    }
    return {
        "name": name,
        "start_deg": [0.0],
        "duration_s": seconds,
        "moves": [TURN],
        "measured": {"file": f"{name}.csv", "signals": signals},
    }


def fitted(folder: Path, records: list[dict[str, Any]], **keys: Any) -> MotionFit:
    """With an optimizer that is content with less than the default one."""
    problem = arms.study(
        folder,
        arms.one_link(0.0),
        motor=DC,
        gear={"ratio": FREE},
        servo=SERVO,
        noise=NOISE,
        records=records,
        **{"optimizer": STAGE, **keys},
    )
    return fit_motion(problem, Progress())


def test_ratio_and_gains_are_found_within_their_intervals(tmp_path: Path) -> None:
    """Over seeds, the truth lies in the 95 % intervals about as often as they say, and the gap is 1."""
    inside, gaps = [], []
    for seed in range(4):
        found = fitted(tmp_path / str(seed), [record(tmp_path / str(seed), "a", seed)])
        result = evaluate_fit(found.problem, found)
        assert result.parameters is not None
        p = result.parameters
        inside.append((p.low_95 <= [RATIO, KP, KD]) & (p.high_95 >= [RATIO, KP, KD]))
        np.testing.assert_allclose(p.value, [RATIO, KP, KD], rtol=0.06)
        gaps.append(found.fit.cost)
    assert np.mean(gaps) == pytest.approx(1.0, abs=0.1)
    assert 0.7 <= np.mean(inside) <= 1.0
    assert (p.high_95 / p.low_95 < 1.2).all()


def test_a_bee_colony_then_gauss_newton_gets_there_from_afar(tmp_path: Path) -> None:
    stages = [
        {"kind": "artificial-bee-colony", "evaluations": 150, "population": 30},
        {"kind": "gauss-newton", "tolerance": 1e-8},
    ]
    found = fitted(tmp_path, [record(tmp_path, "a", 1)], optimizer=stages)
    np.testing.assert_allclose(found.fit.values, [RATIO, KP, KD], rtol=0.03)
    assert found.fit.cost == pytest.approx(
        TrajectoryObjective(found.problem, found.problem.records, NOISE).costs(found.fit.values[None])[0]
    )


def test_a_missing_effect_is_added_and_a_spurious_one_is_not(tmp_path: Path) -> None:
    """The truth has dry friction and no integral action; the second record judges."""
    records = [record(tmp_path, "a", 1, dry=25.0), {**record(tmp_path, "b", 2, dry=25.0), "use": "validate"}]
    found = fitted(tmp_path, records, candidates=[INTEGRAL, COULOMB])
    kept = [trial.name for trial in found.trials if trial.kept]
    assert kept == ["the model as it is", "dry friction"]
    assert found.trials[0].gap_judged > 4.0
    assert min(trial.gap_judged for trial in found.trials) < 1.3
    names = [p.name for p in found.problem.parameters]
    assert found.fit.values[names.index("joint1.friction.coulomb")] == pytest.approx(25.0, rel=0.05)


def test_effects_of_two_rounds_stay_together(tmp_path: Path) -> None:
    """Integral action and dry friction are both missing: what the first round added is in the model of the
    second.
    """
    records = [record(tmp_path, "a", 1, dry=40.0, ki=900.0)]
    found = fitted(tmp_path, records, candidates=[COULOMB, INTEGRAL])
    assert {trial.name for trial in found.trials if trial.kept} == {
        "the model as it is",
        "dry friction",
        "integral action",
    }
    values = dict(zip((p.name for p in found.problem.parameters), found.fit.values, strict=True))
    assert values["joint1.friction.coulomb"] == pytest.approx(40.0, rel=0.05)
    assert values["joint1.servo.integral_gain"] == pytest.approx(900.0, rel=0.1)
    assert values["joint1.gear.ratio"] == pytest.approx(RATIO, rel=0.05)
    assert found.fit.cost < 1.3


def _one_link(folder: Path) -> MotionProblem:
    """One link and one record of it."""
    return arms.study(
        folder,
        arms.one_link(0.0),
        motor=DC,
        gear={"ratio": FREE},
        servo=SERVO,
        noise=NOISE,
        records=[record(folder, "a", 3)],
    )


def test_residuals_and_costs_agree_and_the_gradient_is_the_slope(tmp_path: Path) -> None:
    problem = _one_link(tmp_path)
    objective, scale, values = (
        TrajectoryObjective(problem, problem.records, NOISE),
        Scale(problem.parameters),
        problem.initial,
    )
    residuals, slopes = objective.residuals(values, scale.free)
    assert np.sqrt(np.sum(residuals**2)) == pytest.approx(objective.costs(values[None])[0], rel=1e-12)
    for column, number in enumerate(scale.free):
        moved = np.tile(values, (2, 1))
        moved[:, number] *= [1 + 1e-3, 1 - 1e-3]
        up, down = objective.costs(moved) ** 2
        assert (up - down) / (moved[0] - moved[1])[number] == pytest.approx(
            2 * residuals @ slopes[:, column], rel=0.02
        )
    assert objective.costs(np.array([[50.0, 2000.0, 40.0]]))[0] == np.inf  # that loop is unstable


def test_what_is_computed_along_with_a_cost_changes_nothing(tmp_path: Path) -> None:
    """A step that is taken, one that is not, and one taken after it: as an objective that saw nothing before
    has them.
    """
    problem = _one_link(tmp_path)

    def fresh() -> TrajectoryObjective:
        return TrajectoryObjective(problem, problem.records, NOISE)

    objective, free = fresh(), Scale(problem.parameters).free
    objective.residuals(problem.initial, free)
    for growth, taken in ((1.1, True), (1.2, False), (1.3, True)):
        values = growth * problem.initial
        assert objective.costs(values[None])[0] == fresh().costs(values[None])[0]
        if taken:
            for one, other in zip(
                objective.residuals(values, free), fresh().residuals(values, free), strict=True
            ):
                np.testing.assert_array_equal(one, other)


def test_motions_of_the_last_two_values_are_not_simulated_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whatever a logarithmic scale makes of their last digit; those of other values are."""
    problem, runs, run = _one_link(tmp_path), list[int](), MotionProblem.run

    def counted(self: MotionProblem, values: Array, *given: Any, **named: Any) -> SimulatedMotion:
        runs.append(len(values))
        return run(self, values, *given, **named)

    monkeypatch.setattr(MotionProblem, "run", counted)
    free = Scale(problem.parameters).free
    objective = TrajectoryObjective(problem, problem.records, NOISE)
    first, second = problem.initial, 1.01 * problem.initial
    for values in (first, second):
        objective.residuals(values, free)
    assert len(runs) == 2
    for values in (first, second):
        rounded = np.exp(np.log(values)) * (1 + 1e-15)
        assert not np.array_equal(rounded, values)
        objective.residuals(rounded, free)
        objective.costs(rounded[None])
    assert len(runs) == 2
    objective.residuals(first * (1 + 1e-9), free)
    assert len(runs) == 3


def test_rms_by_phase() -> None:
    time = np.linspace(0, 2, 201)
    difference = np.where(time < 1, 3.0, 4.0)[:, None] * [1.0, 2.0]
    rms = phase_rms(difference, time, {"slow": (0, 0.99), "fast": (1, 2)})
    np.testing.assert_allclose(rms[1:], [[3, 6], [4, 8]])
    assert 3 < rms[0, 0] < 4


def test_a_record_that_is_not_there_is_named(tmp_path: Path) -> None:
    stage = [{"kind": "gauss-newton", "measurements": ["b"]}]
    with pytest.raises(InputError, match="no record 'b' is fitted"):
        fitted(tmp_path, [record(tmp_path, "a", 1)], optimizer=stage)
    with pytest.raises(InputError, match=r"unknown number 'friction\.colomb'"):
        fitted(
            tmp_path,
            [record(tmp_path, "a", 1)],
            candidates=[{"name": "x", "numbers": {"friction.colomb": 1.0}}],
        )

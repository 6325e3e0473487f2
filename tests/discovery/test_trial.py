"""What a trial's numbers mean, against costs computed here, and which channels are left out for
validation.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np
import pytest

from identify.core.parameters import Scale
from identify.core.thresholds import QUIET
from identify.discovery.task import Task
from identify.discovery.thinned import left_out, thinned
from identify.discovery.trial import TrialRunner, from_each
from identify.model.effects.base import parse_effect
from identify.vibration.costs.frf_least_squares import FrfLeastSquares
from identify.vibration.problem import Problem, load_problem, with_effects
from identify.vibration.study import read_study
from identify.vibration.uncertainty import (
    fitted_information,
    gap_elsewhere,
    predictive_squares,
    uncertainty,
)
from tests.hidden import config_of, truth, write_config
from tests.shared import shared

CONFIG = Path(__file__).parents[2] / "configs" / "arm_hammer_test.yaml"


@pytest.fixture(scope="module")
def problem() -> Problem:
    """The shipped example with its data."""
    return load_problem(read_study(CONFIG))


def _squares(problem: Problem, values: np.ndarray, use: str = "fit") -> tuple[float, int]:
    """Sum of squared residuals over noise and their number, line by line from the FRFs themselves."""
    squares, count = 0.0, 0
    for target in problem.targets(use).frf:  # type: ignore[arg-type]
        assert target.noise is not None
        part = (target.predict(values) - target.data.frf) / target.noise
        known = np.isfinite(part)
        squares += float(np.sum(part[known].real ** 2 + part[known].imag ** 2))
        count += 2 * int(known.sum())
    return squares, count


@pytest.mark.parametrize("how", ["glance", "quick"])
def test_squares_of_a_trial_are_those_of_its_residuals(problem: Problem, how: str) -> None:
    bench, known = TrialRunner(problem), tuple(problem.file.study.effects)
    trial = bench.run(Task(known, (), {}, how))  # type: ignore[arg-type]
    thin = thinned(problem)
    squares, count = _squares(thin, thin.at(trial.values))
    assert (trial.squares, trial.count) == (pytest.approx(squares, rel=1e-6), count)
    assert trial.gap == pytest.approx(np.sqrt(squares / count), rel=1e-6)
    assert trial.free == sum(p.free for p in problem.parameters)


def test_other_data_are_judged_against_what_the_fit_knows(problem: Problem) -> None:
    """Springs that the fit leaves wide open predict nothing along them, and fail nowhere."""
    bench, known = TrialRunner(problem), tuple(problem.file.study.effects)
    link = problem.robot.links[2].name
    spring = parse_effect({"kind": "spring-to-ground", "link": link, "cross_coupling": True})
    trial = bench.run(Task(known, (spring,), {}, "onward"))
    model = with_effects(problem, trial.task.effects, trial.values)
    squares, count = _squares(model, model.initial, "validate")
    assert trial.count_validation == count
    assert trial.squares_validation < 0.99 * squares
    expected, _ = predictive_squares(model, fitted_information(model, model.initial), model.initial)
    assert trial.squares_validation == pytest.approx(expected, rel=1e-6)


def test_a_third_is_left_out_and_has_all_directions(problem: Problem) -> None:
    """Responses come point by point, three directions each: what is left out and what is kept has all
    three.
    """
    split = left_out(thinned(problem))
    kept, aside = (
        [channel for m in split.measurements if m.settings.use == use for channel in m.given.data.outputs]
        for use in ("fit", "validate")
    )
    assert len(aside) == pytest.approx((len(kept) + len(aside)) / 3, abs=2)
    for channels in (kept, aside):
        directions = [str(channel)[-1] for channel in channels]
        shares = [directions.count(one) / len(directions) for one in "XYZ"]
        assert shares == pytest.approx([1 / 3] * 3, abs=0.15)


def test_thinned_lines_are_spread_evenly_and_keep_their_own_noise(problem: Problem) -> None:
    for whole, thin in zip(
        [m for m in problem.measurements if m.settings.use == "fit"],
        thinned(problem).measurements,
        strict=True,
    ):
        lines = np.searchsorted(whole.given.data.frequency_hz, thin.given.data.frequency_hz)
        assert np.ptp(np.diff(lines)) == 0
        assert np.array_equal(thin.given.data.frf, whole.given.data.frf[lines])
        assert np.array_equal(thin.given.noise, whole.given.noise[lines])
        assert thin.given.data.frequency_hz[-1] > 0.9 * whole.given.data.frequency_hz[-1]


def test_doubled_noise_quarters_the_squares(problem: Problem) -> None:
    known = tuple(problem.file.study.effects)
    loud = replace(
        problem,
        measurements=tuple(
            replace(
                m,
                given=replace(m.given, data=replace(m.given.data, noise=2 * m.given.noise)),
                target=replace(m.target, noise=2 * m.target.noise),  # type: ignore[union-attr,operator]
            )
            for m in problem.measurements
        ),
    )
    stated, doubled = (TrialRunner(one).run(Task(known, (), {}, "glance")) for one in (problem, loud))
    assert doubled.squares == pytest.approx(stated.squares / 4, rel=1e-6)
    assert doubled.gap == pytest.approx(stated.gap / 2, rel=1e-6)


def test_a_resonator_is_reached_from_the_start_whose_valley_is_its_own(tmp_path: Path) -> None:
    """Not from the best of the grid, whose frequency is another."""
    runner = TrialRunner(load_problem(read_study(write_config("absorber_l3_101", tmp_path))))
    known = tuple(runner.whole.file.study.effects)
    present = runner.run(Task(known, (), {p.name: p.initial for p in runner.whole.parameters}, "start"))
    effect = parse_effect({"kind": "appended-resonator", "link": "link3", "axis": "y"})
    problem = with_effects(runner.thin, (*known, effect), present.values)
    names = [p.name for p in problem.parameters]
    stiffness, mass = (names.index(f"link3.resonator_y.{one}") for one in ("stiffness", "mass"))
    [*_, (_, own)] = problem.measurements[0].system.effects
    terms = effect.terms(problem.robot, problem.measurements[0].system.site, f"effects.{len(known)}")
    grid = effect.initial_values(terms, (3.0, 80.0))
    starts = np.repeat(problem.initial[None], len(grid), axis=0)
    starts[:, own] = grid

    def hz(values: np.ndarray) -> float:
        return float(np.sqrt(values[stiffness] / values[mass]) / (2 * np.pi))

    true = truth("absorber_l3_101")["effects"][0]["frequency_hz"]
    costs = FrfLeastSquares(residual="log").objective(problem.targets()).costs(starts)
    assert hz(from_each(problem, starts)) == pytest.approx(true, rel=0.05)
    assert hz(from_each(problem, starts[[int(np.argmin(costs))]])) != pytest.approx(true, rel=0.05)


def _first_looks(case: str, level: str, folder: Path, effects: list[dict[str, object]]) -> list[float]:
    """Gaps of candidates beside the study's own effects after first looks, with errors of what was told."""
    config = config_of(shared("hidden_dirty", case), folder, extra=f"uncertainty: {level}")
    runner = TrialRunner(load_problem(read_study(config)))
    known = tuple(runner.whole.file.study.effects)
    values = {p.name: p.initial for p in runner.whole.parameters}
    tasks = [Task(known, (parse_effect(effect),), values, "brief") for effect in effects]
    first = [runner.run(task) for task in tasks]
    led = [runner.run(replace(one.task, values=one.values, how="led")) for one in first]
    return [runner.run(replace(one.task, values=one.values, how="quick")).gap for one in led]


def test_under_stated_uncertainty_a_first_look_ends_in_the_right_valley(tmp_path: Path) -> None:
    """A tilt, a link that bends beside it, and a tilt that a few timid steps put before both."""
    tilt, beside, other = _first_looks(
        "tilt_j2_8102_dirt3",
        "typical",
        tmp_path,
        [
            {"kind": "joint-compliance", "joints": [2], "axes": ["rx", "ry"]},
            {"kind": "link-flexibility", "link": "link2"},
            {"kind": "joint-compliance", "joints": [3], "axes": ["rx", "ry"]},
        ],
    )
    assert tilt < 0.8 * beside < 0.4 * other


def test_under_stated_uncertainty_a_reversed_channel_stands_out(tmp_path: Path) -> None:
    true, other = _first_looks(
        "polarity_8101_dirt1",
        "careful",
        tmp_path,
        [{"kind": "channel-polarity", "channel": f"{channel}:+Y"} for channel in (10, 1)],
    )
    assert true < 0.2 * other


def _stated(folder: Path) -> Problem:
    """The shipped example as a careful lab would have told it."""
    config = folder / "study.yaml"
    text = CONFIG.read_text(encoding="utf-8").replace("../data", str(CONFIG.parents[1] / "data"))
    config.write_text(f"{text}\nuncertainty: careful\n", encoding="utf-8")
    return load_problem(read_study(config))


def test_under_stated_uncertainty_a_first_look_that_went_astray_begins_with_the_present_values(
    tmp_path: Path,
) -> None:
    """Where those of the study are far from the data, so that a look from them ends nowhere."""
    near = _stated(tmp_path)
    present = {p.name: p.initial for p in near.parameters}
    known = tuple(near.file.study.effects)
    tilt = parse_effect({"kind": "joint-compliance", "joints": [2], "axes": ["rx", "ry"]})

    def gap(problem: Problem, how: Literal["brief", "astray"] = "brief") -> float:
        return TrialRunner(problem).run(Task(known, (tilt,), present, how)).gap

    far = tuple(
        replace(p, initial=20 * p.initial, upper=100 * p.upper) if p.free and not p.nuisance else p
        for p in near.parameters
    )
    far_off = replace(near, parameters=far)
    assert gap(far_off, "astray") < 0.2 * gap(far_off)


def test_under_stated_uncertainty_a_trial_says_of_other_data_what_its_result_would(tmp_path: Path) -> None:
    """So that it is not judged twice."""
    stated = _stated(tmp_path)
    trial = TrialRunner(stated).run(Task(tuple(stated.file.study.effects), (), {}, "onward"))
    values, targets = stated.at(trial.values), stated.targets()
    trusted = uncertainty(targets, Scale(stated.parameters), values, disagreement=False)
    assert trial.gap_validation == pytest.approx(gap_elsewhere(stated, trusted, values), rel=1e-6)


def test_under_stated_uncertainty_two_effects_begin_where_each_does_by_default(tmp_path: Path) -> None:
    """Not where either ended by itself, which made up for the other."""
    runner = TrialRunner(_stated(tmp_path))
    known = tuple(runner.whole.file.study.effects)
    present = {p.name: p.initial for p in runner.whole.parameters}
    two = tuple(
        parse_effect({"kind": "joint-compliance", "joints": [joint], "axes": ["rx", "ry"]})
        for joint in (2, 3)
    )
    ended = {f"joint{joint}.{axis}.stiffness": 1e9 for joint in (2, 3) for axis in ("rx", "ry")}
    first = runner.run(Task(known, two, present, "astray"))
    assert set(ended) <= set(first.values)
    misled = runner.run(Task(known, two, {**present, **ended}, "astray"))
    assert misled.gap == pytest.approx(first.gap, rel=1e-6)


def test_from_afresh_a_valley_is_left_only_for_a_better_one(tmp_path: Path) -> None:
    """A tilt that is stuck where it does nothing, and one that is where it belongs."""
    config = config_of(shared("hidden_dirty", "tilt_j2_8102_dirt3"), tmp_path, extra="uncertainty: typical")
    runner = TrialRunner(load_problem(read_study(config)))
    known = tuple(runner.whole.file.study.effects)
    tilt = parse_effect({"kind": "joint-compliance", "joints": [2], "axes": ["rx", "ry"]})
    stuck = {p.name: p.initial for p in runner.whole.parameters}
    stuck |= {f"joint2.{axis}.stiffness": 1e9 for axis in ("rx", "ry")}
    reached = runner.run(Task(known, (tilt,), stuck, "afresh"))
    assert reached.gap < QUIET
    again = runner.run(Task(known, (tilt,), reached.values, "afresh"))
    assert again.values == reached.values

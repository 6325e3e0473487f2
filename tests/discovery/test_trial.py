"""What a trial's numbers mean, against costs computed here, and which channels are left out for
validation.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from identify.core.parameters import Scale
from identify.discovery.decimated import decimated, left_out
from identify.discovery.task import Task
from identify.discovery.trial import TrialRunner
from identify.model.effects.base import parse_effect
from identify.vibration.elsewhere import gap_elsewhere, predictive_squares
from identify.vibration.problem import Problem, load_problem, with_effects
from identify.vibration.study import read_study
from identify.vibration.uncertainty import (
    fitted_information,
    uncertainty,
)

DELAY = parse_effect({"kind": "time-delay"})
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


@pytest.mark.parametrize("whole", [False, True])
def test_squares_of_a_trial_are_those_of_its_residuals(problem: Problem, whole: bool) -> None:
    bench, known = TrialRunner(problem), tuple(problem.file.study.effects)
    trial = bench.run(Task(known, (), {}, whole))
    fitted = problem if whole else decimated(problem)
    squares, count = _squares(fitted, fitted.at(trial.values))
    assert (trial.squares, trial.count) == (pytest.approx(squares, rel=1e-6), count)
    assert trial.gap == pytest.approx(np.sqrt(squares / count), rel=1e-6)
    assert trial.free == sum(p.free for p in problem.parameters)


def test_other_data_are_judged_against_what_the_fit_knows(problem: Problem) -> None:
    """Springs that the fit leaves wide open predict nothing along them, and fail nowhere."""
    bench, known = TrialRunner(problem), tuple(problem.file.study.effects)
    link = problem.robot.links[2].name
    spring = parse_effect({"kind": "spring-to-ground", "link": link, "cross_coupling": True})
    trial = bench.run(Task(known, (spring,), {}, whole=True))
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
    split = left_out(decimated(problem))
    kept, aside = (
        [channel for m in split.measurements if m.settings.use == use for channel in m.given.data.outputs]
        for use in ("fit", "validate")
    )
    assert len(aside) == pytest.approx((len(kept) + len(aside)) / 3, abs=2)
    for channels in (kept, aside):
        directions = [str(channel)[-1] for channel in channels]
        shares = [directions.count(one) / len(directions) for one in "XYZ"]
        assert shares == pytest.approx([1 / 3] * 3, abs=0.15)


def test_decimated_lines_are_spread_evenly_and_keep_their_own_noise(problem: Problem) -> None:
    for whole, thin in zip(
        [m for m in problem.measurements if m.settings.use == "fit"],
        decimated(problem).measurements,
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
    stated, doubled = (TrialRunner(one).run(Task(known, (), {})) for one in (problem, loud))
    assert doubled.squares == pytest.approx(stated.squares / 4, rel=1e-6)
    assert doubled.gap == pytest.approx(stated.gap / 2, rel=1e-6)


def _stated(folder: Path) -> Problem:
    """The shipped example as a careful lab would have told it."""
    config = folder / "study.yaml"
    text = CONFIG.read_text(encoding="utf-8").replace("../data", str(CONFIG.parents[1] / "data"))
    config.write_text(f"{text}\nuncertainty: careful\n", encoding="utf-8")
    return load_problem(read_study(config))


def test_under_stated_uncertainty_a_trial_says_of_other_data_what_its_result_would(tmp_path: Path) -> None:
    """So that it is not judged twice."""
    stated = _stated(tmp_path)
    trial = TrialRunner(stated).run(Task(tuple(stated.file.study.effects), (), {}, whole=True))
    values, targets = stated.at(trial.values), stated.targets()
    trusted = uncertainty(targets, Scale(stated.parameters), values, disagreement=False)
    assert trial.gap_validation == pytest.approx(gap_elsewhere(stated, trusted, values), rel=1e-6)


def test_what_is_new_begins_at_the_best_of_its_grid(problem: Problem) -> None:
    """Not at its default, from which a delay of the other sign is not reached; values that are given stay."""
    known = tuple(problem.file.study.effects)
    late = {"responses.delay": -2e-3}
    model = with_effects(problem, (*known, DELAY), late)
    measured = tuple(
        replace(m, given=replace(m.given, data=replace(m.given.data, frf=told.target.predict(model.initial))))  # type: ignore[union-attr]
        for m, told in zip(problem.measurements, model.measurements, strict=True)
    )
    runner = TrialRunner(with_effects(replace(problem, measurements=measured), known, {}))
    values = {p.name: p.initial for p in problem.parameters}
    assert runner.run(Task(known, (DELAY,), values)).values["responses.delay"] == pytest.approx(
        -2e-3, rel=1e-3
    )

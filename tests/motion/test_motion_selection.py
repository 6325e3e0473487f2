"""How effects of a simulated motion are chosen: evidence on the records that judge, pruning, rivals, and no
set of effects fitted twice.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from identify.fitting.fit import Fit, Progress, Start
from identify.fitting.plan import FitPlan
from identify.motion import workbench
from identify.motion.changed import with_numbers
from identify.motion.evaluate import rivals_said
from identify.motion.judging import FittedMotion, JudgingRecords
from identify.motion.problem import MotionProblem
from identify.motion.trajectory_fit import MotionFit, fit_motion
from tests.motion import arms
from tests.motion.test_simulate import DC
from tests.motion.test_trajectory_fit import COULOMB, FREE, INTEGRAL, NOISE, SERVO, record

Array = NDArray[np.float64]
VISCOUS = {
    "name": "viscous friction",
    "numbers": {"friction.viscous": {"initial": 1.0, "bounds": [0.01, 1e3]}},
}
KEYS = {"friction.coulomb": "C", "servo.integral_gain": "I", "friction.viscous": "V"}


def problem_of(folder: Path, *, judged: bool = True) -> MotionProblem:
    second = record(folder, "b", 2, seconds=0.8) | ({"use": "validate"} if judged else {})
    records = [record(folder, "a", 1, seconds=0.8), second]
    return arms.study(
        folder,
        arms.one_link(0.0),
        motor=DC,
        gear={"ratio": FREE},
        servo=SERVO,
        noise=NOISE,
        records=records,
        candidates=[COULOMB, INTEGRAL, VISCOUS],
    )


def letters(names: list[str]) -> str:
    """Which effects there are, by their parameters."""
    return "".join(letter for key, letter in KEYS.items() if any(name.endswith(key) for name in names))


def tabled(monkeypatch: pytest.MonkeyPatch, gaps: dict[str, float], samples: int = 400) -> list[str]:
    """Gaps by sets of effects in place of simulations; the sets that are fitted, in order."""
    fits: list[str] = []

    def fake(plan: FitPlan, progress: Progress) -> Fit:
        fits.append(letters([p.name for p in plan.parameters]))
        values = np.array([p.initial for p in plan.parameters])
        start = Start(values, values, gaps[fits[-1]], 1, 0.0, True, "")
        return Fit(values, start.cost, (start,), np.zeros((0, 5)), 0.0)

    def residuals(self: FittedMotion) -> list[Array]:
        return [self.gap * np.random.default_rng(1).normal(size=(samples, 1))]

    monkeypatch.setattr(workbench, "fit", fake)
    monkeypatch.setattr(FittedMotion, "gap", property(lambda self: self.fit.cost))
    monkeypatch.setattr(FittedMotion, "residuals", property(residuals))
    monkeypatch.setattr(FittedMotion, "fitted_residuals", property(lambda self: []))
    return fits


def kept(found: MotionFit) -> list[str]:
    return [trial.name for trial in found.trials[1:] if trial.kept]


def test_an_effect_that_others_made_needless_is_taken_out(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    gaps = {"": 10.0, "C": 3.0, "I": 4.0, "V": 5.0, "CI": 2.0, "CV": 2.5, "IV": 1.0, "CIV": 1.0}
    fits = tabled(monkeypatch, gaps)
    found = fit_motion(problem_of(tmp_path), Progress())
    assert kept(found) == ["integral action", "viscous friction"]
    assert letters([p.name for p in found.problem.parameters]) == "IV"
    assert found.fit.cost == 1.0
    assert sorted(fits) == sorted(gaps)  # each set once
    tabled(monkeypatch, {**gaps, "IV": 1.5})  # all three are missed now
    assert set(kept(fit_motion(problem_of(tmp_path / "all"), Progress()))) == {
        "dry friction",
        "integral action",
        "viscous friction",
    }


@pytest.mark.parametrize(
    ("gap", "samples", "stays"), [(9.95, 4000, False), (9.8, 4000, True), (9.8, 80, False)]
)
def test_an_effect_must_take_a_hundredth_off_the_gap_and_have_the_odds(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, gap: float, samples: int, stays: bool
) -> None:
    """For half a hundredth, 4000 samples have odds of e^20; for two, 80 samples have e^1.6."""
    tabled(monkeypatch, {"": 10.0, "C": gap, "I": 10.0, "V": 10.0, "CI": gap, "CV": gap}, samples)
    found = fit_motion(problem_of(tmp_path), Progress())
    assert kept(found) == (["dry friction"] if stays else [])


def test_a_rival_that_does_as_well_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    gaps = {"": 10.0, "C": 1.0, "I": 1.0, "V": 3.0, "CI": 1.0, "CV": 1.0}
    tabled(monkeypatch, gaps)
    found = fit_motion(problem_of(tmp_path), Progress())
    assert found.rivals == (("dry friction", "integral action"),)
    assert "cannot tell dry friction from integral action" in rivals_said(found)[0]
    tabled(monkeypatch, {**gaps, "I": 1.2})
    assert fit_motion(problem_of(tmp_path / "apart"), Progress()).rivals == ()


def motion(
    problem: MotionProblem, gap: float, residual: Array, fitted: list[Array] | None = None
) -> FittedMotion:
    """A fitted motion whose simulation is known."""
    found: Any = FittedMotion(problem, Fit(problem.initial, gap, (), np.zeros((0, 5)), 0.0))
    found.__dict__.update(gap=gap, residuals=[residual], fitted_residuals=fitted or [])
    return found  # type: ignore[no-any-return]


def test_evidence_is_of_correlated_residuals_and_fitted_parameters_cost(
    tmp_path: Path,
) -> None:
    """Samples without a measurement, and joints that do not change, say nothing."""
    problem, everything = problem_of(tmp_path), problem_of(tmp_path / "all", judged=False)
    noise = np.random.default_rng(0).normal(size=(800, 2))
    noise[::2, 1] = np.nan
    slow = noise + np.sin(np.arange(800) / 50)[:, None] * [1.0, 0.0]
    gain = JudgingRecords().gain(motion(problem, 1.2, slow), motion(problem, 1.0, noise))
    squares = np.sum(slow[:, 0] ** 2 - noise[:, 0] ** 2) / 2
    assert 0.5 * squares < gain.log_odds < 1.1 * squares  # four lines of noise are by chance above one
    assert gain.explained == pytest.approx(1 - 1 / 1.2)
    wrong = 3 * np.sin(np.arange(800) / 90)[:, None]  # what both get wrong is as slow: hardly any evidence
    among = JudgingRecords().gain(motion(problem, 2.4, slow + wrong), motion(problem, 2.3, noise + wrong))
    assert 0 < among.log_odds < 7
    back = JudgingRecords().gain(motion(problem, 1.0, noise), motion(problem, 1.2, slow))
    assert back.log_odds < 0
    assert not back.confirmed
    same = JudgingRecords().gain(motion(problem, 1.0, noise), motion(problem, 1.0, noise + 0.01))
    assert same.log_odds == 0
    freed = with_numbers(everything, everything.file.study.candidates[0].numbers, {})
    priced = JudgingRecords().gain(motion(everything, 1.2, slow), motion(freed, 1.0, noise))
    assert gain.log_odds - priced.log_odds == pytest.approx(np.log(1200) / 2, rel=0.05)


def test_what_all_models_get_wrong_at_a_frequency_is_evidence_for_none(tmp_path: Path) -> None:
    """Beside a slow error of three times the noise, taking off a tenth of it says little, and as much of what
    is fast says what it would say without; the best of all models says how wrong all are.
    """
    problem, rng = problem_of(tmp_path), np.random.default_rng(0)
    spectrum = np.where(np.arange(2001) < 40, 1.0, 0.0) * np.exp(2j * np.pi * rng.random(2001))
    slow = np.fft.irfft(spectrum, 4000)[:, None]
    slow *= 3.0 / np.std(slow)
    fast, noise = 0.75 * np.sin(1.3 * np.arange(4000))[:, None], rng.normal(size=(4000, 1))
    first = motion(problem, 3.2, noise + 1.1 * slow + fast)
    less_slow, less_fast = motion(problem, 3.1, noise + slow + fast), motion(problem, 3.1, noise + 1.1 * slow)
    whole = 0.5 * 4000 * 0.75**2 / 2
    assert JudgingRecords().gain(first, less_fast).log_odds == pytest.approx(whole, rel=0.15)
    assert 0 < JudgingRecords().gain(first, less_slow).log_odds < 0.02 * 0.5 * 4000 * 0.21 * 9
    right = motion(problem, 1.0, noise)
    assert JudgingRecords((right,)).gain(first, less_slow).log_odds > 2000


def test_all_records_say_which_and_those_that_judge_confirm_it(tmp_path: Path) -> None:
    problem, noise = problem_of(tmp_path), np.random.default_rng(0).normal(size=(4000, 1))
    better, worse = (motion(problem, 1.0, noise, [part * noise]) for part in (1.0, 1.1))
    assert JudgingRecords().gain(worse, better).log_odds == pytest.approx(0.21 * 2000, rel=0.1)
    assert not JudgingRecords(least=5.0).gain(worse, better).confirmed


def test_a_motion_that_runs_away_gains_nothing(tmp_path: Path) -> None:
    problem, fine = problem_of(tmp_path), np.ones((100, 1))
    away = motion(problem, np.inf, np.full((100, 1), np.nan))
    assert JudgingRecords().gain(motion(problem, 1.0, fine), away).log_odds == -np.inf
    assert JudgingRecords().gain(away, motion(problem, 1.0, fine)).explained == 1.0

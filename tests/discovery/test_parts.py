"""The parts of the loop, each on its own."""

from __future__ import annotations

import math
from pathlib import Path
from typing import cast

import numpy as np
import pytest
from ruamel.yaml import YAML

from identify.core.parameters import Parameter
from identify.core.threads import one_thread
from identify.core.thresholds import CONVINCING
from identify.discovery import sentences as told
from identify.discovery.decimated import decimated, left_out
from identify.discovery.evidence import EvidenceCriterion, removed
from identify.discovery.localise import Part, band_limits, gap_map, in_words, parts
from identify.discovery.loop import Discovery
from identify.discovery.new_config import config_text
from identify.discovery.task import Option, Step, Task, Trial
from identify.discovery.trial import TrialRunner
from identify.discovery.workers import Workers
from identify.fitting.selection import workbench as selection
from identify.fitting.selection.gain import Gain
from identify.model.effects.base import Effect, Term, parse_effect
from identify.vibration.measured_modes import modes_of
from identify.vibration.problem import Problem, load_problem
from identify.vibration.study import StudyFile, read_study

NO_PROBLEM = cast(Problem, None)

CONFIG = Path(__file__).parents[2] / "configs" / "arm_hammer_test.yaml"
ROCKING = parse_effect({"kind": "base-compliance", "axes": ["rx", "ry"]})
TILT = parse_effect({"kind": "joint-compliance", "joints": [2], "axes": ["rx", "ry"]})


@pytest.fixture(scope="module")
def file() -> StudyFile:
    """The shipped example."""
    return read_study(CONFIG)


@pytest.fixture(scope="module")
def problem(file: StudyFile) -> Problem:
    """With its data."""
    return load_problem(file)


def _trial(squares: float, validation: float, free: int, new: tuple[Effect, ...] = ()) -> Trial:
    count = 0 if math.isnan(validation) else 500
    return Trial(Task((), new, {}), {}, squares, 1000, validation, count, free)


def _option(effect: Effect, trial: Trial, log_odds: float) -> Option:
    return selection.Option(effect, trial, 4, Gain(log_odds, 1.0))


class TestEvidence:
    def test_a_parameter_has_its_price(self) -> None:
        gain = EvidenceCriterion(1.0).gain(_trial(1100, 1, 10), _trial(1000, 1, 12))
        assert gain.log_odds == pytest.approx((100 - 2 * math.log(1000)) / 2)

    def test_correlated_residuals_count_for_less(self) -> None:
        before, after = _trial(1100, 1, 10), _trial(1000, 1, 12)
        assert (
            EvidenceCriterion(20.0).log_odds(before, after)
            < 0
            < EvidenceCriterion(1.0).log_odds(before, after)
        )

    @pytest.mark.parametrize(
        ("before", "after", "agree"), [(500, 600, False), (600, 500, True), (math.nan, math.nan, True)]
    )
    def test_other_data_must_agree(self, before: float, after: float, agree: bool) -> None:
        found = EvidenceCriterion(1.0).gain(_trial(9000, before, 1), _trial(1000, after, 2))
        assert found.confirmed is agree

    def test_share_removed(self) -> None:
        assert removed(5.0, 3.0) == pytest.approx(0.5)
        assert removed(5.0, 0.9) == 1.0


class TestInitialValues:
    UNIT = np.ones((1, 1))

    def test_a_spring_is_tried_from_soft_to_stiff_with_its_damping(self) -> None:
        spring = Term(Parameter("j.rx.stiffness", "N m/rad", 1e5, 1.0, 1e12), stiffness=self.UNIT)
        damper = Term(Parameter("j.rx.damping", "N m s/rad", 10.0, 1e-6, 1e6), damping=self.UNIT)
        found = TILT.initial_values([spring, damper], (3, 80))
        assert found[0].tolist() == [1e5, 10.0]
        assert found[1:, 0].min() == pytest.approx(1e3)
        assert found[1:, 0].max() == pytest.approx(1e8)
        assert found[1:, 1] / np.sqrt(found[1:, 0]) == pytest.approx(10 / np.sqrt(1e5))

    @pytest.mark.parametrize("names", [("mass", "stiffness", "damping"), ("a", "b", "c")])
    def test_a_resonator_is_tuned_over_the_band_whatever_its_parameters_are_called(
        self, names: tuple[str, str, str]
    ) -> None:
        mass, spring, damper = (
            Parameter(f"l.u.{name}", "", start, 1e-9, 1e12)
            for name, start in zip(names, (1.0, 15791.0, 5.0), strict=True)
        )
        moment = Parameter("l.u.moment_x", "kg m", 0.0, -1.0, 1.0, log=False)
        terms = [
            Term(mass, mass=self.UNIT, stiffness=-self.UNIT),
            Term(spring, stiffness=self.UNIT),
            Term(damper, damping=self.UNIT),
            Term(moment, mass=self.UNIT),
        ]
        found = ROCKING.initial_values(terms, (3, 80))
        hz = np.sqrt(found[1:, 1] / found[1:, 0]) / (2 * np.pi)
        assert hz.min() == pytest.approx(3)
        assert hz.max() == pytest.approx(80)
        assert not found[:, 3].any()

    def test_others_go_across_their_bounds_and_stay_inside(self) -> None:
        delay = Term(Parameter("responses.delay", "s", 0.0, -5e-3, 5e-3, log=False))
        found = ROCKING.initial_values([delay], (3, 80))
        assert found[0, 0] == 0
        assert -5e-3 <= found.min() < -4e-3
        assert 4e-3 < found.max() <= 5e-3


class TestTrials:
    def test_few_lines_and_fitted_measurements_only(self, problem: Problem) -> None:
        thin = decimated(problem)
        assert [m.settings.use for m in thin.measurements] == ["fit", "fit"]
        assert all(30 <= len(m.given.data.frequency_hz) <= 63 for m in thin.measurements)
        assert thin.measurements[0].given.record == problem.measurements[0].given.record

    def test_channels_left_out_are_all_there(self, problem: Problem) -> None:
        split = left_out(decimated(problem))
        outputs = [set(map(str, m.given.data.outputs)) for m in split.measurements[:2]]
        assert not outputs[0] & outputs[1]
        assert outputs[0] | outputs[1] == set(map(str, problem.measurements[0].given.data.outputs))

    def test_a_model_that_cannot_be_made_is_a_trial_that_failed(self, problem: Problem) -> None:
        known = tuple(problem.file.study.effects)
        trial = TrialRunner(problem).run(Task(known, known, {}))
        assert trial.gap == math.inf
        assert "claimed" in trial.failure

    def test_what_was_tried_is_remembered_in_order(self, problem: Problem) -> None:
        known = tuple(problem.file.study.effects)
        tasks = [Task(known, (effect,), {}) for effect in (ROCKING, parse_effect({"kind": "time-delay"}))]
        with Workers(problem, 1) as workers:
            first = workers.run(tasks)
            kept = len(workers.memory)
            again = workers.run(tasks[::-1])
        assert kept == len(workers.memory) == 2
        assert [t.squares for t in again] == [t.squares for t in first[::-1]]
        assert again[0].values == first[1].values

    def test_processes_find_what_one_finds(self, problem: Problem) -> None:
        known = tuple(problem.file.study.effects)
        tasks = [Task(known, (effect,), {}) for effect in (ROCKING, TILT)]
        names = [m.name for m in problem.measurements]
        with one_thread(), Workers(problem, 1) as one, Workers(problem, 2) as two:  # as a discovery runs
            assert [t.squares for t in one.run(tasks)] == [t.squares for t in two.run(tasks)]
            assert list(one.each(_first_hz, names)) == list(two.each(_first_hz, names))


def _first_hz(problem: Problem, name: str) -> float:
    found = modes_of(problem, name)
    assert found is not None
    return float(found.table.frequency_hz[0])


class TestWhere:
    def test_parts_of_each_kind_make_the_whole(self, problem: Problem) -> None:
        values = np.array([p.initial for p in problem.parameters])
        found = parts(problem, values, band_limits(problem))
        for kind in ("measurement", "band", "point", "direction", "force"):
            assert sum(p.share for p in found if p.kind == kind) == pytest.approx(1)
        assert {p.name for p in found if p.kind == "direction"} == {"X", "Y", "Z"}

    def test_the_map_has_the_size_of_the_whole(self, problem: Problem) -> None:
        values = np.array([p.initial for p in problem.parameters])
        found = gap_map(problem, values, band_limits(problem))
        assert found.gap.shape == (3, 12, 30)
        assert np.nanmax(found.gap) > 10

    def test_words_name_what_stands_out(self) -> None:
        rows = [
            Part("band", "10 to 12 Hz", 9.0, 0.8),
            Part("band", "12 to 14 Hz", 2.0, 0.1),
            Part("band", "14 to 16 Hz", 2.0, 0.1),
        ]
        assert "80% of it at 10 to 12 Hz" in in_words(rows, 5.0)
        even = [Part("band", f"{n} Hz", 5.0, 0.1) for n in range(10)]
        assert "evenly" in in_words(even, 5.0)
        assert "nothing stands out" in in_words(rows, 1.02)


class TestNewConfig:
    def test_it_is_the_study_with_more_effects_and_values(self, file: StudyFile, tmp_path: Path) -> None:
        text = config_text(file, [(ROCKING, "found")], {"joint1.rz.stiffness": 1234567.0}, tmp_path)
        (tmp_path / "new.yaml").write_text(text)
        assert "# The model: rigid links" in text
        assert "# found\n- {kind: base-compliance" in text
        study = read_study(tmp_path / "new.yaml").study
        assert study.effects == [*file.study.effects, ROCKING]
        assert study.initial == {"joint1.rz.stiffness": 1234570.0}
        assert (tmp_path / study.measurements[0].source).resolve() == file.resolve(
            file.study.measurements[0].source
        ).resolve()

    def test_a_study_without_effects_gets_its_default_written_out(
        self, file: StudyFile, tmp_path: Path
    ) -> None:
        data = YAML().load(file.text)
        del data["effects"]
        with (tmp_path / "bare.yaml").open("w") as stream:
            YAML().dump(data, stream)
        bare = read_study(tmp_path / "bare.yaml")
        (tmp_path / "new.yaml").write_text(config_text(bare, [(TILT, "found")], {}, tmp_path))
        assert read_study(tmp_path / "new.yaml").study.effects == [*bare.study.effects, TILT]


class TestSentences:
    def _step(self, before: Trial, *options: Option, alike: tuple[Option, ...] = ()) -> Step:
        return selection.Step(
            before,
            options,
            options[:1] if options and options[0].gain.log_odds > CONVINCING else (),
            alike,
            EvidenceCriterion(1.0),
        )

    def test_nothing_missing(self) -> None:
        trial = _trial(1030, 520, 12)
        assert told.verdict(Discovery(NO_PROBLEM, trial, trial, (), (self._step(trial),)))[0].startswith(
            "Nothing is missing"
        )

    def test_something_the_catalogue_does_not_have(self) -> None:
        trial = _trial(50000, 25000, 12)
        assert (
            "no combination of known effects explains it"
            in told.verdict(Discovery(NO_PROBLEM, trial, trial, (), (self._step(trial),)))[0]
        )

    def test_a_search_that_was_cut_short_says_nothing_of_the_catalogue(self) -> None:
        trial = _trial(50000, 25000, 12)
        [said] = told.verdict(Discovery(NO_PROBLEM, trial, trial, (), (), late=True))
        assert "within the time limit" in said
        assert "catalogue" not in said

    def test_something_found(self) -> None:
        before, after = _trial(50000, 25000, 12), _trial(1030, 520, 16, (ROCKING,))
        option = _option(ROCKING, after, 4000.0)
        found = Discovery(NO_PROBLEM, before, after, (option,), (self._step(before, option),))
        first, second = told.verdict(found)
        assert "compliance of the base (rx, ry)" in first
        assert "7.07" in first
        assert "noise" in second

    @pytest.mark.parametrize(("squares", "hides"), [(1080, False), (1166, True)])  # gaps of 1.04 and 1.08
    def test_a_gap_that_may_hide_something_small_is_said(self, squares: float, *, hides: bool) -> None:
        before, after = _trial(50000, 25000, 12), _trial(squares, 520, 16, (ROCKING,))
        option = _option(ROCKING, after, 4000.0)
        found = Discovery(NO_PROBLEM, before, after, (option,), (self._step(before, option),))
        nothing = Discovery(NO_PROBLEM, after, after, (), (self._step(after),))
        for one in (found, nothing):
            assert hides == any("8% above it" in sentence for sentence in told.verdict(one))
        assert hides != ("The remaining residual is noise." in told.verdict(found))

    def test_what_cannot_be_told_apart_is_said(self) -> None:
        before, after = _trial(50000, 25000, 12), _trial(1030, 520, 16, (ROCKING,))
        best, other = _option(ROCKING, after, 4000.0), _option(TILT, _trial(1031, 520, 16, (TILT,)), 3999.0)
        step = self._step(before, best, other, alike=(other,))
        assert told.alike(step) == ("tilt compliance of joint 2 (rx, ry)",)
        assert told.verdict_of(other, step) == "the data cannot tell it from the best"

"""What is named of a search: beside stated uncertainty, of several mistakes, in files of any order."""

from __future__ import annotations

from pathlib import Path

import pytest

from identify.measured.correction import Correction
from identify.setup.decide import needed
from identify.setup.diagnosis import look
from identify.setup.hypothesis import Hypothesis
from identify.setup.registry import KINDS
from identify.setup.score import scored
from identify.setup.search import Candidate, Searched
from identify.setup.stated import Stated
from identify.setup.within import levelled, times, within
from identify.vibration.problem import load_problem
from identify.vibration.study import read_study
from tests.setup import studies


def _after(one: Candidate, hypothesis: Hypothesis) -> Candidate:
    stated = one.stated.changed(hypothesis.edits)
    score = scored(stated.problem(), one.score.values)
    return Candidate(stated, score, (*one.hypotheses, hypothesis))


def _hypothesis(kind: str, told: Stated, words: str) -> Hypothesis:
    found = KINDS[kind](told, scored(told.problem()))
    return next(one for one in found if words in one.sentence)


@pytest.mark.parametrize("order", [("joint-sign", "gravity"), ("gravity", "joint-sign")])
def test_a_mistake_that_the_others_do_not_need_is_left_out(order: tuple[str, str], tmp_path: Path) -> None:
    """Whether it was found last or first."""
    turned = [
        {**one, "posture_deg": [a if n != 1 else -a for n, a in enumerate(one["posture_deg"])]}
        for one in studies.each()
    ]
    told = studies.of(tmp_path, studies.config(measurements=turned))
    words = {"joint-sign": "joint 2", "gravity": "ceiling"}
    plain = Candidate(told, scored(told.problem()))
    first = _after(plain, _hypothesis(order[0], told, words[order[0]]))
    second = _after(first, _hypothesis(order[1], told, words[order[1]]))
    best, _ = needed(Searched(plain, ((first,), (second,)), (), 100))
    assert best.codes == ("joint-sign",)


def test_what_was_stated_to_be_uncertain_explains_no_wrong_unit(tmp_path: Path) -> None:
    """All masses and gains could be off by some of their standard deviations at once, but are not."""
    told = studies.of(tmp_path, studies.config(uncertainty="typical"))
    score = scored(told.problem())
    right = within(score, told.uncertainty)
    assert right.explained
    assert within(score, None).errors == 1.0
    heavy = told.changed(times(told, 2.0))
    twice = scored(heavy.problem())
    wrong = within(twice, told.uncertainty)
    assert wrong.errors > 2 * right.errors
    assert not wrong.explained
    assert within(levelled(heavy, twice), told.uncertainty).explained


def test_a_right_study_beside_stated_uncertainty_is_asked_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("identify.setup.diagnosis.searched", None)
    path = studies.written(tmp_path, studies.config(uncertainty="careful"))
    found = look(load_problem(read_study(path)))
    assert found.diagnosis is None
    assert found.gap < 1.15


def test_files_are_told_apart_where_the_first_is_not_fitted(tmp_path: Path) -> None:
    first, second = studies.each()
    measurements = [
        {**first, "use": "validate", "correct": Correction(factor=0.1).model_dump(exclude_defaults=True)},
        second,
    ]
    told = studies.of(tmp_path, studies.config(measurements=measurements))
    found = [one.sentence for one in KINDS["one-measurement"](told, scored(told.problem()))]
    low = {one for one in found if " 0." in one}
    assert low, "the first is too small beside the second, or the second too large"
    assert {studies.FILES[0] in one for one in low} == {True}
    assert {studies.FILES[1] in one for one in set(found) - low} <= {True}

"""What is named of a search: beside stated uncertainty, of several mistakes, in files of any order."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from identify.measured.correction import Correction
from identify.measured.quality_robot import possible
from identify.setup import diagnosis, search
from identify.setup.bounds import sag
from identify.setup.brakes import Brake
from identify.setup.constants import Factor, near, nearest
from identify.setup.decide import Decision, log_odds, needed
from identify.setup.diagnosis import (
    Found,
    Looked,
    _apart,
    _in_rad_per_s,
    _likelier,
    _Put,
    _put_right,
    _without_factor,
    look,
)
from identify.setup.edits import Edit
from identify.setup.hypothesis import Hypothesis
from identify.setup.kinds.readout import radians_per_second
from identify.setup.registry import KINDS
from identify.setup.score import ROUGH, SLIGHT, Score, scored
from identify.setup.search import Candidate, Searched, _again, _better, _bodies, _round
from identify.setup.sentences import sentences
from identify.setup.soft import springs_explain
from identify.setup.stated import LINES, Stated, stated
from identify.setup.within import Within, levelled, times, within, within_as_stated
from identify.vibration.log_shape import frf_targets
from identify.vibration.problem import load_problem
from identify.vibration.study import read_study
from tests.setup import studies

KOBE = Path(__file__).parents[2] / "configs" / "kobe_36dof.yaml"


@pytest.fixture(scope="module")
def typical(tmp_path_factory: pytest.TempPathFactory) -> Stated:
    """A right study, of which as much is uncertain as is typical."""
    return studies.of(tmp_path_factory.mktemp("typical"), studies.config(uncertainty="typical"))


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


def test_what_makes_no_study_is_no_rival() -> None:
    """A payload of nothing leaves as much as no payload, and ends no diagnosis."""
    told, score = studies.right()
    body = [{"link": "link6", "mass_kg": 0.0, "centre_m": [0, 0, 0]}]
    edit = Edit(("robot", "payload"), body)
    nothing = Hypothesis("payload", "", (), "payload", lambda _: (edit,))
    none, plain = (
        Decision(Candidate(told, score, some), (), None, 9.0)
        for some in ((nothing,), tuple[Hypothesis, ...]())
    )
    assert [one.decision for one in _put_right(told, [none, plain])] == [plain]


def test_factors_that_the_data_cannot_tell_apart_are_all_asked(
    typical: Stated, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whatever gaps they leave, which takes long to be told."""
    monkeypatch.setattr(diagnosis, "within", lambda *_: Within(1.0, 1.0))
    plain = Candidate(typical, scored(typical.problem()))
    found = _put_right(typical, [Decision(plain, (), nearest(9.9), 9.0)])
    assert {one.decision.factor.value for one in found if one.decision.factor} == {9.80665, 10.0}


def test_a_known_factor_may_be_as_far_as_masses_are_uncertain(typical: Stated) -> None:
    exact = replace(typical, uncertainty=None)
    assert [one.value for one in near(850.0, _apart(exact))] == [850.0]
    assert [one.value for one in near(850.0, _apart(typical))] == [1000.0]


def _told_within(told: Stated, score: Score, worst: float, *hypotheses: Hypothesis) -> Candidate:
    """A candidate of which the likelihood is known."""
    known = replace(score, level=0.0, asked={"within": Within(worst, 1.0)})
    return Candidate(told, known, hypotheses)


def test_beside_stated_uncertainty_the_likelihood_says_what_helps(typical: Stated) -> None:
    told, score = typical, scored(typical.problem())
    flexible, right = (Hypothesis(code, code, (), code) for code in ("payload", "size"))
    base = _told_within(told, score, 4.0)
    tried = [_told_within(told, score, 3.9, flexible), _told_within(told, score, 1.0, right)]
    assert [one.codes for one in _better(base, tried)] == [("size",), ("payload",)]
    assert not _better(base, tried[:1])
    exact = [replace(one, stated=replace(told, uncertainty=None)) for one in (base, *tried)]
    assert not _better(exact[0], exact[1:]), "logarithms alone say that neither does"


def test_a_brake_is_told_by_the_likelihood_too(typical: Stated) -> None:
    told, score = typical, scored(typical.problem())
    one, four, five = (_told_within(told, score, worst).score for worst in (1.0, 4.0, 5.0))
    assert Brake(1, 3, 6.0, 0.9, 126, one, one, four).likely(told).share == pytest.approx(1 / 16)
    assert Brake(1, 3, 6.0, 0.9, 126, four, one, five).likely(told).share == 0.9, "the others do not agree"


def test_bodies_that_cannot_be_are_put_right_first(tmp_path: Path) -> None:
    """Inertias in kg mm2 leave a search nothing to go by, and are the only thing that is asked."""
    text = (studies.DATA / "robot.urdf").read_text()
    wrong = re.sub(r'\b(i[xyz]{2})="([^"]*)"', lambda m: f'{m[1]}="{1e6 * float(m[2]):.9g}"', text)
    (tmp_path / "robot.urdf").write_text(wrong)
    told = studies.of(tmp_path, studies.config(robot={"urdf": str(tmp_path / "robot.urdf")}))
    assert not possible(told.robot)
    plain = Candidate(told, scored(told.problem()))
    tried, asked = _round(plain)
    assert asked < 8
    assert {one.codes for one in tried} == {("robot-units",)}
    assert "kg mm2" in tried[0].hypotheses[-1].sentence
    assert possible(tried[0].stated.robot)
    assert _better(replace(plain, score=replace(plain.score, cost=1e-9)), tried) == tried


def test_bodies_are_told_by_every_spring() -> None:
    """A study's own model may leave more than a wrong unit does; of bodies that are the same up to a common
    factor the first needs none, or one that a mistake has.
    """
    told, score = studies.right()

    def candidate(cost: float, soft: float, level: float) -> Candidate:
        asked = {"softened": replace(score, cost=soft, level=level)}
        return Candidate(told, replace(score, cost=cost, asked=asked))

    wrong, in_grams, right = (
        candidate(13.0, 6.0, 0.0),
        candidate(13.2, 2.15, -6.9),
        candidate(13.2, 2.16, 0.1),
    )
    assert _bodies([wrong, in_grams, right]) == [right, in_grams]
    inches, no_unit = candidate(13.2, 2.15, 3.67), candidate(13.2, 2.14, -3.24)
    assert _bodies([no_unit, inches, in_grams, right]) == [right, inches, in_grams, no_unit]


def test_of_factors_that_explain_as_well_the_first_is_one_that_a_mistake_has() -> None:
    told, score = studies.right()
    base = Candidate(told, score)
    known, unknown, nothing = (
        _Put(Decision(base, (), factor, 9.0), (), score, gap)
        for factor, gap in ((nearest(39.4), 1.01), (nearest(0.039), 1.0), (None, 1.02))
    )
    assert sorted([unknown, known, nothing], key=_likelier) == [nothing, known, unknown]
    assert _bodies([]) == []


@pytest.mark.parametrize(("cost", "level", "asked"), [(0.9, 0.1, False), (1.1, 0.1, True), (0.9, 2.0, True)])
def test_a_set_up_that_is_roughly_right_is_not_asked_beside_springs(
    monkeypatch: pytest.MonkeyPatch, cost: float, level: float, asked: bool
) -> None:
    """Whatever its noise makes of the gap."""
    told, right = studies.right()
    score = replace(right, cost=cost, level=level)
    score.asked.update(softened=replace(score, cost=2.0, asked={}), within=Within(50.0, 1.0))
    beside = list[Score]()
    monkeypatch.setattr(
        diagnosis, "searched", lambda told, score: Searched(Candidate(told, score), (), (), 1)
    )
    monkeypatch.setattr(diagnosis, "brake", lambda *_: None)
    monkeypatch.setattr(diagnosis, "beside_springs", lambda _, plain: beside.append(plain))
    monkeypatch.setattr(diagnosis, "decided", lambda _: None)
    assert diagnosis._wrong(told, score, 50.0).looked.diagnosis is None
    assert beside == ([score] if asked else [])


def test_a_factor_that_an_own_model_has_is_dropped_beside_springs() -> None:
    """With the mistakes beside it, or alone; it may stand for a power of j omega."""
    told, score = studies.right()
    sign = Hypothesis("joint-sign", "a sign", (Edit(("joint_angles", "sign"), [1, -1, 1, 1, 1, 1]),), "sign2")
    factor = Factor(0.0068, "0.0068 times")
    nothing = Found(Looked(9.0), score)
    for hypotheses, codes in (((sign,), ("joint-sign",)), ((), None)):
        edits = [edit for one in hypotheses for edit in one.edits]
        decision = Decision(Candidate(told.changed(edits), score, hypotheses), (), factor, 9.0)
        found = _without_factor(told, _Put(decision, (), score, 5.0), nothing)
        named = found.looked.diagnosis
        assert (named and named.codes) == codes
        assert named is None or named.edits == sign.edits
        less = Found(Looked(0.5), score)
        assert _without_factor(told, _Put(decision, (), score, 5.0), less) is less, "what leaves more is none"


def test_mistakes_are_chosen_again_beside_the_others(tmp_path: Path) -> None:
    """The factor of a file that was found while angles were still wrong."""
    wrong = [
        {**one, "posture_deg": [-one["posture_deg"][0], *one["posture_deg"][1:]]} for one in studies.each()
    ]
    for one in wrong:
        one["posture_deg"][1] *= -1
    wrong[0]["correct"] = {"factor": 1 / 9.80665}
    told = studies.of(tmp_path, studies.config(measurements=wrong))
    plain = Candidate(told, scored(told.problem()))
    edit = Edit(("measurements", 1, "correct", "factor"), 2 * np.pi)
    mistaken = _after(plain, Hypothesis("one-measurement", "6.283", (edit,), "set1"))
    both = _after(mistaken, _hypothesis("joint-sign", told, "joint 2"))
    again = _again(plain, both)
    [factor] = [one for one in again.hypotheses if one.code == "one-measurement"]
    assert "9.807" in factor.sentence or "0.102" in factor.sentence


def test_few_lines_are_looked_at_in_hertz_and_in_rad_per_s() -> None:
    told, score = studies.right()
    lines = {len(target.data.frequency_hz) for target in frf_targets(told.problem())}
    assert lines == {LINES}
    [fast] = radians_per_second(told, score)
    spread = [target.data.frequency_hz for target in frf_targets(told.changed(fast.edits).problem())]
    assert all(len(one) <= LINES and one.max() < 80 for one in spread)


def test_what_was_stated_to_be_uncertain_explains_no_wrong_unit(typical: Stated) -> None:
    """All masses and gains could be off by some of their standard deviations at once, but are not."""
    told, score = typical, scored(typical.problem())
    right = within(score, told.uncertainty)
    assert right.explained
    assert within(score, None).errors == 1.0
    heavy = told.changed(times(told, 2.0))
    twice = scored(heavy.problem())
    wrong = within(twice, told.uncertainty)
    assert wrong.errors > 2 * right.errors
    assert not wrong.explained
    assert within(levelled(heavy, twice), told.uncertainty).explained


def test_a_likelihood_that_was_given_up_is_found_again_where_it_is_asked_for_more(typical: Stated) -> None:
    """And is not looked for again where as little is asked."""
    wrong = typical.changed([Edit(("joint_angles", "sign"), [1, -1, 1, 1, 1, 1])])
    score = scored(wrong.problem())
    given_up = within(score, wrong.uncertainty, 1.0)
    assert not given_up.explained and given_up.worst == np.inf
    assert within(score, wrong.uncertainty, 0.5) is given_up
    found = within(score, wrong.uncertainty)
    assert found.gap < given_up.gap
    assert found == within(replace(score, asked={}), wrong.uncertainty)
    assert within(score, wrong.uncertainty, 1.0) is found


def test_what_leaves_nothing_at_all_says_nothing() -> None:
    assert log_odds(0.01, 9) > log_odds(0.2, 9) > 0
    assert log_odds(0.0, 9) == log_odds(0.3, 9) == -np.inf


def test_where_springs_explain_nearly_all_the_own_model_is_no_judge(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    told, right = studies.right()
    monkeypatch.setattr(diagnosis, "_beside_springs", lambda *_: None)
    monkeypatch.setattr(diagnosis, "searched", lambda *_: pytest.fail("searched"))
    plain = replace(right, cost=9.0)
    plain.asked["softened"] = replace(right, cost=1.5)
    assert diagnosis._wrong(told, plain, 30.0).looked == Looked(30.0)
    plain.asked["softened"] = replace(right, cost=2.0)
    with pytest.raises(pytest.fail.Exception):
        diagnosis._wrong(told, plain, 30.0)


def test_a_right_study_beside_stated_uncertainty_is_asked_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("identify.setup.diagnosis.searched", None)
    path = studies.written(tmp_path, studies.config(uncertainty="careful"))
    found = look(load_problem(read_study(path)))
    assert found.diagnosis is None
    assert found.gap < 1.15


def test_where_every_spring_explains_the_data_no_mistake_is_looked_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As of the published arm, whose guesses are rough; springs explain no joint that turns the other way."""
    monkeypatch.setattr(diagnosis, "searched", None)
    found = look(load_problem(read_study(KOBE)))
    assert found.diagnosis is None
    assert found.gap > 5
    wrong = studies.of(tmp_path, studies.config(joint_angles={"sign": [1, -1, 1, 1, 1, 1]}))
    assert not springs_explain(scored(wrong.problem()), None)


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


def test_what_explains_the_data_as_well_is_said_whole(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """2.205 and 0.2248 are 9.807 times each other: either file may be the one with the wrong unit.  Of what
    else it may be a few are asked.
    """
    few = ("one-measurement", "joint-sign", "gravity")
    kinds = {name: kind if name in few else lambda *_: iter(()) for name, kind in KINDS.items()}
    monkeypatch.setattr(search, "KINDS", kinds)
    wrong = []
    for number, factor in enumerate((2.20462, 0.224809)):
        folder = tmp_path / f"{number}"
        folder.mkdir()
        wrong.append(studies.misread(folder, Correction(factor=factor))[number])
    path = studies.written(tmp_path, studies.config(measurements=wrong))
    found = look(load_problem(read_study(path))).diagnosis
    assert found is not None and len(found.instead) == 1
    files = {
        one.sentence for some in (found.mistakes, *found.instead) for one in some if "factor" not in one.code
    }
    assert files == {
        "the FRFs of posture1.uff are 9.807 times what they should be",
        "the FRFs of posture3.uff are 0.102 times what they should be",
    }
    assert any("It may equally be that" in text for text in sentences(found, path.name))


@pytest.mark.parametrize("band", [(3.0, 3.5), (3.0, 8.0)])
def test_a_band_without_a_resonance_tells_no_mistake(
    band: tuple[float, float], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its FRFs are a stiffness line and noise, which any factor or stiffness explains: what explains the data
    as stated is right, and no drive is too stiff there.
    """
    monkeypatch.setattr("identify.setup.diagnosis.searched", None)
    problem = load_problem(read_study(studies.written(tmp_path, studies.config(band_hz=list(band)))))
    score = scored(stated(problem).problem())
    assert abs(score.level) > SLIGHT or score.cost > ROUGH, "logarithms would say something"
    assert sag(score) is None
    assert look(problem) == Looked(pytest.approx(1.0, abs=0.15))


def test_where_logarithms_lead_astray_the_study_begins_at_its_own_start_values(tmp_path: Path) -> None:
    _, fitted = studies.right()
    known = [round(value) for name, value in fitted.by_name.items() if name.endswith(".stiffness")]
    springs = {"kind": "joint-compliance", "joints": "all", "axes": ["rz"], "stiffness": {"initial": known}}
    told = studies.of(tmp_path, studies.config(effects=[springs]))
    problem = told.problem()
    astray = Score(problem, problem.initial * 1e-3, fitted.cost, fitted.level)
    assert not within(astray, None).explained
    found = within_as_stated(astray, told.uncertainty)
    assert found.explained
    assert within(astray, None) is found, "for all who ask"


def test_no_sag_is_stated_where_the_frequencies_in_rad_per_s_have_no_resonance(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    told, score = studies.right()
    monkeypatch.setattr(diagnosis, "too_stiff", lambda one: one is score)
    monkeypatch.setattr(diagnosis, "sag", lambda one: 1e-5 if one is score else 0.01)
    there = _in_rad_per_s(told, score, 1.0)
    assert there is not None and there.diagnosis is not None
    assert "in rad/s by 0.6" in there.diagnosis.mistakes[0].sentence
    monkeypatch.setattr(diagnosis, "sag", lambda one: 1e-5 if one is score else None)
    assert _in_rad_per_s(told, score, 1.0) is None

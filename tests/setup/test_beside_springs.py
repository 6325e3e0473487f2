"""Mistakes of the set-up that are judged beside every spring."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from identify.core.yaml_input import yaml_text
from identify.fitting.optimizers.gauss_newton import GaussNewton
from identify.measured.correction import Correction
from identify.setup import beside_springs as springs
from identify.setup.beside_springs import (
    _by_squares,
    _each_way,
    _factors,
    _levels,
    _nearly_right,
    _needed,
    _promising,
    _settled,
    _simpler,
    beside_springs,
)
from identify.setup.diagnosis import Diagnosis, _joined
from identify.setup.edits import Edit, Entries, OnLink, edited, in_words
from identify.setup.hypothesis import Hypothesis
from identify.setup.kinds.channels import of_each, sizes
from identify.setup.registry import KINDS
from identify.setup.score import SLIGHT, scored
from identify.setup.search import Candidate, glanced, glances, of_kinds, without
from identify.setup.soft import LINES, read_otherwise, softened, with_springs
from identify.setup.stated import stated
from identify.setup.within import within
from identify.vibration.log_shape import LogShape
from identify.vibration.problem import load_problem
from identify.vibration.study import read_study
from tests.hidden import config_of
from tests.setup import studies
from tests.shared import shared

PAIRS = ((15.0, 0.0), (15.0, 30.0))
KEY = ("measurements", 0, "correct", "outputs")


def test_several_channels_are_found_together(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Two points exchanged and a third one reversed: each is right beside the other, and signs of joints are
    asked as well; all else takes most of the time.
    """
    monkeypatch.setattr(springs, "KINDS", {"joint-sign": KINDS["joint-sign"]})
    wrong = Correction(nodes={5: 9, 9: 5}, outputs={"12": -1.0})
    told = studies.of(tmp_path, studies.config(measurements=studies.misread(tmp_path, wrong)[:1]))
    found = beside_springs(told, scored(told.problem()))
    assert found is not None
    assert {one.sentence for one in found.hypotheses} == {
        "points 5 and 9 are exchanged",
        "all channels of point 12 have the other sign",
    }
    assert found.gap_after < 0.5 * found.gap_before
    data = edited(told.data, found.edits)
    corrected = scored(studies.of(tmp_path, data).problem())
    right = scored(studies.of(tmp_path, studies.config(measurements=studies.each()[:1])).problem())
    assert corrected.cost == pytest.approx(right.cost, rel=0.05)


def test_nothing_is_misread_in_a_right_study(monkeypatch: pytest.MonkeyPatch) -> None:
    """And only channels are looked at: what else would be named leaves more than a right study does."""
    monkeypatch.setattr(springs, "_promising", lambda _: pytest.fail("it is nearly right"))
    told, plain = studies.right()
    assert beside_springs(told, plain) is None
    assert not _nearly_right(Candidate(told, replace(plain, cost=1.5)))
    assert not _nearly_right(Candidate(told, replace(plain, level=1.0)))


def test_all_else_waits_where_a_channel_explains_most(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = list[Candidate]()
    monkeypatch.setattr(springs, "_promising", lambda own: [*map(asked.append, [own])] and [])
    for wrong in (Correction(outputs={"5": -1.0, "9": -1.0}), Correction(quantity="mobility")):
        told = studies.of(tmp_path, studies.config(measurements=studies.misread(tmp_path, wrong)[:1]))
        found = beside_springs(told, scored(told.problem()))
        assert (found is None) == bool(asked) == (wrong.quantity is not None)


def test_what_is_about_all_points_is_looked_at_as_all_else(monkeypatch: pytest.MonkeyPatch) -> None:
    """Among single channels it would come last: it explains none of them more than the others."""
    base = Candidate(*studies.right())
    monkeypatch.setattr(springs, "glances", lambda _, some: [(1.0, one) for one in some])
    shifted = [one for one in of_kinds(base, ["links"]) if one.code == "links-shifted"]
    assert len(shifted) == 2
    assert not any(one.code == "links-shifted" for one in _by_squares(shifted))
    assert "links-shifted" in {one.code for one in _promising(base)}


@pytest.mark.parametrize(("factor", "other", "paid"), [(-1.0, -0.74, False), (-3.0, -3.0, True)])
def test_another_size_and_the_other_sign_are_two_mistakes(
    factor: float, other: float, paid: bool, tmp_path: Path
) -> None:
    """A sign alone is named unless the data pay for the size too."""
    told = studies.of(
        tmp_path, studies.config(measurements=studies.misread(tmp_path, Correction(outputs={"5:+X": factor})))
    )
    score = scored(told.problem())
    proposed = [one for one in sizes(told, score) if "channel 5:+X" in one.sentence]
    for one in proposed:
        assert one.count == (2 if "times with the other sign" in one.sentence else 1)
    assert {one.count for one in proposed} == ({1, 2} if paid else {1})

    def candidate(size: float, mistakes: int) -> Candidate:
        hypothesis = Hypothesis("", "", of_each(told, "outputs", {"5:+X": 1 / size}), "", count=mistakes)
        there = told.changed(hypothesis.edits)
        return Candidate(there, scored(there.problem(), score.values), (hypothesis,))

    sign, both = candidate(-1.0, 1), candidate(other, 2)
    assert _simpler(sign, both) != paid
    assert not _simpler(both, sign)
    assert sign.cost == sign.score.cost
    assert both.cost > both.score.cost


@pytest.mark.exam
def test_mistakes_are_named_beside_twenty_effects(tmp_path: Path) -> None:
    """Bearings, base, links, hoses: far more than a single turned sensor leaves."""
    told = stated(load_problem(read_study(config_of(shared("hall", "h7_blunders_9101_level1"), tmp_path))))
    found = beside_springs(told, scored(told.problem()))
    assert found is not None
    assert {one.sentence for one in found.hypotheses} == {
        "points 7 and 8 are exchanged",
        "the sensor at point 12 is turned: 12:+X is 12:-Y and 12:+Y is 12:+X",
        "channel 6:+Z has the other sign",
    }


def test_what_is_kept_for_validation_is_looked_at_beside_uncertainty(tmp_path: Path) -> None:
    """As where a brake is asked for in that file alone."""
    first, second = studies.each()
    kept = [first, {**second, "use": "validate"}]
    told = studies.of(tmp_path, studies.config(measurements=kept, uncertainty="careful")).without(0)
    assert np.isfinite(within(scored(told.problem()), told.uncertainty).gap)


def test_what_takes_a_common_factor_away_at_no_cost_may_stand_in_its_place() -> None:
    told, right = studies.right()
    score = replace(right, cost=8.0, level=-4.0)
    base = Candidate(told, score)
    for cost, level, wanted in ((7.9, -0.1, True), (8.1, -0.1, False), (7.9, -3.9, False), (7.9, 4.0, False)):
        assert _levels(base, replace(base, score=replace(score, cost=cost, level=level))) == wanted
    slight = replace(base, score=replace(score, level=0.1))
    assert not _levels(slight, replace(base, score=replace(score, cost=7.0, level=0.0)))


@pytest.mark.parametrize(("factor", "known"), [(9.80665, True), (0.0067, False)])
def test_of_common_factors_those_that_a_mistake_has(tmp_path: Path, factor: float, known: bool) -> None:
    told = studies.of(tmp_path, studies.config(measurements=studies.each(correct={"factor": factor})))
    found, _ = _factors(Candidate(told, scored(told.problem())), 1)
    assert bool(found) == known


def test_a_posture_that_is_off_by_little_is_no_mistake() -> None:
    """Whatever explains it, such as two joints exchanged that are at about the same angle."""
    told, plain = studies.right()
    base = Candidate(told, softened(plain))
    for turn, slight in ((3.0, True), (20.0, False)):
        edit = Edit(("joint_angles", "offset_deg"), [0.0, turn, 0, 0, 0, 0])
        seen = Candidate(told.changed([edit]), base.score, (Hypothesis("", "", (edit,), "zero"),))
        assert (_settled(base, seen) is base) == slight


def test_a_fit_that_ended_in_a_valley_makes_no_mistake_of_what_leads_out_of_it() -> None:
    told, plain = studies.right()
    good = softened(plain)
    lost = replace(good, values=good.values * 1.5, cost=9.0)
    edit = Entries(KEY, {"5:+X": 1.0})
    best = Candidate(told.changed([edit]), good, (Hypothesis("", "", (edit,), "nothing"),))
    kept, _ = _needed(Candidate(told, lost), best, 1)
    assert not kept.hypotheses
    assert kept.score.cost <= 1.01 * good.cost


def test_how_channels_are_read_leaves_the_model_as_it_is() -> None:
    """The same predictions as of all built anew; a point on another link is another model."""
    told, plain = studies.right()
    soft = with_springs(replace(told, lines=LINES).problem(), plain.by_name)
    known = scored(soft, soft.initial, GaussNewton(evaluations=3), slopes=())
    swapped = told.changed([Edit(("measurements", 0, "correct", "nodes"), {5: 9, 9: 5})])
    reread = read_otherwise(replace(swapped, lines=LINES).problem(), known)
    anew = with_springs(replace(swapped, lines=LINES).problem(), known.by_name)
    assert reread is not None
    assert reread.measurements[0].system is known.problem.measurements[0].system
    for one, other in zip(
        LogShape(reread).left(known.values), LogShape(anew).left(known.values), strict=True
    ):
        assert one == pytest.approx(other, rel=1e-6, abs=1e-6)
    moved = told.changed([OnLink(5, told.points[9].link)])
    assert told.points[5].link != told.points[9].link
    assert read_otherwise(moved.problem(), known) is None
    turned = told.changed([Edit(("joint_angles", "sign"), [1, -1, 1, 1, 1, 1])])
    assert read_otherwise(turned.problem(), known) is None
    assert read_otherwise(swapped.problem(), plain) is None


def test_a_hypothesis_is_looked_at_once_on_top_of_a_fit(monkeypatch: pytest.MonkeyPatch) -> None:
    base = Candidate(*studies.right())
    some = list(of_kinds(base, ["quantity", "axes"]))
    first = glanced(base, some)
    costs = [cost for cost, _ in glances(base, some)]
    assert costs == sorted(one.score.cost * (1.03 if abs(one.score.level) > SLIGHT else 1) for one in first)
    monkeypatch.setattr("identify.setup.search._with", lambda *_: pytest.fail("looked at again"))
    assert [cost for cost, _ in glances(base, some)] == costs


def test_of_what_holds_a_number_the_best_of_each_sign_is_looked_at() -> None:
    some = list(of_kinds(Candidate(*studies.right()), ["joint-offset", "joint-sign"]))
    kept = [one.sentence for one in _each_way(some)]
    offsets = [one for one in kept if "off by about" in one]
    assert len(offsets) == 2 * 6
    assert offsets[:2] == [f"the zero of joint 1 is off by about {turn} degrees" for turn in (15, -15)]
    assert kept[len(offsets) :] == [one.sentence for one in some if one.moved is None]


def test_what_a_later_mistake_holds_too_is_not_left_out() -> None:
    """Two joints' zeros are one key; two channels are entries of their own."""
    told, score = studies.right()
    zeros = [Edit(("joint_angles", "offset_deg"), [0.0, turn, 0, 0, other, 0]) for turn, other in PAIRS]
    for edits, held in ((zeros, True), ([Entries(KEY, {"5": 2.0}), Entries(KEY, {"9": 2.0})], False)):
        wrong = tuple(Hypothesis("", "", (edit,), f"{n}") for n, edit in enumerate(edits))
        plain, best = Candidate(told, score), Candidate(told.changed(edits), score, wrong)
        assert (without(plain, best, wrong[0]) is None) == held
        assert without(plain, best, wrong[1]) is not None


def test_gaps_of_what_is_found_beside_springs_are_said_to_be_so() -> None:
    """Wherever in a diagnosis it was found."""
    alone, soft = (Diagnosis((), 0.9, 9.0, 3.0, (), (), softened=it) for it in (False, True))
    assert _joined(alone, soft).softened and _joined(soft, alone).softened
    assert not _joined(alone, alone).softened


def test_entries_are_put_beside_those_that_are_there() -> None:
    """Whichever came first, and a factor of what has one is that much more."""
    data = {"measurements": [{"correct": {"outputs": {"5:+X": 2.0}}}]}
    edits = [Entries(KEY, {"6:+Z": "6:-Z"}), Entries(KEY, {"5:+X": -1.0})]
    for order in (edits, edits[::-1]):
        assert edited(data, order)["measurements"][0]["correct"]["outputs"] == {"5:+X": -2.0, "6:+Z": "6:-Z"}
    assert in_words(edits) == "`measurements.correct.outputs: {6:+Z: 6:-Z, 5:+X: -1}`"
    assert in_words([Edit(("band_hz",), [3, 80]), *edits]).startswith("`band_hz: [3, 80]`; `measurements")


def test_entries_do_not_share_what_they_hold() -> None:
    """The same entries in two places, of which one gets more."""
    one = Entries(KEY, {"5:+X": 2.0})
    data = edited({"measurements": [{}]}, [one, Entries(KEY, {"5:+X": 3.0})])
    assert data["measurements"][0]["correct"]["outputs"] == {"5:+X": 6.0}
    assert one.value == {"5:+X": 2.0}
    assert yaml_text(data)

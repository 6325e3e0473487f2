"""Mistakes of the set-up that are judged beside every spring."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from identify.core.yaml_input import yaml_text
from identify.measured.correction import Correction
from identify.setup.beside_springs import beside_springs
from identify.setup.diagnosis import Diagnosis, _joined
from identify.setup.edits import Edit, Entries, edited, in_words
from identify.setup.hypothesis import Hypothesis
from identify.setup.score import scored
from identify.setup.search import Candidate, without
from identify.setup.stated import stated
from identify.setup.within import within
from identify.vibration.problem import load_problem
from identify.vibration.study import read_study
from tests.hidden import config_of
from tests.setup import studies
from tests.shared import shared

PAIRS = ((15.0, 0.0), (15.0, 30.0))
KEY = ("measurements", 0, "correct", "outputs")


def test_several_channels_are_found_together(tmp_path: Path) -> None:
    """Two points exchanged and a third one reversed: each is right beside the other."""
    wrong = Correction(nodes={5: 9, 9: 5}, outputs={"12": -1.0})
    told = studies.of(tmp_path, studies.config(measurements=studies.misread(tmp_path, wrong)))
    found = beside_springs(told, scored(told.problem()))
    assert found is not None
    assert {one.sentence for one in found.hypotheses} == {
        "points 5 and 9 are exchanged",
        "all channels of point 12 have the other sign",
    }
    assert found.gap_after < 0.5 * found.gap_before
    data = edited(told.data, found.edits)
    corrected = scored(studies.of(tmp_path, data).problem())
    right = studies.of(tmp_path, studies.config())
    assert corrected.cost == pytest.approx(scored(right.problem()).cost, rel=0.05)


def test_nothing_is_misread_in_a_right_study(tmp_path: Path) -> None:
    told = studies.of(tmp_path, studies.config())
    assert beside_springs(told, scored(told.problem())) is None


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


def test_what_a_later_mistake_holds_too_is_not_left_out(tmp_path: Path) -> None:
    """Two joints' zeros are one key; two channels are entries of their own."""
    told = studies.of(tmp_path, studies.config())
    score = scored(told.problem())
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

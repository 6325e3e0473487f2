"""Sentences that keep their code, and how errors name what can be given."""

from __future__ import annotations

import pickle
from dataclasses import replace

import pytest

from identify.core.asked import as_options, key
from identify.core.coded import Coded, code_of
from identify.modal.reasons import Why, because, in_short
from identify.modes.evaluate import turned_down
from tests.reports.modes_sample import modes_result


def test_a_sentence_is_a_text_and_keeps_its_code() -> None:
    said = Coded("it is so", "so")
    assert said == "it is so" and isinstance(said, str)
    assert (code_of(said), code_of(said.and_(", still")), code_of("it is so")) == ("so", "so", "")
    assert said.and_(", still") == "it is so, still"


@pytest.mark.parametrize("why", list(Why))
def test_every_reason_has_a_sentence_and_a_short_form(why: Why) -> None:
    reason = because(why, 0.25, 3.0)
    assert "{" not in reason and code_of(reason) == why
    assert in_short(why) != in_short("unheard of") == "for other reasons"
    assert Why(code_of(reason.and_(" (setup1)"))) is why


def test_a_key_is_an_option_where_there_is_no_config() -> None:
    assert key("unit", "g") == "the key unit, such as unit: g"
    with as_options():
        assert key("unit", "g") == "`--unit`, such as `--unit g`"
        assert key("window_decay_per_s") == "`--window-decay`"
    assert key("averages") == "the key averages"


def test_what_was_turned_down_is_counted_by_code() -> None:
    one = modes_result().measurements["table"]
    worded = replace(one, rejected=replace(one.rejected, reason=("for some reason", "for another")))
    said = "2 candidates were rejected: 1 in too few orders, 1 as duplicate."
    assert turned_down(one) == turned_down(worded) == said


def test_the_code_survives_the_way_to_a_worker_and_back() -> None:
    sent = pickle.loads(pickle.dumps(Coded("left out", "left-out")))
    assert (sent, code_of(sent)) == ("left out", "left-out")

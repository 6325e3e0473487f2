"""The report of a discovery tells its story, and what it draws is what the result says."""

from __future__ import annotations

import dataclasses
import html
import re

import numpy as np
import pytest

from identify.reports.compare.pick import Shared
from identify.reports.discovery import sections
from identify.reports.discovery import tables as discovery_tables
from identify.reports.discovery.page_data import page_data
from identify.reports.discovery.pick import (
    AFTER,
    BEFORE,
    beside,
    gap_maps,
    part_bars,
    reach,
    standings,
    waterfall,
)
from identify.reports.kit.cells import NONE
from tests.reports.discovery_sample import BASE, ODD, TILT, discovery_result, null_result
from tests.reports.kinds import document_of, page_of
from tests.reports.pdf_text import lines
from tests.reports.sample import modal_result


@pytest.fixture(scope="module")
def told(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """The visible text of the page and of the PDF."""
    result = discovery_result()
    path = tmp_path_factory.mktemp("discovery") / "report.pdf"
    path.write_bytes(document_of(result).compile(result))
    page = html.unescape(
        re.sub(r"<[^>]+>", " ", page_of(result).partition("<main>")[2].partition("<script")[0])
    )
    return {"page": " ".join(page.split()), "pdf": " ".join(" ".join(lines(path)).split())}


@pytest.mark.parametrize("where", ["page", "pdf"])
def test_the_story_is_told_in_order(told: dict[str, str], where: str) -> None:
    said = (
        "Missing from the model",
        f"Step 1: {TILT}, added",
        "Model: the study's. The residual is 12.35 times the noise",
        f"Step 2: {ODD}, followed but not kept",
        f"Model: the study's with {TILT}.",
        f"The data cannot tell it from {BASE}. To tell them apart, measure",
        "Step 3: no candidate is supported",
        "Before and after",
        "joints: [2], axes: [rx, ry]",
    )
    places = [told[where].find(text) for text in said]
    assert -1 not in places, said[places.index(-1)]
    assert places[:-1] == sorted(places[:-1])


def test_further_candidates_are_folded(told: dict[str, str]) -> None:
    assert told["page"].count("The other 3 candidates") == 3
    assert "The first 12 of 15 rows" in told["pdf"]


def test_each_fall_begins_where_the_one_before_ended() -> None:
    rows = waterfall(discovery_result())
    assert [row.label for row in rows] == [BEFORE, f"+ {TILT}", AFTER]
    assert rows[0].begin == rows[2].begin == (1.0, 1.0)
    assert rows[0].end == rows[1].begin == (12.3456, 11.875)
    assert rows[1].end == rows[2].end == (1.0331, 1.0626)


def test_without_validation_the_final_gap_elsewhere_is_that_of_the_last_addition() -> None:
    found = discovery_result()
    blind = dataclasses.replace(found, after=dataclasses.replace(found.after, gap_validation=np.nan))
    assert waterfall(blind)[-1].end == (1.0331, 1.0626)


def test_nothing_is_embedded_twice() -> None:
    result = discovery_result()
    for one in beside(result):
        data = sections._measurement(one)["frf"]
        assert set(data["curves"]["blocks"][0]) == {"measured", "fitted", "before", "band", "coherence"}
        assert one.frfs[AFTER].fitted is result.after.measurements[one.name].frf.fitted  # type: ignore[union-attr]
        assert one.frfs[BEFORE].fitted is result.before.measurements[one.name].frf.fitted  # type: ignore[union-attr]


def test_gap_maps_stand_beside_each_other_in_the_same_colours() -> None:
    result = discovery_result()
    data = page_data(result)["maps"]
    for row, ((title, panels), drawn) in enumerate(zip(gap_maps(result), data["sets"], strict=True)):
        assert title == ("posture1, fitted", "posture2, validation only")[row]
        assert [label for label, _ in panels] == [BEFORE, AFTER]
        for (_, gap), kept, one in zip(
            panels, (result.map_before, result.map_after), drawn["maps"], strict=True
        ):
            np.testing.assert_array_equal(gap, kept.gap[row])
            np.testing.assert_array_equal(one["gap"], kept.gap[row].T)
    assert data["reach"] == reach(result) == pytest.approx(np.nanmax(result.map_before.gap))


def test_how_a_candidate_stands_is_not_read_from_words() -> None:
    step = discovery_result().steps["1"]
    worded = dataclasses.replace(step.options, verdict=("so-so",) * len(step.options.verdict))
    found = [standings(one) for one in (step, dataclasses.replace(step, options=worded))]
    assert found[0] == found[1] == [0, 1, *[2] * (len(found[0]) - 2)]


def test_bands_and_modes_stand_by_frequency_and_the_others_by_share() -> None:
    bars = {one.title: one for one in part_bars(discovery_result().steps["0"].parts, 12.3456)}
    assert bars["Frequency band"].names == ["3.13 to 8 Hz", "8 to 25 Hz", "25 to 79.4 Hz"]
    assert bars["Around a mode of the model"].names == ["12.1 Hz", "27.4 Hz"]
    assert (len(bars["Point"].names), bars["Point"].total) == (12, 14)
    assert bars["Direction"].names == ["Y", "X"]
    assert "Measurement" not in bars, "one alone says nothing"


def test_shares_of_noise_are_not_shown() -> None:
    bars = part_bars(discovery_result().steps["2"].parts, 1.0331)
    assert {share for one in bars for share in one.share} == {""}


def test_where_nothing_was_added_nothing_stands_before_and_after() -> None:
    result = null_result()
    page = page_of(result).partition("<script")[0]
    assert "What was added" not in page
    assert AFTER not in page
    assert [row.label for row in waterfall(result)] == [BEFORE]
    assert [label for _, panels in gap_maps(result) for label, _ in panels] == [BEFORE, BEFORE]


def test_measured_modes_stand_beside_those_of_both_models() -> None:
    after = modal_result().measurements["table"]
    assert after.pairs is not None
    lost = dataclasses.replace(after.pairs, measured=np.array([1]), model=np.array([1]), mac=np.array([0.5]))
    shifted = dataclasses.replace(after.modes, frequency_hz=1.1 * after.modes.frequency_hz)
    before = dataclasses.replace(after, modes=shifted, pairs=lost)
    table = discovery_tables.mode_table(Shared("table", {AFTER: after, BEFORE: before}, {}))
    assert table is not None
    first, second, third = table.rows
    assert first[3:] == (NONE, NONE, NONE, NONE, "12.05", "-0.413", "4.100", "0.9876")
    assert second[3:5] == ("30.13", "+10.8")
    assert third[3:] == (NONE,) * 8

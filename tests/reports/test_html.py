"""The page: one file, nothing loaded, nothing broken by what stands in a study."""

from __future__ import annotations

import json
import re
import shutil
from html.parser import HTMLParser
from pathlib import Path

import pytest

from identify.results import file as result_file
from identify.results.comparison import compared
from identify.results.fit import FitResult
from tests.reports.kinds import page_of
from tests.reports.sample import CONFIG, frf_result, large_result, modal_result

_LOADS = {"src", "href", "srcset", "data", "poster", "action", "formaction", "background"}


class Reader(HTMLParser):
    """Elements with their attributes, texts by enclosing element, scripts."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.texts: list[tuple[str, str]] = []
        self._open = ""
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self._open = tag
        self.elements.append((tag, dict(attrs)))

    def handle_data(self, data: str) -> None:
        self.texts.append((self._open, data))

    def joined(self, tag: str) -> str:
        return "".join(text for name, text in self.texts if name == tag)


@pytest.fixture(scope="module")
def page() -> str:
    return page_of(frf_result())


def test_sections(page: str) -> None:
    ids = {attrs.get("id") for _, attrs in Reader(page).elements}
    wanted = {
        "verdict",
        "robot",
        "frf",
        "gap",
        "parameters",
        "modes",
        "errors",
        "convergence",
        "identifiability",
        "asked",
        "provenance",
    }
    assert wanted <= ids
    links = {attrs["href"] for tag, attrs in Reader(page).elements if tag == "a"}
    assert links == {f"#{name}" for name in wanted}


def test_a_result_without_frfs_has_no_frf_sections() -> None:
    ids = {attrs.get("id") for _, attrs in Reader(page_of(modal_result())).elements}
    assert not {"frf", "gap", "errors", "frf-plot"} & ids
    assert {"modes", "mac-0", "robot-measured"} <= ids


def test_nothing_is_loaded(page: str) -> None:
    reader = Reader(page)
    loaded = [
        value for _, attrs in reader.elements for name, value in attrs.items() if name in _LOADS and value
    ]
    assert all(value.startswith(("#", "data:")) for value in loaded), loaded
    style = reader.joined("style")
    assert "@import" not in style and "url(" not in style
    policy = next(
        attrs["content"]
        for tag, attrs in reader.elements
        if tag == "meta" and attrs.get("http-equiv") == "Content-Security-Policy"
    )
    assert policy is not None and "default-src 'none'" in policy and "http" not in policy


def test_what_stands_in_a_study_is_text(page: str) -> None:
    reader = Reader(page)
    assert reader.joined("pre").strip() == CONFIG.strip()
    assert 'alert("#config")' not in reader.joined("script")
    assert sum(tag == "script" for tag, _ in reader.elements) == 9
    assert any("1 < 2 & more" in text for _, text in reader.texts)
    assert _data(page)["measurements"][0]["robot"]["name"][0] == "p<1>"


def _data(page: str) -> dict:  # type: ignore[type-arg]
    return json.loads(re.search(r'id="data">(.*?)</script>', page, re.DOTALL)[1])  # type: ignore[index, no-any-return]


def test_verdict_and_notes_are_on_top(page: str) -> None:
    top = page.index("<section")
    result = frf_result()
    assert all(page.index(sentence) < top for sentence in result.verdict)
    assert page.index("Only one start found the best minimum") < top
    assert 'class="warning"' in page[:top]


@pytest.mark.parametrize("result", [frf_result(), modal_result()], ids=["frf", "modal"])
def test_same_result_same_page(result: FitResult) -> None:
    assert page_of(result) == page_of(result)


def test_two_runs_of_three_thousand_frfs_stay_below_20_mb(tmp_path: Path) -> None:
    """That one does, and is usable, is an exam in `test_browser.py`."""
    result, files = large_result(), [tmp_path / "a.h5", tmp_path / "b.h5"]
    assert sum(len(m.frf.output) for m in result.measurements.values() if m.frf) == pytest.approx(3000, abs=5)
    result_file.write(result, files[0])
    shutil.copy(files[0], files[1])
    page = page_of(compared(files))
    assert page.count('"curves":{"size":64') == 3
    assert len(page.encode()) < 20e6

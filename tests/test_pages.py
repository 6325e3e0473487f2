"""Numbers of the pages of studies are those of stored runs."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.benchmarks import pages, scores
from tests.benchmarks.pages import BLOCK, CELL, cell, rewritten

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
PAGES = [page for page in sorted(DOCS.glob("*.md")) if BLOCK.search(page.read_text(encoding="utf-8"))]
STUDIES = (
    "fast_chirp_rx160",
    "kawasaki_rs010l",
    "kobe_36dof",
    "kobe_circle",
    "kuka_kr300",
    "nagoya_two_link",
    "umons_open",
    "umons_tx200",
)
NUMBER = re.compile(r"(?<![\w.:/])\d+\.\d+(?![\w.]*\d|/)")
STATED = re.compile(r"<!-- of the paper: ([^>]*?) -->")
"""What a page says is printed in the paper, and not in a config or beside the data."""


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_tables_of_a_page_are_those_of_its_runs(page: Path) -> None:
    """`python -m tests.benchmarks.pages write` makes them anew."""
    text = page.read_text(encoding="utf-8")
    assert rewritten(text) == text
    marked = [found[0] for pattern in (BLOCK, CELL) for found in pattern.finditer(text)]
    for block in marked:  # another digit is noticed
        head, shown = block.split("-->", 1)
        digit = next(character for character in shown if character.isdigit())
        other = text.replace(block, f"{head}-->{shown.replace(digit, str((int(digit) + 1) % 10), 1)}", 1)
        assert rewritten(other) != other


def test_stored_scores_are_those_of_the_newest_exams() -> None:
    """`python -m tests.benchmarks.scores` makes them anew; the pages that show them are tested above."""
    shown = pages.tables(scores.NAME)
    for title, rows in scores.tables().items():
        assert [shown[title]["head"], *shown[title]["rows"]] == rows, title


@pytest.mark.parametrize("name", STUDIES)
def test_every_other_number_of_a_study_s_page_is_stated(name: str) -> None:
    """In its configs, beside its data, or printed in the paper; else it is of a run and has to be marked."""
    text = (DOCS / f"{name}.md").read_text(encoding="utf-8")
    studies = {name, *re.findall(r"configs/(\w+)\.yaml", text)}
    sources = [ROOT / "configs" / f"{study}.yaml" for study in studies]
    for study in studies:
        sources += [f for f in (ROOT / "data" / study).glob("*") if f.suffix in (".md", ".json", ".yaml")]
    told = " ".join(f.read_text(encoding="utf-8") for f in sources if f.exists())
    told += " ".join(STATED.findall(text))
    known = set(re.findall(r"\d+\.\d+", told))
    found = NUMBER.findall(CELL.sub("", BLOCK.sub("", text)))
    assert not [number for number in found if number not in known]


def test_a_number_that_nobody_stated_is_noticed() -> None:
    """Negative control of what counts as a number; a cell of no run, or of several, is refused."""
    assert NUMBER.findall("it leaves 7.31 of 2 (docs/v1.2, 10.1007/s12206-014-0139-x)") == ["7.31"]
    with pytest.raises(KeyError, match="0 rows"):
        cell("kuka_kr300", "Motor torque: residuals; 9; Explained (%)")
    with pytest.raises(KeyError, match="5 rows"):
        cell("kuka_kr300", "Motor torque: values; torque ripple of motor 1, 8 waves per motor turn; Fitted")


def test_every_mark_of_a_run_has_its_end() -> None:
    """Kawasaki, Kobe, Nagoya and UMONS have tables of runs."""
    for page in PAGES:
        text = page.read_text(encoding="utf-8")
        assert text.count("<!-- run ") == text.count("<!-- end of run -->") == len(BLOCK.findall(text))
        assert text.count("<!-- cell ") == text.count("<!-- end -->") == len(CELL.findall(text))
    assert len(PAGES) >= 4

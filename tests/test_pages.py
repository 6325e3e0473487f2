"""Numbers of the pages of studies are those of stored runs."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.benchmarks.pages import BLOCK, rewritten

DOCS = Path(__file__).parents[1] / "docs"
PAGES = [page for page in sorted(DOCS.glob("*.md")) if BLOCK.search(page.read_text(encoding="utf-8"))]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_tables_of_a_page_are_those_of_its_runs(page: Path) -> None:
    """`python -m tests.benchmarks.pages write` makes them anew."""
    text = page.read_text(encoding="utf-8")
    assert rewritten(text) == text
    blocks = [found[4] for found in BLOCK.finditer(text)]
    for block in blocks:  # another digit is noticed
        digit = next(character for character in block if character.isdigit())
        other = text.replace(block, block.replace(digit, str((int(digit) + 1) % 10), 1), 1)
        assert rewritten(other) != other


def test_every_mark_of_a_run_has_its_end() -> None:
    """Kawasaki, Kobe, Nagoya and UMONS have tables of runs."""
    for page in PAGES:
        text = page.read_text(encoding="utf-8")
        assert text.count("<!-- run ") == text.count("<!-- end of run -->") == len(BLOCK.findall(text))
    assert len(PAGES) >= 4

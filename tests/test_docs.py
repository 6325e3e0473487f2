"""The documentation: built strictly, and complete."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from identify.model.effects.base import EFFECTS

DOCS = Path(__file__).parents[1] / "docs"


_BUILDS = """
import json, pathlib, sys
from sphinx.cmd.build import build_main

docs = pathlib.Path(sys.argv[1])
build = ["-W", "-q", "-b", sys.argv[2], str(docs), str(docs / "_build" / sys.argv[2])]
ended = [build_main(build)]
print("====", file=sys.stderr)
(docs / "faq.md").write_text("# Questions\\n\\n[gone](gone.md)\\n")
ended.append(build_main([*build, str(docs / "faq.md")]))
print(json.dumps(ended))
"""
"""As they are and, in the same process because importing takes seconds, with a link to nowhere."""


def _built(docs: Path, builder: str) -> tuple[list[int], list[str]]:
    """Exit codes of both builds, and what they said; builder: of sphinx."""
    environment = {**os.environ, "PYTHONPATH": str(DOCS.parent)}
    done = subprocess.run(
        [sys.executable, "-c", _BUILDS, str(docs), builder],
        check=False,
        capture_output=True,
        text=True,
        env=environment,
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout), done.stderr.split("====\n")


def _loaded_from_afar(page: str) -> list[str]:
    """Addresses on the network of what a page loads by itself: scripts, styles, pictures."""
    loaded = r'<(?:script|img|iframe)[^>]*\bsrc="(https?:[^"]*)"|<link[^>]*\bhref="(https?:[^"]*)"'
    return ["".join(found) for found in re.findall(loaded, page)]


def test_what_a_page_loads_from_the_network_is_seen() -> None:
    page = '<script defer src="https://cdn.example/mathjax.js"></script><a href="https://example.org">x</a>'
    assert _loaded_from_afar(page) == ["https://cdn.example/mathjax.js"]


@pytest.fixture
def copied(tmp_path: Path) -> Path:
    """The sources of the documentation, without what was built of them."""
    docs = tmp_path / "docs"
    shutil.copytree(DOCS, docs, ignore=shutil.ignore_patterns("_build", "reference", "__pycache__"))
    return docs


OPTIONS = ("--profile", "--window-decay", "--no-report", "identify simulate")
KEYS = ("window_decay_per_s", "posture_deg", "start_factor", "differential-evolution")


def test_the_docs_are_read_strictly_and_have_every_option_key_and_effect(copied: Path) -> None:
    """Without their pages, which take as long again."""
    (built, again), (said, said_again) = _built(copied, "dummy")
    assert built == 0, said
    for name, words in (("options", OPTIONS), ("config_vibration", KEYS)):
        text = (copied / "reference" / f"{name}.md").read_text()
        assert [word for word in words if word not in text] == []
    for kind in EFFECTS.builtin:
        assert "$$" in (copied / "reference" / "effects" / f"{kind}.md").read_text(), kind
    assert again != 0
    assert "gone.md" in said_again, "a link to nowhere is an error"


@pytest.mark.exam
def test_pages_have_every_option_key_and_formula_and_need_no_network(copied: Path) -> None:
    (built, again), (said, said_again) = _built(copied, "html")
    assert built == 0, said
    html = copied / "_build" / "html"
    for name, words in (("options", OPTIONS), ("config_vibration", KEYS)):
        page = (html / "reference" / f"{name}.html").read_text()
        assert [word for word in words if word not in page] == []
    for kind in EFFECTS.builtin:
        page = (html / "reference" / "effects" / f"{kind}.html").read_text()
        assert 'class="math' in page, kind
    assert (html / "searchindex.js").exists()
    pages = [page.read_text() for page in html.rglob("*.html")]
    assert [address for page in pages for address in _loaded_from_afar(page)] == []
    assert any("mathjax" in page for page in pages)
    assert (html / "_static" / "mathjax" / "tex-chtml.js").exists(), "formulas are set without network"
    assert again != 0
    assert "gone.md" in said_again, "a link to nowhere is an error"


def test_every_effect_has_a_formula() -> None:
    sections = [
        line[3:] for line in (DOCS / "formulas.md").read_text().splitlines() if line.startswith("## ")
    ]
    assert sorted(sections) == sorted(EFFECTS.builtin)

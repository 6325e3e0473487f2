"""Packages of third parties at plug points: what one does wrong is told of it, in one sentence."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from tests.programs import ran

ROOT = Path(__file__).parents[2]
EVIL = """
from typing import Literal
import numpy as np
from pydantic import Field
from identify.core.parameters import Values, single_parameter
from identify.fitting.optimizers.base import Optimizer
from identify.model.effects.base import Effect, Term

class Plain(Effect):
    kind: Literal["plain"] = "plain"
    stiffness: Values = Field(Values(initial=1e3, bounds=(1.0, 1e7)))
    def sentence(self): return "evil"
    @classmethod
    def instances(cls, robot, points):
        raise RuntimeError("boom in instances")
        yield
    def matrix(self, n): return np.eye(n)
    def terms(self, robot, site, where):
        print("HELLO")
        parameter = single_parameter("evil.k", "N m/rad", self.stiffness, f"{where}.stiffness", default=1e3)
        return [Term(parameter, stiffness=self.matrix(len(site.coordinates)))]

class Raising(Plain):
    kind: Literal["raising"] = "raising"
    def terms(self, *words): raise RuntimeError("boom")
class NotANumber(Plain):
    kind: Literal["nan"] = "nan"
    def matrix(self, n): return np.full((n, n), np.nan)
class Larger(Plain):
    kind: Literal["larger"] = "larger"
    def matrix(self, n): return np.eye(n + 1)
class Unsymmetric(Plain):
    kind: Literal["unsymmetric"] = "unsymmetric"
    def matrix(self, n): return np.triu(np.ones((n, n)))
def function(*words): return 3
class Silent(Optimizer):
    kind: Literal["silent"] = "silent"
    def minimize(self, search, start, rng): return None
class Lost(Optimizer):
    kind: Literal["lost"] = "lost"
    def minimize(self, search, start, rng): return search.costs(np.full((1, len(start)), np.nan))
def nothing(path, options): return None
"""
POINTS = {
    "effects": "plain=Plain raising=Raising nan=NotANumber larger=Larger unsymmetric=Unsymmetric"
    " function=function missing=Missing quits=quitter:Quits",
    "optimizers": "silent=Silent lost=Lost",
    "loaders": "nothing=nothing",
    "costs": "function=function",
}


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A small study, in a folder where the package is installed."""
    folder = tmp_path_factory.mktemp("evil")
    (folder / "evilp.py").write_text(EVIL)
    (folder / "quitter.py").write_text("import sys\nsys.exit('no licence')\n")
    info = folder / "evil-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: evil\nVersion: 1.0\n")
    lines = []
    for group, entries in POINTS.items():
        lines += [f"[identify.{group}]", *(_line(entry) for entry in entries.split())]
    (info / "entry_points.txt").write_text("\n".join(lines) + "\n")
    text = (ROOT / "configs" / "arm_hammer_test.yaml").read_text().replace("../data", str(ROOT / "data"))
    kept = text.replace("starts: 10", "starts: 1").replace("[3, 80]", "[5, 30]")
    (folder / "plain.yaml").write_text(kept)
    return folder / "plain.yaml"


def _line(entry: str) -> str:
    name, _, what = entry.partition("=")
    return f"{name} = {what if ':' in what else f'evilp:{what}'}"


def run(study: Path, *words: str) -> subprocess.CompletedProcess[str]:
    return ran(*words, cwd=study.parent, packages=study.parent)


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ("  - {kind: raising}", "plug-in 'raising' of the package evil 1.0: RuntimeError: boom"),
        (
            "  - {kind: nan}",
            "plug-in 'nan' of the package evil 1.0: the stiffness of evil.k is a matrix with NaN",
        ),
        ("  - {kind: larger}", "package evil 1.0: the stiffness of evil.k is a matrix of shape (43, 43)"),
        (
            "  - {kind: unsymmetric}",
            "package evil 1.0: the stiffness of evil.k is a matrix that is not symmetric",
        ),
        ("  - {kind: function}", "package evil 1.0: evilp:function is no effect"),
        ("  - {kind: missing}", "plug-in 'missing' of the package evil 1.0: AttributeError"),
        ("  - {kind: quits}", "plug-in 'quits' of the package evil 1.0: SystemExit: no licence"),
        ("optimizer: silent", "plug-in 'silent' of the package evil 1.0: `minimize` gives None"),
        ("optimizer: lost", "plug-in 'lost' of the package evil 1.0: ValueError: it asks for the cost"),
        ("cost: function", "package evil 1.0: evilp:function is no cost"),
    ],
)
def test_what_a_package_does_wrong_is_told_of_it(more: str, said: str, study: Path) -> None:
    text = study.read_text()
    changed = study.with_name("changed.yaml")
    text = text.replace("cost: frf-least-squares", "") if more.startswith("cost") else text
    changed.write_text(
        text.replace("\ncost:", f"\n{more}\ncost:") if "cost:" in text else f"{text}\n{more}\n"
    )
    done = run(study, "fit", "changed.yaml", "--no-report", "-q")
    assert (done.returncode, done.stdout) == (2, ""), done.stderr
    told = [line for line in done.stderr.splitlines() if line != "HELLO"]
    assert len(told) == 1 and said in told[0], done.stderr


def test_a_loader_that_gives_nothing_is_named(study: Path) -> None:
    changed = study.with_name("loaded.yaml")
    changed.write_text(
        study.read_text().replace("    averages: 4\n", "    averages: 4\n    format: nothing\n")
    )
    done = run(study, "fit", "loaded.yaml", "--no-report", "-q")
    assert done.returncode == 2 and "plug-in 'nothing' of the package evil 1.0" in done.stderr, done.stderr


def test_one_that_prints_spoils_no_output(study: Path) -> None:
    changed = study.with_name("printing.yaml")
    changed.write_text(study.read_text().replace("\ncost:", "\n  - {kind: plain}\ncost:"))
    done = run(study, "fit", "printing.yaml", "--no-report", "-q")
    assert done.stdout == "" and "HELLO" in done.stderr and "Traceback" not in done.stderr


def test_a_broken_one_that_is_merely_installed_is_left_out_and_named(study: Path) -> None:
    done = run(study, "config")
    assert done.returncode == 0 and done.stdout.startswith("{"), done.stderr
    notes = done.stderr.splitlines()
    assert len(notes) == 4 and all(note.startswith("note: left out: plug-in") for note in notes), notes

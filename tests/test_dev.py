"""The recipe that needs no make, as far as it can be tried without building an environment."""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys
import tomllib
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def dev() -> ModuleType:
    """dev.py as a module."""
    spec = importlib.util.spec_from_file_location("dev", ROOT / "dev.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_programs_are_where_each_system_has_them(dev: ModuleType) -> None:
    assert dev.program("python", Path("e"), windows=True) == Path("e/Scripts/python.exe")
    assert dev.program("python", Path("e"), windows=False) == Path("e/bin/python")


def test_every_recipe_is_a_target_of_make(dev: ModuleType) -> None:
    makefile = (ROOT / "Makefile").read_text()
    for name in dev.RECIPES:
        assert f"dev.py {name}\n" in makefile, name


def test_lowest_runs_tests_that_are_there_and_bounds_every_dependency(dev: ModuleType) -> None:
    assert all((ROOT / name).exists() for name in dev._TRIED)
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert all(">=" in one for one in [*project["dependencies"], *dev._TRIED_WITH])
    assert "ruamel.yaml>=0.19" in project["dependencies"], "0.18 knows no depth of what it reads"


@pytest.mark.parametrize("words", [[], ["nonsense"], ["demo", "test"]])
def test_other_words_are_answered_with_the_recipes(words: list[str]) -> None:
    ran = subprocess.run(
        [sys.executable, str(ROOT / "dev.py"), *words], check=False, capture_output=True, text=True
    )
    assert ran.returncode == 1
    assert "usage: python dev.py ready | demo | test | exam | release" in ran.stderr


def test_an_old_python_is_told_so(dev: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(dev, "_LEAST", (99, 0))
    with pytest.raises(SystemExit, match="identify needs"):
        dev.main(["ready"])


def test_what_is_ready_is_left_alone(
    dev: ModuleType, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    ran: list[tuple[str, ...]] = []
    for name in dev._MADE_OF:
        (tmp_path / name).write_text("")
    (tmp_path / "ready").write_text("")
    monkeypatch.setattr(dev, "ROOT", tmp_path)
    monkeypatch.setattr(dev, "READY", tmp_path / "ready")
    monkeypatch.setattr(dev, "run", lambda *words: ran.append(words))
    monkeypatch.setattr(dev, "program", lambda name: Path(sys.executable))
    dev.ready()
    assert ran == []
    (tmp_path / "ready").unlink()
    dev.ready()
    assert ran[1][:5] == ("python", "-m", "uv", "pip", "install")


@pytest.mark.skipif(os.name == "nt", reason="programs that are scripts of a shell")
@pytest.mark.parametrize(("types", "tests", "code"), [(0, 0, 0), (1, 0, 1), (0, 3, 3)])
def test_types_are_checked_beside_tests_and_told_after_them(
    dev: ModuleType,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    types: int,
    tests: int,
    code: int,
) -> None:
    for name, ends in (("ruff", 0), ("python", 0), ("mypy", types), ("pytest", tests)):
        (tmp_path / name).write_text(f"#!/bin/sh\necho {name} says so\nexit {ends}\n")
        (tmp_path / name).chmod(0o700)
    monkeypatch.setattr(dev, "ready", lambda: None)
    monkeypatch.setattr(dev, "program", lambda name: tmp_path / name)
    with pytest.raises(SystemExit) as ended:
        dev.test()
    assert (ended.value.code, capsys.readouterr().out) == (code, "mypy says so\n")

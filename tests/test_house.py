"""The rules of the house that a machine can check: imports, versions, names, README."""

from __future__ import annotations

import ast
import re
import shlex
import subprocess
import tomllib
from collections.abc import Iterable
from functools import cache
from importlib.metadata import version
from pathlib import Path

import pytest
from typer.testing import CliRunner

import identify
from identify.cli import app
from identify.fitting.optimizers.base import OPTIMIZERS
from identify.model.effects.base import EFFECTS
from identify.vibration.costs.base import COSTS

ROOT = Path(__file__).parents[1]
MODULES = {
    ".".join(path.relative_to(ROOT).with_suffix("").parts): path for path in (ROOT / "identify").rglob("*.py")
}


def _tracked() -> list[Path]:
    listed = subprocess.run(["git", "ls-files"], check=False, cwd=ROOT, capture_output=True, text=True)
    if listed.returncode:
        pytest.skip("this copy is not a git checkout, so its files cannot be listed")
    return [ROOT / name for name in listed.stdout.splitlines() if (ROOT / name).is_file()]


def test_import_identify_is_ours() -> None:
    assert Path(identify.__file__).parent == ROOT / "identify"
    assert version("robot-identify") == identify.__version__


@cache
def _imports(path: Path) -> set[str]:
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.module and node.module.startswith("identify"):
            found |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
    return {name for name in found if name in MODULES}


def test_there_is_no_import_cycle() -> None:
    graph = {name: _imports(path) for name, path in MODULES.items()}
    done: set[str] = set()

    def visit(name: str, above: tuple[str, ...]) -> None:
        assert name not in above, " -> ".join((*above, name))
        if name not in done:
            for other in graph.get(name, ()):
                visit(other, (*above, name))
            done.add(name)

    for name in graph:
        visit(name, ())


def _folders(arrows: Iterable[tuple[str, str]]) -> dict[str, set[str]]:
    """Of imports (module, imported module), from which folder of a package to which other."""
    found: dict[str, set[str]] = {}
    for one, other in arrows:
        a, b = one.rpartition(".")[0], other.rpartition(".")[0]
        if a != b and "." in a:
            found.setdefault(a, set()).add(b)
    return found


def _circles(folders: dict[str, set[str]]) -> set[frozenset[str]]:
    """The folders that lie on a common circle."""

    def reached(start: str) -> set[str]:
        seen: set[str] = set()
        left = [start]
        while left:
            for other in folders.get(left.pop(), set()) - seen:
                seen.add(other)
                left.append(other)
        return seen

    far = {folder: reached(folder) for folder in folders}
    every = {frozenset({a, *(b for b in far[a] if a in far.get(b, ()))}) for a in folders if a in far[a]}
    return {circle for circle in every if len(circle) > 1}


PLUG_POINTS = {
    frozenset(f"identify.{name}" for name in names)
    for names in (
        ("explain", "explain.effects"),
        ("fitting", "fitting.optimizers"),
        ("setup", "setup.kinds"),
        ("vibration", "vibration.costs", "vibration.nuisances"),
        ("discovery", "discovery.places", "discovery.sparse"),
    )
}
"""Folders on a circle with the one they stand in, whose kinds are built from what it has and used by it; no
other may come to be.
"""


def test_there_is_no_circle_of_folders() -> None:
    """A circle of files is one of folders, but not the other way round."""
    arrows = [(name, other) for name, path in MODULES.items() for other in _imports(path)]
    for circle in _circles(_folders(arrows)):
        assert any(circle <= known for known in PLUG_POINTS), sorted(circle)


def test_a_circle_of_folders_is_seen() -> None:
    up = [("identify.reports.kit.page", "identify.reports.fit.pick")]
    down = [("identify.reports.fit.parts", "identify.reports.kit.report")]
    assert _circles(_folders(up)) == _circles(_folders(down)) == set()
    assert _circles(_folders(up + down)) == {frozenset({"identify.reports.fit", "identify.reports.kit"})}


ORDER = (
    "cli",
    "api",
    "reports",
    "map",
    "export",
    "excite",
    "planning",
    "machining",
    "batch",
    "discovery",
    "setup",
    "modes",
    "vibration",
    "explain",
    "joints",
    "motion",
    "fitting",
    "modal",
    "model",
    "results",
    "measured",
    "robot",
    "core",
)
"""The packages, from the top of the house to its ground; what stands loose at the root is its roof, `cli`."""


def _package(module: str) -> str:
    """The package that a module belongs to; the roof where it stands at the root."""
    parts = module.split(".")
    inside = len(parts) > 2 or (len(parts) == 2 and (ROOT / "identify" / parts[1]).is_dir())
    return parts[1] if inside else ORDER[0]


def _upwards(arrows: Iterable[tuple[str, str]]) -> list[str]:
    """The imports, as (module, imported module), that do not run downwards."""
    level = {package: number for number, package in enumerate(ORDER)}
    packages = [(one, other, _package(one), _package(other)) for one, other in arrows]
    return [f"{one} imports {other}" for one, other, a, b in packages if a != b and level[a] >= level[b]]


def test_every_file_stands_in_a_package_of_the_plan() -> None:
    assert {_package(name) for name in MODULES} == set(ORDER)
    loose = [path for path in (ROOT / "identify").glob("*.py")]
    assert len(loose) <= 4, loose


def test_arrows_run_downwards_only() -> None:
    assert _upwards((name, other) for name, path in MODULES.items() for other in _imports(path)) == []


@pytest.mark.parametrize(
    ("one", "other"),
    [("identify.core.errors", "identify.cli"), ("identify.fitting.fit", "identify.vibration.costs.base")],
)
def test_an_arrow_upwards_is_seen(one: str, other: str) -> None:
    assert one in MODULES and other in MODULES
    assert _upwards([(one, other)]) == [f"{one} imports {other}"]
    assert _upwards([(other, one)]) == []


def test_the_lock_has_every_dependency() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    wanted = project["project"]["dependencies"] + project["dependency-groups"]["dev"]
    locked = set(re.findall(r"^([A-Za-z0-9_.-]+)==", (ROOT / "requirements.lock").read_text(), re.MULTILINE))
    normal = {name.lower().replace("_", "-").replace(".", "-") for name in locked}
    for line in wanted:
        name = re.split(r"[<>=;\[ ]", line)[0].lower().replace("_", "-").replace(".", "-")
        assert name in normal, name


def test_nothing_names_a_machine_or_its_paths() -> None:
    pattern = re.compile(
        r"(/(work|farm|root|home)/[a-z.]|/tmp/[a-z]|https?://[^/ ]*(pypi|pythonhosted|npmjs|debian)\b)"
    )
    for path in _tracked():
        if path.suffix in (".png", ".uff", ".h5", ".pdf") or path == Path(__file__):
            continue
        match = pattern.search(path.read_text(encoding="utf-8", errors="ignore"))
        assert match is None, f"{path.relative_to(ROOT)}: {match[0] if match else ''}"


def test_the_docs_name_every_kind() -> None:
    """Every built-in: what other packages register is theirs to describe."""
    studies = (ROOT / "docs" / "studies.md").read_text()
    for registry in (EFFECTS, COSTS, OPTIMIZERS):
        for name in registry.builtin:
            assert f"`{name}`" in studies, f"{registry.what} {name}"


def test_the_readme_is_one_screen() -> None:
    readme = (ROOT / "README.md").read_text()
    assert len(readme.splitlines()) <= 70
    assert readme.index("**gap**") < readme.index("gap well above"), "explained before it is used"


PAGES = ["README.md", *sorted(f"docs/{path.name}" for path in (ROOT / "docs").glob("*.md"))]


@pytest.mark.parametrize("page", PAGES)
def test_files_and_commands_of_a_page_exist(page: str) -> None:
    text = (ROOT / page).read_text()
    for path in re.findall(r"`((?:configs|tests|data)/[\w/.]+)`", text):
        assert (ROOT / path).exists(), path
    for path in re.findall(r"\]\((?!https?:|#)([^)#]+)", text):
        assert (ROOT / page).parent.joinpath(path).exists(), path
    targets = set(re.findall(r"^([a-z]+):", (ROOT / "Makefile").read_text(), re.MULTILINE))
    for block in re.findall(r"```sh\n(.*?)```", text, re.DOTALL):
        for line in block.splitlines():
            _check_command(shlex.split(line.split("#")[0]), targets)


def _check_command(words: list[str], targets: set[str]) -> None:
    """A command that the docs show: its target, or its name and options, exist."""
    if words[:1] == ["make"]:
        assert words[1] in targets, words
    elif words[:1] == ["identify"]:
        shown = CliRunner().invoke(app, [words[1], "--help"])
        assert shown.exit_code == 0, words
        for option in (word.partition("=")[0] for word in words[2:] if word.startswith("--")):
            assert option in shown.stdout, words
        configs = [word for word in words[2:] if word.startswith("configs/")]
        assert all((ROOT / config).exists() for config in configs), words


@pytest.mark.parametrize("line", ["identify nonsense", "identify fit --nonsense", "make nonsense"])
def test_a_command_that_does_not_exist_is_seen(line: str) -> None:
    with pytest.raises(AssertionError):
        _check_command(line.split(), {"demo"})


@pytest.mark.parametrize("config", sorted(path.name for path in (ROOT / "configs").glob("*.yaml")))
def test_every_config_loads(config: str) -> None:
    from identify.core.config import family_of
    from identify.excite.limits import limits_of
    from identify.excite.study import read_excite_study
    from identify.explain.run import known_of
    from identify.explain.study import read_explain_study
    from identify.joints.study import bench_of, read_joint_study
    from identify.machining.tool import read_tool
    from identify.motion.problem import load_motion
    from identify.motion.study import read_motion_study
    from identify.robot.read import read_robot
    from identify.vibration.problem import load_problem
    from identify.vibration.study import read_study

    path = ROOT / "configs" / config
    family = family_of(path)
    if family == "identify-tool":
        assert read_tool(path).study.teeth
        return
    if family == "identify-joints":
        assert bench_of(read_joint_study(path)).joints
        return
    if family == "identify-excite":
        asked = read_excite_study(path)
        assert limits_of(asked.study, read_robot(asked.study.robot, path.parent)).moving.size
        return
    if family == "identify-explain":
        explained = read_explain_study(path)
        assert known_of(explained.study, read_robot(explained.study.robot, path.parent)).joints
        return
    problem = (
        load_motion(read_motion_study(path))
        if family == "identify-motion"
        else load_problem(read_study(path))
    )
    assert problem.parameters

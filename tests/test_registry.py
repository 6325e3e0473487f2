"""Plug points: built-ins and third parties come through the same door."""

from __future__ import annotations

import ast
import re
import sys
import tomllib
from collections.abc import Iterator
from dataclasses import replace
from importlib import import_module
from importlib.metadata import EntryPoint, EntryPoints
from pathlib import Path

import pytest

import identify
from identify.core import registry
from identify.core.errors import InputError, InputErrors
from identify.core.registry import Registry
from identify.fitting.fit import fit
from identify.fitting.resume import run_key
from identify.measured.loaders import load_frf_set
from identify.measured.uff.write import write_uff58
from identify.model.effects.base import EFFECTS, Term
from identify.model.effects.site import Site
from identify.model.effects.spring_to_ground import SpringToGround
from identify.results.provenance import computing
from identify.robot.description import Robot
from identify.vibration.plan import fit_plan
from identify.vibration.problem import load_problem
from identify.vibration.provenance import provenance_of
from identify.vibration.study import StudyFile, read_study
from tests.test_study import GOOD, folder  # noqa: F401  the fixture


def test_unknown_names_are_refused_with_the_known_ones() -> None:
    with pytest.raises(InputError, match="unknown colour 'blue'; expected one of green, red"):
        Registry("colour", "nowhere", {"red": "a:b", "green": "a:b"}).get("blue")


def test_a_name_is_taken_once() -> None:
    colours = Registry("colour", "nowhere", {"red": "a:b"})
    colours.add("blue", 1)
    assert colours.get("blue") == 1
    assert colours.names() == ["blue", "red"]
    for name in ("red", "blue"):
        with pytest.raises(ValueError, match="registered already"):
            colours.add(name, 2)


CONTRIBUTING = (Path(__file__).parents[1] / "CONTRIBUTING.md").read_text()


def _block(language: str, containing: str) -> str:
    """The one block of code in CONTRIBUTING.md in that language with that text in it."""
    [found] = [b for b in re.findall(rf"```{language}\n(.*?)```", CONTRIBUTING, re.DOTALL) if containing in b]
    return str(found)


@pytest.fixture
def rubber_pad(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[EntryPoint]:
    """The package of CONTRIBUTING.md, where Python finds it; its entry point."""
    package = tmp_path / "site"
    package.mkdir()
    (package / "rubber_pad.py").write_text(_block("python", "class RubberPad"))
    monkeypatch.syspath_prepend(package)
    project = tomllib.loads(_block("toml", "entry-points"))["project"]
    [(group, entries)] = project["entry-points"].items()
    [(name, value)] = entries.items()
    yield EntryPoint(name, value, group)
    sys.modules.pop("rubber_pad", None)


@pytest.fixture
def installed(rubber_pad: EntryPoint, monkeypatch: pytest.MonkeyPatch) -> None:
    """The package is installed."""

    monkeypatch.setattr(registry, "installed", lambda group: EntryPoints([rubber_pad]).select(group=group))


def _with(folder: Path, entry: str) -> StudyFile:  # noqa: F811  the fixture
    (folder / "config.yaml").write_text(GOOD + f"  - {entry}\n")
    return read_study(folder / "config.yaml")


@pytest.mark.usefixtures("installed")
def test_the_effect_of_contributing_is_used_like_a_built_in(folder: Path) -> None:  # noqa: F811
    assert "rubber-pad" in EFFECTS.names()
    with pytest.raises(ValueError, match="registered already"):
        EFFECTS.add("rubber-pad", object)
    problem = load_problem(_with(folder, "{kind: rubber-pad, stiffness: {initial: 3.0e+6}}"))
    last, system = problem.parameters[-1], problem.measurements[0].system
    assert (last.name, last.initial, last.free) == ("base.pad.stiffness", 3e6, True)
    column = system.coordinates.index("base.tz")
    _, _, stiffness = system.matrices(problem.initial)
    more = problem.initial.copy()
    more[-1] += 1e3
    assert (system.matrices(more)[2] - stiffness)[column, column] == pytest.approx(1e3)
    plan = fit_plan(problem)
    found = fit(replace(plan, starts=1))
    assert found.cost < plan.objective.costs(problem.initial[None])[0]
    assert found.values[-1] != problem.initial[-1]


def test_without_the_package_its_effect_is_unknown(folder: Path) -> None:  # noqa: F811
    with pytest.raises(InputErrors, match="unknown effect 'rubber-pad'"):
        _with(folder, "{kind: rubber-pad}")


def test_the_effect_of_contributing_as_a_built_in(
    folder: Path,  # noqa: F811
    rubber_pad: EntryPoint,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    line = _block("python", "identify.model.effects.rubber_pad")
    [(name, value)] = ast.literal_eval("{" + line + "}").items()
    module, attribute = value.split(":")
    monkeypatch.setitem(sys.modules, module, import_module("rubber_pad"))
    monkeypatch.setitem(EFFECTS.builtin, name, f"{module}:{attribute}")
    names = [p.name for p in load_problem(_with(folder, "{kind: rubber-pad}")).parameters]
    assert names[-1] == "base.pad.stiffness"


def test_contributing_names_every_group() -> None:
    """Found in the calls of `Registry` all over the package."""
    groups = set()
    for path in Path(identify.__file__).parent.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "Registry":
                groups.add(ast.literal_eval(node.args[1]))
    assert {"identify.effects", "identify.motion_effects"} <= groups
    assert [group for group in sorted(groups) if f"`{group}`" not in CONTRIBUTING] == []


class Clamp(SpringToGround):
    """A third party's effect that looks for its link without saying where."""

    kind: str = "clamp"  # type: ignore[assignment]

    def terms(self, robot: Robot, site: Site, where: str) -> list[Term]:
        robot.link(self.link)
        return super().terms(robot, site, where)


@pytest.mark.parametrize("kind", ["spring-to-ground", "added-mass", "link-flexibility", "clamp"])
def test_an_unknown_link_is_reported_once_with_file_and_line(
    kind: str,
    folder: Path,  # noqa: F811
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(EFFECTS.added, "clamp", Clamp)
    first = load_frf_set(folder / "frf.uff")
    write_uff58(folder / "other.uff", replace(first, frf=2 * first.frf))
    both = GOOD.replace(
        "band_hz", "  - {file: other.uff, posture_deg: [1, 2, 3, 4, 5, 6], averages: 4}\nband_hz"
    )
    (folder / "config.yaml").write_text(both + f"  - {{kind: {kind}, link: nowhere}}\n")
    line = len(both.splitlines()) + 1
    with pytest.raises((InputError, InputErrors)) as caught:
        load_problem(read_study(folder / "config.yaml"))
    assert re.fullmatch(
        rf"\S*config\.yaml line {line}: effects\.1(\.link)?: unknown link 'nowhere'; expected one of [^\n]*",
        str(caught.value),
    ), str(caught.value)


def test_another_version_of_a_plug_in_is_another_run(
    folder: Path,  # noqa: F811  the fixture
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """What it computes may differ, so `--resume` begins anew."""
    package = tmp_path / "installed" / "rubber_pad-1.0.dist-info"
    package.mkdir(parents=True)
    (package / "entry_points.txt").write_text("[identify.effects]\nrubber-pad = rubber_pad:RubberPad\n")
    monkeypatch.syspath_prepend(package.parent)
    (folder / "config.yaml").write_text(GOOD)
    file, keys = read_study(folder / "config.yaml"), []
    for version in ("1.0", "1.1", "1.1"):
        (package / "METADATA").write_text(f"Metadata-Version: 2.1\nName: rubber-pad\nVersion: {version}\n")
        registry.installed.cache_clear()
        computing.cache_clear()
        assert f"rubber-pad {version}" in provenance_of(file).packages
        keys.append(run_key(provenance_of(file), file))
    monkeypatch.undo()
    registry.installed.cache_clear()
    computing.cache_clear()
    assert keys[0] != keys[1] == keys[2]
    assert not any(one.startswith("rubber-pad") for one in computing())

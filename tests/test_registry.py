"""Plug points: built-ins and third parties come through the same door."""

from __future__ import annotations

from importlib.metadata import EntryPoint, EntryPoints
from pathlib import Path

import pytest

from identify.core import registry
from identify.core.errors import InputError
from identify.core.registry import Registry
from identify.model.effects.base import EFFECTS
from identify.model.effects.base_compliance import BaseCompliance
from identify.vibration.problem import load_problem
from identify.vibration.study import read_study
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


class Foundation(BaseCompliance):
    """An effect of another package: the base compliance under another name."""

    kind: str = "foundation"  # type: ignore[assignment]


def test_an_effect_of_another_package_is_used_like_a_built_in(
    folder: Path,  # noqa: F811  the fixture
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    point = EntryPoint("foundation", f"{__name__}:Foundation", "identify.effects")
    monkeypatch.setattr(EntryPoint, "load", lambda self: Foundation)

    def found(**wanted: str) -> EntryPoints:
        return EntryPoints([point]).select(**wanted)

    monkeypatch.setattr(registry, "entry_points", found)
    assert "foundation" in EFFECTS.names()
    (folder / "config.yaml").write_text(GOOD + "  - {kind: foundation, axes: [rz]}\n")
    problem = load_problem(read_study(folder / "config.yaml"))
    assert "base.rz.stiffness" in [parameter.name for parameter in problem.parameters]
    with pytest.raises(ValueError, match="registered already"):
        EFFECTS.add("foundation", Foundation)

"""What tests of discovery share."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import pytest

from identify.discovery import workbench
from identify.discovery.candidates import candidates
from identify.discovery.places import look
from identify.discovery.places.catalogue import places_of
from identify.model.effects.base import Effect
from identify.model.effects.place import Place
from identify.vibration.problem import Problem


def only(monkeypatch: pytest.MonkeyPatch, some: Callable[[Effect], bool]) -> None:
    """Some of the catalogue are tried, and their places are looked at, so that what is tested of the loop is
    tested quickly; all of it is in tests/benchmarks/discovery.py.
    """

    def theirs(problem: Problem, found: Sequence[Effect]) -> list[Place]:
        own = {place for effect in found for place in effect.places(problem.robot, problem.points)}
        return [place for place in places_of(problem, found) if place in own]

    monkeypatch.setattr(
        workbench, "candidates", lambda *known: [effect for effect in candidates(*known) if some(effect)]
    )
    monkeypatch.setattr(look, "places_of", theirs)


@pytest.fixture
def faults_of_instruments(monkeypatch: pytest.MonkeyPatch) -> None:
    """What instruments may do."""
    only(monkeypatch, lambda effect: effect.of_measurement)


@pytest.fixture
def small_catalogue(monkeypatch: pytest.MonkeyPatch) -> None:
    """A delay, and what one joint may do."""

    def some(effect: Effect) -> bool:
        compliance = effect.kind == "joint-compliance" and " of joint 2 " in effect.sentence()
        return compliance or effect.kind == "time-delay"

    only(monkeypatch, some)


@pytest.fixture
def friction_or_delay(monkeypatch: pytest.MonkeyPatch) -> None:
    """Friction of joint 2, whose every refit simulates impacts, and a delay."""

    def some(effect: Effect) -> bool:
        return effect.sentence().startswith("dry friction of joint 2 ") or effect.kind == "time-delay"

    only(monkeypatch, some)

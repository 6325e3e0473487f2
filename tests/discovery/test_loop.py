"""The order in which a search asks what is missing: selections with canned ends."""

from __future__ import annotations

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any, cast

import pytest

from identify.discovery import loop
from identify.discovery.loop import discover
from identify.discovery.task import Option, Task, Trial
from identify.discovery.workbench import ImpactWorkbench
from identify.discovery.workers import Workers
from identify.fitting.selection.gain import Gain
from identify.fitting.selection.loop import Selection
from identify.fitting.selection.workbench import Story
from identify.model.effects.base import Effect, parse_effect
from identify.vibration.problem import Problem

_REVERSED = parse_effect({"kind": "channel-polarity", "channel": "5:+Y"})
_DELAY = parse_effect({"kind": "time-delay"})
_RESONATOR = parse_effect({"kind": "appended-resonator", "link": "link2", "axis": "z"})


def _model(*effects: Effect, gap: float = 1.05, elsewhere: float = 1.02) -> Trial:
    return Trial(Task(effects, (), {}), {}, 100 * gap**2, 100, 50 * elsewhere**2, 50)


def _found(first: Trial, *effects: Effect, new: Sequence[Effect] = (), elsewhere: float = 1.02) -> Any:
    final = _model(*effects, elsewhere=elsewhere)
    options = tuple(Option(one, final, 1, Gain(50.0, 0.9, True, True)) for one in new)
    return Selection(first, final, options)


@pytest.mark.parametrize(("named", "elsewhere"), [(True, 2.0), (True, 1.02), (False, 2.0)])
def test_what_was_named_from_errors_is_searched_beside_where_other_data_stay_open(
    named: bool, elsewhere: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A reversed channel hid a resonator: errors of that sensor made up for both."""
    first, begun = _model(gap=9.0), list[Trial]()
    one = _found(first, _REVERSED, _DELAY, new=[_REVERSED, _DELAY], elsewhere=elsewhere)
    two = _found(one.final, _REVERSED, _RESONATOR, new=[_RESONATOR])
    ends = [(one, named), (two, False)]

    def added(model: Trial) -> tuple[Effect, ...]:
        return model.task.effects

    bench = SimpleNamespace(go_on_from=begun.append, added=added, refitted=None, problem=None)
    monkeypatch.setattr(loop, "check_data", lambda problem: None)
    monkeypatch.setattr(loop, "timed", lambda problem: problem)
    monkeypatch.setattr(loop, "ImpactWorkbench", lambda problem, workers: bench)
    monkeypatch.setattr(loop, "_found", lambda *every: ends.pop(0))
    monkeypatch.setattr(loop, "_selected", lambda *every: ends.pop(0))
    monkeypatch.setattr(loop, "in_turn", lambda problem, workers, first, options, final, refitted: options)
    workers = SimpleNamespace(with_errors=True, turn_to=lambda problem, *, with_errors: None)

    found = discover(cast(Problem, None), cast(Workers, workers))
    again = named and elsewhere > 1.1
    assert begun == ([one.final] if again else [])
    assert found.first is first
    assert found.final is (two.final if again else one.final)
    # The delay did not outlast the second search.
    expected = [_REVERSED, _RESONATOR] if again else [_REVERSED, _DELAY]
    assert [option.effect for option in found.added] == expected


@pytest.mark.parametrize("law", [True, False])
def test_errors_beside_a_law_that_no_effect_has_are_not_named(
    law: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It is only near what acts, and they make up for the rest."""
    effect = parse_effect({"kind": "measured-impedance", "at": ["joint2.rx"]}) if law else _DELAY
    found, asked = _found(_model(gap=9.0), effect, new=[effect]), list[str]()

    def as_they_are(judge: None, bench: object, options: Sequence[Option], story: Story) -> Any:
        asked.append("forms")
        return None, options

    problem = SimpleNamespace(nuisances=SimpleNamespace(entries=("a",)))
    monkeypatch.setattr(loop, "select", lambda bench, story: found)
    monkeypatch.setattr(loop, "judge_of", lambda problem, final: None)
    monkeypatch.setattr(loop, "in_fitting_forms", as_they_are)
    monkeypatch.setattr(loop, "promoted", lambda judge, workers, options, story: (options, found.final))
    bench = SimpleNamespace(problem=problem, workers=None)
    assert loop._selected(cast(ImpactWorkbench, bench), Story()) == (found, False)
    assert asked == ([] if law else ["forms"])

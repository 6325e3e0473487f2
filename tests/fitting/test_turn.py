"""A turn of the selection goes on to what promises less where nothing of what was tried is admitted."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import pytest

from identify.fitting.selection.gain import Gain, Rule
from identify.fitting.selection.policy import Policy
from identify.fitting.selection.turn import turn
from identify.fitting.selection.workbench import Attempt, Story


@dataclass(frozen=True)
class Named:
    name: str

    def sentence(self) -> str:
        return self.name


class Bench:
    """Models are numbers, gains their differences; two candidates are refitted at a time."""

    def __init__(self, worth: dict[str, float], persistent: bool) -> None:
        self.worth, self.refitted = worth, list[str]()
        self.policy = Policy(admit=Rule(log_odds=5.0), retain=(), persistent=persistent)

    def candidates(self, model: float) -> list[Named]:
        return [Named(name) for name in self.worth]

    def screen(self, model: float, effects: Sequence[Named], story: Story) -> list[Attempt[Named, float]]:
        return [Attempt(effect, model, 0) for effect in effects]

    def promising(self, model: float, screened: Sequence[Any]) -> Sequence[Any]:
        return screened[:2]

    def refit(self, model: float, promising: Sequence[Any]) -> list[list[Any]]:
        self.refitted += [one.effect.name for one in promising]
        return [[replace(one, model=model + self.worth[one.effect.name])] for one in promising]

    def criterion(self, models: Sequence[float]) -> Bench:
        return self

    def gain(self, before: float, after: float) -> Gain:
        return Gain(after - before, 0.5)

    def pair(self, step: Any, screened: Any, banned: Any) -> None:
        return None


WORTH = {"a": 1.0, "b": 3.0, "c": 9.0, "d": 2.0, "e": 20.0}


@pytest.mark.parametrize(
    ("persistent", "found", "refitted"), [(True, "c", ["a", "b", "c", "d"]), (False, "", ["a", "b"])]
)
def test_the_next_are_tried_until_one_is_admitted(persistent: bool, found: str, refitted: list[str]) -> None:
    bench: Any = Bench(WORTH, persistent)
    step = turn(bench, 0.0, Story())
    assert "".join(option.effect.name for option in step.found) == found
    assert bench.refitted == refitted
    assert len(step.options) == len(WORTH)  # the rest as they were looked at


def test_no_further_ones_are_tried_when_time_is_over() -> None:
    bench: Any = Bench(WORTH, True)
    assert turn(bench, 0.0, Story(until=-math.inf)).found == ()
    assert bench.refitted == ["a", "b"]

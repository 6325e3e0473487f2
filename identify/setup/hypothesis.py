"""A mistake of the set-up that may have been made: in words, and what of the study puts it right."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from identify.core.arrays import Array
from identify.setup.edits import Change
from identify.setup.score import Score
from identify.setup.stated import Stated

Moved = Callable[[Array], "Hypothesis"]
Settle = Callable[[Score], tuple[Change, ...]]


@dataclass(frozen=True)
class Hypothesis:
    """code: of its kind; sentence: what was done, as "the angles of joint 2 have the other sign"; edits: what
    puts it right; settle: the edits that a fit of it leads to, where they hold a number that was fitted
    along; about: what it is about, of which one mistake at a time is looked for; count: how many it is;
    numbers (n,): what it holds that is only about right, by less than reach; moved: the same with others;
    promise: of how a channel is read, the squares that it explains of what the fit as stated leaves.
    """

    code: str
    sentence: str
    edits: tuple[Change, ...]
    about: str
    settle: Settle | None = None
    count: int = 1
    numbers: Array | None = None
    reach: float = 0.0
    moved: Moved | None = None
    promise: float = 0.0

    @property
    def key(self) -> str:
        """By which it is known when it is asked for again."""
        return f"{self.sentence} {self.edits!r}"

    def settled(self, score: Score) -> tuple[Change, ...]:
        """What puts it right, with the numbers that a fit found."""
        return self.settle(score) if self.settle else self.edits


Kind = Callable[[Stated, Score], Iterator[Hypothesis]]
"""The hypotheses of a kind on a study, of which a fit as stated is known."""

"""What the loop asks of an analysis: a workbench knows its data, what may be missing, and how to refit."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, Generic, Protocol, TypeVar

from identify.fitting.selection.gain import Gain
from identify.fitting.selection.policy import Policy


class Named(Protocol):
    """An effect, as far as the loop is concerned: something that can be said."""

    def sentence(self) -> str:
        """What this instance is, as an engineer would say it."""


E = TypeVar("E", bound=Named)
M = TypeVar("M")
M_contra = TypeVar("M_contra", contravariant=True)


class Criterion(Protocol[M_contra]):
    """How gains are judged."""

    def gain(self, before: M_contra, after: M_contra) -> Gain:
        """What `after` gains over `before`."""


@dataclass(frozen=True)
class Attempt(Generic[E, M]):
    """A model with one more effect; size: number of parameters that this one adds."""

    effect: E
    model: M
    size: int


@dataclass(frozen=True)
class Option(Attempt[E, M]):
    """An attempt with what it gains over the model without it."""

    gain: Gain


@dataclass(frozen=True)
class Step(Generic[E, M]):
    """What one turn found: the model before; all options, best first; what was chosen (two where only a pair
    is enough); what the data cannot tell from it; how it was judged.
    """

    before: M
    options: tuple[Option[E, M], ...]
    found: tuple[Option[E, M], ...]
    rivals: tuple[Option[E, M], ...]
    criterion: Criterion[M]

    @property
    def best(self) -> Option[E, M] | None:
        """The first that was chosen; None where nothing was."""
        return self.found[0] if self.found else None


@dataclass
class Story:
    """Who is told of the progress: `say` gets a sentence at each turn, `done` the number of finished attempts
    and of all in a step, `doing` what is done now; steps: every step so far; until: when no further stage is
    begun, s of the monotonic clock.
    """

    say: Callable[[str], None] = lambda sentence: None
    done: Callable[[int, int], None] = lambda number, total: None
    steps: list[Step[Any, Any]] = field(default_factory=list)
    until: float = math.inf
    doing: Callable[[str], None] = lambda what: None

    @property
    def late(self) -> bool:
        """Whether the time that was given is over: what has been found so far is the result."""
        return time.monotonic() > self.until


class Workbench(Protocol[E, M]):
    """Data and models of one analysis.  A model M is whatever the analysis refits; an effect E can be
    compared.
    """

    @property
    def policy(self) -> Policy:
        """What is asked of the effects."""

    def begin(self) -> M:
        """The model to begin with, refitted."""

    def added(self, model: M) -> Sequence[E]:
        """Effects of a model that were selected, in order."""

    def candidates(self, model: M) -> list[E]:
        """What may be missing from a model."""

    def screen(self, model: M, effects: Sequence[E], story: Story) -> list[Attempt[E, M]]:
        """A cheap first look at every candidate, best first."""

    def promising(self, model: M, screened: Sequence[Attempt[E, M]]) -> Sequence[Attempt[E, M]]:
        """Those that may win."""

    def refit(self, model: M, promising: Sequence[Attempt[E, M]]) -> list[list[Attempt[E, M]]]:
        """For each promising one, what it is refitted, in other forms too where these are tried; what has no
        solution is left out.
        """

    def criterion(self, models: Sequence[M]) -> Criterion[M]:
        """How gains among these models are judged."""

    def quick_criterion(self, model: M) -> Criterion[M]:
        """The same about one model, without the cost of its uncertainties."""

    def pair(
        self, step: Step[E, M], screened: Sequence[Attempt[E, M]], banned: Sequence[E]
    ) -> tuple[Option[E, M], ...] | None:
        """What to choose where two effects hide each other; None where no pair passes."""

    def settled(self, model: M) -> M:
        """A chosen model, fitted as well as it can be."""

    def leave_out(self, model: M, effects: Sequence[E]) -> list[M]:
        """For each effect, the model without it."""

    def removable(self, model: M) -> Sequence[E]:
        """Added effects that no other one needs."""

    def replaceable(self, model: M, effect: E) -> bool:
        """Whether what might do what an effect of a model does is looked for anew at the end."""

    def can_replace(self, effect: E) -> bool:
        """Whether an effect may do what another does."""

    def implausible(self, model: M, effect: E) -> bool:
        """Whether an effect has values that it cannot have."""

    def size(self, model: M, effect: E) -> int:
        """Number of free parameters that an effect of a model has."""

    def standing(self, model: M) -> str:
        """How far a model is from the data, as part of a sentence: `gap 1.02`."""

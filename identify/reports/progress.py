"""What fits, discoveries, searches of motions and batches show while they go on."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

from identify.batch.loop import BatchIndex, Watch
from identify.fitting.fit import Progress
from identify.fitting.selection.workbench import Story
from identify.reports.shown import Shown, shown


@contextmanager
def progress_bar(quiet: bool) -> Iterator[Progress]:
    """The starts of a fit with the best cost so far, which is that of the result."""
    with shown(quiet, "reading") as where:
        count = StartCount(where)
        yield Progress(count, ended=count.ended)


@dataclass
class StartCount:
    """Shows starts and stages of a fit, told as `Progress.show` is."""

    where: Shown
    _lowest: float = np.inf
    _stage: int = 0
    _before: tuple[int, int] = (0, 0)

    def __call__(self, start: int, starts: int, kind: str, evaluations: int, best: float) -> None:
        """Cost: NaN in a stage whose cost is not that of the result."""
        self._stage += (start, evaluations) < self._before or start != self._before[0]
        self._before = (start, evaluations)
        self._lowest = float(np.fmin(self._lowest, best))
        which = f"start {start + 1} of {starts}" if start < starts else "one more start"
        self.where.tell(f"{which}, {kind}{self._cost}", start, max(starts, start + 1), self._stage)

    def ended(self) -> None:
        """What is left to do has no parts to count."""
        self.where.tell(f"intervals and modes of the best start{self._cost}", stage="ended")

    @property
    def _cost(self) -> str:
        return f", best cost {self._lowest:.4g}" if np.isfinite(self._lowest) else ""


@contextmanager
def story(quiet: bool) -> Iterator[Story]:
    """The turns of a discovery as they come, what is done, and how many candidates of a turn are tried."""
    with shown(quiet, "reading, and fitting the present model") as where:

        def tried(number: int, total: int) -> None:
            if number < total or not total:
                of = f" of {total}" if total else ""
                where.tell(f"trying candidates: {number}{of}", number, total or None, "candidates")
            else:
                where.tell("comparing the best candidates", stage="best")

        yield Story(where.say, tried, doing=lambda what: where.tell(what, stage=what))


@contextmanager
def motions(quiet: bool) -> Iterator[Story]:
    """The motions of which the best is taken, as they are improved."""
    with shown(quiet, "trying motions at random") as where:
        yield Story(
            where.say, lambda number, total: where.tell(f"{number} of {total} motions", number, total)
        )


@contextmanager
def batch_bar(quiet: bool) -> Iterator[Watch]:
    """The jobs that are done, with how many failed."""
    with shown(quiet, "starting") as where:

        def watch(index: BatchIndex) -> None:
            counts = index.counts()
            failed = f", {counts['failed']} failed" if counts["failed"] else ""
            ended = counts["done"] + counts["failed"]
            sentence = f"{index.about['workers']}: {ended} of {len(index.jobs)} done{failed}"
            if ended < len(index.jobs):
                where.tell(sentence, ended, len(index.jobs), "jobs")
            else:
                where.tell(f"{sentence}; putting them together", stage="together")

        yield watch

"""What the figures of an explained motion draw: curves over time, and shares per effect."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identify.core.arrays import Array
from identify.reports.explain.tables import scale
from identify.results.explain import Curves, TargetResult


@dataclass(frozen=True)
class History:
    """One joint of one record in the shown unit, (samples,): measured, known, explained; left before and
    after, NaN where not counted.
    """

    time_s: Array
    measured: Array
    known: Array
    explained: Array
    before: Array
    after: Array


def history(found: TargetResult, curves: Curves, row: int) -> History:
    """The curves of the joint in that row."""
    factor, _ = scale(found)
    measured, known, explained = (
        factor * getattr(curves, name)[:, row] for name in ("measured", "known", "explained")
    )
    used = curves.used[:, row]
    before, after = (np.where(used, measured - model, np.nan) for model in (known, explained))
    return History(curves.time_s, measured, known, explained, before, after)


def bars(found: TargetResult) -> tuple[tuple[str, ...], Array]:
    """Names of effects and how much each step took of the squares there were at first, % of all (steps,
    joints); found order.
    """
    squares = np.vstack([found.rms_judge_start, found.steps.rms_judge]) ** 2
    return found.steps.name, -100 * np.diff(squares, axis=0) / squares[0]

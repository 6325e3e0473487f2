"""Laws that no effect has, beside errors of what was told, where a place says nothing without them: they are
tried in place of springs that come near.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identify.core.thresholds import MISSING
from identify.discovery.evidence import above_noise, closed, removed
from identify.discovery.lean import may_lean
from identify.discovery.screen import likeliest_first
from identify.discovery.task import Task, Trial, near_enough, once, squares_of
from identify.discovery.workers import Workers, further
from identify.model.effects.measured_impedance import MeasuredImpedance
from identify.model.effects.springs import Springs
from identify.vibration.nuisances.nuisance import bare
from identify.vibration.problem import Problem

_LAWS, _MOST_OF_IT, _HOPE, _NEARLY = 2, 0.6, 0.3, 1.5
"""How many laws are taken to all lines; which part of the gap above noise that springs leave they must take;
and on few lines, to get there; how many times the gap above noise that the best of them leaves others may
leave on few lines."""
_TRIED, _FARTHEST = 0.01, 0.1
"""Slopes of an axis, for the parabola and the largest."""


def with_laws(workers: Workers, problem: Problem, groups: Sequence[list[Trial]]) -> list[list[Trial]]:
    """The refitted candidates where errors of what was told are fitted along, with laws that no effect has in
    place of springs that are new to the best of them, if they take most of what those leave open: what
    relaxes is nearly a spring and a damper.

    On all their coordinates and on each alone, with one relaxation time and with two; on a single one also
    about an axis of its own direction.
    """
    best = min((trial for group in groups for trial in group), key=squares_of, default=None)
    if best is None or closed(best) or best.gap > MISSING:
        return list(groups)
    [springs] = best.task.new
    if not isinstance(springs, Springs):
        return list(groups)
    names = springs.free_coordinates(problem.robot)
    stiffness = {name: best.values[f"{name}.stiffness"] for name in names}
    at = [names, *([name] for name in names if len(names) > 1)]
    laws = [MeasuredImpedance(at=some, branches=count) for some in at for count in (1, 2)]
    starts = [bare(best.values) | law.starts_beside(stiffness) for law in laws]
    pairs = zip(laws, starts, strict=True)
    tasks = [replace(best.task, new=(law,), values=values, how="quick") for law, values in pairs]
    quick = workers.run(tasks)
    ends = further(workers, near_enough(quick, min(one.gap for one in quick), _NEARLY), "likely")
    hopeful = [end for end in ends if removed(best.gap, end.gap) >= _HOPE]
    near = likeliest_first(near_enough(hopeful, ends[0].gap, _NEARLY))
    single = next((one for one in near if may_lean(one.task.new[0])), None)
    if single is not None and above_noise(ends[0].gap):
        near = [leaning_softly(workers, single), *near]
    whole = further(workers, once(near)[:_LAWS], "onward")
    found = [one for one in whole if closed(one) and removed(best.gap, one.gap) >= _MOST_OF_IT]
    return [*groups, *([one] for one in found)]


def leaning_softly(workers: Workers, trial: Trial) -> Trial:
    """A trial of such a law beside errors of what was told, on few lines, or the same about the axis about
    which it leaves least, if that is less.
    """
    [law] = trial.task.new
    assert isinstance(law, MeasuredImpedance)
    body, _, axis = law.at[0].partition(".")
    others = [f"{body}.{axis[0]}{other}" for other in "xyz" if other != axis[1]]

    def turned(lean: dict[str, float]) -> Task:
        return replace(
            trial.task, new=(law.model_copy(update={"lean": lean}),), values=trial.values, how="nearby"
        )

    sides = workers.run([turned({other: by}) for other in others for by in (_TRIED, -_TRIED)])
    by = dict[str, float]()
    for other, up, down in zip(others, sides[::2], sides[1::2], strict=True):
        bend = up.squares - 2 * trial.squares + down.squares
        if np.isfinite(bend) and bend > 0:
            least = _TRIED / 2 * (down.squares - up.squares) / bend
            by[other] = round(float(np.clip(least, -_FARTHEST, _FARTHEST)), 6)
    return min([trial, *workers.run([turned(by)] if by else [])], key=squares_of)

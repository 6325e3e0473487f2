"""How long the records behind FRFs were, where nobody says so and not all of their lines may be there: the
length whose end explains the data.

What is missing behind the end of a record is e^(-sT) of a free motion. On lines that are multiples of 1 / T
it changes the residues of each mode alone, by 1 - e^((lambda - sigma) T), so no line says anything of T
without a model; with one, each length has its likelihood.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from identify.core.arrays import Array
from identify.core.errors import InputError
from identify.core.parameters import Scale
from identify.core.thresholds import CONVINCING, MATERIAL, QUIET, SIGMAS_95
from identify.fitting.fit import Fit, Progress, fit, unmoving
from identify.measured.frf_set import FrfSet
from identify.model.effects.pre_trigger import PRE_TRIGGER, PreTrigger
from identify.vibration.costs.base import parse_cost
from identify.vibration.given import Given
from identify.vibration.plan import fit_plan
from identify.vibration.problem import Problem, with_effects, with_given

_WORDS = ("", "second", "third", "fourth", "fifth", "sixth")
_TIMES = range(1, len(_WORDS) + 1)
"""Multiples of the shortest record that may have been, and which of its lines then stand."""


Show = Callable[[int, int, str, int, float], None]


def with_records(problem: Problem, found: Fit, show: Show | None = None) -> tuple[Problem, Fit]:
    """The problem and its fit with the length of records that explains the data, where the one assumed does
    not do so as well; notes of the data say which was taken, or that another may be as right.
    """
    if not _open(problem):
        return problem, found
    times, best = _best(problem, found.values, found.cost, show)
    if best is None:
        return _in_doubt(problem, 1, found), found
    note = (
        f"only every {_WORDS[times - 1]} line of records of {{:.4g}} s was exported: with records as short as"
        f" one over the spacing of lines, the gap would be {found.cost:.3g}, not {best.cost:.3g}"
    )
    best = replace(best, seconds=found.seconds + best.seconds)
    return _in_doubt(_noted(problem, note, times), times, best), best


def check_records(problem: Problem, values: Array, cost: float) -> None:
    """Raise an InputError where other records than assumed explain the data; values (unknowns,) and cost are
    those of a fit.
    """
    times, best = _best(problem, values, cost) if _open(problem) else (1, None)
    if best is not None:
        record = times * next(m.given.record or 0.0 for m in problem.measurements if _assumed(m.given))
        raise InputError(
            "measurements",
            f"every {_WORDS[times - 1]} line of records of {record:.4g} s, which explain the data (gap"
            f" {best.cost:.3g}, not {cost:.3g})",
            "the length of the records",
            f"add `record_s: {record:.6g}` to each measurement",
        )


def _best(problem: Problem, values: Array, cost: float, show: Show | None = None) -> tuple[int, Fit | None]:
    """How many times as long records explain the data best, with their fit; None where the fit with the
    shortest, of these values and cost, does about as well.  Fits are made only where a step promises it.
    """
    squares = {times: _ahead(_longer(problem, times), values).squares for times in _TIMES}
    fits = {
        times: fit(fit_plan(_held(_longer(problem, times))), Progress(show) if show else None)
        for times in _TIMES[1:]
        if squares[times] < (1 - MATERIAL) * squares[1]
    }
    if not fits:
        return 1, None
    best = min(fits, key=lambda times: fits[times].cost)
    explains = fits[best].cost <= QUIET and cost - fits[best].cost >= MATERIAL
    return (best, fits[best]) if explains else (1, None)


def _open(problem: Problem) -> bool:
    """Whether the ends of records count whose length nobody said, and a likelihood can tell it."""
    likely = problem.file.study.cost == parse_cost("frf-least-squares")
    return likely and any(_assumed(m.given) for m in problem.measurements)


class _Ahead(NamedTuple):
    """The sum of squares after one step of Gauss-Newton, the step (f,) and standard deviations (f,)."""

    squares: float
    step: Array
    std: Array


def _ahead(problem: Problem, values: Array) -> _Ahead:
    """Where one step from values (unknowns,) leads."""
    free = Scale(problem.parameters).free
    product = problem.file.study.cost.objective(problem.targets()).product(values, free)
    if not np.isfinite(product).all():
        return _Ahead(np.inf, np.zeros(len(free)), np.ones(len(free)))
    scale = np.sqrt(np.maximum(np.diag(product)[:-1], np.finfo(float).tiny))
    inverse = np.linalg.pinv(product[:-1, :-1] / np.outer(scale, scale), rcond=1e-12, hermitian=True)
    score = product[:-1, -1] / scale
    std = np.sqrt(np.maximum(np.diag(inverse), 0.0)) / scale
    return _Ahead(float(product[-1, -1] - score @ inverse @ score), -(inverse @ score) / scale, std)


def _in_doubt(problem: Problem, taken: int, found: Fit) -> Problem:
    """The problem with shortest records, with those so many times as long that were taken; with a note where
    others are about as likely and move a value out of its interval.
    """
    noise, number = max(found.cost, 1.0) ** 2, Scale(problem.parameters).free
    here = _ahead(_longer(problem, taken), found.values)
    for times in _TIMES:
        there = _ahead(_longer(problem, times), found.values)
        moved = np.abs(there.step - here.step) / np.maximum(here.std, 1e-300) / np.sqrt(noise)
        most = int(np.argmax(moved))
        if there.squares - here.squares < 2 * CONVINCING * noise and moved[most] >= SIGMAS_95:
            name = problem.parameters[int(number[most])].name
            note = (
                f"the length of the records is not stated: {{:.4g}} s was assumed, but {times / taken:.3g}"
                f" times as long is about as likely and would move {name} by {moved[most]:.2g} standard"
                " deviations: state `record_s`"
            )
            problem = _noted(problem, note, taken)
            break
    return _longer(problem, taken)


def _assumed(one: Given) -> bool:
    """Whether the end of its records counts, and their length is only assumed."""
    return isinstance(one.data, FrfSet) and one.record is not None and one.data.record_s is None


def _longer(problem: Problem, times: int) -> Problem:
    """With records so many times as long, where their length is assumed."""

    def longer(one: Given) -> Given:
        if not _assumed(one) or one.record is None:
            return one
        record = times * one.record
        return replace(one, record=record, impact=one.impact and replace(one.impact, record=record))

    return with_given(problem, [longer(m.given) for m in problem.measurements])


def _held(problem: Problem) -> Problem:
    """With the pre-trigger as it is where longer records have died out, so that nothing moves it."""
    plan = fit_plan(problem)
    if PRE_TRIGGER not in unmoving(plan.parameters, plan.objective):
        return problem
    still = [
        effect.model_copy(update={"time": effect.time.model_copy(update={"fixed": True})})
        if isinstance(effect, PreTrigger)
        else effect
        for effect in problem.file.study.effects
    ]
    values = {p.name: float(p.initial) for p in problem.parameters}
    return with_effects(problem, still, values)


def _noted(problem: Problem, note: str, times: int) -> Problem:
    """With a note beside the first data whose records' length is assumed, with so many times that in it."""
    given = [m.given for m in problem.measurements]
    number = next(n for n, one in enumerate(given) if _assumed(one))
    first = given[number]
    assert isinstance(first.data, FrfSet)
    data = replace(first.data, notes=(*first.data.notes, note.format(times * (first.record or 0.0))))
    given[number] = replace(first, data=data)
    return with_given(problem, given)

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
from identify.core.parameters import Scale
from identify.core.thresholds import CONVINCING, MATERIAL, QUIET
from identify.fitting.fit import Fit, Progress, fit
from identify.measured.frf_set import FrfSet
from identify.vibration.costs.base import parse_cost
from identify.vibration.given import Given
from identify.vibration.plan import fit_plan
from identify.vibration.problem import Problem, with_given

_ORDINAL = {2: "second", 3: "third", 4: "fourth"}
"""Multiples of the shortest record that may have been, and which of its lines then stand."""
_MATTERS = 1.0
"""Standard deviations by which another length moves a value from which a reader is asked for it."""

Show = Callable[[int, int, str, int, float], None]


def with_records(problem: Problem, found: Fit, show: Show | None = None) -> tuple[Problem, Fit]:
    """The problem and its fit with the length of records that explains the data, where the one assumed does
    not do so as well; notes of the data say which was taken, or that another may be as right.
    """
    likely = problem.file.study.cost == parse_cost("frf-least-squares")
    if not likely or not any(map(_assumed, [m.given for m in problem.measurements])):
        return problem, found
    here, doubt = _ahead(problem, found.values), ""
    for times, word in _ORDINAL.items():
        other = _longer(problem, times)
        there = _ahead(other, found.values)
        if there.squares < here.squares:
            again = fit(fit_plan(other), Progress(show) if show else None)
            if again.cost <= QUIET and found.cost - again.cost >= MATERIAL:
                note = (
                    f"only every {word} line of records of {{:.4g}} s stands: were they no longer"
                    f" than one over their spacing, the gap would be {found.cost:.3g}, not {again.cost:.3g}"
                )
                return _noted(other, note), again
        doubt = doubt or _doubt(problem, found, here, there, times)
    return _noted(problem, doubt) if doubt else problem, found


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


def _doubt(problem: Problem, found: Fit, here: _Ahead, there: _Ahead, times: int) -> str:
    """A note where records so many times as long are about as likely and move a value; empty elsewhere."""
    noise = max(found.cost, 1.0) ** 2
    moved = np.abs(there.step - here.step) / np.maximum(here.std, 1e-300) / np.sqrt(noise)
    number = int(np.argmax(moved))
    if there.squares - here.squares >= 2 * CONVINCING * noise or not moved[number] >= _MATTERS:
        return ""
    name = problem.parameters[int(Scale(problem.parameters).free[number])].name
    return (
        f"the length of the records is not told: {{:.4g}} s was assumed, and {times} times as long is about"
        f" as likely but moves {name} by {moved[number]:.2g} of its standard deviations: give `record_s`"
    )


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


def _noted(problem: Problem, note: str) -> Problem:
    """With a note on the records of the data, with their length in it, beside the first of them."""
    given = [m.given for m in problem.measurements]
    number = next(n for n, one in enumerate(given) if _assumed(one))
    first = given[number]
    assert isinstance(first.data, FrfSet)
    data = replace(first.data, notes=(*first.data.notes, note.format(first.record)))
    given[number] = replace(first, data=data)
    return with_given(problem, given)

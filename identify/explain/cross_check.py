"""Every record judged by every other one: the effects that were found, fitted to one record alone, on
another.

Which effects there are was decided by all records to fit and to judge together; what a single pair says of
them shows what hangs on one record.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identify.explain.gain import record_gain
from identify.explain.regression import Fit, RegressionProblem, aligned, solve
from identify.explain.workbench import rms
from identify.results.explain import PairTable


def cross_check(
    fitted: RegressionProblem,
    judge: RegressionProblem,
    tests: Sequence[RegressionProblem],
    start: Fit,
    fit: Fit,
) -> PairTable:
    """A row for each pair of records: fitted to one that was there to fit or to judge, judged by any other.

    start: the fit of no effect; parameters inside the columns stay those of `fit`.
    """
    own = [*_single(fitted), *_single(judge)]
    others = [*own, *(one for test in tests for one in _single(test))]
    pairs = [(one, other) for one in own for other in others if other is not one]
    rows = [_judged(one, other, start, fit) for one, other in pairs]
    return PairTable(
        tuple(one.name for one, _ in pairs),
        tuple(other.name for _, other in pairs),
        tuple(effect.name for effect in fit.effects),
        np.array([row[0] for row in rows]),
        np.array([row[1] for row in rows]),
        np.array([row[2] for row in rows]).reshape(len(rows), len(fit.effects)),
    )


def _judged(
    one: RegressionProblem, other: RegressionProblem, start: Fit, fit: Fit
) -> tuple[list[float], list[float], list[float]]:
    """RMS on the other record before and after, per joint, and the part of its squares that each effect takes
    away as it was fitted: with it and without, all else the same, so that nothing else is blamed for its
    absence.
    """
    found = solve(one, fit.effects, fit.nonlinear, fit.weights)
    without = [found.replaced(effect, np.zeros(len(effect.coefficients))) for effect in fit.effects]
    shares = [record_gain(other, less, found, one).explained for less in without]
    return rms(other, start).tolist(), rms(other, aligned(other, found)).tolist(), shares


def _single(problem: RegressionProblem) -> list[RegressionProblem]:
    """The records of a problem, one by one: the others do not count."""
    if len(problem.scene.records) == 1:
        return [problem]
    found = []
    for name, record in zip(problem.scene.names, problem.scene.records, strict=True):
        mask = np.zeros_like(problem.mask)
        mask[record] = problem.mask[record]
        found.append(replace(problem, name=name, mask=mask, remembered={}, searched={}))
    return found

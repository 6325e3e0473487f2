"""What a fit says of nuisance parameters: how far each is off, what stands out, which statement was too
small, and how much of the uncertainty of each parameter they make.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import groupby

import numpy as np
import scipy

from identify.core.arrays import Array
from identify.core.text import listed
from identify.fitting.uncertainty import Uncertainty
from identify.results.fit import StatedUncertainty
from identify.vibration.nuisances.nuisance import Nuisance
from identify.vibration.nuisances.sentences import kind_of, sentence
from identify.vibration.problem import Problem

_HELD = (
    "The cost is no likelihood, so nuisance parameters were not fitted: the intervals carry them as far"
    " as they move its optimum."
)
_NOTABLE, _FEW = 0.01, 6
"""Chance below which an error stands out; how many are put in words at most."""
_TOO_SMALL, _SURE, _SEEN = 1.3, 0.001, 0.5
"""How many times larger than stated errors of a kind must be to be reported, the chance that they are not,
and of how many errors together the data must tell.
"""


def stated_uncertainty(problem: Problem, trusted: Uncertainty, values: Array) -> StatedUncertainty | None:
    """The table of a fit at values (unknowns,); None where nothing was stated."""
    entries, joint = problem.nuisances.entries, trusted.joint
    if joint is None:
        return None
    shift = values[problem.size :]
    kind = [kind_of(one) for one in entries]
    kinds = list(dict.fromkeys(kind))
    free = [number for number, p in enumerate(problem.of_effects) if p.free]
    parts = np.full((problem.size, len(kinds)), np.nan)
    for column, name in enumerate(kinds):
        own = np.array([one == name for one in kind])
        parts[free, column] = np.sum(joint.stated[:, own] ** 2, axis=1) / trusted.std**2
    found = (*_outstanding(entries, shift), *_too_small(entries, shift, joint.spread))
    return StatedUncertainty(
        kind=tuple(kind),
        place=tuple(one.place for one in entries),
        change=tuple(one.change for one in entries),
        unit=tuple(one.unit for one in entries),
        stated=np.array([one.std for one in entries]),
        shift=shift,
        spread=joint.spread,
        sentences=found if problem.file.study.cost.likelihood else (_HELD,),
        kinds=tuple(kinds),
        parts=parts,
        root=joint.root,
    )


def groups(entries: Sequence[Nuisance]) -> Iterator[list[int]]:
    """Numbers of the errors that belong together: of one kind at one place."""
    order = sorted(range(len(entries)), key=lambda n: (kind_of(entries[n]), entries[n].place, n))
    for _, group in groupby(order, key=lambda n: (kind_of(entries[n]), entries[n].place)):
        yield list(group)


def _outstanding(entries: Sequence[Nuisance], shift: Array) -> list[str]:
    """A sentence on the errors that are larger than chance lets the largest of so many be."""
    together = list(groups(entries))
    chances = [float(scipy.special.chdtrc(len(group), np.sum(shift[group] ** 2))) for group in together]
    order = np.argsort(chances)
    reasons = [
        sentence([entries[n] for n in together[g]], shift[together[g]])
        for g in order[:_FEW]
        if chances[g] < _NOTABLE
    ]
    return [f"The data say that {listed(reasons)}."] if reasons else []


def _too_small(entries: Sequence[Nuisance], shift: Array, spread: Array) -> Iterator[str]:
    """Sentences on kinds of errors that are larger than was stated."""
    kind = np.array([kind_of(one) for one in entries])
    for name in dict.fromkeys(kind.tolist()):
        own = kind == name
        ratio = times_as_large(shift[own], spread[own])
        if ratio > _TOO_SMALL:
            yield (
                f"Errors of {name} are {ratio:.1f} times as large as stated: the statement was too small, or"
                " something is missing from the model."
            )


def times_as_large(shift: Array, spread: Array) -> float:
    """How many times as large as stated some errors are, by what the data tell of them; 1 where that is not
    sure: shift (e,) of their values and spread (e,) that the fit left of them, in stated standard deviations.
    """
    squares, seen = float(np.sum(shift**2)), float(np.sum(np.maximum(1 - spread**2, 0.0)))
    if seen <= _SEEN or scipy.special.chdtrc(max(seen, 1.0), squares) >= _SURE:
        return 1.0
    return float(np.sqrt(squares / seen))

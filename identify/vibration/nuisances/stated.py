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
from identify.vibration.nuisances.nuisance import FORCE, Nuisance
from identify.vibration.problem import Problem

_HELD = (
    "The cost is no likelihood, so nuisance parameters were not fitted: their effect on the optimum is"
    " included in the intervals."
)
_NOTABLE, _FEW = 0.01, 6
"""Chance below which an error stands out; how many are put in words at most."""
_TOO_SMALL, _SURE, _SEEN = 1.3, 0.001, 0.5
"""How many times larger than stated errors of a kind must be to be reported, the chance that they are not,
and of how many errors together the data must tell.
"""
_KINDS = {
    "channel": "sensitivities",
    "impact": "directions of impacts",
    "joint": "joint angles",
    "kinematics": "places of joints",
    "set": "delays",
    "form": "forms of bending links",
    "impulse": "strengths of impacts",
}
_SINGLE = ("masses", "sensitivities", "delays", "strengths of impacts", "durations of impacts")


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


def kind_of(one: Nuisance) -> str:
    """What it is an error of, as a plural: what a measurement of its own would remove."""
    if one.group == "link":
        return {"mass": "masses", "centre": "centres of mass"}.get(one.change.split("_")[0], "inertias")
    if one.group == "point":
        return "directions of sensors" if one.change.startswith("r") else "places of points"
    return "durations of impacts" if one.change == "duration" else _KINDS[one.group]


def sentence(some: Sequence[Nuisance], shift: Array) -> str:
    """Errors of one kind at one place, in units of their standard deviations (n,), as part of a sentence."""
    first, amount = some[0], np.array([one.std for one in some]) * shift
    kind, place, beyond = kind_of(first), first.place, float(np.abs(shift).max())
    said = _single(kind, place, amount) if kind in _SINGLE else _several(kind, place, amount, some)
    return f"{said} ({beyond:.1f} times what was stated)"


def _single(kind: str, place: str, amount: Array) -> str:
    """What one number says."""
    more = bool(amount[0] > 0)
    if kind == "masses":
        return f"{place} is {_percent(amount[0])} {'heavier' if more else 'lighter'}"
    if kind == "sensitivities":
        name = "the force transducer" if place == FORCE else f"channel {place}"
        return f"{name} reads {_percent(amount[0])} too {'much' if more else 'little'}"
    if kind == "strengths of impacts":
        return f"impacts {place} were {_percent(amount[0])} {'stronger' if more else 'weaker'} than stated"
    if kind == "durations of impacts":
        return f"impacts were {_percent(amount[0])} {'longer' if more else 'shorter'} than stated"
    return f"responses of {place} are {1e6 * abs(amount[0]):.0f} µs {'late' if more else 'early'}"


def _several(kind: str, place: str, amount: Array, some: Sequence[Nuisance]) -> str:
    """What numbers along several axes say."""
    size, most = float(np.linalg.norm(amount)), float(np.abs(amount).max())
    along = f"({_along(some, 1e3 * amount)} mm)"
    return {
        "centres of mass": f"the centre of mass of {place} is {1e3 * size:.1f} mm off {along}",
        "inertias": f"the inertia of {place} is up to {_percent(most)} off",
        "places of points": f"point {place} is {1e3 * size:.1f} mm off its stated place {along}",
        "directions of sensors": f"sensor {place} is turned by {np.degrees(size):.1f}°",
        "directions of impacts": f"the impact {place} was turned by {np.degrees(size):.1f}°",
        "joint angles": f"the angles of {place} are up to {np.degrees(most):.2f}° off",
        "forms of bending links": f"{place} differs from a beam by up to {100 * most:.0f} %",
        "places of joints": f"{place} is {1e3 * size:.1f} mm off its stated place",
    }[kind]


def _percent(logarithm: float) -> str:
    return f"{100 * abs(np.expm1(logarithm)):.1f} %"


def _along(some: Sequence[Nuisance], amount: Array) -> str:
    return ", ".join(
        f"{one.change.split('_')[-1]} {value:+.1f}" for one, value in zip(some, amount, strict=True)
    )

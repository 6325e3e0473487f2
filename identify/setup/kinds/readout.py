"""What a file of FRFs says of itself: quantity, unit of frequencies, axes, which posture it is of."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations, permutations
from typing import Any

from identify.core.text import listed
from identify.measured.frf_set import POWER
from identify.setup.edits import Edit
from identify.setup.hypothesis import Hypothesis
from identify.setup.score import Score
from identify.setup.stated import Stated

_WHAT = {"receptance": "displacements", "mobility": "velocities", "accelerance": "accelerations"}
_FEW = 4
"""Postures up to which every order of them is tried; of more, exchanges of two."""


def correct(stated: Stated, key: str, value: Any) -> tuple[Edit, ...]:
    """The same correction of every measurement."""
    numbers = range(len(stated.study.measurements))
    return tuple(Edit(("measurements", number, "correct", key), value) for number in numbers)


def quantity(stated: Stated, plain: Score) -> Iterator[Hypothesis]:
    """Displacements or velocities under the name of accelerations, and the like."""
    now = plain.problem.targets().frf[0].data.quantity
    for other in POWER:
        if other != now:
            sentence = f"the responses are {_WHAT[other]}, not {_WHAT[now]}"
            yield Hypothesis("quantity", sentence, correct(stated, "quantity", other), "quantity")


def inverse(stated: Stated, plain: Score) -> Iterator[Hypothesis]:
    """Forces over responses."""
    if not any(one.correct.inverse for one in stated.measured):
        sentence = "each FRF is force over response, 1/H, not response over force"
        yield Hypothesis("inverse", sentence, correct(stated, "inverse", True), "inverse")


def radians_per_second(stated: Stated, plain: Score) -> Iterator[Hypothesis]:
    """Frequencies in rad/s."""
    if all(one.correct.frequency == "Hz" for one in stated.measured):
        edits = correct(stated, "frequency", "rad/s")
        yield Hypothesis("frequency", "the frequencies are in rad/s, not in Hz", edits, "frequency")


def base_axes(stated: Stated, plain: Score) -> Iterator[Hypothesis]:
    """Sensors along the axes of the room."""
    if all(one.correct.axes == "link" for one in stated.measured):
        sentence = "the channels are along the axes of the base, not along those of the points' links"
        yield Hypothesis("axes", sentence, correct(stated, "axes", "base"), "axes")


def postures(stated: Stated, plain: Score) -> Iterator[Hypothesis]:
    """Files that belong to each other's postures."""
    told = [one.posture_deg for one in stated.study.measurements]
    distinct = [n for n, one in enumerate(told) if one not in told[:n]]
    orders = permutations(range(len(distinct))) if len(distinct) <= _FEW else _exchanges(len(distinct))
    for order in orders:
        moved = [n for n, other in enumerate(order) if n != other]
        if not moved:
            continue
        new = {tuple(told[distinct[n]]): told[distinct[order[n]]] for n in range(len(distinct))}
        edits = [
            Edit(("measurements", n, "posture_deg"), new[tuple(one)])
            for n, one in enumerate(told)
            if new[tuple(one)] != one
        ]
        names = [stated.study.measurements[distinct[n]].source.name for n in moved]
        others = [stated.study.measurements[distinct[order[n]]].source.name for n in moved]
        sentence = f"the postures of {listed(names)} are mixed up: they are those of {listed(others)}"
        yield Hypothesis("postures", sentence, tuple(edits), "postures")


def _exchanges(count: int) -> Iterator[tuple[int, ...]]:
    """Orders with two exchanged."""
    for one, other in combinations(range(count), 2):
        order = list(range(count))
        order[one], order[other] = other, one
        yield tuple(order)

"""Where model and measurement disagree: the gap by posture, band, channel, point, direction and mode, in
numbers and in words.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from identify.core.arrays import Array
from identify.core.thresholds import QUIET
from identify.model.modes import complex_modes
from identify.results.discovery import GapByBand
from identify.robot.points import Point
from identify.vibration.costs.target import FrfTarget
from identify.vibration.problem import Problem

_BANDS = 12
_CONCENTRATED = 0.5
"""A part of the data that has this share of what is above noise is named in words."""


@dataclass(frozen=True)
class Part:
    """One part of the data: what it is one of (`band`, `point`, ...), its name, its gap, its share of all
    that is above noise, and the frequency of a band's lower end or a mode, NaN of others.
    """

    kind: str
    name: str
    gap: float
    share: float
    frequency_hz: float = np.nan


def band_limits(problem: Problem) -> Array:
    """(bands + 1,), Hz: limits of bands of equal width on a logarithmic axis over all FRFs."""
    frequencies = np.concatenate([target.data.frequency_hz for target in _targets(problem)])
    return np.geomspace(frequencies.min(), frequencies.max() * (1 + 1e-9), _BANDS + 1)


def gap_map(problem: Problem, values: Array, bands: Array) -> GapByBand:
    """The gap by band and response channel for each FRF measurement."""
    targets = _targets(problem)
    names = tuple(
        sorted({channel_name(problem.points, output) for t in targets for output in t.data.outputs})
    )
    gap = np.full((len(targets), len(bands) - 1, len(names)), np.nan)
    for row, target in enumerate(targets):
        squares, outputs = _squares(target, values), target.pairs[0]
        own = np.array([channel_name(problem.points, target.data.outputs[output]) for output in outputs])
        for band, lines in enumerate(_lines(target, bands)):
            for name in np.unique(own) if lines.any() else ():
                gap[row, band, names.index(name)] = np.sqrt(squares[np.ix_(lines, own == name)].mean())
    return GapByBand(tuple(t.name for t in targets), bands, names, gap)


def parts(problem: Problem, values: Array, bands: Array) -> list[Part]:
    """The gap of the fitted data by measurement, band, point, direction, force and mode, largest share first
    within each kind.
    """
    fitted = [t for t, m in zip(_targets(problem), _measurements(problem), strict=True) if m == "fit"]
    squares = [_squares(target, values) for target in fitted]
    whole = max(sum(float((s - 1).sum()) for s in squares), 1e-12)
    found: list[Part] = []

    def add(kind: str, name: str, chosen: Sequence[Array], hz: float = np.nan) -> None:
        count = sum(part.size for part in chosen)
        if count:
            total = sum(float(part.sum()) for part in chosen)
            found.append(Part(kind, name, float(np.sqrt(total / count)), (total - count) / whole, hz))

    for target, own in zip(fitted, squares, strict=True):
        add("measurement", target.name, [own])
    for band, (low, high) in enumerate(pairwise(bands)):
        add(
            "band",
            f"{low:.3g} to {high:.3g} Hz",
            [s[_lines(t, bands)[band]] for t, s in zip(fitted, squares, strict=True)],
            float(low),
        )
    for kind, label in (("point", _point_of), ("direction", _direction_of), ("force", _force_of)):
        names = {label(problem, t, pair) for t in fitted for pair in range(len(t.pairs[0]))}
        for name in names:
            chosen = [[label(problem, t, pair) == name for pair in range(len(t.pairs[0]))] for t in fitted]
            add(kind, name, [s[:, pick] for s, pick in zip(squares, chosen, strict=True)])
    for frequency, half in _modes(fitted, values):
        near = [np.abs(t.data.frequency_hz - frequency) <= half for t in fitted]
        there = [s[pick] for s, pick in zip(squares, near, strict=True)]
        add("mode", f"{frequency:.1f} Hz", there, float(frequency))
    return sorted(found, key=lambda part: -part.share)


def in_words(found: list[Part], gap: float) -> str:
    """One sentence: how large the gap is and in which parts of the data most of it lives."""
    if gap <= QUIET:
        return f"The residual is {gap:.2f} times the noise: nothing stands out."
    said = []
    for kind, text in (
        ("band", "at {}"),
        ("point", "at point {}"),
        ("direction", "along {}"),
        ("measurement", "in {}"),
    ):
        rows = [part for part in found if part.kind == kind]
        if len(rows) < 2:
            continue
        even = 1 / len(rows)
        taken, share = [], 0.0
        for part in rows:
            taken.append(part.name)
            share += part.share
            if share >= _CONCENTRATED:
                break
        if len(taken) <= 3 and share > 1.5 * even * len(taken):
            said.append(f"{min(share, 1):.0%} of it {text.format(' and '.join(taken))}")
    where = "; ".join(said) if said else "spread evenly over bands, points, directions and measurements"
    return f"The residual is {gap:.2f} times the noise, {where}."


def channel_name(points: dict[int, Point], channel: object) -> str:
    """A channel with the name of its point instead of its node number."""
    node, axis = str(channel).split(":")
    known = node.isdigit() and int(node) in points
    return f"{points[int(node)].name if known else node}:{axis}"


def _targets(problem: Problem) -> list[FrfTarget]:
    return [m.target for m in problem.measurements if isinstance(m.target, FrfTarget)]


def _measurements(problem: Problem) -> list[str]:
    return [m.settings.use for m in problem.measurements if isinstance(m.target, FrfTarget)]


def _squares(target: FrfTarget, values: Array) -> Array:
    """(lines, pairs): mean of the squares of real and imaginary part of the residual over noise; 1 is
    noise.
    """
    return np.asarray(np.abs((target.predict_pairs(values) - target.measured) / target.sigma) ** 2 / 2)


def _lines(target: FrfTarget, bands: Array) -> list[NDArray[np.bool_]]:
    number = np.digitize(target.data.frequency_hz, bands) - 1
    return [number == band for band in range(len(bands) - 1)]


def _point_of(problem: Problem, target: FrfTarget, pair: int) -> str:
    return channel_name(problem.points, target.data.outputs[target.pairs[0][pair]]).split(":")[0]


def _direction_of(problem: Problem, target: FrfTarget, pair: int) -> str:
    return str(target.data.outputs[target.pairs[0][pair]]).split(":")[1].lstrip("+-")


def _force_of(problem: Problem, target: FrfTarget, pair: int) -> str:
    return channel_name(problem.points, target.data.inputs[target.pairs[1][pair]])


def _modes(fitted: list[FrfTarget], values: Array) -> list[tuple[float, float]]:
    """Frequency and half width, Hz, of the model's modes within the band, at the first posture."""
    first, own = fitted[0].at(values)
    modes = complex_modes(*first.system.matrices(own))
    inside = (modes.frequency_hz > first.data.frequency_hz[0]) & (
        modes.frequency_hz < first.data.frequency_hz[-1]
    )
    width = np.maximum(
        2 * modes.damping_ratio * modes.frequency_hz, np.diff(first.data.frequency_hz).min(initial=1.0) * 2
    )
    return list(zip(modes.frequency_hz[inside].tolist(), width[inside].tolist(), strict=True))

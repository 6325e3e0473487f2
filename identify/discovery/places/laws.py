"""Which simple law a measured dynamic stiffness follows, on each coordinate of its place alike: chosen by
evidence from what the data say of the unknowns of all lines together.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from identify.core.arrays import Array, Complex
from identify.discovery.places.law import Whitened, fit_law
from identify.discovery.places.semiparametric import COMMON, SemiParametricFit

_SPAN = 12.0
"""Natural logarithm of how far values may be from where they start."""
_AROUND = (0.25, 0.5, 1.0, 1.5)
"""Resonances that are tried, over the middle of the band, and delays, over a radian there."""
_EVALUATIONS = 24
"""Steps of each law from its best starts: a curve has few numbers."""


@dataclass(frozen=True)
class Law:
    """A dynamic stiffness with parameters on a logarithmic scale.

    of: (s (l,), values (q,)) -> (l,); start: values (n, q) from a stiffness, a damping at w rad/s, at several
    frequencies or delays where one start may be in a wrong valley, or (q,).
    """

    name: str
    count: int
    of: Callable[[Complex, Array], Complex]
    start: Callable[[float, float, float], Array]


@dataclass(frozen=True)
class Ranked:
    """A law at a place: gap that it leaves, log odds for it over the best of the others (the best) or over
    the best (all others), values by coordinate (d, q).
    """

    law: Law
    gap: float
    log_odds: float
    values: Array


def _maxwell(s: Complex, v: Array) -> Complex:
    return np.asarray(v[0] + s * v[2] * v[1] / (v[1] + s * v[2]))


def _sum(one: Law, other: Law) -> Law:
    """Both side by side, the second one at first a third of the first."""

    def start(k: float, h: float, w: float) -> Array:
        starts = np.atleast_2d(one.start(k, h, w)), np.atleast_2d(other.start(k / 3, h / 3, w))
        return np.array([np.concatenate([a, b]) for a in starts[0] for b in starts[1]])

    return Law(
        f"{one.name}, with {other.name}",
        one.count + other.count,
        lambda s, v: one.of(s, v[: one.count]) + other.of(s, v[one.count :]),
        start,
    )


_SINGLE = (
    Law("spring k", 1, lambda s, v: v[0] + 0 * s, lambda k, h, w: np.array([k])),
    Law("spring and damper k + s c", 2, lambda s, v: v[0] + s * v[1], lambda k, h, w: np.array([k, h / w])),
    Law(
        "hysteretic spring k (1 + j eta)",
        2,
        lambda s, v: v[0] * (1 + 1j * v[1]) + 0 * s,
        lambda k, h, w: np.array([k, h / k]),
    ),
    Law("mass m s^2", 1, lambda s, v: v[0] * s**2, lambda k, h, w: np.array([k / w**2])),
    Law(
        "spring, damper and mass k + s c + m s^2",
        3,
        lambda s, v: v[0] + s * v[1] + v[2] * s**2,
        lambda k, h, w: np.array([k, h / w, 0.1 * k / w**2]),
    ),
    Law(
        "body on a spring and damper",
        3,
        lambda s, v: v[2] * s**2 * (v[0] + s * v[1]) / (v[0] + s * v[1] + v[2] * s**2),
        lambda k, h, w: np.array([[k, 0.1 * k / w, k / (r * w) ** 2] for r in _AROUND]),
    ),
    Law(
        "spring with one relaxation time",
        3,
        _maxwell,
        lambda k, h, w: np.array([k, max(2 * h, 0.1 * k), max(2 * h, 0.1 * k) / w]),
    ),
    Law(
        "spring and fractional damper k + c s^a",
        3,
        lambda s, v: v[0] + v[1] * s ** np.clip(v[2], 0.0, 1.0),
        lambda k, h, w: np.array([k, h / w**0.5, 0.5]),
    ),
    Law(
        "spring that acts late k e^(-s tau)",
        2,
        lambda s, v: v[0] * np.exp(-s * v[1]),
        lambda k, h, w: np.array([[k, h / (k * w)], *([k, r / w] for r in _AROUND)]),
    ),
)
_DAMPER, _HYSTERETIC, _MASS, _BODY, _RELAXING, _LATE = (_SINGLE[n] for n in (1, 2, 3, 5, 6, 8))
_SUMS = ((_HYSTERETIC, _MASS), (_RELAXING, _MASS), (_DAMPER, _BODY), (_DAMPER, _LATE))
LAWS = (*_SINGLE, *(_sum(one, other) for one, other in _SUMS))
"""Each on every coordinate of the place."""


def rank_laws(fit: SemiParametricFit, stiffness: Complex, s: Complex, sign: float) -> list[Ranked]:
    """All laws, likeliest first, for a measured dynamic stiffness (l, d, d) at s (l,).

    Two coordinates are also coupled by a spring and a damper: the directions in which they give way most and
    least may lie between them.
    """
    whitened, size = Whitened(fit, sign), stiffness.shape[-1]
    middle = float(np.median(s.imag))
    starts = [_typical(stiffness[:, i, i]) for i in range(size)]
    coupled = np.sqrt(np.prod(starts, axis=0)) / (1.0, middle) if size == 2 else np.zeros(0)
    count = max(fit.count - fit.unknowns, 1)
    found = []
    for law in LAWS:
        each = [np.atleast_2d(law.start(k, h, middle)) for k, h in starts]
        first = np.log(np.maximum(np.concatenate(each, axis=1), 1e-12))
        first = np.hstack([first, np.zeros((len(first), len(coupled)))])
        lower, upper = first.min(axis=0) - _SPAN, first.max(axis=0) + _SPAN
        own = law.count * size

        def of(x: Array, law: Law = law, own: int = own) -> Complex:
            result = _diagonal([law.of(s, v) for v in np.exp(x[:own]).reshape(size, law.count)])
            if len(coupled):
                k, c = coupled * x[own:]
                result[:, 0, 1] = result[:, 1, 0] = k + s * c
            return result

        end = fit_law(whitened, of, first, lower, upper, _EVALUATIONS)
        squares = fit.squares + end.squares
        score = squares / COMMON + own * np.log(count / COMMON)
        values = np.exp(end.values[:own]).reshape(size, -1)
        found.append((score, law, np.sqrt(squares / fit.count), values))
    found.sort(key=lambda one: one[0])
    best, second = found[0][0], found[1][0]
    return [
        Ranked(law, float(gap), float((second - best if n == 0 else best - score) / 2), values)
        for n, (score, law, gap, values) in enumerate(found)
    ]


def _typical(entry: Complex) -> tuple[float, float]:
    """Sizes of the real and the imaginary part."""
    finite = entry[np.isfinite(entry)]
    if not len(finite):
        return 1.0, 1.0
    real, imaginary = np.median(np.abs(finite.real)), np.median(np.abs(finite.imag))
    return float(real) + 1e-12, float(imaginary) + 1e-12


def _diagonal(entries: list[Complex]) -> Complex:
    matrix = np.zeros((len(entries[0]), len(entries), len(entries)), dtype=complex)
    for number, entry in enumerate(entries):
        matrix[:, number, number] = entry
    return matrix

"""The exact depth limit beside one that another method found, and how it moves with the tip's receptance.

At a limit a and a frequency f, the loop of `multi_frequency` has an eigenvalue 1/a:

    mu(f, a) = a lambda(f) = 1,   L(f) v = lambda v,   l' L = lambda l',   l' v = 1,

two real equations for f and a, solved by Newton's method.  A change dH_r of the receptance at the harmonic r
changes mu by a delay sum_r l_r' dH_r (W v)_r, and so f and a by the same two equations, linearised: exact,
and without another solution of the eigenvalue problem.  One harmonic is the solution of zeroth order; without
the delay it is the limit of mode coupling.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from identify.core.arrays import Array, Complex, Index
from identify.machining.engagement import Engagement

Receptance = Callable[[Array], Complex]
"""(lines,) Hz, of any sign, to (lines, 3, 3), m/N."""
_STEPS, _CLOSE, _FAR = 30, 1e-8, 0.3
_STEP, _LEAST = 1e-6, 0.1
"""Steps of frequency and depth for slopes, in units; least unit of frequency, in that of the teeth."""


@dataclass(frozen=True)
class ExactLimit:
    """A depth, m, a frequency, Hz, and what they follow: lines_hz (r,), of any sign; slope (r, 3, 3), so that
    a small change dH (r, 3, 3) of the tip's receptance changes the depth by Re sum(slope dH).

    strongest_hz: the harmonic at which the tip moves most, which is heard.
    """

    depth: float
    chatter_hz: float
    lines_hz: Array
    slope: Complex
    strongest_hz: float


@dataclass(frozen=True)
class Loop:
    """A cut on a tip; base_hz: how often it repeats in a second, which teeth at even angles do with each
    tooth; orders (r,): harmonics that take part; delayed: whether a tooth cuts what the last one left.
    """

    cut: Engagement
    tip: Receptance
    base_hz: float
    orders: Index
    delayed: bool = True

    def nearest(self, hz: float, depth: float) -> tuple[complex, Complex, Complex, Complex]:
        """The eigenvalue mu nearest to 1, its left vector times the depth (r, 3), W v (r, 3), delays and
        all, and v (r, used).
        """
        factors, used = self._factors(hz, depth)
        tip = self.tip(self.lines(hz))
        count, kept = len(self.orders), len(used)
        loop = tip[:, used] @ factors.reshape(count, 3, count * kept)
        values, vectors = np.linalg.eig(depth * loop.reshape(count * kept, count * kept))
        at = int(np.argmin(np.abs(values - 1)))
        left = np.linalg.solve(vectors.T, np.eye(len(values))[at])  # l' v = 1
        pushed = (factors.reshape(3 * count, -1) @ vectors[:, at]).reshape(count, 3)
        whole = np.zeros((count, 3), dtype=complex)
        whole[:, used] = depth * left.reshape(count, kept)
        return complex(values[at]), whole, pushed, vectors[:, at].reshape(count, kept)

    def lines(self, hz: float) -> Array:
        """(r,), Hz."""
        return np.asarray(hz + self.orders * self.base_hz, dtype=float)

    @cached_property
    def _harmonics(self) -> Complex:
        """W_{p-r} (r, r, 3, 3)."""
        apart = self.orders[:, None] - self.orders
        return np.asarray(self.cut.harmonics(np.arange(apart.min(), apart.max() + 1))[apart - apart.min()])

    def _factors(self, hz: float, depth: float) -> tuple[Complex, Index]:
        """The same with helix and delays (r, 3, r, used), and the axes along which chips are cut."""
        used = np.flatnonzero(np.abs(self._harmonics).sum(axis=(0, 1, 2)) > 0)
        lag = self.cut.along_helix(self.orders[:, None] - self.orders, depth)
        if self.delayed:
            lag = lag * self.cut.regenerated(self.orders, np.array(hz / self.base_hz))
        found = lag[..., None, None] * self._harmonics[..., used]
        return np.swapaxes(found, 1, 2), used

    def solved(self, hz: float, depth: float) -> ExactLimit | None:
        """The limit by Newton's method, with the slopes of its start, from a frequency and depth near it;
        None where it leads away.
        """
        unit = np.array([max(abs(hz), _LEAST * self.base_hz), depth])
        at = np.array([hz, depth])
        back = np.linalg.pinv(self._slopes(at, unit), rcond=1e-14)
        for _ in range(_STEPS):
            move = -back @ _parts(self.nearest(*at)[0] - 1)
            at = at + move * unit
            if not np.all(np.abs(at - (hz, depth)) < _FAR * unit):
                return None
            if np.abs(move).max() < _CLOSE:
                return self._found(at, unit)
        return None

    def _slopes(self, at: Array, unit: Array) -> Array:
        """Derivatives of mu (2, 2), by frequency and depth in units."""
        mu, moved = self.nearest(*at)[0], at + _STEP * np.diag(unit)
        return np.stack([_parts((self.nearest(*one)[0] - mu) / _STEP) for one in moved], axis=1)

    def _found(self, at: Array, unit: Array) -> ExactLimit:
        hz, depth = map(float, at)
        _, left, pushed, moves = self.nearest(hz, depth)
        slopes = self._slopes(at, unit)
        back = -np.linalg.pinv(slopes, rcond=1e-14)[1] * unit[1]  # of Re and Im of a change of mu
        slope = (back[0] - 1j * back[1]) * left[:, :, None] * pushed[:, None, :]
        lines = self.lines(hz)
        strongest = abs(float(lines[np.argmax(np.linalg.norm(moves, axis=1))]))
        return ExactLimit(depth, abs(hz), lines, slope, strongest)


def _parts(value: complex) -> Array:
    return np.array([value.real, value.imag])


def exact_limit(
    cut: Engagement,
    tip: Receptance,
    highest_hz: float,
    rpm: float,
    near: tuple[float, float],
    quick: bool = False,
) -> ExactLimit | None:
    """The limit at a spindle speed beside a depth, m, and the frequency of its chatter, Hz; None where there
    is none.  highest_hz: the highest frequency that matters; quick: without a look at more harmonics.
    """
    depth, hz = near
    few, many = _loops(cut, tip, highest_hz, rpm)
    found = few.solved(_folded(hz, few.base_hz), depth)
    if found is not None and not quick:
        found = many.solved(found.chatter_hz, found.depth)
    return found and replace(found, chatter_hz=_unfolded(found, hz, few.base_hz))


def _loops(cut: Engagement, tip: Receptance, highest_hz: float, rpm: float) -> tuple[Loop, Loop]:
    """With harmonics that are enough for a part in a thousand, and with twice as many.

    There are as many above half of the tooth frequency as below: there the eigenvalues of a flip are real.
    """
    base_hz = cut.repeats * rpm / 60
    most = int(np.ceil(highest_hz / base_hz)) + 3 * cut.teeth // cut.repeats
    few, many = (Loop(cut, tip, base_hz, np.arange(-n - 1, n + 1)) for n in (most, 2 * most))
    return few, many


def _folded(hz: float, base_hz: float) -> float:
    """Distance from the nearest harmonic of the cut."""
    return abs(hz - round(hz / base_hz) * base_hz)


def _unfolded(found: ExactLimit, hz: float, base_hz: float) -> float:
    """The frequency of a limit beside hz, where it was found folded."""
    nearest = round(hz / base_hz) * base_hz
    return float(nearest + np.copysign(found.chatter_hz, hz - nearest))


def exact_coupling(cut: Engagement, tip: Receptance, near: tuple[float, float]) -> ExactLimit | None:
    """The limit of mode coupling beside a depth, m, and its frequency, Hz."""
    return Loop(cut, tip, 1.0, np.zeros(1, dtype=int), delayed=False).solved(near[1], near[0])

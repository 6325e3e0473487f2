"""Stability of milling in the time domain: semi-discretisation.

The coefficients of M q'' + C q' + K q = S' a W(t) (S q(t) - S q(t - T)) are periodic with the tooth period T.
Over each of m equal steps, W is its mean over the step and the delayed displacement a straight line between
its two ends, so that the motion over the step is known exactly; the product over a period is a matrix whose
eigenvalues lie within the unit circle where the cut is stable (Insperger and Stepan 2004, Int. J. Numer.
Meth. Eng. 61; of first order, Insperger, Stepan and Turi 2008, J. Sound Vib. 313).
No part of `lobes` is used.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from identify.core.arrays import Array, Index
from identify.core.interruption import check
from identify.machining.engagement import Engagement
from identify.machining.structure import Structure

_STEPS_PER_WAVE = 24
_LEAST_STEPS, _MOST_STEPS = 48, 120
_COARSER = 3
_FINER, _CLOSE = 1.2, 1e-4


@dataclass(frozen=True)
class TimeDomain:
    """A tool on its structure; highest_hz: the highest frequency that matters, which sets the step; coarse:
    of a third of the steps, which finds the limit within some parts in a hundred.
    """

    structure: Structure
    cut: Engagement
    highest_hz: float
    coarse: bool = False

    def multiplier(self, rpm: float, depth: float, steps: int = 0) -> float:
        """Largest size of the eigenvalues over a tooth period at a spindle speed and a depth, m; above 1 the
        cut is unstable.
        """
        return float(np.abs(np.linalg.eigvals(self._over_a_period(rpm, depth, steps)[0])).max())

    def chatter_hz(self, rpm: float, depth: float) -> float:
        """The frequency that is strongest in the tip's motion as the cut becomes unstable."""
        whole, kept = self._over_a_period(rpm, depth, 0)
        values, vectors = np.linalg.eig(whole)
        most = int(np.argmax(np.abs(values)))
        tip = vectors[2 * len(self.structure.mass) :, most].reshape(-1, kept)[::-1]
        count, tooth_hz = len(tip), self.cut.teeth * rpm / 60
        turn = np.log(values[most]) / count
        periodic = tip * np.exp(-turn * np.arange(count))[:, None]
        power = np.abs(np.fft.fft(periodic, axis=0)) ** 2
        order = np.fft.fftfreq(count, 1 / count)[int(np.argmax(power.sum(axis=1)))]
        return float(abs(np.angle(values[most]) / (2 * np.pi) + order) * tooth_hz)

    def limit(self, rpm: float, near: float, most: float) -> float:
        """The least depth, m, at a spindle speed where the cut becomes unstable, inf where it is stable up to
        `most`; near: where it may be, to begin well below it.
        """
        low, high = 0.0, min(0.4 * near, most)
        while self.multiplier(rpm, high) <= 1.0:
            check()
            if high >= most:
                return np.inf
            low, high = high, min(_FINER * high, most)
        close = 100 * _CLOSE if self.coarse else _CLOSE
        return float(
            scipy.optimize.brentq(lambda depth: self.multiplier(rpm, depth) - 1.0, low, high, rtol=close)
        )

    def _over_a_period(self, rpm: float, depth: float, steps: int) -> tuple[Array, int]:
        """What a tooth period does to state and past displacements, newest first, and how many of the axes
        have a past that matters.
        """
        period = 60.0 / (self.cut.teeth * rpm)
        count = steps or int(np.clip(_STEPS_PER_WAVE * self.highest_hz * period, _LEAST_STEPS, _MOST_STEPS))
        if self.coarse and not steps:
            count //= _COARSER
        factors = depth * self.cut.steps(count, depth)
        used = np.flatnonzero(np.any(factors, axis=(0, 1)))
        return _product(self.structure, factors, used, period / count), len(used)


def _product(structure: Structure, factors: Array, used: Index, step: float) -> Array:
    """The product over a period; factors (m, 3, 3), N/m; used: axes whose past displacement matters."""
    size, count, kept = len(structure.mass), len(factors), len(used)
    moves, drives = _steps(structure, factors, used, step)
    out = np.hstack([structure.out[used], np.zeros((kept, size))])
    whole = 2 * size + kept * count
    state = np.eye(2 * size, whole)
    past = [np.eye(kept, whole, 2 * size + kept * k) for k in reversed(range(count))]  # the oldest first
    for number in range(count):
        past.append(out @ state)
        delayed = np.vstack([past[number], past[number + 1] - past[number]])
        state = moves[number] @ state + drives[number] @ delayed
    return np.vstack([state, *reversed(past[count:])])


def _steps(structure: Structure, factors: Array, used: Index, step: float) -> tuple[Array, Array]:
    """Over each step, what becomes of the state (m, 2n, 2n), and what the delayed displacement at its begin
    and the change of that over it add (m, 2n, 2 used).
    """
    size, kept = len(structure.mass), len(used)
    inverse = np.linalg.inv(structure.mass)
    push = inverse @ structure.out.T @ factors  # (m, n, 3)
    whole = 2 * (size + kept)
    rates = np.zeros((len(factors), whole, whole))
    rates[:, :size, size : 2 * size] = np.eye(size)
    rates[:, size : 2 * size, :size] = push @ structure.out - inverse @ structure.stiffness
    rates[:, size : 2 * size, size : 2 * size] = -inverse @ structure.damping
    rates[:, size : 2 * size, 2 * size : 2 * size + kept] = -push[:, :, used]
    rates[:, 2 * size : 2 * size + kept, 2 * size + kept :] = np.eye(kept) / step
    _, first, back = np.unique(
        factors.reshape(len(factors), -1), axis=0, return_index=True, return_inverse=True
    )
    grown = scipy.linalg.expm(step * rates[first])[np.ravel(back)]
    return grown[:, : 2 * size, : 2 * size], grown[:, : 2 * size, 2 * size :]

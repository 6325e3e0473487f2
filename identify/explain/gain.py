"""How much a fit gains over another on a record that neither was fitted to."""

from __future__ import annotations

import numpy as np

from identify.core.correlated import effective_samples, log_likelihood_gain, mean_above_zero
from identify.explain.regression import Fit, RegressionProblem, aligned, strain
from identify.fitting.selection.gain import Gain

_TOUCH = 1e-6
"""Fraction of its residual by which a joint must change to count as touched."""
_MOVED = 0.03
"""The same where errors of bodies are fitted along, which an effect at one joint moves a little at all."""
_CHANCE = 0.05
"""Chance of no mean gain from which on a gain is not confirmed: it is not spread over the record."""


def record_gain(problem: RegressionProblem, before: Fit, after: Fit) -> Gain:
    """The gain of `after` over `before` on a record that neither was fitted to.

    Log odds are the natural logarithm of the likelihood ratio of correlated residuals; explained are the
    parts of each joint's sum of squares that go, and their sum; the chance that the mean gain is none comes
    from blocks.  Parameters need no price of their own; a phase that is turned to the record's own beginning
    does (Schwarz 1978).
    """
    old, new = aligned(problem, before).residual(problem), aligned(problem, after).residual(problem)
    size = np.abs(old).max(axis=0)
    touch = _TOUCH if problem.bodies is None else _MOVED
    touched = [
        joint
        for joint in range(old.shape[1])
        if np.abs(old - new)[:, joint].max() > touch * size[joint] and problem.mask[:, joint].any()
    ]
    log_odds, parts, gain = 0.0, np.full(old.shape[1], np.nan), np.zeros(len(old))
    for joint in touched:
        mask = problem.mask[:, joint]
        one, other = float((old[:, joint] ** 2).sum()), float((new[:, joint] ** 2).sum())
        parts[joint] = 1 - other / one
        more, fall = log_likelihood_gain(old[:, joint], new[:, joint], mask)
        log_odds += more
        gain += fall
    chance = 1.0
    if touched:
        if problem.scene.relative:
            turned = sum(e.harmonic for e in after.effects) - sum(e.harmonic for e in before.effects)
            log_odds -= turned / 2 * np.log(problem.mask[:, touched].sum())
        chance = mean_above_zero(gain[problem.mask[:, touched].any(axis=1)])
    relief, part = _relief(problem, before, after)
    explained = float(np.nansum(parts)) + part
    return Gain(float(log_odds) + relief, explained, chance < _CHANCE, True, parts, chance)


def _relief(problem: RegressionProblem, before: Fit, after: Fit) -> tuple[float, float]:
    """Gain in log odds of coefficients that are nearer to what was expected of them, and its part of what
    residuals and coefficients have to explain together.
    """
    first, last = (float((strain(problem, fit) ** 2).sum()) for fit in (before, after))
    if first == last:
        return 0.0, 0.0
    residual = before.residual(problem)
    samples = sum(
        effective_samples(residual[:, joint], problem.mask[:, joint]) for joint in range(residual.shape[1])
    )
    return (first - last) / 2, (first - last) / (samples + max(first, last))

"""How much a fit gains over another on a record that neither was fitted to."""

from __future__ import annotations

import numpy as np

from identify.core.arrays import Array
from identify.core.correlated import effective_samples, log_likelihood_gain, mean_above_zero
from identify.explain.regression import Fit, RegressionProblem, aligned, strain, summed
from identify.fitting.selection.gain import Gain

_TOUCH = 1e-6
"""Fraction of its residual by which a joint must change to count as touched."""
_MOVED = 0.03
"""The same where errors of bodies are fitted along, which an effect at one joint moves a little at all."""
_ENOUGH = 0.1
"""Part of the moving samples below which a direction of motion is not asked."""
_CHANCE = 0.05
"""Chance of no mean gain from which on a gain is not confirmed: it is not spread over the record."""


def record_gain(
    problem: RegressionProblem, before: Fit, after: Fit, fitted: RegressionProblem | None = None
) -> Gain:
    """The gain of `after` over `before` on a record that neither was fitted to.

    fitted: the record that they were fitted to, which knows errors of bodies only so far: on the other one
    they may be what suits it, at a price, for either fit (see `_with_own_bodies`), so that what they may do
    is nobody's gain.

    Log odds are the natural logarithm of the likelihood ratio of correlated residuals; explained are the
    parts of each joint's sum of squares that go, and their sum; the chance that the mean gain is none comes
    from blocks.  Parameters need no price of their own; a phase that is turned to the record's own beginning
    does (Schwarz 1978).
    """
    (old, price), (new, other_price) = (_left(problem, fit, fitted) for fit in (before, after))
    old, new = _of_springs(problem, (before, old), (after, new))
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
    return Gain(
        float(log_odds) + price - other_price + relief, explained, chance < _CHANCE, True, parts, chance
    )


def _of_springs(
    problem: RegressionProblem, before: tuple[Fit, Array], after: tuple[Fit, Array]
) -> tuple[Array, Array]:
    """What two fits leave (samples, joints), as torque at joints where both have a spring.

    The errors there are those of the torque (`identify.explain.effects.joint_stiffness`), and a compliance
    carries them into the deflection: a stiffer spring leaves less of the same errors, which is no gain.
    """
    sizes = [np.ones(left.shape[1]) for _, left in (before, after)]
    for row, axis in enumerate(problem.scene.axes):
        springs = [_spring(problem, fit, axis) for fit, _ in (before, after)]
        if None not in springs:
            for size, compliance in zip(sizes, springs, strict=True):
                size[row] = compliance
    mean = np.sqrt(sizes[0] * sizes[1])
    return before[1] * (mean / sizes[0]), after[1] * (mean / sizes[1])


def _spring(problem: RegressionProblem, fit: Fit, axis: int) -> float | None:
    """The compliance that a fit has at a joint, of one that hardens a mean one."""
    for effect, parameters in zip(fit.effects, fit.nonlinear, strict=True):
        if effect.axis == axis and effect.instruments(problem.scene, parameters) is not None:
            bent = problem.columns_where(effect, parameters).values[:, 0, 0] * fit.of(effect)[0]
            return float(np.sqrt((bent**2).sum() / (problem.scene.load[:, axis - 1] ** 2).sum())) or None
    return None


def loses_a_direction(problem: RegressionProblem, before: Fit, after: Fit, fitted: RegressionProblem) -> bool:
    """Whether waves that `after` has and `before` has not leave more squares of a record, all else the same,
    than there are without them while their joint turns one of the two ways.

    A wave over an angle is there whichever way the joint turns; what looks like one and is made of friction,
    which changes with the way, need not be.
    """
    there = {effect.name for effect in before.effects}
    turned = aligned(problem, after)
    for wave in [e for e in after.effects if e.harmonic and e.name not in there]:
        less = turned.replaced(wave, np.zeros(len(wave.coefficients)))
        old, new = (_with_own_bodies(problem, fit, fitted)[0] for fit in (less, turned))
        column = problem.scene.axes.index(wave.axis)
        fall = np.where(problem.mask, old**2 - new**2, 0.0)[:, column]
        way = np.sign(problem.scene.velocity[:, wave.axis - 1])
        counted = [problem.mask[:, column] & (way == sign) for sign in (1, -1)]
        enough = _ENOUGH * sum(int(one.sum()) for one in counted)
        if any(one.sum() > enough and fall[one].sum() <= 0 for one in counted):
            return True
    return False


def _left(problem: RegressionProblem, fit: Fit, fitted: RegressionProblem | None) -> tuple[Array, float]:
    """See `_with_own_bodies`; of a fit that is compared with one after another, computed once."""
    return problem.left.of((fit, fitted), lambda: _with_own_bodies(problem, aligned(problem, fit), fitted))


def _with_own_bodies(
    problem: RegressionProblem, fit: Fit, fitted: RegressionProblem | None
) -> tuple[Array, float]:
    """What a fit leaves of a record (samples, joints) where errors of bodies may differ from those that the
    fitted record gave, and the price of that in log odds.

    What the fitted record knows of them, B'W^2 B + 1 with the fit's own weights W, is the prior of the other:
    the predictive likelihood of linear models (Bernardo and Smith 2000, section 5.1) but for its
    determinants, which are the same for both fits.
    """
    residual = fit.residual(problem)
    if fitted is None or fitted.bodies is None or problem.bodies is None:
        return residual, 0.0
    squares = fit.weights**2
    precision = np.tensordot(squares, fitted.body_products, axes=1) + np.eye(problem.bodies.shape[2])
    own = np.tensordot(squares, problem.body_products, axes=1)
    flat = problem.bodies.reshape(-1, problem.bodies.shape[2])
    pull = flat.T @ (residual * squares).ravel()
    moved = np.asarray(np.linalg.solve(own + precision, pull), dtype=float)
    left = np.where(problem.mask, np.subtract(residual, summed(problem.bodies, moved)), 0.0)
    return left, float(moved @ precision @ moved) / 2


def _relief(problem: RegressionProblem, before: Fit, after: Fit) -> tuple[float, float]:
    """Gain in log odds of coefficients that are nearer to what was expected of them, and its part of what
    residuals and coefficients have to explain together.
    """
    first, last = (float((strain(problem, fit) ** 2).sum()) for fit in (before, after))
    if first == last:
        return 0.0, 0.0
    count = problem.samples.of((before,), lambda: sum(samples(problem, before)))
    return (first - last) / 2, (first - last) / (count + max(first, last))


def samples(problem: RegressionProblem, fit: Fit) -> list[float]:
    """How many independent samples what a fit leaves is worth, joint by joint."""
    residual, mask = fit.residual(problem), problem.mask
    return [effective_samples(residual[:, joint], mask[:, joint]) for joint in range(residual.shape[1])]

"""How far a fit of vibration can be trusted: the information in FRFs and modes, the variance of its scores,
structured residuals.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from identify.core.arrays import Array, Complex, Index, Mask, gram
from identify.core.coded import Coded
from identify.core.parameters import Scale
from identify.core.thresholds import QUIET
from identify.fitting.jackknife import scatter_of_blocks
from identify.fitting.uncertainty import Joint, Uncertainty, joint_uncertainty, sandwich
from identify.model.modes import complex_modes
from identify.vibration.costs.eigenfrequency import pair_all
from identify.vibration.costs.information import information, information_by_force
from identify.vibration.costs.make_target import ModalTarget, Targets
from identify.vibration.costs.target import FrfTarget
from identify.vibration.nuisances.stated import times_as_large
from identify.vibration.problem import Problem

FREQUENCY_STD, DAMPING_STD = 0.005, 0.10
"""Relative standard deviations assumed of measured modes that come without: 0.5 % of frequency, 10 % of
damping ratio.
"""
ALIKE = 0.45
"""Correlation of neighbouring lines up to which a residual passes as unstructured (a window that decays to a
third correlates them by 0.33).
"""
UNRELIABLE = "unreliable"
"""Code of a note that intervals cannot be relied on."""
_LAGS, _POOL = 20, 45
"""Neighbouring lines whose correlation is counted; lines over which the level of noise on the force is
averaged.
"""
KNOWN = 100.0
"""Information of the data over that of the bounds from which on a value counts as known to them."""
FEWEST_BLOCKS = 4
"""Forces of all postures together from which on what they disagree by says something."""
_FAR_MORE, _LARGER = 2.0, 1.5
"""How many times as wide as noise makes them standard deviations must be, and how many times as large as
stated all errors, for that to be said."""
_TINY = float(np.finfo(float).tiny)


def uncertainty(targets: Targets, scale: Scale, values: Array, *, disagreement: bool = True) -> Uncertainty:
    """The intervals and their limits at values (unknowns,); of parameters that nuisance parameters go
    along with, marginal.

    disagreement: widened where the forces of the postures disagree by more than their residuals say.
    """
    if targets.nuisances:
        return _jointly(targets, scale, values, disagreement)
    found, wider, notes = by_residuals(targets, scale, values, disagreement)
    return sandwich(found.product, found.variance, found.count, scale, values, notes, wider)


def by_residuals(
    targets: Targets, scale: Scale, values: Array, disagreement: bool = True
) -> tuple[Information, Array, tuple[str, ...]]:
    """What residuals say of the parameters where what was stated is exact: their information, by how much
    wider (f,) than that the forces disagree, and words of warning.
    """
    found = _information(targets, values, scale.free, scale.slope(scale.to_x(values)))
    wider = np.ones(len(scale.free))
    if disagreement and len(found.parts) >= FEWEST_BLOCKS:
        wider = _disagreement(found, scale)
    return found, wider, tuple(_structure(targets, values))


@dataclass(frozen=True)
class Information:
    """J'J, the variance of the scores J'e (f, f) each, how many real numbers were measured; of each force but
    of motors of each posture its own J'J, parts (b, f, f), and scores (b, f).
    """

    product: Array
    variance: Array
    count: int
    parts: Array
    scores: Array


def _disagreement(found: Information, scale: Scale) -> Array:
    """(f,): by how much wider than stated the values scatter when each force is left out in turn, at least 1.

    Held askew, a hammer makes an error that all lines and channels of its force have in common: no
    correlation of neighbouring lines shows it.  A few forces say little of one value, so what they say of all
    that the data determine counts as much.
    """
    prior = scale.prior_information()
    bread = np.linalg.inv(found.product + np.diag(prior))
    scatter, _ = scatter_of_blocks(found.parts, found.scores, prior)
    known = np.diag(found.product) > KNOWN * prior
    stated = np.diag(bread @ found.variance @ bread)  # none of what no datum depends on
    return _wider(np.divide(scatter, stated, out=np.ones(len(stated)), where=stated > 0), known)


def _wider(ratio: Array, known: Mask) -> Array:
    """(f,): from variances over those stated; known (f,): the values that the data determine."""
    of_all = float(np.mean(ratio[known])) if known.any() else 1.0
    return np.asarray(np.sqrt(np.maximum(1.0, (np.where(known, ratio, of_all) + of_all) / 2)))


def _jointly(targets: Targets, scale: Scale, values: Array, disagreement: bool) -> Uncertainty:
    """scale and values of all unknowns; the uncertainty of the parameters among them."""
    slope, free = scale.slope(scale.to_x(values)), scale.free
    found = information_by_force(targets.frf, values, free)
    forces, count = [one.on_scale(slope) for one in found], sum(one.count for one in found)
    errors, known = np.isin(free, targets.nuisances), np.sum([product for product, _ in forces], axis=0)
    own = Scale(tuple(p for p in scale.parameters if not p.nuisance))

    def noise(combinations: Array) -> Array:
        """Their variance, whatever correlates the residuals."""
        return _variance(targets, values, free, (slope * combinations).T)

    given, notes = (own, values[: len(own.parameters)]), tuple(_structure(targets, values))
    plain = joint_uncertainty(known, noise, errors, count, *given, notes)
    if plain.joint is None:
        return plain
    notes = (*notes, *_beyond_statement(values[len(own.parameters) :], plain.joint.spread))
    if not disagreement or len(forces) < FEWEST_BLOCKS:
        return replace(plain, notes=notes)
    wider = _joint_disagreement(plain, plain.joint, forces, scale, own)
    same, notes = plain.joint.noise, (*notes, *_disagreeing(plain, own, wider))
    return joint_uncertainty(known, lambda _: same, errors, count, *given, notes, wider)


def _joint_disagreement(
    plain: Uncertainty, joint: Joint, forces: Sequence[tuple[Array, Array]], scale: Scale, own: Scale
) -> Array:
    """`_disagreement` of the parameters (f,) where nuisance parameters are fitted along: of the part of
    their variance that noise has.  Few forces leave much open beside so many errors, so that what independent
    residuals would make of leaving one out is counted off.
    """
    count = len(plain.std)
    parts, scores = (np.array(each) for each in zip(*forces, strict=True))
    every = scatter_of_blocks(parts, scores, scale.prior_information())
    scatter, expected = (each[:count] for each in every)
    bread = np.linalg.inv(joint.information)[:count]
    independent = np.einsum("ij,jk,ik->i", bread, parts.sum(axis=0), bread)
    noise = np.maximum(np.diag(joint.noise), independent)  # the least that is believed
    seen = (expected > 0) & (noise > 0)  # where rounding is more than data tell, there is none of either
    ratio = np.divide(scatter * independent, expected * noise, out=np.ones(count), where=seen)
    known = plain.independent_std**-2 > KNOWN * own.prior_information()
    return _wider(ratio, known)


def _beyond_statement(shift: Array, spread: Array) -> list[str]:
    """A sentence where all nuisance parameters together (e,) are far larger than stated: what is missing
    from a model may leave nothing else, and its parameters wrong.
    """
    ratio = times_as_large(shift, spread)
    if ratio <= _LARGER:
        return []
    said = (
        f"nuisance parameters are together {ratio:.1f} times as large as stated: the statement is too"
        " small or something is missing from the model, so values may be biased and the intervals cannot be"
        " relied on"
    )
    return [Coded(said, UNRELIABLE)]


def _disagreeing(plain: Uncertainty, own: Scale, wider: Array) -> list[str]:
    """A sentence where forces disagree far more than noise allows."""
    names = [own.parameters[number].name for number in own.free]
    rows = zip(wider, names, plain.status, strict=True)
    most, name = max(((w, name) for w, name, word in rows if word == "determined"), default=(1.0, ""))
    if most <= _FAR_MORE:
        return []
    return [
        f"the forces of the postures disagree by more than noise, most about {name} ({most:.1f} times): the"
        " model is not quite what was measured; the intervals are widened by it"
    ]


def _variance(targets: Targets, values: Array, free: Index, combinations: Array) -> Array:
    """(c, c): variance of combinations (free, c) of the scores."""
    variance, count = np.zeros((combinations.shape[1],) * 2), 0
    for target in targets.frf:
        h, gradient = target.gradient_pairs(values, free)
        e, j = (h - target.measured) / target.sigma, (gradient @ combinations) / target.sigma[..., None]
        count += 2 * e.size
        for entry in np.unique(target.pairs[1]):
            column = target.pairs[1] == entry
            variance += score_variance(e[:, column], j[:, column], (h / target.sigma)[:, column])
    return np.asarray(variance * count / max(1, count - len(free)))


def gap(targets: Targets, values: Array) -> float:
    """RMS of the residuals in units of noise over everything: 1 is perfect; NaN where no FRF noise is
    known.  Where nuisance parameters were fitted, their squares are among those of the residuals.
    """
    if any(target.noise is None for target in targets.frf):
        return float("nan")
    nothing = np.zeros(0, dtype=int)
    squares = [np.abs(_frf_residuals(target, values, None)[0]) ** 2 / 2 for target in targets.frf]
    squares += [_modal_residuals(target, values, nothing)[0] ** 2 for target in targets.modal]
    together = np.concatenate([part.ravel() for part in squares]) if squares else np.full(1, np.nan)
    errors = float(np.sum(values[list(targets.nuisances)] ** 2))
    return float(np.sqrt(np.mean(together) + errors / (2 * together.size)))


def fitted_information(problem: Problem, values: Array) -> Array:
    """(u, u): what fitted data and statements say of all free unknowns, on the search scale."""
    scale, targets = Scale(problem.parameters), problem.targets()
    known, _ = information(targets.frf, values, scale.free).on_scale(scale.slope(scale.to_x(values)))
    return np.asarray(known + np.diag(scale.prior_information()))


def covariance_root(problem: Problem, trusted: Uncertainty, values: Array) -> tuple[Index, Array]:
    """Numbers (u,) of the free unknowns, and a matrix (u, u) whose product with its transpose is the
    covariance of their values.
    """
    scale = Scale(problem.parameters)
    slope = scale.slope(scale.to_x(values))
    if trusted.joint is not None:
        return scale.free, slope[:, None] * trusted.joint.root
    squares, directions = np.linalg.eigh(trusted.correlation)
    return scale.free, (trusted.std * slope)[:, None] * directions * np.sqrt(np.maximum(squares, 0.0))


def _information(targets: Targets, values: Array, free: Index, slope: Array) -> Information:
    """On the search scale, of which slope (f,) is the derivative."""
    product, variance, count = np.zeros((len(free), len(free))), np.zeros((len(free), len(free))), 0
    parts, scores = list[Array](), list[Array]()
    for target in targets.frf:
        e, gradient = _frf_residuals(target, values, free)
        j = gradient * slope
        count += 2 * e.size
        common = target.predict_pairs(values) / target.sigma if target.noise is not None else target.measured
        for entry in np.unique(target.pairs[1]):
            column = target.pairs[1] == entry
            slopes, residual = j[:, column], e[:, column]
            variance += score_variance(residual, slopes, common[:, column])
            outer = gram(slopes, slopes)
            product += outer
            if target.data.inputs[entry].motor is None:  # a motor's torque cannot be held askew
                parts.append(outer)
                scores.append(np.einsum("lof,lo->f", np.conj(slopes), residual).real)
    variance *= count / max(1, count - len(free))
    for modal in targets.modal:
        residuals, by_value = _modal_residuals(modal, values, free)
        own = (by_value * slope).T @ (by_value * slope)
        product, variance, count = product + own, variance + own, count + residuals.size
    return Information(product, variance, count, np.array(parts), np.array(scores))


def score_variance(e: Complex, j: Complex, h: Complex) -> Array:
    """Variance (f, f) of the scores Re sum conj(J) e of one force: e (lines, outputs), j (lines, outputs, f),
    FRFs over noise h like e.

    At each line e = c u + rest, with u the unit vector along h: noise on the force multiplies all responses
    alike and so is in c only, with a variance 2 (1 + b |h|^2) when that of the rest is 2.  b (over
    neighbouring lines), the variance of the rest and the correlation over lines are taken from the residual,
    pooled, so that they are far less noisy than the scores.
    """
    size = np.linalg.norm(h, axis=1, keepdims=True)
    u = h / np.where(size > 0, size, 1.0)
    c = np.sum(np.conj(u) * e, axis=1)
    rest = e - c[:, None] * u
    a = np.einsum("lof,lo->lf", np.conj(j), u)
    level_rest = np.sum(np.abs(rest) ** 2) / max(1, rest.size - len(c))
    level = common_variance(np.abs(c) ** 2, size[:, 0] ** 2, level_rest)
    common, other = a * np.sqrt(level / 2)[:, None], np.sqrt(level_rest / 2)
    turned, left = other * np.conj(j), other * a
    lags, whole = range(1, min(_LAGS, len(c) // 5) + 1), max(float(np.sum(np.abs(e) ** 2)), _TINY)
    alike = [complex(np.vdot(e[:-lag], e[lag:])) / whole for lag in lags]
    total = np.zeros((j.shape[-1],) * 2)
    for x, sign in ((common, 1), (turned, 1), (left, -1)):
        near = np.zeros_like(x)  # of the lines after each, as far as they are correlated with it
        for lag, share in zip(lags, alike, strict=True):
            near[:-lag] += share * x[lag:]
        cross = gram(x, near)
        total += sign * (gram(x, x) + cross + cross.T)
    return total


def common_variance(squares: Array, power: Array, rest: float) -> Array:
    """Variance rest + b |h|^2 (lines,) of c from its squares, b >= 0 by maximum likelihood over neighbouring
    lines; power is |h|^2.
    """
    kernel, b, floor = np.ones(min(_POOL, len(power))), np.zeros(len(power)), _TINY
    for _ in range(6):
        weight = power / (rest + b * power + floor) ** 2
        top, bottom = (
            np.convolve(part, kernel, "same") for part in (weight * (squares - rest), weight * power)
        )
        b = np.maximum(top / np.maximum(bottom, floor), 0.0)
    return np.asarray(rest + b * power)


def _frf_residuals(target: FrfTarget, values: Array, free: Index | None) -> tuple[Complex, Complex]:
    """Complex residuals over noise (lines, pairs) and derivatives (lines, pairs, free); unknown noise is
    taken from the residual.
    """
    if free is None:
        h, gradient = target.predict_pairs(values), np.zeros((0, 0, 0), dtype=complex)
    else:
        h, gradient = target.gradient_pairs(values, free)
    difference = h - target.measured
    if target.noise is None:
        level = np.sqrt(np.mean(np.abs(difference) ** 2, axis=0) / 2)
        sigma = np.broadcast_to(np.maximum(level, 1e-9 * np.abs(target.measured).max()), difference.shape)
    else:
        sigma = target.sigma
    return difference / sigma, gradient if free is None else gradient / sigma[..., None]


def _modal_residuals(target: ModalTarget, values: Array, free: Index) -> tuple[Array, Array]:
    """Differences of frequency, then of known damping ratios, over their standard deviations; derivatives (r,
    free).
    """
    system, own = target.at(values)
    modes, data = complex_modes(*system.matrices(own)), target.data
    order = pair_all(target, modes)
    d_frequency, d_damping = target.slopes(modes, values, free)
    frequency_std = (
        data.frequency_hz * FREQUENCY_STD if data.frequency_std_hz is None else data.frequency_std_hz
    )
    damping_std = data.damping_ratio * DAMPING_STD if data.damping_std is None else data.damping_std
    known = np.isfinite(data.damping_ratio / damping_std)
    frequency = (modes.frequency_hz[order] - data.frequency_hz) / frequency_std
    damping = ((modes.damping_ratio[order] - data.damping_ratio) / damping_std)[known]
    slopes = [d_frequency[order] / frequency_std[:, None], (d_damping[order] / damping_std[:, None])[known]]
    return np.concatenate([frequency, damping]), np.concatenate(slopes)


def _structure(targets: Targets, values: Array) -> list[str]:
    """A warning where the residual is more than the stated noise, and a stronger one where it is correlated
    over lines.
    """
    squares = lagged = count = 0.0
    for target in targets.frf:
        if target.noise is None:
            continue
        e, _ = _frf_residuals(target, values, None)
        squares, count = squares + float(np.sum(np.abs(e) ** 2)), count + 2 * e.size
        lagged += float(np.abs(np.sum(np.conj(e[:-1]) * e[1:])))
    total = squares + float(np.sum(values[list(targets.nuisances)] ** 2))
    if not count or total <= QUIET**2 * count:
        return []
    level, alike = np.sqrt(total / count), lagged / squares
    if alike <= ALIKE:
        return [
            f"the residual is {level:.2f} times the stated noise but without structure: the intervals are"
            " widened by it"
        ]
    said = (
        f"the residual is {level:.2f} times the noise and structured (neighbouring lines correlate by"
        f" {alike:.2f}): something is missing from the model or wrong in the data, so values may be biased;"
        " the intervals are widened but cannot be relied on"
    )
    return [Coded(said, UNRELIABLE)]

"""Standard deviation of measured FRFs, from coherence and number of averages or from repeated measurements.

One line tells little: with four averages its variance estimate has six degrees of freedom and scatters by 58
%.  So neighbouring lines are pooled by a model of how the noise comes about.  X = H F + n_x is measured with
the force F + n_f, so the variance of H_ij is

    var = alpha_ij(f) + beta_j(f) |H_ij|^2,

alpha = S_nx / S_ff being noise of the response and beta = S_nf / S_ff noise of the force, common to all
outputs of an input, both per number of averages and smooth over frequency.  The line estimates are gamma
distributed around it; alpha and beta are piecewise linear and found by maximum likelihood.

Noise of the force also makes H1 too small, to first order by the share beta (n - 1) of n averages: S_ff in
its denominator is measured with the noise (Bendat and Piersol, section 9.1), but what an average's own noise
does to the numerator compensates for one n-th of that.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import combinations
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy

from identify.core.arrays import Array
from identify.core.asked import key
from identify.core.errors import InputError
from identify.core.latest import LatestLike
from identify.core.text import count
from identify.measured.frf_set import FrfSet
from identify.measured.rounded import in_words, remark, rounding
from identify.measured.scatter import FREEDOM, scatter

_POOLED_FREEDOM = 120
_ROUNDS, _ITERATIONS, _SETTLED = 3, 200, 1e-3
_FLOOR, _TINY = 1e-14, 1e-150
_RARE = 1e-3
_PRINTED = 5e-7
"""Files of single precision print a coherence to six digits: a 1 stands for anything above 1 - 5e-7, and half
of that is assumed.
"""
_ACROSS = 0.01
"""Transverse sensitivity of a good accelerometer: a channel that moves less than this part of what others do
measures their motion."""
_PLAINLY = 1.5
"""Scatter over stated noise from which a reader is warned."""
_DENSE = 2000
"""Numbers in a basis up to which the zeros among them take less time than their leaving out."""
if TYPE_CHECKING:
    _Basis = Any  # an array, or scipy.sparse.csr_array
    _Bases = tuple[_Basis, _Basis]


@dataclass(frozen=True)
class _Pooled:
    """variance (lines, outputs, inputs) of complex FRFs, of_force (lines, inputs) its share beta of |H|^2."""

    variance: Array
    of_force: Array


_seen = LatestLike[_Pooled](12)
"""A run asks for the noise of the same FRFs when it looks at the set-up and when it fits."""


def noise_std(frf_set: FrfSet) -> Array:
    """Standard deviation (lines, outputs, inputs) of the real part, and equally of the imaginary part, of
    each FRF value; NaN where none.

    From each line's |H|^2 (1 - g2) / (g2 (n - 1)), the unbiased variance of the complex H1 from n averages
    with coherence g2 (Bendat and Piersol, Random Data, 4th ed., section 9.2, with the n - 1 of a regression
    on n independent averages), pooled as said above. InputError where coherence or averages are missing or
    averages < 2.
    """
    return np.sqrt(_of_coherence(frf_set).variance / 2)


def without_bias(frf_set: FrfSet) -> FrfSet:
    """H1 with its noise (`noise_std`), and without what noise of the force takes off it, as said above.

    InputError as for `noise_std`.
    """
    pooled = _of_coherence(frf_set)
    more = pooled.of_force * ((frf_set.averages or 1) - 1)
    whole = replace(frf_set, frf=frf_set.frf * (1 + more[:, None, :]))
    return _with_noise(whole, np.sqrt(pooled.variance / 2))


def with_noise(frf_set: FrfSet) -> FrfSet:
    """The same with its noise (`noise_std`) alone, as of FRFs that are not H1."""
    return _with_noise(frf_set, noise_std(frf_set))


def _with_noise(frf_set: FrfSet, noise: Array) -> FrfSet:
    """With that noise, and a note where a coherence was not fine enough to tell it."""
    note = "" if frf_set.coherence is None else remark(frf_set.coherence)
    return replace(frf_set, noise=noise, notes=(*frf_set.notes, *filter(None, [note])))


def with_relative_noise(frf_set: FrfSet, share: float) -> FrfSet:
    """With noise of this share of each FRF's RMS over its lines, as stated, but no less than neighbouring
    lines scatter, and no less than that share of what a sensor picks up of motion across its axis.
    """
    level = np.sqrt(np.mean(np.abs(frf_set.frf) ** 2, axis=0))
    stated = share * np.maximum(level, _ACROSS * _largest_alike(frf_set, level))
    between = scatter(frf_set)
    seen = np.zeros_like(level) if between is None else np.sqrt(np.median(between, axis=0))
    noise = np.broadcast_to(np.fmax(stated, seen) / np.sqrt(2), frf_set.frf.shape).copy()
    noisy = np.argwhere(seen > _PLAINLY * stated)
    notes = frf_set.notes
    if len(noisy):
        i, j = max(noisy.tolist(), key=lambda pair: float(seen[*pair] / stated[*pair]))
        most = f"{frf_set.outputs[i]}/{frf_set.inputs[j]}, by {seen[i, j] / level[i, j]:.2g} of its RMS"
        notes += (
            f"{count(len(noisy), 'FRF')} scatter more between lines than the stated noise of {share:g}, most"
            f" {most}: their scatter is taken as their noise",
        )
    return replace(frf_set, noise=noise, notes=notes)


def _largest_alike(frf_set: FrfSet, level: Array) -> Array:
    """(outputs, inputs): the largest level of FRFs with the same unit."""
    turns = [np.array([abs(c.direction) > 3 for c in some]) for some in (frf_set.outputs, frf_set.inputs)]
    kind = turns[0][:, None] * 2 + turns[1]
    return np.asarray(
        np.select(
            [kind == one for one in range(4)],
            [np.nanmax(np.where(kind == one, level, 0.0), initial=0.0) for one in range(4)],
        )
    )


def _of_coherence(frf_set: FrfSet) -> _Pooled:
    where, averages, coherence = frf_set.source or "FRF set", frf_set.averages, frf_set.coherence
    if coherence is None:
        raise InputError(
            where, "no coherence", "coherences or repeated measurements", "noise cannot be known without"
        )
    if averages is None or averages < 2:
        raise InputError(
            where, f"averages: {averages}", "the number of averages, at least 2", f"add {key('averages')}"
        )
    lacking = np.argwhere(frf_set.measured & np.isnan(coherence).any(axis=0))
    if len(lacking):
        i, j = lacking[0]
        raise InputError(
            where,
            f"FRF {frf_set.outputs[i]}/{frf_set.inputs[j]} has no coherence",
            "a coherence for each FRF",
        )
    step = rounding(coherence)
    if step:
        return _of_rounded(frf_set, coherence, averages, step)
    return _of_lines(frf_set, np.minimum(coherence, 1 - _PRINTED / 2), averages)


def _of_lines(frf_set: FrfSet, coherence: Array, averages: int) -> _Pooled:
    power = np.abs(frf_set.frf) ** 2
    line_variance = power * (1 - coherence) / (np.maximum(coherence, 1e-9) * (averages - 1))
    return _pooled(power, line_variance, 2 * (averages - 1))


def _of_rounded(frf_set: FrfSet, coherence: Array, averages: int, step: float) -> _Pooled:
    """By the scatter between neighbouring lines, within what a coherence rounded or cut off to so much
    allows.

    InputError where there is no such scatter, and most of the coherence is as good as one.
    """
    most, least = (_of_lines(frf_set, np.clip(coherence + off, 0.0, 1.0), averages) for off in (-step, step))
    between = scatter(frf_set)
    if between is not None:
        found = _pooled(np.abs(frf_set.frf) ** 2, between, FREEDOM)
    elif np.nanmedian(1 - coherence) > step:
        found = _of_lines(frf_set, np.minimum(coherence, 1 - step / 4), averages)
    else:
        raise InputError(
            frf_set.source or "FRF set",
            f"a coherence {in_words(step)}, and lines too few or uneven to tell the noise",
            "a coherence with at least five decimals",
            "export it so, or give `noise: {relative: 0.02}` in the measurement",
        )
    return _Pooled(
        np.clip(found.variance, least.variance, np.maximum(most.variance, least.variance)),
        np.minimum(found.of_force, most.of_force),
    )


def noise_std_from_repeats(sets: list[FrfSet]) -> Array:
    """Standard deviation (lines, outputs, inputs) of the real part of the mean of repeated measurements.

    From their scatter, pooled likewise.  InputError where there are fewer than two, or they differ in
    channels, quantity, window or frequencies.
    """
    mean = mean_of_repeats(sets)
    scatter = np.sum([np.abs(one.frf - mean.frf) ** 2 for one in sets], axis=0)
    line_variance = scatter / (len(sets) * (len(sets) - 1))
    return np.sqrt(pooled_variance(np.abs(mean.frf) ** 2, line_variance, 2 * (len(sets) - 1)) / 2)


def mean_of_repeats(sets: list[FrfSet]) -> FrfSet:
    """The mean FRFs of repeated measurements of the same thing; its coherence is dropped, since the scatter
    says more.

    InputError as for `noise_std_from_repeats`.
    """
    if len(sets) < 2:
        raise InputError("repeats", f"{len(sets)} measurement", "at least two")
    first = sets[0]
    for other in sets[1:]:
        alike = all(
            getattr(other, name) == getattr(first, name)
            for name in ("outputs", "inputs", "quantity", "window_decay_per_s", "record_s")
        )
        if (
            not alike
            or other.frf.shape != first.frf.shape
            or not np.allclose(other.frequency_hz, first.frequency_hz, rtol=1e-6)
        ):
            found = f"channels, quantity, window, record or lines other than in {first.source or 'the first'}"
            raise InputError(other.source or "repeats", found, "repeats of one measurement")
    for one, other in combinations(sets, 2):
        if np.array_equal(one.frf, other.frf, equal_nan=True):
            found = f"the same FRFs as in {one.source or 'another repeat'}"
            raise InputError(
                other.source or "repeats", found, "a measurement of its own", "name another file"
            )
    sources = " + ".join(one.source for one in sets)
    return replace(
        first,
        frf=np.mean([one.frf for one in sets], axis=0),
        coherence=None,
        averages=None,
        source=sources,
        sha256="",
    )


def pooled_variance(power: Array, line_variance: Array, freedom: int) -> Array:
    """Variance (lines, outputs, inputs) smoothed by alpha + beta |H|^2 from single-line estimates with
    `freedom` degrees of freedom each.

    power is |H|^2; NaN in either marks what was not measured.  A line that stands out beyond chance (mains
    hum) keeps its own estimate and stays out of its neighbours'.
    """
    return _pooled(power, line_variance, freedom).variance


def _pooled(power: Array, line_variance: Array, freedom: int) -> _Pooled:
    found = _seen.of((power, line_variance, freedom), lambda: _fitted(power, line_variance, freedom))
    return _Pooled(found.variance.copy(), found.of_force.copy())


def _fitted(power: Array, line_variance: Array, freedom: int) -> _Pooled:
    # Outputs last, because sums run over them and factors are common to them.
    power, line_variance = (np.ascontiguousarray(one.swapaxes(1, 2)) for one in (power, line_variance))
    known = np.isfinite(power) & np.isfinite(line_variance)
    power, line_variance = np.where(known, power, 0.0), np.where(known, line_variance, 0.0)
    spacing = _POOLED_FREEDOM / freedom
    alpha_basis, beta_basis = _hats(len(power), spacing), _hats(len(power), 2 * spacing)
    limit = float(scipy.special.chdtri(freedom, _RARE)) / freedom
    use, parts = known, None
    for _ in range(_ROUNDS):
        model, parts = _fit(power, np.where(use, line_variance, np.nan), (alpha_basis, beta_basis), parts)
        use = known & (line_variance <= limit * model)
    pooled = np.where(known, np.where(use, model, np.maximum(model, line_variance)), np.nan)
    assert parts is not None
    return _Pooled(np.ascontiguousarray(pooled.swapaxes(1, 2)), beta_basis @ parts[1])


def _fit(
    power: Array, variance: Array, bases: _Bases, start: tuple[Array, Array] | None
) -> tuple[Array, tuple[Array, Array]]:
    """alpha + beta power (lines, inputs, outputs) of greatest gamma likelihood, and the coefficients of alpha
    and beta.

    NaN in variance marks lines to leave out.  Multiplicative updates for the positive parts of a
    gamma-distributed sum never lower the likelihood and keep the parts positive (Fevotte and Idier, Neural
    Computation 23 (2011), algorithm MM for Itakura-Saito divergence).
    """
    use = np.isfinite(variance).astype(float)
    variance = np.where(use > 0, variance, 0.0)
    floor = _FLOOR * power + _TINY
    onto = _transposed(bases[0]), _transposed(bases[1])
    alpha, beta = start or _start(power, variance, use, onto)
    model = _model(alpha, beta, bases, power, floor)
    for _ in range(_ITERATIONS):
        inverse = 1 / model
        push = use * inverse
        pull = variance * inverse
        pull *= inverse
        alpha = alpha * np.sqrt(_share(_project(onto[0], pull), _project(onto[0], push)))
        pulls, pushes = (onto[1] @ np.einsum("lio,lio->li", power, one) for one in (pull, push))
        beta = beta * np.sqrt(_share(pulls, pushes))
        model = _model(alpha, beta, bases, power, floor)
        inverse *= model
        if max(inverse.max() - 1, 1 - inverse.min()) < _SETTLED:
            break
    return model, (alpha, beta)


def _start(power: Array, variance: Array, use: Array, onto: _Bases) -> tuple[Array, Array]:
    """Half of the variance from either source."""
    ratio = np.divide(variance, power, out=np.zeros_like(variance), where=power > 0)
    alpha = _share(_project(onto[0], variance), _project(onto[0], use)) / 2
    beta = _share(onto[1] @ ratio.sum(axis=2), onto[1] @ use.sum(axis=2)) / 2
    return alpha, beta


def _model(alpha: Array, beta: Array, bases: _Bases, power: Array, floor: Array) -> Array:
    """alpha(f) + beta(f) power + floor from coefficients (knots, inputs, outputs) and (knots, inputs)."""
    model = (bases[1] @ beta)[:, :, None] * power
    model += (bases[0] @ alpha.reshape(len(alpha), -1)).reshape(power.shape)
    model += floor
    return np.asarray(model)


def _project(onto: _Basis, values: Array) -> Array:
    """Sum over the lines (axis 0) of values, weighted by each hat, a row each."""
    return np.asarray((onto @ values.reshape(len(values), -1)).reshape(-1, *values.shape[1:]))


def _share(a: Array, b: Array) -> Array:
    """a / b, and 0 where there is nothing to divide."""
    return np.divide(a, b, out=np.zeros_like(a), where=b > 0)


def _transposed(basis: _Basis) -> _Basis:
    return np.ascontiguousarray(basis.T) if isinstance(basis, np.ndarray) else basis.T.tocsr()


def _hats(lines: int, spacing: float) -> _Basis:
    """Piecewise linear basis (lines, knots) with knots about `spacing` lines apart; its rows sum to 1."""
    intervals = max(1, round((lines - 1) / max(spacing, 1.0)))
    position = np.linspace(0, intervals, lines)
    left = np.minimum(position.astype(int), intervals - 1)
    right_share = position - left
    rows = np.repeat(np.arange(lines), 2)
    columns = np.stack([left, left + 1], axis=1).ravel()
    shares = np.stack([1 - right_share, right_share], axis=1).ravel()
    hats = scipy.sparse.csr_array((shares, (rows, columns)), shape=(lines, intervals + 1))
    return hats.toarray() if lines * (intervals + 1) <= _DENSE else hats

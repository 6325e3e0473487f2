"""The measured dynamic stiffness of a place, line by line: with its uncertainty, posture by posture, and
whether the postures agree, also those that were not fitted.

In the axes of its joint or link a place has one dynamic stiffness whatever the posture.  A of a line and the
known parameters are known with the covariance that `identify.discovery.places.weighted` says; kappa = A^-1 -
zeta and Delta = (A^-1 - zeta)^-1 bend so much where A is hardly known that their bands are drawn at random.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.core.arrays import Array, Complex, Index
from identify.core.parameters import Scale
from identify.core.thresholds import SIGMAS_95
from identify.discovery.places.normal import Normal, normal_equations
from identify.discovery.places.predict import StructuralModel, Unknown, misalignments
from identify.discovery.places.semiparametric import SemiParametricFit
from identify.discovery.places.update import a_of, pairs_of, stiffness_of, symmetric, triangle
from identify.discovery.places.weighted import WeightedFit, force_noise, weighted_fit

_DRAWS = 500
"""Of what the data leave open; the half-widths of bands are known to 4 % so."""


@dataclass(frozen=True)
class Curve:
    """Dynamic stiffness by line: frequency_hz (l,), values (l, m), the upper triangle of a symmetric matrix,
    and the standard deviations of their real and imaginary parts (l, m), NaN where nothing is known.
    """

    name: str
    frequency_hz: Array
    values: Complex
    std_real: Array
    std_imag: Array


@dataclass(frozen=True)
class MeasuredCurve:
    """pooled: of all fitted sets; postures: of each set alone, then of sets that were not fitted; agreement:
    RMS difference of each from the pooled one, over its standard deviation; entries: which coordinates each
    column is of; misalignment (towards, 2): how far its axis is misaligned, with the standard deviation.
    """

    entries: tuple[str, ...]
    pooled: Curve
    postures: tuple[Curve, ...]
    agreement: Array
    misalignment: Array


def measured_curve(
    model: StructuralModel, fit: SemiParametricFit, scale: Scale, others: StructuralModel | None = None
) -> MeasuredCurve:
    """The curve of a fitted place; others: the same place in sets that were not fitted."""
    end = weighted_fit(model, fit, scale)
    frequency = model.lines(end.values).imag / (2 * np.pi)
    order = np.argsort(frequency, kind="stable")
    spread = _drawn(end.covariance, end)
    pooled = _curve(model, "all postures", frequency, end.unknown, spread, order)
    curves, agreement = [], []
    for one, shared in ((model, True), *(((others, False),) if others is not None else ())):
        for number in range(len(one.views)):
            curve, rms = _alone(one, number, model, end, shared)
            curves.append(curve)
            agreement.append(rms)
    return MeasuredCurve(
        _entries(model), pooled, tuple(curves), np.array(agreement), misalignment_of(model, end, scale)
    )


def misalignment_of(model: StructuralModel, end: WeightedFit, scale: Scale) -> Array:
    """(towards, 2): how far the axis of a place is misaligned, and the standard deviation of that."""
    last, slope = len(misalignments(model.place)), scale.slope(scale.to_x(end.values))
    std = np.sqrt(np.diag(end.known)) * slope
    return np.column_stack([end.values[len(end.values) - last :], std[len(std) - last :]])


def seen(misalignment: Array) -> NDArray[np.bool_]:
    """(towards,): where an axis is misaligned by more than its own 95 % interval, of misalignments (towards,
    2).
    """
    return np.asarray(np.abs(misalignment[:, 0]) > SIGMAS_95 * misalignment[:, 1])


def _entries(model: StructuralModel) -> tuple[str, ...]:
    place = model.place
    names = getattr(place, "coordinates", None) or tuple(f"{place.link} {one}" for one in place.directions)  # type: ignore[union-attr]
    return tuple(names[i] if i == j else f"{names[i]} with {names[j]}" for i, j in pairs_of(len(names)))


def _drawn(covariance: Complex, fit: WeightedFit | None = None) -> Complex:
    """(draws, l, m): changes of A that the data leave open, with those that follow the known parameters of a
    fit; the same draws for all lines, NaN at those where nothing is known.
    """
    rng, told = np.random.default_rng(0), np.asarray(np.isfinite(covariance).all(axis=(1, 2), keepdims=True))
    squares, directions = np.linalg.eigh(np.where(told, covariance, 0.0))
    root = directions * np.sqrt(np.maximum(squares, 0.0))[:, None, :]
    normal = rng.normal(size=(_DRAWS, covariance.shape[1], 2)) @ np.array([1.0, 1j])
    own = np.where(told[..., 0], np.einsum("lmn,qn->qlm", root, normal), np.nan)
    if fit is None:
        return np.asarray(own)
    moved = rng.multivariate_normal(np.zeros(len(fit.known)), fit.known, _DRAWS, method="eigh")
    return np.asarray(own + np.einsum("lmx,qx->qlm", fit.through, moved))


def _curve(
    model: StructuralModel, name: str, frequency: Array, unknown: Unknown, spread: Complex, order: Index
) -> Curve:
    """Dynamic stiffness with half its 95 % interval for given changes of A, in standard deviations."""
    with np.errstate(all="ignore"):
        entries = np.concatenate([unknown.values[None], unknown.values + spread])
        stiffness = triangle(stiffness_of(symmetric(entries, model.size), unknown.reference, model.sign))
        off = stiffness[1:] - stiffness[0]
    real, imaginary = (np.quantile(np.abs(part), 0.95, axis=0) / SIGMAS_95 for part in (off.real, off.imag))
    return Curve(name, frequency[order], stiffness[0][order], real[order], imaginary[order])


def _alone(
    model: StructuralModel, number: int, fitted: StructuralModel, fit: WeightedFit, shared: bool
) -> tuple[Curve, float]:
    """One set's own curve, known parameters held, and how far it is from the pooled one.

    H is linear in A at the set's own zeta, so that one step is exact.
    """
    view = model.views[number]
    own, s = model.lines_of(number, fit.values), fitted.lines(fit.values)
    where = [int(np.argmin(np.abs(s - line))) for line in own]
    reference = model.zeta(number, fit.values)
    a = a_of(fitted.stiffness(fit.unknown)[where], reference, model.sign)
    start, lines = Unknown(triangle(a), reference), np.arange(len(own))
    forces = model.predict_one(number, start, fit.values, np.zeros(0, dtype=int)).by_force(lines)
    first = normal_equations(forces, [lines] * len(forces), len(own)).inverse

    def normal(*, stated: bool) -> Normal:
        white = [force_noise(force, first, stated=stated).whitened(force) for force in forces]
        return normal_equations(white, [lines] * len(white), len(own))

    found = normal(stated=False)
    curve = _curve(
        model,
        view.target.name,
        own.imag / (2 * np.pi),
        Unknown(start.values + found.change(np.zeros(0)), reference),
        _drawn(fit.wider * found.inverse),
        lines,
    )
    pooled = None if shared else _moved(fit.covariance[where], fit.unknown, where, reference)
    return curve, _distance(normal(stated=True), pooled)


def _distance(normal: Normal, pooled: Complex | None) -> float:
    """RMS over lines and entries of how far a set is from the pooled curve, over its standard deviation by
    the noise as stated, as a score test: what is not determined does not count.

    pooled (l, m, m): uncertainty of the pooled curve, where the set has no part in it.
    """
    variance = normal.gram
    if pooled is not None:
        variance = variance + normal.gram @ pooled @ normal.gram
    size = np.einsum("lmm->lm", variance).real
    unit = np.eye(variance.shape[1]) * (1e-9 * size.max(axis=1) + np.finfo(float).tiny)[:, None, None]
    through = np.linalg.solve(variance + unit, normal.slope[..., None])[..., 0]
    squares = np.sum(np.conj(normal.slope) * through, axis=1).real
    return float(np.sqrt(squares.mean() / (2 * variance.shape[1])))


def _moved(covariance: Complex, unknown: Unknown, where: Sequence[int], reference: Complex) -> Complex:
    """Covariance of A as it is of another reference."""
    size = reference.shape[-1]
    a, old = symmetric(unknown.values, size)[where], unknown.reference[where]
    unit, columns = np.eye(size), []
    turn = np.linalg.inv(unit + (reference - old) @ a)
    for i, j in pairs_of(size):
        direction = np.zeros((size, size))
        direction[i, j] = direction[j, i] = 1.0
        columns.append(triangle(np.swapaxes(turn, 1, 2) @ direction @ turn))
    slope = np.stack(columns, axis=-1)
    return np.asarray(slope @ covariance @ np.conj(np.swapaxes(slope, 1, 2)))

"""The measured dynamic stiffness of a place, line by line: with its uncertainty, posture by posture, and
whether the postures agree, also those that were not fitted.

In the axes of its joint or link a place has one dynamic stiffness whatever the posture.  At the fitted place
the unknown A of a line has the covariance G^-1 B G^-1 with G = J' J, and B counts the noise of each force,
which is in all its responses (`identify.vibration.uncertainty.score_variance`); what the known parameters do
not settle is added.  kappa = A^-1 - zeta and Delta = (A^-1 - zeta)^-1 follow to first order.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from identify.core.arrays import Array, Complex, Index
from identify.core.parameters import Scale
from identify.discovery.places.predict import Predicted, StructuralModel, Unknown
from identify.discovery.places.semiparametric import Normal, SemiParametricFit, normal_equations
from identify.discovery.places.update import a_of, pairs_of, stiffness_of, symmetric, triangle
from identify.discovery.places.views import View
from identify.vibration.uncertainty import common_variance


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
    column is of.
    """

    entries: tuple[str, ...]
    pooled: Curve
    postures: tuple[Curve, ...]
    agreement: Array


def measured_curve(
    model: StructuralModel, fit: SemiParametricFit, scale: Scale, others: StructuralModel | None = None
) -> MeasuredCurve:
    """The curve of a fitted place; others: the same place in sets that were not fitted."""
    x = scale.to_x(fit.values)
    known = np.asarray(np.linalg.pinv(fit.normal.information, rcond=1e-10, hermitian=True), dtype=float)
    parts = _parts(model, fit.unknown, fit.values, scale)
    normal = normal_equations(
        _scaled(parts, scale.slope(x)), [v.lines for v in model.views], len(fit.unknown.values)
    )
    spread = _spread(parts, model.views, len(fit.unknown.values))
    covariance = normal.inverse @ spread @ normal.inverse
    through = -normal.inverse @ normal.coupling
    s = model.lines(fit.values)
    frequency = s.imag / (2 * np.pi)
    order = np.argsort(frequency, kind="stable")
    pooled = _curve(model, "all postures", frequency, fit.unknown, covariance, (through, known), order)
    curves, agreement = [], []
    for one, shared in ((model, True), *(((others, False),) if others is not None else ())):
        for number in range(len(one.views)):
            curve, rms = _alone(
                one, number, model.stiffness(fit.unknown), s, fit, scale, (covariance, fit.unknown), shared
            )
            curves.append(curve)
            agreement.append(rms)
    return MeasuredCurve(_entries(model), pooled, tuple(curves), np.array(agreement))


def _entries(model: StructuralModel) -> tuple[str, ...]:
    place = model.place
    names = getattr(place, "coordinates", None) or tuple(f"{place.link} {axis}" for axis in place.axes)  # type: ignore[union-attr]
    return tuple(names[i] if i == j else f"{names[i]} with {names[j]}" for i, j in pairs_of(len(names)))


def _parts(model: StructuralModel, unknown: Unknown, values: Array, scale: Scale) -> list[Predicted]:
    return model.predict(unknown, values, scale.free, model.rests(unknown, values))


def _scaled(parts: Sequence[Predicted], slope: Array) -> list[Predicted]:
    return [replace(part, by_parameter=part.by_parameter * slope) for part in parts]


def _spread(parts: Sequence[Predicted], views: Sequence[View], count: int) -> Complex:
    """(l, m, m): variance of the scores J' e over that of independent noise with unit parts."""
    size = parts[0].by_unknown.shape[-1]
    total = np.zeros((count, size, size), dtype=complex)
    for part, view in zip(parts, views, strict=True):
        for entry in range(part.forces):
            np.add.at(total, view.lines, _of_force(part, entry))
    return total


def _of_force(part: Predicted, entry: int, *, stated: bool = False) -> Complex:
    """Of one force of a set: the component of residuals along the responses has the force's noise too.

    stated: the noise of the rest is as stated, whatever the residual says.
    """
    e, j, h = part.of_force(entry)
    size = np.linalg.norm(h, axis=1)
    u = h / np.where(size > 0, size, 1.0)[:, None]
    along = np.sum(np.conj(u) * e, axis=1)
    rest = e - along[:, None] * u
    level = 2.0 if stated else max(float(np.sum(np.abs(rest) ** 2)) / max(1, rest.size - len(rest)), 2.0)
    common = common_variance(np.abs(along) ** 2, size**2, level)
    pull = np.einsum("lrm,lr->lm", np.conj(j), u)
    own = np.conj(np.swapaxes(j, 1, 2)) @ j
    extra = (common / 2 - level / 2)[:, None, None] * pull[:, :, None] * np.conj(pull)[:, None, :]
    return np.asarray(level / 2 * own + extra)


def _curve(
    model: StructuralModel,
    name: str,
    frequency: Array,
    unknown: Unknown,
    covariance: Complex,
    known: tuple[Complex, Array] | None,
    order: Index,
) -> Curve:
    """Dynamic stiffness with its standard deviations, to first order."""
    a = symmetric(unknown.values, model.size)
    with np.errstate(all="ignore"):
        stiffness = stiffness_of(a, unknown.reference, model.sign)
        slope = _slope(a, unknown.reference, model.sign)
    spread = slope @ covariance @ np.conj(np.swapaxes(slope, 1, 2))
    real = imaginary = np.maximum(np.einsum("lmm->lm", spread).real, 0.0)
    if known is not None:
        moved = slope @ known[0]
        real = real + np.einsum("lmx,xy,lmy->lm", moved.real, known[1], moved.real)
        imaginary = imaginary + np.einsum("lmx,xy,lmy->lm", moved.imag, known[1], moved.imag)
    return Curve(
        name, frequency[order], triangle(stiffness)[order], np.sqrt(real)[order], np.sqrt(imaginary)[order]
    )


def _slope(a: Complex, reference: Complex, sign: float) -> Complex:
    """(l, m, m): derivatives of the triangle of kappa or Delta by that of A."""
    size = a.shape[-1]
    unit = np.eye(size)
    left = np.linalg.inv(a) if sign > 0 else np.linalg.inv(unit - a @ reference)
    right = left if sign > 0 else np.linalg.inv(unit - reference @ a)
    columns = []
    for i, j in pairs_of(size):
        direction = np.zeros((size, size))
        direction[i, j] = direction[j, i] = 1.0
        columns.append(-sign * triangle(left @ direction @ right))
    return np.stack(columns, axis=-1)


def _alone(
    model: StructuralModel,
    number: int,
    pooled: Complex,
    s: Complex,
    fit: SemiParametricFit,
    scale: Scale,
    known: tuple[Complex, Unknown],
    shared: bool,
) -> tuple[Curve, float]:
    """One set's own curve, known parameters held, and how far it is from the pooled one.

    H is linear in A at the set's own zeta, so that one step is exact.
    """
    view = model.views[number]
    own = view.target.s_at(fit.values)
    where = [int(np.argmin(np.abs(s - line))) for line in own]
    reference = model.zeta(number, fit.values)
    a = a_of(pooled[where], reference, model.sign)
    start = Unknown(triangle(a), reference)
    part = model.predict_one(number, start, fit.values, scale.free)
    lines = np.arange(len(own))
    normal = normal_equations([part], [lines], len(own))
    step = -(normal.inverse @ normal.slope[..., None])[..., 0]
    spread = np.zeros_like(normal.gram)
    for entry in range(part.forces):
        spread += _of_force(part, entry)
    covariance = normal.inverse @ spread @ normal.inverse
    curve = _curve(
        model,
        view.target.name,
        own.imag / (2 * np.pi),
        Unknown(start.values + step, reference),
        covariance,
        None,
        lines,
    )
    return curve, _distance(
        part, normal, None if shared else _moved(known[0][where], known[1], where, reference)
    )


def _distance(part: Predicted, normal: Normal, pooled: Complex | None) -> float:
    """RMS over lines and entries of how far a set is from the pooled curve, over its standard deviation by
    the noise as stated, as a score test: what is not determined does not count.

    pooled (l, m, m): uncertainty of the pooled curve, where the set has no part in it.
    """
    variance = np.zeros_like(normal.gram)
    for entry in range(part.forces):
        variance += _of_force(part, entry, stated=True)
    if pooled is not None:
        variance += normal.gram @ pooled @ normal.gram
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

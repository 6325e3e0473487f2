"""How far a fit can be trusted: covariance and 95 % intervals, parameters that the data do not determine, structured residuals.

All of it rests on residuals in units of their noise at the optimum, whichever cost and optimizer found it.  With J their
derivatives on the search scale (ln value for stiffness and damping), the covariance is (J'J + P)^-1, where P is what the
bounds alone say: weak enough not to matter for a parameter that the data determine, enough to keep the others finite.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.costs.base import real_rows
from identify.costs.eigenfrequency import pair_all
from identify.costs.target import FrfTarget, ModalTarget, Targets
from identify.model.modes import complex_modes, frequency_and_damping_gradient
from identify.optimizers.base import Scale

Array = NDArray[np.float64]
Index = NDArray[np.intp]

FREQUENCY_STD, DAMPING_STD = 0.005, 0.10
"""Relative standard deviations assumed of measured modes that come without: 0.5 % of frequency, 10 % of damping ratio."""
_DETERMINED = np.log(2) / 2
"""Standard deviation of ln value up to which the 95 % interval stays within a factor of two: the parameter is determined."""
_UNDETERMINED = 1.0
"""Above this (95 %: a factor of seven) the data do not determine it."""


@dataclass(frozen=True)
class Trust:
    """What the data say about the free parameters (f of them).

    std (f,): standard deviation on the search scale, widened where the residual is structured; low, high (f,): 95 %
    limits of the values, clipped to the bounds; status (f,): determined, weak or not determined; singular_values (f,)
    of J and directions (f, f), a row each; inflation: what the standard deviations were multiplied by; count: real numbers measured; notes: sentences.
    """

    std: Array
    low: Array
    high: Array
    status: tuple[str, ...]
    correlation: Array
    singular_values: Array
    directions: Array
    inflation: float
    count: int
    notes: tuple[str, ...]


def noise_residuals(targets: Targets, values: Array, free: Index) -> tuple[Array, Array]:
    """Residuals in units of noise (r,) and their derivatives with respect to the free values (r, free).

    FRFs without known noise are taken to have that of their own residual; modes without, FREQUENCY_STD and DAMPING_STD.
    """
    parts = [_frf_residuals(target, values, free) for target in targets.frf] + [_modal_residuals(t, values, free) for t in targets.modal]
    return np.concatenate([r for r, _ in parts]), np.concatenate([j for _, j in parts])


def gap(targets: Targets, values: Array) -> float:
    """RMS of the residuals in units of noise over everything: 1 is perfect; NaN where no FRF noise is known."""
    squares = count = 0.0
    for target in targets.frf:
        if target.noise is None:
            return float("nan")
        e = (target.predict_pairs(values) - target.measured) / target.sigma
        squares, count = squares + float(np.sum(np.abs(e) ** 2)), count + 2 * e.size
    for modal in targets.modal:
        r, _ = _modal_residuals(modal, values, np.zeros(0, dtype=int))
        squares, count = squares + float(r @ r), count + r.size
    return float(np.sqrt(squares / count)) if count else float("nan")


def trust(targets: Targets, scale: Scale, values: Array) -> Trust:
    """The intervals and their limits at parameter values (parameters,)."""
    x, free = scale.to_x(values), scale.free
    residuals, slopes = noise_residuals(targets, values, free)
    jacobian = np.nan_to_num(slopes * scale.slope(x))
    lower, upper = scale.bounds()
    information = jacobian.T @ jacobian
    covariance = np.linalg.inv(information + np.diag((4 / (upper - lower)) ** 2))
    inflation, notes = _inflation(targets, values)
    std = np.sqrt(np.diag(covariance))
    correlation = covariance / np.outer(std, std)
    wide = std * inflation
    squares, directions = np.linalg.eigh(information)
    order = np.argsort(squares)[::-1]
    bound = [scale.to_values(np.clip(x + sign * 1.96 * wide, lower, upper))[free] for sign in (-1, 1)]
    parameters = [scale.parameters[n] for n in free]
    unit = np.array([1.0 if p.log else abs(value) / (p.upper - p.lower) * 10 for p, value in zip(parameters, values[free], strict=True)])
    relative = wide / np.maximum(unit, 1e-12)
    status = tuple("determined" if r <= _DETERMINED else "weak" if r <= _UNDETERMINED else "not determined" for r in relative)
    singular = np.sqrt(np.maximum(squares[order], 0.0))
    return Trust(wide, bound[0], bound[1], status, correlation, singular, directions[:, order].T, inflation, len(residuals), tuple(notes))


def inseparable(trust_: Trust, names: list[str]) -> list[tuple[str, ...]]:
    """Groups of parameters that the data cannot tell apart: those that share a direction which J hardly moves."""
    groups: list[tuple[str, ...]] = []
    for singular, direction in zip(trust_.singular_values, trust_.directions, strict=True):
        if singular * _UNDETERMINED >= 1.0:
            continue
        size = np.abs(direction)
        members = tuple(name for name, part in zip(names, size, strict=True) if part > 0.3 * size.max())
        if members not in groups:
            groups.append(members)
    return groups


def _frf_residuals(target: FrfTarget, values: Array, free: Index) -> tuple[Array, Array]:
    h, gradient = target.gradient_pairs(values, free)
    difference = h - target.measured
    if target.noise is None:
        sigma = np.broadcast_to(np.sqrt(np.mean(np.abs(difference) ** 2, axis=0) / 2), difference.shape)
        sigma = np.maximum(sigma, 1e-9 * np.abs(target.measured).max())
    else:
        sigma = target.sigma
    return real_rows(difference / sigma, gradient / sigma[..., None])


def _modal_residuals(target: ModalTarget, values: Array, free: Index) -> tuple[Array, Array]:
    modes, data = complex_modes(*target.system.matrices(values)), target.data
    order = pair_all(target, modes)
    d_frequency, d_damping = frequency_and_damping_gradient(modes, target.system.factors, len(values))
    frequency_std = data.frequency_hz * FREQUENCY_STD if data.frequency_std_hz is None else data.frequency_std_hz
    damping_std = data.damping_ratio * DAMPING_STD if data.damping_std is None else data.damping_std
    known = np.isfinite(data.damping_ratio / damping_std)
    residuals = [
        (modes.frequency_hz[order] - data.frequency_hz) / frequency_std,
        ((modes.damping_ratio[order] - data.damping_ratio) / damping_std)[known],
    ]
    slopes = [d_frequency[order] / frequency_std[:, None], (d_damping[order] / damping_std[:, None])[known]]
    return np.concatenate(residuals), np.concatenate(slopes)[:, free]


def _inflation(targets: Targets, values: Array) -> tuple[float, list[str]]:
    """What the intervals must be widened by, and why.

    A residual above noise counts in full; one that hangs together over neighbouring lines has fewer independent
    values than lines: with correlation r of neighbours, by (1 + r)/(1 - r).
    """
    known = [target for target in targets.frf if target.noise is not None]
    if not known:
        return 1.0, []
    squares = lagged = count = 0.0
    for target in known:
        e = (target.predict_pairs(values) - target.measured) / target.sigma
        squares += float(np.sum(np.abs(e) ** 2))
        lagged += float(np.abs(np.sum(np.conj(e[:-1]) * e[1:])))
        count += 2 * e.size
    level, alike = np.sqrt(squares / count), min(lagged / squares, 0.98)
    if level <= _QUIET:
        return float(max(1.0, level)), []
    if alike <= _ALIKE:
        note = f"the residual is {level:.2f} times the stated noise but without structure: the intervals are widened by it"
        return float(level), [note]
    widened = float(level * np.sqrt((1 + alike) / (1 - alike)))
    note = (
        f"the residual is {level:.2f} times the noise and structured (neighbouring lines correlate by {alike:.2f}): something is "
        "missing from the model or wrong in the data, so values may be biased; the intervals, widened "
        f"{widened:.1f} times, cannot be relied on"
    )
    return widened, [note]


_QUIET, _ALIKE = 1.15, 0.45
"""Gap up to which a residual passes as noise; correlation of neighbouring lines up to which it passes as unstructured (a window that
decays to a third correlates them by 0.33)."""

"""How far a fit can be trusted: covariance and 95 % intervals, parameters that the data do not determine,
structured residuals.

All of it rests on residuals e in units of their noise at the optimum, whichever cost and optimizer found it,
and on their derivatives J on the search scale (ln value for stiffness and damping).  Were the residuals
independent, the covariance would be (J'J)^-1.  They are not: an exponential window smears noise over
neighbouring lines, and noise on the force is common to all responses of an impact.  So the covariance is the
sandwich A^-1 B A^-1 with A = J'J + P and B the variance of the scores J'e, never less than independence says.
P is what the bounds alone say: too weak to matter for a parameter that the data determine, enough to keep the
others finite.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from identify.core.arrays import Array, Mask
from identify.core.parameters import Scale
from identify.core.thresholds import SIGMAS_95, SIGMAS_95_ONE_SIDED

_DETERMINED = np.log(2) / 2
"""Standard deviation of ln value up to which the 95 % interval stays within a factor of two: the parameter is
determined.
"""
AT_LOWER, AT_UPPER = BOUNDS = ("at its lower bound", "at its upper bound")
"""What is said of a parameter that the fit would take further than it may: its interval has one side."""
_AT_BOUND = 1e-6
"""Part of the way between the bounds, on the search scale, that counts as being there."""
_UNDETERMINED = 1.0
"""Above this (95 %: a factor of seven) the data do not determine it."""


@dataclass(frozen=True)
class Uncertainty:
    """Identifiability of the free parameters (f of them).

    std (f,): standard deviation on the search scale; independent_std (f,): that for independent noise; low,
    high (f,): 95 % limits of the values, by std or wider (`with_more`), clipped to the bounds; one-sided for
    a parameter at a bound, which is then the other limit; status (f,): determined, weak, not determined, or
    at a bound; correlation (f, f); singular_values (f,) of J and directions (f, f), a row each; count: real
    numbers measured; notes: sentences of warning.
    """

    std: Array
    independent_std: Array
    low: Array
    high: Array
    status: tuple[str, ...]
    correlation: Array
    singular_values: Array
    directions: Array
    count: int
    notes: tuple[str, ...]
    joint: Joint | None = None


@dataclass(frozen=True)
class Joint:
    """What is known of parameters and nuisance parameters together, on the search scale.

    root (u, u): its product with its transpose is the covariance of all unknowns; noise (f, f): the part of
    the covariance of the free parameters that comes from noise; stated (f, e): what a standard deviation of
    each error contributes to each of them; spread (e,): standard deviation of each error after the fit, in
    units of its own; information (u, u) of data and statements.
    """

    root: Array
    noise: Array
    stated: Array
    spread: Array
    information: Array


def sandwich(
    information: Array,
    variance: Array,
    count: int,
    scale: Scale,
    values: Array,
    notes: tuple[str, ...] = (),
    widening: Array | float = 1.0,
) -> Uncertainty:
    """Uncertainty from J'J and the variance of the scores J'e, both (free, free) on the search scale, of
    `count` residuals at values; standard deviations (free,) are widened by as much.
    """
    bread = _bread(information, scale)
    covariance = bread @ variance @ bread * np.outer(widening, widening)
    return _uncertainty(information, covariance, bread, count, scale, values, notes)


def of_covariance(
    information: Array, covariance: Array, count: int, scale: Scale, values: Array
) -> Uncertainty:
    """Uncertainty from J'J and a covariance (free, free) on the search scale that was found otherwise; never
    less than independent residuals would have.
    """
    bread = _bread(information, scale)
    return _uncertainty(information, covariance.copy(), bread, count, scale, values, ())


def _bread(information: Array, scale: Scale) -> Array:
    """(J'J + P)^-1, with P what the bounds alone say."""
    return np.asarray(np.linalg.inv(information + np.diag(scale.prior_information())), dtype=np.float64)


def _uncertainty(
    information: Array,
    covariance: Array,
    bread: Array,
    count: int,
    scale: Scale,
    values: Array,
    notes: tuple[str, ...],
) -> Uncertainty:
    """bread (free, free): the covariance that independent residuals would have, the least that is
    believed.
    """
    blind = np.flatnonzero(
        np.diag(covariance) <= 0
    )  # the residuals say nothing of these, not even how they scatter
    covariance[blind, blind] = np.diag(bread)[blind]
    widening = np.sqrt(np.maximum(1.0, np.diag(bread) / np.diag(covariance)))
    covariance *= np.outer(widening, widening)
    std = np.sqrt(np.diag(covariance))
    status, low, high = _limits(scale, values, std)
    squares, directions = np.linalg.eigh(information)
    return Uncertainty(
        std=std,
        independent_std=np.sqrt(np.diag(bread)),
        low=low,
        high=high,
        status=status,
        correlation=covariance / np.outer(std, std),
        singular_values=np.sqrt(np.maximum(squares[::-1], 0.0)),
        directions=directions[:, ::-1].T,
        count=count,
        notes=notes,
    )


def _limits(scale: Scale, values: Array, std: Array) -> tuple[tuple[str, ...], Array, Array]:
    """Status and 95 % limits by standard deviations (free,) on the search scale."""
    x, (lower, upper) = scale.to_x(values), scale.bounds()
    status = _with_bounds(statuses(scale, values, std), x, lower, upper)
    reach = np.where([one in BOUNDS for one in status], SIGMAS_95_ONE_SIDED, SIGMAS_95) * std
    low, high = (scale.to_values(np.clip(x + sign * reach, lower, upper))[scale.free] for sign in (-1, 1))
    return status, low, high


def with_more(found: Uncertainty, std: Array, scale: Scale, values: Array, *notes: str) -> Uncertainty:
    """Limits widened by further standard deviations (free,), of what no data and no prediction depend on:
    std and correlation, by which predictions are as sure as they are, stay.
    """
    status, low, high = _limits(scale, values, np.hypot(found.std, std))
    return replace(found, low=low, high=high, status=status, notes=(*found.notes, *notes))


def joint_uncertainty(
    information: Array,
    noise: Callable[[Array], Array],
    errors: Mask,
    count: int,
    scale: Scale,
    values: Array,
    notes: tuple[str, ...] = (),
    widening: Array | float = 1.0,
) -> Uncertainty:
    """Uncertainty of parameters beside nuisance parameters: marginal, with what is known of both.

    information (u, u): J'J of all free unknowns on the search scale; errors (u,): which of them are errors,
    each in units of its standard deviation.  noise gives, for some combinations (c, u) of the scores J'e,
    their variance (c, c).  scale, values: those of the parameters, whose standard deviations by noise (f,)
    are widened by as much.
    """
    known, own = np.ones(len(errors)), np.flatnonzero(~errors)
    known[own] = scale.prior_information()
    root = _root_of_inverse(information, known)
    bread = root @ root.T
    from_noise = noise(bread[own]) * np.outer(widening, widening)
    summary = partial(_uncertainty, count=count, scale=scale, values=values, notes=notes)
    return _marginal(root, information + np.diag(known), from_noise, errors, summary)


def propagated_uncertainty(
    information: Array,
    variance: Array,
    moved: Array,
    count: int,
    scale: Scale,
    values: Array,
    notes: tuple[str, ...] = (),
    widening: Array | float = 1.0,
) -> Uncertainty:
    """`sandwich` of parameters that were fitted with nuisance parameters held at nothing: moved (f, e) is
    how far a standard deviation of each error moves the optimum, on the search scale.

    The truth is the optimum, plus what noise does, plus moved times the errors, of which the data then tell
    nothing: each stays as stated.
    """
    prior = scale.prior_information()
    own_root, bread = _root_of_inverse(information, prior), _bread(information, scale)
    from_noise = bread @ variance @ bread * np.outer(widening, widening)
    size, count_of_errors = moved.shape
    errors = np.arange(size + count_of_errors) >= size
    root = np.block([[own_root, moved], [np.zeros(moved.shape[::-1]), np.eye(count_of_errors)]])
    without = information + np.diag(prior)
    across = -without @ moved
    both = np.block([[without, across], [across.T, np.eye(count_of_errors) - moved.T @ across]])
    summary = partial(_uncertainty, count=count, scale=scale, values=values, notes=notes)
    return _marginal(root, both, from_noise, errors, summary)


def _marginal(
    root: Array,
    information: Array,
    from_noise: Array,
    errors: Mask,
    summary: Callable[[Array, Array, Array], Uncertainty],
) -> Uncertainty:
    """Of the parameters, with what is known of both: root (u, u) of the inverse of the information (u, u);
    from_noise (f, f): the covariance that noise alone makes of the parameters; summary: what is said of
    information, covariance and its inverse, each (f, f).
    """
    own, bread = np.flatnonzero(~errors), root @ root.T
    stated = bread[np.ix_(own, np.flatnonzero(errors))]
    directions, sizes, _ = np.linalg.svd(root[own], full_matrices=False)  # the root is far from singular
    reduced = (directions / sizes**2) @ directions.T
    found = summary(reduced, from_noise + stated @ stated.T, bread[np.ix_(own, own)])
    more = np.ones(len(errors))
    more[own] = found.std / found.independent_std
    spread = np.sqrt(np.diag(bread)[errors])
    joint = Joint(more[:, None] * root, from_noise, stated, spread, information)
    return replace(found, joint=joint)


def _root_of_inverse(information: Array, known: Array) -> Array:
    """A root R of the inverse R R' of information (u, u) of data and what is known (u,) of each without them.

    Of what data tell less than rounding errors are, only the latter counts: the inverse itself need not be
    positive definite.
    """
    size = np.sqrt(np.diag(information) + known)
    squares, directions = np.linalg.eigh((information + np.diag(known)) / np.outer(size, size))
    alone = (known / size**2) @ directions**2
    squares = np.where(squares > len(size) * np.finfo(float).eps * squares[-1], squares, alone)
    return np.asarray(directions / np.sqrt(squares) / size[:, None])


def inseparable(trusted: Uncertainty, names: list[str]) -> list[tuple[str, ...]]:
    """What the data do not determine, alone or in combination: the parameters of each direction that J hardly
    moves.
    """
    groups: list[tuple[str, ...]] = []
    for singular, direction in zip(trusted.singular_values, trusted.directions, strict=True):
        size = np.abs(direction)
        members = tuple(name for name, part in zip(names, size, strict=True) if part > 0.3 * size.max())
        if singular * _UNDETERMINED < 1.0 and members not in groups:
            groups.append(members)
    return groups


def statuses(scale: Scale, values: Array, std: Array) -> tuple[str, ...]:
    """determined, weak or not determined, per free parameter, from the standard deviation on the search
    scale.
    """
    parameters = [scale.parameters[number] for number in scale.free]
    size = np.array(
        [
            1.0 if p.log else abs(v) / (p.upper - p.lower) * 10
            for p, v in zip(parameters, values[scale.free], strict=True)
        ]
    )
    relative = std / np.maximum(size, 1e-12)
    return tuple(
        "determined" if r <= _DETERMINED else "weak" if r <= _UNDETERMINED else "not determined"
        for r in relative
    )


def _with_bounds(status: tuple[str, ...], x: Array, lower: Array, upper: Array) -> tuple[str, ...]:
    """The statuses of parameters at x (free,), those at a bound said to be there."""
    near = _AT_BOUND * (upper - lower)
    return tuple(
        AT_LOWER if low else AT_UPPER if high else one
        for one, low, high in zip(status, x <= lower + near, x >= upper - near, strict=True)
    )


def at_bounds(trusted: Uncertainty, scale: Scale) -> str:
    """A sentence that names the parameters at a bound; empty where there is none."""
    parameters = [scale.parameters[number] for number in scale.free]
    found = [
        f"{p.name} ({p.lower if status == AT_LOWER else p.upper:.4g} {p.unit})"
        for p, status in zip(parameters, trusted.status, strict=True)
        if status in BOUNDS
    ]
    if not found:
        return ""
    return f"At a bound: {', '.join(found)}: widen `bounds`, or something is missing from the model."

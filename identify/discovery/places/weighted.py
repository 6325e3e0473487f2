"""A fitted place once more, by generalised least squares: its dynamic stiffness is sharper so, and its
uncertainty is known.

Noise of a force multiplies all responses to it alike, so that residuals scatter more along H than across it.
Divided by that scatter they are independent, and the normal equations say how sure the unknowns are.  How
sure the known parameters are is said by the scores of each force, because neighbouring lines are correlated
(`identify.vibration.uncertainty.score_variance`).  An error that all lines of a force share, as of a hammer
held askew, shows in neither: it is seen by how far everything moves when each force is left out in turn (as
in `identify.fitting.jackknife`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from identify.core.arrays import Array, Complex
from identify.core.parameters import Scale
from identify.discovery.places.normal import LEAST, Normal, normal_equations, scaled, step_of, sums
from identify.discovery.places.predict import ForceResponses, StructuralModel, Unknown
from identify.discovery.places.semiparametric import SemiParametricFit
from identify.vibration.uncertainty import FEWEST_BLOCKS, KNOWN, common_variance, score_variance

_ROUNDS = 3
_HELD = 1e-10
"""Share of the largest information below which a combination of parameters is not determined."""
_STATED = 2.0
"""Squares of a residual over noise, of both its parts together."""
_LEAST_LEFT = 0.02
"""Share of a force's noise that is taken to be left in its residual at least, whatever the unknown of the
line took up."""


@dataclass(frozen=True)
class WeightedFit:
    """Unknown and known parameters by generalised least squares, with their normal equations; known (p, p):
    covariance of the parameters on the search scale; wider: variance of the unknowns over that of independent
    noise, at least 1.
    """

    unknown: Unknown
    values: Array
    normal: Normal
    known: Array
    wider: float

    @property
    def covariance(self) -> Complex:
        """(l, m, m): of the unknowns by themselves, each part's."""
        return np.asarray(self.wider * self.normal.inverse)

    @property
    def through(self) -> Complex:
        """(l, m, p): how the unknowns follow the parameters."""
        return np.asarray(-self.normal.inverse @ self.normal.coupling)


@dataclass(frozen=True)
class ForceNoise:
    """Variance of one force's residuals: common (l,) along H, of which `along` (l, r) are unit vectors, rest
    across it.
    """

    along: Complex
    common: Array
    rest: float

    def whitened(self, force: ForceResponses) -> ForceResponses:
        """In units of that noise."""
        across = np.sqrt(_STATED / self.rest)
        extra = (np.sqrt(_STATED / self.common) - across)[:, None]

        def turned(array: Complex) -> Complex:
            flat = array.reshape(*array.shape[:2], -1)
            along = np.conj(self.along)[:, None] @ flat * extra[..., None]
            return np.asarray(across * flat + self.along[..., None] * along).reshape(array.shape)

        return replace(
            force,
            residual=turned(force.residual),
            by_unknown=turned(force.by_unknown),
            by_parameter=turned(force.by_parameter),
            h=turned(force.h),
        )


def force_noise(force: ForceResponses, inverse: Complex, *, stated: bool = False) -> ForceNoise:
    """From its residuals and the inverse (lines, m, m) of the normal equations that left them.

    What the unknowns took up of the noise is given back (Bell and McCaffrey, Survey Methodology 28-2, 2002).
    stated: the noise of the rest is as stated, whatever the residual says.
    """
    e, j, inverse = force.residual, force.by_unknown, inverse[force.lines]
    size = np.linalg.norm(force.h, axis=1)
    along = force.h / np.where(size > 0, size, 1.0)[:, None]
    common = np.sum(np.conj(along) * e, axis=1)
    rest = e - common[:, None] * along
    pull = np.conj(along)[:, None] @ j
    taken = (pull @ inverse @ np.conj(np.swapaxes(pull, 1, 2)))[:, 0, 0].real
    whole = np.einsum("lrm,lmn,lrn->l", j, inverse, np.conj(j)).real
    freedom = rest.size - len(rest) - float(np.sum(whole - taken))
    level = _STATED if stated else max(float(np.sum(np.abs(rest) ** 2)) / max(freedom, 1.0), _STATED)
    squares = np.abs(common) ** 2 / np.maximum(1 - taken, _LEAST_LEFT)
    return ForceNoise(along, common_variance(squares, size**2, level), level)


def weighted_fit(model: StructuralModel, fit: SemiParametricFit, scale: Scale) -> WeightedFit:
    """From where a place ended, a few steps of everything while they help."""
    x, values, unknown, count = scale.to_x(fit.values), fit.values, fit.unknown, len(fit.unknown.values)
    lower, upper = scale.bounds()
    forces = _forces(model, unknown, values, scale)
    noise = [force_noise(force, fit.normal.inverse) for force in forces]
    white = _whitened(noise, forces)
    normal = normal_equations(white, [force.lines for force in white], count)
    for _ in range(_ROUNDS):
        step, change = step_of(normal, LEAST)
        trial = np.clip(x + np.clip(step, -1, 1), lower, upper)
        new = scale.to_values(trial)
        moved = model.refreshed(Unknown(unknown.values + change, unknown.reference), new)
        tried = _whitened(noise, _forces(model, moved, new, scale))
        if not _squares(tried) < _squares(white):
            break
        x, values, unknown, white = trial, new, moved, tried
        normal = normal_equations(white, [force.lines for force in white], count)
    return _widened(WeightedFit(unknown, values, normal, _of_parameters(white, normal), 1.0), white, scale)


def _forces(model: StructuralModel, unknown: Unknown, values: Array, scale: Scale) -> list[ForceResponses]:
    """All forces of all sets, derivatives on the search scale."""
    parts = model.predict(unknown, values, scale.free, model.rests(unknown, values))
    parts = scaled(parts, scale.slope(scale.to_x(values)))
    views = zip(parts, model.views, strict=True)
    return [force for part, view in views for force in part.by_force(view.lines)]


def _whitened(noise: Sequence[ForceNoise], forces: Sequence[ForceResponses]) -> list[ForceResponses]:
    return [one.whitened(force) for one, force in zip(noise, forces, strict=True)]


def _squares(forces: Sequence[ForceResponses]) -> float:
    return sum(float(np.sum(np.abs(force.residual) ** 2)) for force in forces)


def _of_parameters(forces: Sequence[ForceResponses], normal: Normal) -> Array:
    """(p, p): covariance of the known parameters.  What the unknowns compensate for entirely, as they do for
    the spring beside which they act, is held.
    """
    through = -normal.inverse @ normal.coupling
    variance, count = np.zeros_like(normal.information), 0
    for force in forces:
        slopes = force.by_parameter + force.by_unknown @ through[force.lines]
        variance += score_variance(force.residual, slopes, force.h)
        count += 2 * force.residual.size
    variance *= count / max(1, count - 2 * normal.determined - len(variance))
    bread = np.linalg.pinv(normal.information, rcond=_HELD, hermitian=True)
    return np.asarray(bread @ variance @ bread)


def _widened(fit: WeightedFit, forces: Sequence[ForceResponses], scale: Scale) -> WeightedFit:
    """By how far parameters, and then unknowns, scatter when each force is left out, where that is more than
    stated: the parameters by the mean of all that are known, the unknowns by the middle of all lines.
    """
    if len(forces) < FEWEST_BLOCKS:
        return fit
    total = sums(forces, [force.lines for force in forces], len(fit.unknown.values))
    prior = scale.prior_information()
    there = _rest_of(fit.normal, prior)
    steps = [_rest_of(total.without(force, force.lines).normal(), prior) for force in forces]
    moved = np.sum([(step - there[0]) ** 2 for step, _ in steps], axis=0)
    change = np.sum([np.abs(change - there[1]) ** 2 for _, change in steps], axis=0)
    variance = np.diag(fit.known)  # 0 of what is held
    sure = (np.diag(fit.normal.information) > KNOWN * prior) & (variance > 0)
    ratio = float(np.mean(moved[sure] / variance[sure])) if sure.any() else 1.0
    known = max(ratio, 1.0) * fit.known
    own = np.einsum("lmm->lm", fit.normal.inverse).real
    stated = 2 * own + np.einsum("lmx,xy,lmy->lm", np.conj(fit.through), known, fit.through).real
    wider = float(np.median((change / np.where(own > 0, stated, 1.0))[own > 0])) if (own > 0).any() else 1.0
    return replace(fit, known=known, wider=max(wider, 1.0))


def _rest_of(normal: Normal, prior: Array) -> tuple[Array, Complex]:
    """How far parameters and unknowns still are from the least squares of some of the forces."""
    step = np.asarray(-np.linalg.solve(normal.information + np.diag(prior), normal.gradient), dtype=float)
    return step, normal.change(step)

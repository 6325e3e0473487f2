"""What a fitted model does not explain of the FRFs that it was fitted to, as errors of its stiffnesses.

A model that lacks something has no one stiffness that is right everywhere: each line and posture would have
its own.  So the residual of a FRF is taken as noise and the effect of a relative error xi_j of every
stiffness k_j,

    H - H_fit = noise + sum_j (dH / d ln k_j) xi_j,    E|noise|^2 = 2 theta sigma^2,  E|xi_j|^2 = tau_j^2,

xi complex (its imaginary part is damping), of mean zero, anew at every line.  The tau_j are variance
components: |H - H_fit|^2 has the mean 2 theta sigma^2 + sum_j |dH / d ln k_j|^2 tau_j^2, linear in tau_j^2
and in theta, by which the noise is more or less than was stated (what is spread as noise is in the fit's own
covariance already, and is no misfit).  They are found by scoring, weighted least squares with the weights of
the last step (for powers that are exponential, as those of complex normal errors are, that is maximum
likelihood; McCullagh and Nelder 1989, chapter 8).  The same errors then act at a tool and a posture that were
not measured.
"""

from __future__ import annotations

import numpy as np
import scipy

from identify.core.arrays import Array, Index
from identify.measured.channel import Channel
from identify.measured.frf_set import POWER
from identify.model.frf import frf_and_gradient
from identify.model.system import System
from identify.results.fit import FitResult, FrfComparison
from identify.vibration.costs.make_target import channel_rows
from identify.vibration.fitted_model import FittedModel

_ROUNDS = 8
_LEAST = 1e-12


def misfit(result: FitResult, model: FittedModel) -> Array:
    """tau (p,): RMS of the relative errors of the parameters that are stiffnesses, 0 of the others; zeros
    where no FRFs were fitted.
    """
    owners = _stiffnesses(model.system(model.posture))
    powers, slopes, noise = [np.zeros(0)], [np.zeros((0, len(owners)))], [np.zeros(0)]
    for name, one in result.measurements.items():
        if one.use != "fit" or one.frf is None or not owners.size:
            continue
        left = np.abs(one.frf.measured - one.frf.fitted) ** 2
        known = np.zeros_like(left) if one.frf.noise is None else 2 * one.frf.noise**2
        system = model.system(np.deg2rad(one.posture_deg), model.driven.get(name, frozenset()))
        slope = _slopes(model, system, one.frf, owners)
        kept = np.isfinite(left) & (left + known > 0)
        powers.append(left[kept])
        noise.append(known[kept])
        slopes.append(slope[kept])
    found = np.zeros(len(model.values))
    found[owners] = np.sqrt(
        components(
            np.concatenate(powers), np.concatenate(noise), np.concatenate(slopes), len(result.correlation)
        )
    )
    return found


def components(power: Array, noise: Array, slope: Array, fitted: int) -> Array:
    """tau^2 (p,), of relative errors, from |residual|^2 (c,), what the stated noise has of it (c,), and
    |dH / d ln k|^2 (c, p); fitted: how many real numbers the fit took from the residual.
    """
    if not power.size:
        return np.zeros(slope.shape[1])
    if noise.any():
        columns = np.concatenate([noise[:, None], slope], axis=1)
        return _scored(power, noise, columns, fitted)[1:]
    return _scored(power, np.full(power.shape, power.mean()), slope, fitted)


def _scored(power: Array, mean: Array, columns: Array, fitted: int) -> Array:
    """(p,) >= 0, with which columns (c, p) have the mean of powers (c,); mean (c,): the first guess of it."""
    left, least = max(1.0 - fitted / (2 * power.size), _LEAST), power.mean() * _LEAST
    mean = mean + least
    size = np.sqrt(np.maximum(np.mean((columns / mean[:, None]) ** 2, axis=0), np.finfo(float).tiny))
    found = np.zeros(columns.shape[1])
    for _ in range(_ROUNDS):
        rows = columns / (size * mean[:, None])
        # the normal equations have as many rows as there are components
        product, score = rows.T @ rows, rows.T @ (power / left / mean)
        root = np.linalg.cholesky(product + _LEAST * np.trace(product) * np.eye(len(product)))
        found = scipy.optimize.nnls(root.T, np.linalg.solve(root, score))[0] / size
        mean = columns @ found + least
    return np.asarray(found)


def _stiffnesses(system: System) -> Index:
    """Numbers of the parameters that act as stiffness."""
    factors = system.factors
    return np.unique(factors.owner[(factors.power == 0) & (np.asarray(factors.weight).real != 0)])


def _slopes(model: FittedModel, system: System, frf: FrfComparison, owners: Index) -> Array:
    """|dH / d ln k|^2 (lines, pairs, owners) of measured FRFs, without what instruments do to them."""
    outputs, inputs = (tuple(dict.fromkeys(texts)) for texts in (frf.output, frf.input))
    out, force = (
        channel_rows(system, model.points, tuple(map(Channel.parse, texts)), "misfit")
        for texts in (outputs, inputs)
    )
    s = np.asarray(frf.window_decay_per_s + 2j * np.pi * frf.frequency_hz, dtype=complex)
    matrices = system.matrices(model.values)
    power = POWER[frf.quantity]
    _, gradient = frf_and_gradient(matrices, system.factors, s, out, force.T, power, owners)
    rows = [outputs.index(text) for text in frf.output]
    columns = [inputs.index(text) for text in frf.input]
    return np.asarray(np.abs(gradient[:, rows, columns] * model.values[owners]) ** 2)

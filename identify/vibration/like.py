"""What a fitted robot tells of another one of its type, before that is measured: where its parameters start,
and the bounds that hold 95 % of such robots.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np

from identify.core.parameters import Parameter
from identify.results.discovery import fit_of
from identify.vibration.fitted_model import FittedModel, fitted_model

_SIGMAS = 2.0
"""Bounds are a 95 % interval (`identify.core.parameters.Scale.prior_information`)."""


def as_in_type(parameters: tuple[Parameter, ...], path: Path, spread: float) -> tuple[Parameter, ...]:
    """Parameters that the other robot has too start at its values, within two standard deviations of what is
    uncertain of these and differs between robots; others, and those that stay fixed, are as they are.

    Raises InputError for a file that is no fit.
    """
    model, names = _model(path.resolve(), path.stat().st_mtime_ns if path.exists() else 0)
    rows = {name: row for row, name in enumerate(names)}
    return tuple(_within(p, model, rows[p.name], spread) if p.name in rows else p for p in parameters)


@lru_cache(maxsize=4)
def _model(path: Path, changed: int) -> tuple[FittedModel, tuple[str, ...]]:
    fit = fit_of(path)
    model = fitted_model(fit, str(path))
    return model, tuple(p.name for p in model.system(model.posture).parameters)


def _within(p: Parameter, model: FittedModel, row: int, spread: float) -> Parameter:
    value = float(np.clip(model.values[row], p.lower, p.upper))
    own = float(np.linalg.norm(model.spread[row]))
    if not p.free or (p.log and value <= 0):
        return p
    if p.log:
        reach = np.exp(_SIGMAS * np.hypot(own / value, spread))
        low, high = value / reach, value * reach
    else:
        reach = _SIGMAS * np.hypot(own, spread * abs(value))
        low, high = value - reach, value + reach
    # as few digits as a config that discovery writes keeps of a value that is there
    low, high = (float(f"{side:.4g}") for side in (low, high))
    low, high = max(p.lower, low), min(p.upper, high)
    value = min(max(value, low), high)
    return replace(p, initial=value, lower=low, upper=high) if low < high else p

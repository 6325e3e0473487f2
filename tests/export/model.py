"""The model of a result as it is exported, for comparison."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from identify.export.linear import LinearModel, linear_model
from identify.results.discovery import fit_of
from identify.vibration.fitted_model import fitted_model, posture_of

BAND = (3.0, 80.0)
LINES = np.linspace(*BAND, 40)


def model_of(path: Path, posture: str | None = None) -> LinearModel:
    """At a posture, as `identify export --posture` takes it."""
    fit = fit_of(path)
    model = fitted_model(fit, str(path))
    return linear_model("x", fit, model, posture_of(posture, fit, model), BAND)


def by_solve(mass: np.ndarray, damping: np.ndarray, stiffness: np.ndarray, out: np.ndarray) -> np.ndarray:
    """(l, p, p): receptances at LINES, line by line."""
    s = 2j * np.pi * LINES
    return np.array([out @ np.linalg.solve(stiffness + x * damping + x * x * mass, out.T) for x in s])


def error(found: np.ndarray, right: np.ndarray) -> float:
    """The largest difference over the largest value of the line."""
    return float((np.abs(found - right).max(axis=(1, 2)) / np.abs(right).max(axis=(1, 2))).max())

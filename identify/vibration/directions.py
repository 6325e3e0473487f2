"""The direction in which a coupled pair of springs is most compliant, with its 95 % interval."""

from __future__ import annotations

import numpy as np

from identify.core.arrays import Array
from identify.core.thresholds import SIGMAS_95
from identify.fitting.uncertainty import Uncertainty
from identify.model.effects.coupling import coupled_with
from identify.vibration.problem import Problem
from identify.vibration.uncertainty import covariance_root

_OPEN = 30.0
"""Half an interval, degrees, from which on a direction is not reported."""


def soft_directions(problem: Problem, trusted: Uncertainty, values: Array) -> list[str]:
    """A sentence for each coupled pair at values (unknowns,): for example of a joint's tilt."""
    numbers = {p.name: number for number, p in enumerate(problem.parameters)}
    pairs = [
        [numbers[one] for one in (*pair, name)]
        for name in numbers
        if name.endswith(".stiffness") and (pair := coupled_with(name))
    ]
    if not pairs:
        return []
    free, root = covariance_root(problem, trusted, values)
    every = np.zeros((len(values), root.shape[1]))
    every[free] = root
    between = [problem.parameters[own[-1]] for own in pairs]
    return [_sentence(p.name, p.unit, values[own], every[own]) for p, own in zip(between, pairs, strict=True)]


def _sentence(name: str, unit: str, matrix: Array, root: Array) -> str:
    """matrix (3,): xx, yy, xy; root (3, u) of their covariance."""
    x, y, xy = matrix
    soft, stiff = np.linalg.eigvalsh([[x, xy], [xy, y]])
    across, both = x - y, 2 * xy
    angle = np.degrees(np.arctan2(both, across) / 2) + 90.0
    slope = np.degrees(np.array([-both, both, 2 * across]) / (2 * (across**2 + both**2)))
    half = SIGMAS_95 * float(np.linalg.norm(slope @ root))
    body, axes, _ = name.split(".")
    turns = axes.startswith("r")
    what = f"{body} {'turns most easily about' if turns else 'is most compliant along'}"
    values = f"{soft:.4g} {unit} there, {stiff:.4g} {unit} across it"
    if not half < _OPEN:
        return f"{what} a direction across its z axis that the data do not determine: {values}."
    angle_deg = (angle + 90.0) % 180.0 - 90.0
    return f"{what} a direction {angle_deg:.1f}° ± {half:.2g}° from its x axis towards y: {values}."

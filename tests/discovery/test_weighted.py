"""The noise that residuals tell once unknowns of every line have taken their part, and how sure that leaves
the parameters: against noise that is drawn.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from identify.core.arrays import Complex
from identify.discovery.places.normal import normal_equations
from identify.discovery.places.predict import ForceResponses
from identify.discovery.places.weighted import _of_parameters, force_noise

LINES, OUTPUTS, UNKNOWNS, PARAMETERS = 120, 4, 2, 3
LEVEL = 3.0
"""Noise over what is stated."""


def _white(rng: np.random.Generator, *shape: int) -> NDArray[np.complex128]:
    return rng.normal(size=shape) + 1j * rng.normal(size=shape)


def _fitted(seed: int, forces: int = 1, level: float = LEVEL) -> tuple[list[ForceResponses], Complex]:
    """Responses to some forces that are noise alone, after least squares of the unknowns of every line, which
    all forces share, and of the parameters; inverse of the normal equations of the unknowns.
    """
    rng, lines = np.random.default_rng(seed), np.arange(LINES)
    made = [
        ForceResponses(
            lines,
            level * _white(rng, LINES, OUTPUTS),
            _white(rng, LINES, OUTPUTS, UNKNOWNS),
            _white(rng, LINES, OUTPUTS, PARAMETERS),
            np.exp(1j * rng.uniform(0, 6, (LINES, OUTPUTS))),  # as large at all lines
        )
        for _ in range(forces)
    ]
    normal = normal_equations(made, [lines] * forces, LINES)
    step = -np.linalg.solve(normal.information, normal.gradient)
    change = normal.change(step)
    left = [
        replace(
            one,
            residual=one.residual + one.by_parameter @ step + np.einsum("lrm,lm->lr", one.by_unknown, change),
        )
        for one in made
    ]
    return left, normal.inverse


def test_noise_is_told_right_where_unknowns_take_half_of_it() -> None:
    """Two of four responses of a line: of what is left, half is noise of the unknowns."""
    rest, common = [], []
    for seed in range(20):
        [force], inverse = _fitted(seed)
        rest.append(force_noise(force, inverse).rest)
        common.append(np.mean(force_noise(force, inverse, stated=True).common))
    assert np.mean(rest) == pytest.approx(2 * LEVEL**2, rel=0.06)
    assert np.mean(common) == pytest.approx(2 * LEVEL**2, rel=0.12)
    left = np.mean([np.mean(np.abs(_fitted(seed)[0][0].residual) ** 2) for seed in range(20)])
    assert left < 0.55 * 2 * LEVEL**2, "negative control: what is seen of it is half"


def test_parameters_are_as_sure_as_they_scatter_beside_unknowns_of_every_line() -> None:
    """Closed form: level^2 (J'J)^-1 once the unknowns are out of J."""
    ratio = []
    for seed in range(30):
        forces, _ = _fitted(seed, forces=2)
        normal = normal_equations(forces, [one.lines for one in forces], LINES)
        expected = LEVEL**2 * np.linalg.inv(normal.information)
        ratio.append(np.diag(_of_parameters(forces, normal)) / np.diag(expected))
    assert np.mean(ratio) == pytest.approx(1, abs=0.06)

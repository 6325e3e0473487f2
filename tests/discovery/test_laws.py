"""Which law a curve follows: curves in closed form, with noise, at a place that opposes what a body on a
spring does.
"""

from __future__ import annotations

import numpy as np
import pytest

from identify.core.arrays import Array, Complex
from identify.discovery.places.laws import LAWS, Ranked, rank_laws
from identify.discovery.places.predict import Unknown
from identify.discovery.places.semiparametric import Normal, SemiParametricFit
from identify.discovery.places.update import a_of, triangle

S = 0.7 + 2j * np.pi * np.linspace(5, 80, 60)
DAMPED, LATE = "spring and damper k + s c", "spring that acts late k e^(-s tau)"
HYSTERETIC, MASS = "hysteretic spring k (1 + j eta)", "mass m s^2"
BODY, RELAXING = "body on a spring and damper", "spring with one relaxation time"


def _ranked(stiffness: Complex, noise: float = 1e-3) -> list[Ranked]:
    """Laws of a curve that is known to a share of what it and the place oppose."""
    reference = (2e5 + 40.0 * S + 2.0 * S**2)[:, None, None]
    rng, a = np.random.default_rng(1), 1 / (stiffness + reference[:, 0, 0])
    sigma = noise * np.abs(a)
    measured = a + sigma * (rng.normal(size=len(S)) + 1j * rng.normal(size=len(S)))
    gram = (1 / sigma**2).astype(complex)[:, None, None]
    nothing: Array = np.zeros((len(S), 1, 1), dtype=complex)
    normal = Normal(
        gram, 1 / gram, nothing, nothing[..., 0], np.eye(1), np.zeros(1), taken=0.0, determined=len(S)
    )
    count = 2 * len(S) * 30
    unknown = Unknown(measured[:, None], reference)
    fit = SemiParametricFit(unknown, np.zeros(1), 0.0, float(count), count, 2 * len(S), normal)
    return rank_laws(fit, (1 / measured)[:, None, None] - reference, S, 1.0)


@pytest.mark.parametrize(
    ("name", "curve"),
    [
        (DAMPED, 3e5 + 150 * S),
        (LATE, 3e5 * np.exp(-1.2e-3 * S)),
        (f"{HYSTERETIC}, with {MASS}", 3e5 * (1 + 0.2j) + 1.5 * S**2),
        (f"{RELAXING}, with {MASS}", 2e5 + S * 400 * 3e5 / (3e5 + 400 * S) + 1.5 * S**2),
        (
            f"{DAMPED}, with {BODY}",
            3e5 + 100 * S + 2 * S**2 * (8e4 + 20 * S) / (8e4 + 20 * S + 2 * S**2),
        ),
        (f"{DAMPED}, with {LATE}", 3e5 + 150 * S + 2e5 * np.exp(-6e-3 * S)),
    ],
)
def test_the_law_of_a_curve_comes_first(name: str, curve: Complex) -> None:
    """Also that of a plain spring and damper, which every sum could follow as well, for a price."""
    ranked = _ranked(curve)
    assert ranked[0].law.name == name
    assert ranked[0].log_odds > 3
    assert len({law.name for law in LAWS}) == len(LAWS)


def test_two_springs_between_the_coordinates_are_springs() -> None:
    """Turned by 30 degrees, one thirty times as stiff as the other."""
    turn = np.array([[np.cos(np.pi / 6), -0.5], [0.5, np.cos(np.pi / 6)]])
    own = np.zeros((len(S), 2, 2), dtype=complex)
    own[:, 0, 0], own[:, 1, 1] = 6e4 + 30 * S, 2e3 + 2 * S
    curve = turn @ own @ turn.T
    reference = (2e4 + 4.0 * S + 0.2 * S**2)[:, None, None] * np.eye(2)
    measured = triangle(a_of(curve, reference, 1.0))
    sigma = 1e-3 * np.abs(measured)
    rng = np.random.default_rng(2)
    noisy = measured + sigma * (rng.normal(size=sigma.shape) + 1j * rng.normal(size=sigma.shape))
    gram = (1 / sigma**2).astype(complex)[..., None] * np.eye(3)
    nothing: Array = np.zeros((len(S), 3, 1), dtype=complex)
    normal = Normal(
        gram,
        np.linalg.inv(gram),
        nothing,
        nothing[..., 0],
        np.eye(1),
        np.zeros(1),
        taken=0.0,
        determined=6 * len(S),
    )
    count = 6 * len(S) * 30
    unknown = Unknown(noisy, reference)
    fit = SemiParametricFit(unknown, np.zeros(1), 0.0, float(count), count, 6 * len(S), normal)
    ranked = rank_laws(fit, curve, S, 1.0)
    assert ranked[0].law.name == DAMPED
    assert ranked[0].gap == pytest.approx(1.0, abs=0.03)


def test_a_delay_is_no_damper() -> None:
    """What acts late has an imaginary part below zero, which no spring and damper has."""
    by_name = {one.law.name: one for one in _ranked(3e5 * np.exp(-1.2e-3 * S))}
    assert by_name[LATE].values[0] == pytest.approx([3e5, 1.2e-3], rel=0.02)
    assert by_name[DAMPED].gap > 2 * by_name[LATE].gap
    ahead = {one.law.name: one for one in _ranked(3e5 + 150 * S)}
    assert ahead[LATE].gap > 2 * ahead[DAMPED].gap

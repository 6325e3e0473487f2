"""MAC and its family against closed forms, invariances and negative controls."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from identify.modal import mac as family


def random_shapes(seed: int, modes: int, channels: int) -> np.ndarray:
    random = np.random.default_rng(seed)
    return random.normal(size=(modes, channels)) + 1j * random.normal(size=(modes, channels))


@settings(deadline=None)
@given(st.integers(0, 10_000), st.floats(0.01, 100), st.floats(-3, 3))
def test_mac_is_blind_to_scale_and_phase_and_lies_between_0_and_1(
    seed: int, scale: float, phase: float
) -> None:
    a, b = random_shapes(seed, 3, 5), random_shapes(seed + 1, 4, 5)
    matrix = family.mac(a, b)
    assert matrix.shape == (3, 4)
    assert np.all((matrix >= 0) & (matrix <= 1 + 1e-12))
    np.testing.assert_allclose(family.mac(a * scale * np.exp(1j * phase), b), matrix, rtol=1e-9)
    np.testing.assert_allclose(np.diag(family.auto_mac(a)), 1)


@settings(deadline=None)
@given(st.integers(0, 10_000))
def test_macx_does_not_see_conjugation_and_mac_does(seed: int) -> None:
    a, b = random_shapes(seed, 3, 6), random_shapes(seed + 1, 2, 6)
    np.testing.assert_allclose(family.macx(a.conj(), b), family.macx(a, b), rtol=1e-9)
    np.testing.assert_allclose(np.diag(family.macx(a, a.conj())), 1)
    assert np.all(np.diag(family.mac(a, a.conj())) < 0.99)
    assert np.all(family.macx(a, b) <= 1 + 1e-12)


def test_macx_of_real_shapes_is_mac() -> None:
    a, b = random_shapes(1, 3, 6).real, random_shapes(2, 2, 6).real
    np.testing.assert_allclose(family.macx(a, b), family.mac(a, b))


def test_mac_by_hand() -> None:
    assert family.mac(np.array([1.0, 1.0]), np.array([1.0, 0.0]))[0, 0] == pytest.approx(0.5)
    assert family.mac(np.array([1.0, 1.0]), np.array([1.0, -1.0]))[0, 0] == 0
    assert family.mac(np.zeros(2), np.ones(2))[0, 0] == 0


def test_comac_finds_the_channel_that_disagrees() -> None:
    a = random_shapes(3, 4, 30).real
    b = a * np.array([[2.0], [-1.0], [0.5], [1.0]])
    np.testing.assert_allclose(family.comac(a, b), 1)
    b[:, 2] *= np.array([0.0, 1.0, 2.0, 0.2])
    assert np.argmin(family.comac(a, b)) == 2
    with pytest.raises(ValueError, match="paired"):
        family.comac(a, b[:3])


def test_phase_collinearity_and_deviation() -> None:
    real = random_shapes(4, 2, 8).real * np.exp(1j * np.array([[0.3], [-2.0]]))
    np.testing.assert_allclose(family.mpc(real), 1)
    np.testing.assert_allclose(family.mpd(real), 0, atol=1e-7)
    wave = np.exp(1j * np.arange(8) * np.pi / 4)
    np.testing.assert_allclose(family.mpc(wave), 0, atol=1e-12)
    assert family.mpd(wave)[0] > 0.6
    # Two channels of equal size an angle 2d apart: each is d from the line between them.
    np.testing.assert_allclose(family.mpd(np.exp(1j * np.array([0.1, -0.1]))), 0.1)


def test_frac_is_blind_to_level() -> None:
    a = random_shapes(5, 7, 12).reshape(7, 4, 3)
    assert family.frac(a, a).shape == (4, 3)
    np.testing.assert_allclose(family.frac(a, 2 * a), 1)
    assert np.all(family.frac(a, a.conj()) < 0.99)
    with pytest.raises(ValueError, match="line by line"):
        family.frac(a, a[:5])


def test_shapes_on_different_channels_are_refused() -> None:
    with pytest.raises(ValueError, match="4 and 5 channels"):
        family.mac(np.ones(4), np.ones(5))

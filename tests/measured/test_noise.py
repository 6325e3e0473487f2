"""The noise that is stated against the noise that is there, over many simulated hammer tests of four
averages.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from identify.core.errors import InputError
from identify.measured.channel import Channel
from identify.measured.estimators import frf_from_impacts
from identify.measured.frf_set import FrfSet
from identify.measured.loaders import FrfFileOptions, load_frf_set
from identify.measured.noise import (
    _hats,
    mean_of_repeats,
    noise_std,
    noise_std_from_repeats,
    pooled_variance,
    without_bias,
)
from identify.measured.time_history import TimeHistory
from tests.measured.frf_sets import some_set
from tests.measured.simulate import SAMPLE_RATE_HZ, hammer_test, random_structure
from tests.shared import shared

PLACES, INPUTS, DECAY = 10, (7, 8, 9), 0.693
NOISE = {"of the response": (0.02, 0.01), "of the force": (0.002, 1.0), "of both": (0.01, 0.3)}
"""Standard deviation of each sample: acceleration (m/s^2), force (N)."""


def estimated(signals: np.ndarray, place: int) -> FrfSet:
    channels = (Channel(place + 1, 1), *(Channel(i + 1, 1) for i in range(PLACES)))
    history = TimeHistory(SAMPLE_RATE_HZ, signals, channels, ("N",) + ("m/s^2",) * PLACES)
    return frf_from_impacts(history, decay_per_s=DECAY).band(2.4, 80)


def joined(sets: list[FrfSet]) -> FrfSet:
    whole = {
        name: np.concatenate([getattr(one, name) for one in sets], axis=2) for name in ("frf", "coherence")
    }
    return replace(sets[0], **whole, inputs=tuple(one.inputs[0] for one in sets))  # type: ignore[arg-type]


@cache
def hammer(seed: int, noise: tuple[float, float], hum: float = 0.0) -> tuple[FrfSet, np.ndarray]:
    """A noisy set and its true FRFs: the same estimate without noise, so that cut responses do not count as
    noise.
    """
    random = np.random.default_rng(seed)
    structure = random_structure(seed, PLACES)
    noisy, clean = [], []
    for place in INPUTS:
        signals = hammer_test(structure, place, 4, random)
        level = np.array([noise[1]] + [noise[0]] * PLACES)
        phase = random.uniform(0, 2 * np.pi, (4, 1, 1))
        humming = hum * np.sin(
            2 * np.pi * 50 * np.arange(signals.shape[1])[None, :, None] / SAMPLE_RATE_HZ + phase
        )
        disturbed = signals + level * random.normal(size=signals.shape)
        disturbed[:, :, 1:] += humming
        noisy.append(estimated(disturbed, place))
        clean.append(estimated(signals, place))
    return joined(noisy), joined(clean).frf


def classes(truth: np.ndarray) -> dict[str, np.ndarray]:
    """Lines at resonances, at antiresonances and between, by the level against the surrounding 21 lines."""
    padded = np.pad(np.log(np.abs(truth) ** 2), ((10, 10), (0, 0), (0, 0)), mode="edge")
    around = np.exp(np.lib.stride_tricks.sliding_window_view(padded, 21, axis=0).mean(axis=3))
    level = np.abs(truth) ** 2 / around
    return {
        "resonance": level > 3,
        "antiresonance": level < 1 / 3,
        "between": (level >= 1 / 3) & (level <= 3),
    }


@pytest.mark.parametrize("kind", NOISE)
def test_stated_noise_is_true_noise_in_every_class_of_lines(kind: str) -> None:
    normalised: list[np.ndarray] = []
    by_class: dict[str, list[np.ndarray]] = {}
    for seed in range(16):
        noisy, truth = hammer(seed, NOISE[kind])
        square = np.abs(noisy.frf - truth) ** 2 / (2 * noise_std(noisy) ** 2)
        normalised.append(square.ravel())
        for name, where in classes(truth).items():
            by_class.setdefault(name, []).append(square[where])
    assert 0.95 < np.mean(np.concatenate(normalised)) < 1.05
    for name, squares in by_class.items():
        assert 0.9 < np.sqrt(np.mean(np.concatenate(squares))) < 1.1, name


def _too_large(frf: np.ndarray, truth: np.ndarray) -> float:
    """By what share FRFs are larger than the truth where that is large."""
    ratio = (frf * truth.conj()).real / np.abs(truth) ** 2
    return float(np.mean(ratio[np.abs(truth) > np.median(np.abs(truth))])) - 1


def test_what_noise_of_the_force_takes_off_h1_is_made_up_for() -> None:
    sets = [hammer(seed, NOISE["of the force"]) for seed in range(8)]
    h1, corrected = (
        np.mean([_too_large(one.frf, truth) for one, truth in zip(ones, [t for _, t in sets], strict=True)])
        for ones in ([noisy for noisy, _ in sets], [without_bias(noisy) for noisy, _ in sets])
    )
    assert h1 < -2e-3
    assert abs(corrected) < -h1 / 8


def test_noise_of_responses_takes_nothing_off_h1() -> None:
    noisy, _ = hammer(0, NOISE["of the response"])
    corrected = without_bias(noisy)
    np.testing.assert_allclose(corrected.frf, noisy.frf, rtol=1e-4)
    np.testing.assert_array_equal(corrected.noise, noise_std(noisy))


def _pooled(level: np.ndarray, power: np.ndarray, freedom: int, seeds: int) -> np.ndarray:
    """Pooled estimates (seeds, lines) over the true variance level (lines,), of a set of one FRF with |H|^2 =
    power.
    """
    found = []
    for seed in range(seeds):
        chi2 = np.random.default_rng(seed).chisquare(freedom, len(level)) / freedom
        found.append(pooled_variance(power[:, None, None], (level * chi2)[:, None, None], freedom)[:, 0, 0])
    return np.array(found) / level


def test_so_many_lines_are_pooled_that_the_level_is_known_to_some_per_cent() -> None:
    """120 degrees of freedom between knots: a variance known to about sqrt(2 / 120) = 13 %, not to the 58
    % of a line.
    """
    ratio = _pooled(np.ones(400), np.zeros(400), 6, 30)
    assert ratio.mean() == pytest.approx(1.0, abs=0.03)
    assert 0.12 < ratio[:, 20:-20].std() < 0.165


def test_a_level_that_changes_over_the_band_is_followed() -> None:
    """Noise that rises tenfold over 400 lines, and by half over 60 of them, is not smeared."""
    line = np.arange(400)
    level = 10 ** (line / 400) * (1 + 0.5 * np.exp(-(((line - 200) / 30) ** 2)))
    ratio = _pooled(level, np.zeros(400), 6, 30)
    assert np.abs(ratio.mean(axis=0) - 1).max() < 0.2


def test_noise_of_the_force_is_pooled_over_outputs_and_twice_the_lines() -> None:
    """It is common to all outputs of an input and smooth: 5 x 240 degrees of freedom between knots, so
    known to about 4 % where |H| varies so much that it stands alone.
    """
    off = []
    for seed in range(8):
        rng = np.random.default_rng(seed)
        power, chi2 = 10 ** rng.uniform(-2, 2, (400, 5, 1)), rng.chisquare(6, (400, 5, 1)) / 6
        off.append(np.abs(pooled_variance(power, power * chi2, 6) / power - 1)[20:-20])
    assert 0.031 < np.median(off) < 0.041


def test_levels_are_straight_lines_between_evenly_spaced_knots() -> None:
    sizes = [int(basis.shape[1]) for basis in (_hats(401, 20), _hats(401, 40))]
    assert sizes == [21, 11]
    for basis in (_hats(401, 20), _hats(37, 20), _hats(5, 20)):
        assert np.asarray(basis.sum(axis=1)).ravel() == pytest.approx(np.ones(basis.shape[0]))
    at = np.linspace(0, 1, 21)
    assert _hats(401, 20) @ at == pytest.approx(np.linspace(0, 1, 401)), "a straight line is a straight line"


def test_single_lines_would_not_do() -> None:
    """Negative control: without pooling the normalised square is 6 / 4 = 1.5 on average (mean of an inverse
    chi-square).
    """
    squares = []
    for seed in range(8):
        noisy, truth = hammer(seed, NOISE["of the response"])
        assert noisy.coherence is not None
        variance = np.abs(noisy.frf) ** 2 * (1 - noisy.coherence) / (3 * noisy.coherence)
        squares.append(np.mean(np.abs(noisy.frf - truth) ** 2 / variance))
    assert 1.3 < np.mean(squares) < 1.7


def test_a_humming_line_is_noisy_and_does_not_spoil_its_neighbours() -> None:
    calm, _ = hammer(0, NOISE["of the response"])
    loud, _ = hammer(0, NOISE["of the response"], hum=0.01)
    ratio = np.median(noise_std(loud) / noise_std(calm), axis=(1, 2))
    at = int(np.argmin(np.abs(calm.frequency_hz - 50)))
    assert ratio[at] > 3
    assert np.all(np.abs(np.delete(ratio, at) - 1) < 0.15)


def test_more_averages_need_less_pooling_and_give_less_noise() -> None:
    noisy, _ = hammer(0, NOISE["of both"])
    assert np.all(noise_std(replace(noisy, averages=100)) < noise_std(noisy))


def test_pairs_that_were_not_measured_have_no_noise_and_do_not_disturb_the_others() -> None:
    noisy, _ = hammer(1, NOISE["of the response"])
    frf = noisy.frf.copy()
    frf[:, 2, 1] = np.nan
    std = noise_std(replace(noisy, frf=frf))
    assert np.isnan(std[:, 2, 1]).all() and np.isfinite(np.delete(std[:, :, 1], 2, axis=1)).all()
    np.testing.assert_allclose(std[:, :, 0], noise_std(noisy)[:, :, 0], rtol=0.01)


def test_a_coherence_printed_as_one_stands_for_almost_one() -> None:
    coherence = np.ones((30, 3, 2))
    coherence[0, 0, 0] = 0.999999
    whole = some_set(lines=30, coherence=coherence)
    std = noise_std(whole) / np.abs(whole.frf)
    assert np.all(std > 1e-5) and np.all(std < 1e-3)


def test_rounding_of_coherence_to_six_digits_hardly_changes_the_noise() -> None:
    exact = some_set(lines=200, coherence=1 - 10 ** np.random.default_rng(0).uniform(-7, -5, (200, 3, 2)))
    rounded = replace(exact, coherence=np.round(np.asarray(exact.coherence), 6))
    assert np.mean(rounded.coherence == 1) > 0.1
    assert np.median(np.abs(noise_std(rounded) / noise_std(exact) - 1)) < 0.05


@pytest.mark.parametrize("decimals", [0, 1, 2, 3, 4])
def test_a_coherence_that_is_rounded_further_leaves_the_noise_to_the_scatter_between_lines(
    decimals: int,
) -> None:
    exact = hammer(3, NOISE["of both"])[0]
    coherence = np.round(np.asarray(exact.coherence), decimals)
    rounded = replace(exact, coherence=coherence if decimals else np.ones_like(coherence))
    ratio = noise_std(rounded) / noise_std(exact)
    assert 0.85 < np.median(ratio) < 1.15
    assert np.sqrt(np.mean(ratio**-2)) < 1.25  # what the gap of a right model would be
    said = [note for note in without_bias(rounded).notes if "scatter between neighbouring lines" in note]
    assert len(said) == (np.median(1 - np.asarray(exact.coherence)) < 10 * 10.0**-decimals)


def test_a_coherence_of_one_at_too_few_lines_for_their_scatter_is_refused() -> None:
    few = some_set(lines=8, coherence=np.ones((8, 3, 2)))
    with pytest.raises(InputError, match=r"a coherence is 1 at every line.* too few or uneven.*noise:"):
        noise_std(few)


@pytest.mark.parametrize("lines", [1, 2, 3])
def test_few_lines_are_enough(lines: int) -> None:
    assert np.isfinite(noise_std(some_set(lines=lines))).all()


def test_what_lacks_is_asked_for() -> None:
    whole = some_set()
    assert whole.coherence is not None
    for lacking, found in (
        (replace(whole, coherence=None), "no coherence"),
        (replace(whole, averages=None), "add the key averages"),
        (replace(whole, averages=1), "at least 2"),
        (
            replace(whole, coherence=np.where(np.arange(2) == 1, np.nan, whole.coherence)),
            r"FRF 3:\+X/4:\+Y has no coherence",
        ),
    ):
        with pytest.raises(InputError, match=found):
            noise_std(lacking)


def test_repeats_give_their_mean_and_its_true_noise() -> None:
    random = np.random.default_rng(0)
    truth = np.ones((120, 6, 2)) * np.linspace(1, 4, 120)[:, None, None]
    level = np.linspace(0.1, 0.3, 120)[:, None, None]
    squares = []
    for _ in range(20):
        noise = [
            level * (random.normal(size=truth.shape) + 1j * random.normal(size=truth.shape)) for _ in range(3)
        ]
        repeats = [
            some_set(lines=120, outputs=6, inputs=2, frf=truth + one, coherence=None, averages=None)
            for one in noise
        ]
        mean, std = mean_of_repeats(repeats), noise_std_from_repeats(repeats)
        squares.append(np.mean(np.abs(mean.frf - truth) ** 2 / (2 * std**2)))
    assert 0.95 < np.mean(squares) < 1.05
    with pytest.raises(InputError, match="1 measurement; expected at least two"):
        noise_std_from_repeats(repeats[:1])
    with pytest.raises(InputError, match="other than in the first"):
        mean_of_repeats([repeats[0], replace(repeats[1], window_decay_per_s=0.1)])


@pytest.mark.parametrize("posture", [1, 2, 3])
def test_the_base_of_a_hidden_test_stands_still_so_all_it_shows_is_noise(posture: int) -> None:
    path = shared("hidden", "none_101", f"posture{posture}.uff")
    read = load_frf_set(path, FrfFileOptions(averages=4, window_decay_per_s=0.693))
    base = [i for i, channel in enumerate(read.outputs) if channel.node in (1, 2)]
    square = (np.abs(read.frf) ** 2 / (2 * noise_std(read) ** 2))[:, base]
    assert 0.9 < np.mean(square) < 1.12
    # Elsewhere the scatter of neighbouring lines about a cubic is smaller where lines are alike, never much
    # larger.
    weights = np.array([-1, 4, -6, 4, -1])
    windows = np.lib.stride_tricks.sliding_window_view(read.frf, 5, axis=0)
    variance = np.lib.stride_tricks.sliding_window_view(2 * noise_std(read) ** 2, 5, axis=0)
    scatter = np.abs(windows @ weights) ** 2 / (variance @ weights**2)
    assert 0.3 < np.median(scatter) / np.log(2) < 1.2

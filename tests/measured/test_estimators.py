"""H1, H2, Hv and coherence against closed forms, by signals simulated in the time domain."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from identify.core.errors import InputError
from identify.measured.channel import Channel
from identify.measured.estimators import Method, estimate, frf_from_impacts, frf_from_random
from identify.measured.time_history import TimeHistory
from tests.measured.simulate import SAMPLE_RATE_HZ, SAMPLES, Structure, hammer_test, random_test, two_masses

STRUCTURE = two_masses()


def history(data: np.ndarray, inputs: int = 1) -> TimeHistory:
    """Forces first, then accelerations at places 1, 2, ..."""
    responses = data.shape[2] - inputs
    channels = (*(Channel(j + 1, 1) for j in range(inputs)), *(Channel(i + 1, 1) for i in range(responses)))
    return TimeHistory(
        SAMPLE_RATE_HZ, data, channels, ("N",) * inputs + ("m/s^2",) * responses, source="signals"
    )


def accelerance(structure: Structure, s: np.ndarray) -> np.ndarray:
    return structure.receptance(s) * s[:, None, None] ** 2


@pytest.mark.parametrize("method", ["h1", "h2", "hv"])
def test_hits_with_exponential_window_sample_the_closed_form_at_decay_plus_j_omega(method: Method) -> None:
    hits = history(hammer_test(STRUCTURE, 0, 3, np.random.default_rng(0)))
    read = frf_from_impacts(hits, method, force_window_s=0.05, decay_per_s=4.0)
    assert (read.quantity, read.averages, read.window_decay_per_s) == ("accelerance", 3, 4.0)
    assert [str(c) for c in (*read.outputs, *read.inputs)] == ["1:+X", "2:+X", "1:+X"]
    np.testing.assert_allclose(read.frequency_hz, np.arange(1, SAMPLES // 2 + 1) * SAMPLE_RATE_HZ / SAMPLES)
    low = read.band(0, 150)  # above, sampling itself rings
    truth = accelerance(STRUCTURE, 4.0 + 2j * np.pi * low.frequency_hz)[:, :, :1]
    np.testing.assert_allclose(low.frf, truth, atol=2e-5 * np.abs(truth).max())
    assert read.coherence is not None and read.coherence.min() > 1 - 1e-9
    # Negative control: the same numbers on the imaginary axis are far off.
    plain = accelerance(STRUCTURE, 2j * np.pi * low.frequency_hz)[:, :, :1]
    assert np.abs(low.frf - plain).max() > 0.2 * np.abs(truth).max()


def test_a_response_cut_at_the_end_of_the_block_leaks_without_window() -> None:
    hits = history(hammer_test(STRUCTURE, 0, 1, np.random.default_rng(0)))
    truth = accelerance(STRUCTURE, 2j * np.pi * frf_from_impacts(hits).frequency_hz)[:, :, :1]
    assert np.abs(frf_from_impacts(hits).frf - truth).max() > 2e-3 * np.abs(truth).max()


def test_the_force_window_keeps_noise_behind_the_pulse_out() -> None:
    random = np.random.default_rng(1)
    data = hammer_test(STRUCTURE, 0, 4, random)
    data[:, :, 0] += 0.5 * random.normal(size=data.shape[:2])
    truth = accelerance(STRUCTURE, 4.0 + 2j * np.pi * frf_from_impacts(history(data)).frequency_hz)[:, :, :1]
    with_window, without = (
        frf_from_impacts(history(data), force_window_s=length, decay_per_s=4.0) for length in (0.03, None)
    )
    assert np.linalg.norm(with_window.frf - truth) < 0.5 * np.linalg.norm(without.frf - truth)


@cache
def long_test() -> tuple[np.ndarray, np.ndarray]:
    return random_test(STRUCTURE, [0], 2**19, np.random.default_rng(2))


@pytest.mark.parametrize("noisy", ["response", "force"])
def test_h1_is_unbiased_by_noise_on_the_response_and_h2_by_noise_on_the_force(noisy: str) -> None:
    force, motion = long_test()
    random = np.random.default_rng(3)
    share = 0.7
    extra = share * random.normal(size=len(force)) * np.std(force if noisy == "force" else motion[:, 0])
    signals = np.column_stack(
        [
            force[:, 0] + (extra if noisy == "force" else 0),
            motion[:, 0] + (extra if noisy == "response" else 0),
        ]
    )
    clean = np.column_stack([force[:, 0], motion[:, 0]])
    methods: tuple[Method, ...] = ("h1", "h2", "hv")
    ratios = []
    for method in methods:
        one, reference = (
            frf_from_random(history(data[None]), 2.0, method=method).band(13, 19) for data in (signals, clean)
        )
        ratios.append(np.mean((one.frf / reference.frf).real))
    if noisy == "response":
        with_noise, without = (
            frf_from_random(history(data[None]), 2.0).band(13, 19).coherence for data in (signals, clean)
        )
        assert with_noise is not None and without is not None
        expected = np.mean(without / with_noise)
        assert ratios[0] == pytest.approx(1, abs=0.02)
        assert ratios[1] == pytest.approx(expected, rel=0.03) and expected > 1.1
        assert ratios[0] < ratios[2] < ratios[1]
    else:
        assert ratios[1] == pytest.approx(1, abs=0.02)
        assert ratios[0] == pytest.approx(1 / (1 + share**2), abs=0.02)
        assert ratios[2] == pytest.approx(1 / np.sqrt(1 + share**2), abs=0.02)


def test_long_segments_meet_the_closed_form() -> None:
    force, motion = long_test()
    read = frf_from_random(history(np.column_stack([force, motion])[None]), 16.0)
    truth = accelerance(STRUCTURE, 2j * np.pi * read.frequency_hz)[:, :, :1]
    band = (read.frequency_hz > 5) & (read.frequency_hz < 100)
    np.testing.assert_allclose(read.frf[band], truth[band], atol=0.02 * np.abs(truth[band]).max())


@pytest.mark.parametrize("overlap", [0.0, 0.5, 0.75])
def test_the_variance_that_coherence_and_averages_promise_is_the_scatter_that_is_seen(overlap: float) -> None:
    force, motion = long_test()
    random = np.random.default_rng(4)
    seen, promised = [], []
    for start in range(0, 2**19 - 2**14 + 1, 2**14):
        part = slice(start, start + 2**14)
        signals = np.column_stack(
            [force[part], motion[part, 0] + 3 * np.std(motion[:, 0]) * random.normal(size=2**14)]
        )
        clean = frf_from_random(history(np.column_stack([force[part], motion[part, 0]])[None]), 2.0, overlap)
        noisy = frf_from_random(history(signals[None]), 2.0, overlap)
        assert noisy.coherence is not None and noisy.averages is not None
        seen.append(np.abs(noisy.frf - clean.frf) ** 2)
        promised.append(
            np.abs(noisy.frf) ** 2 * (1 - noisy.coherence) / (noisy.coherence * (noisy.averages - 1))
        )
    assert np.mean(seen) / np.mean(promised) == pytest.approx(1, abs=0.08)


def test_overlapping_segments_are_worth_what_welch_says() -> None:
    data = np.random.default_rng(0).normal(size=(1, 16384, 2))
    averages = [frf_from_random(history(data), 2.0, overlap).averages for overlap in (0.0, 0.5, 0.75)]
    # 16 apart; 31 half overlapped at a correlation of 1/36; 61 at three quarters are worth about 31/0.96
    # (Harris 1978).
    assert averages[0] == 16
    assert averages[1] == int(31 / (1 + 2 * (30 / 31) / 36))
    assert 28 <= averages[2] <= 34


def test_two_inputs_at_once_are_told_apart_even_when_correlated() -> None:
    random = np.random.default_rng(5)
    force, motion = random_test(STRUCTURE, [0, 1], 2**17, random)
    mixed = force @ np.array([[1.0, 0.6], [0.0, 0.8]])
    s = 2j * np.pi * np.fft.rfftfreq(len(mixed), 1 / SAMPLE_RATE_HZ)
    motion = np.fft.irfft(
        np.einsum("lij,lj->li", accelerance(STRUCTURE, s), np.fft.rfft(mixed, axis=0)), len(mixed), axis=0
    )
    read = frf_from_random(history(np.column_stack([mixed, motion])[None], inputs=2), 8.0)
    truth = accelerance(STRUCTURE, 2j * np.pi * read.frequency_hz)
    band = (read.frequency_hz > 5) & (read.frequency_hz < 60)
    np.testing.assert_allclose(read.frf[band], truth[band], atol=0.04 * np.abs(truth[band]).max())
    with pytest.raises(InputError, match="h2 with 2 inputs"):
        frf_from_random(history(np.column_stack([mixed, motion])[None], inputs=2), 8.0, method="h2")
    with pytest.raises(InputError, match="not independent"):
        frf_from_random(history(np.column_stack([mixed[:, :1], mixed[:, :1], motion])[None], inputs=2), 8.0)


def test_the_promised_variance_holds_for_several_inputs_too() -> None:
    random = np.random.default_rng(6)
    h = np.array([[1 + 1j, 0.3], [0.2j, -2.0]])
    mixing = np.array([[1.0, 0.7], [0.0, 0.5]])
    averages, lines = 6, 20000
    f = (random.normal(size=(averages, lines, 2)) + 1j * random.normal(size=(averages, lines, 2))) @ mixing
    noise = random.normal(size=(averages, lines, 2)) + 1j * random.normal(size=(averages, lines, 2))
    frf, gamma2 = estimate(f @ h.T + noise * [0.5, 2.0], f, "h1", "")
    seen = np.mean(np.abs(frf - h) ** 2, axis=0)
    promised = np.mean(np.abs(frf) ** 2 * (1 - gamma2) / (gamma2 * (averages - 2)), axis=0)
    np.testing.assert_allclose(seen / promised, 1, atol=0.06)


spectra = st.integers(0, 10_000).map(np.random.default_rng)


@given(spectra, st.integers(2, 6), st.complex_numbers(min_magnitude=0.01, max_magnitude=100))
@settings(max_examples=50, deadline=None)
def test_algebra_of_one_input(random: np.random.Generator, averages: int, factor: complex) -> None:
    x, f = (random.normal(size=(averages, 5, n)) + 1j * random.normal(size=(averages, 5, n)) for n in (2, 1))
    (h1, gamma2), (h2, _), (hv, _) = (estimate(x, f, method, "") for method in ("h1", "h2", "hv"))
    np.testing.assert_allclose(h1, gamma2 * h2, rtol=1e-9)
    np.testing.assert_allclose(np.abs(hv) ** 2, np.abs(h1) * np.abs(h2), rtol=1e-9)
    assert np.all((gamma2 >= 0) & (gamma2 <= 1 + 1e-12))
    order = random.permutation(averages)
    for method, plain in (("h1", h1), ("h2", h2), ("hv", hv)):
        scaled, same = estimate(factor * x[order], f[order], method, "")
        np.testing.assert_allclose(scaled, factor * plain, rtol=1e-8)
        np.testing.assert_allclose(same, gamma2, rtol=1e-8)
        np.testing.assert_allclose(estimate(x, f * factor, method, "")[0], plain / factor, rtol=1e-8)


@given(spectra)
@settings(max_examples=20, deadline=None)
def test_hv_is_total_least_squares_with_both_signals_scaled_to_unit_power(
    random: np.random.Generator,
) -> None:
    x, f = (random.normal(size=(4, 1, 1)) + 1j * random.normal(size=(4, 1, 1)) for _ in range(2))
    sizes = [np.linalg.norm(signal) for signal in (f, x)]
    both = np.stack([f[:, 0, 0] / sizes[0], x[:, 0, 0] / sizes[1]])
    smallest = np.linalg.eigh(both @ both.conj().T)[1][
        :, 0
    ]  # v^H (f, x) is smallest, so x / f = -conj(v_f / v_x)
    expected = -np.conj(smallest[0] / smallest[1]) * sizes[1] / sizes[0]
    assert estimate(x, f, "hv", "")[0][0, 0, 0] == pytest.approx(expected, rel=1e-8)


@pytest.mark.parametrize(
    ("call", "found"),
    [
        (lambda h: frf_from_impacts(h, force_window_s=9.0), "a force window of 9 s"),
        (lambda h: frf_from_impacts(h, decay_per_s=-1.0), "a window decay of -1"),
        (lambda h: frf_from_random(h, 99.0), "segments of"),
        (lambda h: frf_from_random(h, 0.5, overlap=1.0), "an overlap of 1"),
    ],
)
def test_settings_that_make_no_sense_are_refused(call: object, found: str) -> None:
    with pytest.raises(InputError, match=found):
        call(history(np.ones((1, SAMPLES, 2))))  # type: ignore[operator]


def test_signals_that_give_no_frf_are_refused() -> None:
    data = np.random.default_rng(0).normal(size=(1, 64, 2))
    channels = (Channel(1, 1), Channel(2, 1))
    for units, found in ((("N", "N"), "2 forces and 0 responses"), (("m", "m"), "0 forces and 2 responses")):
        with pytest.raises(InputError, match=found):
            frf_from_impacts(TimeHistory(512, data, channels, units))
    three = np.random.default_rng(0).normal(size=(1, 64, 3))
    with pytest.raises(InputError, match="responses of different kinds: acceleration, velocity"):
        frf_from_impacts(TimeHistory(512, three, (*channels, Channel(3, 1)), ("N", "m/s", "m/s^2")))
    with pytest.raises(InputError, match="1 averages for 2 inputs"):
        frf_from_impacts(history(three, inputs=2))
    with pytest.raises(InputError, match="without any power"):
        frf_from_impacts(history(data * [0, 1]))
    with pytest.raises(ValueError, match="do not belong together"):
        TimeHistory(512, data, channels, ("N",))

"""FRFs and coherences from time histories: hits averaged block by block, or random excitation in overlapping
segments.

With spectra X of responses and F of forces, averaged to Gxx, Gff, Gxf = <X F*>:

- H1 = Gxf Gff^-1 is unbiased by noise on the responses (Bendat and Piersol, Random Data, 4th ed., sections
6.2 and 7.2); the only one
  for several inputs at once;
- H2 = Gxx / Gfx is unbiased by noise on the force;
- Hv = sqrt(Gxx / Gff) Gxf / |Gxf|, their geometric mean: total least squares with equal relative noise on
both (Rocklin, Crowley and
  Vold, A comparison of H1, H2 and Hv frequency response functions, IMAC III, 1985).
"""

from __future__ import annotations

from typing import Literal

import numpy as np

from identify.core.arrays import Array, Complex
from identify.core.errors import InputError
from identify.measured.frf_set import FrfSet, Quantity
from identify.measured.time_history import TimeHistory
from identify.measured.units import QUANTITY_OF_KIND, parse_signal_unit

Method = Literal["h1", "h2", "hv"]


def frf_from_impacts(
    history: TimeHistory, method: Method = "h1", force_window_s: float | None = None, decay_per_s: float = 0.0
) -> FrfSet:
    """FRFs from hits, one block each, at all lines of the block's length but 0 Hz.

    The force is kept for force_window_s (s) from the start of the block and zero behind; exp(-decay_per_s t)
    is put on force and responses alike, so that the set samples H(decay + j omega) exactly where the response
    ends within the block, and says so.  InputError where there is no force, no response, a window outside the
    block, or fewer blocks than inputs.
    """
    samples = history.data.shape[1]
    duration = samples / history.sample_rate_hz
    if force_window_s is not None and not 0 < force_window_s <= duration:
        raise InputError(
            history_name(history),
            f"a force window of {force_window_s:g} s",
            f"more than 0 and at most the block's {duration:g} s",
        )
    if decay_per_s < 0:
        raise InputError(history_name(history), f"a window decay of {decay_per_s:g} 1/s", "0 or more")
    time_s = np.arange(samples) / history.sample_rate_hz
    windows = np.repeat(np.exp(-decay_per_s * time_s)[:, None], len(history.channels), axis=1)
    if force_window_s is not None:
        windows[:, history.forces] *= (time_s < force_window_s)[:, None]
    return _frf_set(history, history.data * windows, method, averages=len(history.data), decay=decay_per_s)


def frf_from_random(
    history: TimeHistory, segment_s: float, overlap: float = 0.5, method: Method = "h1"
) -> FrfSet:
    """FRFs from continuous random excitation: segments of segment_s (s) with a Hann window, overlapping by a
    share of their length.

    The mean of each segment is removed and 0 Hz left out.  averages is the number of independent averages
    that overlapping segments are worth (Welch, IEEE Trans. Audio Electroacoust. 15 (1967), eq. 12).
    InputError where segments are longer than a block, overlap is not in [0, 1), or there are fewer averages
    than inputs.
    """
    size = round(segment_s * history.sample_rate_hz)
    if not 8 <= size <= history.data.shape[1]:
        raise InputError(
            history_name(history), f"segments of {size} samples", f"8 to the block's {history.data.shape[1]}"
        )
    if not 0 <= overlap < 1:
        raise InputError(history_name(history), f"an overlap of {overlap:g}", "0 or more and below 1")
    step = max(1, round(size * (1 - overlap)))
    starts = range(0, history.data.shape[1] - size + 1, step)
    window = np.hanning(size + 1)[:-1]
    segments = np.stack([block[start : start + size] for block in history.data for start in starts])
    segments = (segments - segments.mean(axis=1, keepdims=True)) * window[:, None]
    averages = len(history.data) * _independent(window, step, len(starts))
    return _frf_set(history, segments, method, averages=averages, decay=0.0)


def _independent(window: Array, step: int, count: int) -> float:
    """How many independent averages `count` segments are worth that begin `step` samples apart (Welch 1967,
    eq. 12).
    """
    lags = [k for k in range(1, count) if k * step < len(window)]
    correlation = [float(window[k * step :] @ window[: -k * step] / (window @ window)) ** 2 for k in lags]
    return count / (1 + 2 * sum((1 - k / count) * rho for k, rho in zip(lags, correlation, strict=True)))


def _frf_set(history: TimeHistory, blocks: Array, method: Method, *, averages: float, decay: float) -> FrfSet:
    """FRFs from windowed blocks (blocks, samples, signals), worth so many independent averages."""
    forces, responses = history.forces, history.responses
    if not forces or not responses:
        raise InputError(
            history_name(history),
            f"{len(forces)} forces and {len(responses)} responses",
            "at least one of each",
        )
    if len(blocks) < len(forces):
        raise InputError(
            history_name(history),
            f"{len(blocks)} averages for {len(forces)} inputs at once",
            "at least as many averages as inputs",
        )
    spectra = np.fft.rfft(blocks, axis=1)[:, 1:]
    frf, coherence = estimate(spectra[:, :, responses], spectra[:, :, forces], method, history_name(history))
    return FrfSet(
        frequency_hz=np.asarray(
            np.fft.rfftfreq(blocks.shape[1], 1 / history.sample_rate_hz)[1:], dtype=np.float64
        ),
        frf=frf,
        outputs=tuple(history.channels[i] for i in responses),
        inputs=tuple(history.channels[i] for i in forces),
        quantity=quantity_of(history),
        coherence=coherence,
        averages=max(1, int(averages + 1e-9) - len(forces) + 1),
        window_decay_per_s=decay,
        record_s=blocks.shape[1] / history.sample_rate_hz if decay > 0 else None,
        source=history.source,
        sha256=history.sha256,
    )


def estimate(responses: Complex, forces: Complex, method: Method, where: str) -> tuple[Complex, Array]:
    """FRFs and coherences (lines, outputs, inputs) from spectra (averages, lines, outputs) and (averages,
    lines, inputs).

    With several inputs the coherence is the partial one of each input, all others accounted for (Bendat and
    Piersol, section 7.3): |H_ij|^2 (1 - g2) / (g2 (n - q)) is then the variance of H_ij for n averages of q
    inputs, as with one input. InputError for H2 or Hv with several inputs, or inputs that are not
    independent.
    """
    x, f = np.moveaxis(responses, 0, 2), np.moveaxis(forces, 0, 2)
    gff, gxf = f @ f.conj().swapaxes(1, 2), x @ f.conj().swapaxes(1, 2)
    gxx = np.sum(np.abs(x) ** 2, axis=2)
    inputs = forces.shape[2]
    if method != "h1" and inputs > 1:
        raise InputError(
            where, f"{method} with {inputs} inputs at once", "h1, the only one for several inputs"
        )
    scale = np.sqrt(np.einsum("ljj->lj", gff).real)
    if np.any(scale == 0):
        raise InputError(
            where,
            "a force without any power at some line",
            "forces that excite all lines",
            "check the force channel",
        )
    normalised = gff / (scale[:, :, None] * scale[:, None, :])
    if np.max(np.linalg.cond(normalised)) > 1e10:
        raise InputError(
            where, "forces that are not independent of each other", "uncorrelated forces or enough averages"
        )
    inverse = np.linalg.inv(normalised) / (scale[:, :, None] * scale[:, None, :])
    h1 = gxf @ inverse
    left = np.maximum(gxx - np.einsum("lij,lij->li", h1, gxf.conj()).real, 0.0)
    explained = np.abs(h1) ** 2
    total = explained + left[:, :, None] * np.einsum("ljj->lj", inverse).real[:, None, :]
    coherence = np.divide(explained, total, out=np.zeros_like(explained), where=total > 0)
    return _form(method, h1, gff, gxx), coherence


def _form(method: Method, h1: Complex, gff: Complex, gxx: Array) -> Complex:
    """H1, H2 or Hv; the latter two of one input, from H1 and the autospectra."""
    if method == "h1":
        return h1
    size = np.abs(h1[:, :, 0])
    largest = np.sqrt(gxx / gff[:, 0, :].real)
    phase = np.divide(h1[:, :, 0], size, out=np.zeros_like(h1[:, :, 0]), where=size > 0)
    magnitude = (
        largest if method == "hv" else np.divide(largest**2, size, out=np.zeros_like(size), where=size > 0)
    )
    return np.asarray((magnitude * phase)[:, :, None], dtype=np.complex128)


def quantity_of(history: TimeHistory) -> Quantity:
    """The one quantity of all responses."""
    kinds = {parse_signal_unit(history.units[i], history_name(history)).kind for i in history.responses}
    if len(kinds) > 1:
        raise InputError(
            history_name(history),
            "responses of different kinds: " + ", ".join(sorted(kinds)),
            "one kind",
            "take them apart",
        )
    return QUANTITY_OF_KIND[kinds.pop()]


def history_name(history: TimeHistory) -> str:
    """The history's name in errors."""
    return history.source or "time history"

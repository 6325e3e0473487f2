"""FRFs by H1 and ordinary coherence from averaged spectra (Bendat and Piersol, Random Data, sections 6.1 and
9.2).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tests.generator.rigid import Array

Complex = NDArray[np.complex128]


@dataclass(frozen=True)
class Estimate:
    """frequency_hz (lines,), h1 (lines, outputs), m/s^2/N, and coherence (lines, outputs) of one force."""

    frequency_hz: Array
    h1: Complex
    coherence: Array

    def band(self, low: float, high: float) -> Estimate:
        """The lines from low to high, Hz."""
        inside = (self.frequency_hz >= low) & (self.frequency_hz <= high)
        return Estimate(self.frequency_hz[inside], self.h1[inside], self.coherence[inside])


def h1(forces: Array, responses: Array, rate: float) -> Estimate:
    """Estimate from windowed records: forces (averages, samples), responses (averages, samples, outputs),
    rate in Hz.
    """
    f, x = np.fft.rfft(forces, axis=1)[..., None], np.fft.rfft(responses, axis=1)
    sff, sxx = np.sum(np.abs(f) ** 2, axis=0), np.sum(np.abs(x) ** 2, axis=0)
    sfx = np.sum(f.conj() * x, axis=0)
    coherence = np.divide(np.abs(sfx) ** 2, sff * sxx, out=np.zeros(sfx.shape), where=sxx > 0)
    frequency_hz = np.fft.rfftfreq(forces.shape[1], 1 / rate).astype(np.float64)
    return Estimate(frequency_hz, sfx / sff, coherence)

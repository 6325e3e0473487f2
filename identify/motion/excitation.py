"""Excitation of a controlled joint, and the FRFs of the arm in the closed loop (Nagoya Fig. 8).

While the controller runs, a torque is added to what it gives the motor; FRFs are those from the whole torque
to what it moves, so that the controller drops out.  The torque repeats itself, so that whole periods have
neither leakage nor, behind the first, a transient.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from pydantic import Field, model_validator

from identify.core.arrays import Array, Complex
from identify.core.config import Settings
from identify.measured.estimators import estimate


class Excitation(Settings):
    """A chirp of torque, over and over, added to what the controller gives a motor."""

    joint: int | str = Field(description="number (from 1) or name")
    torque_n_m: float = Field(gt=0, description="amplitude at the gear output")
    band_hz: tuple[float, float] = Field(description="first and last frequency of a period")
    period_s: float = Field(gt=0, description="after which it begins again")

    @model_validator(mode="after")
    def _rises(self) -> Excitation:
        low, high = self.band_hz
        if not 0 < low < high:
            raise ValueError(
                f"band_hz: [{low:g}, {high:g}]; expected two frequencies above zero, the lower first"
            )
        return self

    def torque(self, time: Array) -> Array:
        """N m at times (n,), s."""
        since = np.mod(time + 1e-9, self.period_s)
        low, high = self.band_hz
        phase = 2 * np.pi * (low + (high - low) * since / (2 * self.period_s)) * since
        return np.asarray(self.torque_n_m * np.sin(phase))


def closed_loop_frf(
    torques: Sequence[Array], responses: Sequence[Array], sample_s: float, period_s: float
) -> tuple[Array, Complex, Array]:
    """Frequencies (lines,), Hz, FRFs and coherences (lines, outputs, joints) from records of torque (samples,
    joints) and response (samples, outputs), in each of which another joint is excited; the first period of
    each is left out.  H1 over all periods.

    A period must be a whole number of samples.  InputError where the records together do not excite all
    joints.
    """
    size = round(period_s / sample_s)
    spectra = [
        np.concatenate([_periods(record, size) for record in records]) for records in (responses, torques)
    ]
    frf, coherence = estimate(spectra[0], spectra[1], "h1", "closed-loop FRFs")
    return np.asarray(np.fft.rfftfreq(size, sample_s)[1:], dtype=np.float64), frf, coherence


def _periods(record: Array, size: int) -> Complex:
    """Spectra (periods, lines, signals) of all whole periods but the first, without 0 Hz."""
    count = len(record) // size
    return np.asarray(np.fft.rfft(record[size : count * size].reshape(count - 1, size, -1), axis=1)[:, 1:])

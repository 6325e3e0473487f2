"""A set of measured frequency response functions in SI units, `[frequency, output, input]`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from identify.core.arrays import Array, Complex
from identify.core.errors import InputError
from identify.measured.channel import Channel

Quantity = Literal["receptance", "mobility", "accelerance"]

POWER: dict[str, int] = {"receptance": 0, "mobility": 1, "accelerance": 2}
"""Power of s that turns a receptance into the quantity."""

UNIT: dict[str, str] = {"receptance": "m/N", "mobility": "m/s/N", "accelerance": "m/s^2/N"}
"""SI unit of the quantity between a force and a translation."""


@dataclass(frozen=True)
class FrfSet:
    """H_ij = X_i / F_j with time convention e^{+j omega t}.

    frequency_hz (L,), rising; frf (L, outputs, inputs), complex128, SI, NaN where a pair was not measured;
    coherence like frf or None; noise like frf or None: known standard deviation of real or imaginary part;
    averages behind each FRF or None; window_decay_per_s is the decay sigma of an exponential window e^{-sigma
    t} that was put on force and response (0: none), so that the set samples H(sigma + j omega); record_s:
    length of the records, where it was stated;
    simultaneous_inputs (inputs,): phasors of forces that act at once, such as 1 and -j of one that
    rotates: the FRFs of the first input are then the responses to all of them, and those of the others are
    NaN; source says which file it came from, sha256 what was in it; notes are sentences on what of the file
    was not read.
    """

    frequency_hz: Array
    frf: Complex
    outputs: tuple[Channel, ...]
    inputs: tuple[Channel, ...]
    quantity: Quantity
    coherence: Array | None = None
    noise: Array | None = None
    averages: int | None = None
    window_decay_per_s: float = 0.0
    record_s: float | None = None
    simultaneous_inputs: tuple[complex, ...] | None = None
    source: str = ""
    sha256: str = ""
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        shape = (len(self.frequency_hz), len(self.outputs), len(self.inputs))
        if self.frf.shape != shape:
            raise ValueError(f"frf has shape {self.frf.shape}, expected (lines, outputs, inputs) = {shape}")
        if self.coherence is not None and self.coherence.shape != shape:
            raise ValueError(f"coherence has shape {self.coherence.shape}, expected {shape}")
        if np.any(np.diff(self.frequency_hz) <= 0):
            raise ValueError("frequency_hz must rise")

    @property
    def s(self) -> Complex:
        """Where in the complex plane the set samples H: sigma + j omega, (L,), rad/s."""
        return np.asarray(self.window_decay_per_s + 2j * np.pi * self.frequency_hz, dtype=np.complex128)

    @property
    def measured(self) -> NDArray[np.bool_]:
        """Which (output, input) pairs were measured."""
        return np.asarray(~np.isnan(self.frf).all(axis=0))

    @property
    def joined(self) -> FrfSet:
        """Of forces that act at once, the responses to them as to one force, which is at no point of its own;
        else the set itself.
        """
        if self.simultaneous_inputs is None:
            return self
        one = replace(self.pairs(list(range(len(self.outputs))), [0]), simultaneous_inputs=None)
        return replace(one, inputs=(Channel(self.inputs[0].node, 0),))

    def lines(self, keep: NDArray[np.bool_]) -> FrfSet:
        """The same set on some of its frequency lines."""
        coherence, noise = (None if array is None else array[keep] for array in (self.coherence, self.noise))
        return replace(
            self, frequency_hz=self.frequency_hz[keep], frf=self.frf[keep], coherence=coherence, noise=noise
        )

    def evenly(self, count: int) -> FrfSet:
        """So many of its lines, spread evenly, both ends among them; all where there are no more."""
        keep = np.zeros(len(self.frequency_hz), dtype=bool)
        keep[np.linspace(0, len(keep) - 1, count).astype(int)] = True
        return self.lines(keep)

    def band(self, low_hz: float, high_hz: float) -> FrfSet:
        """The lines with low <= f <= high."""
        return self.lines((self.frequency_hz >= low_hz) & (self.frequency_hz <= high_hz))

    def chosen(self, outputs: Sequence[str] | None, inputs: Sequence[str] | None, where: str) -> FrfSet:
        """The named channels in that order, all of a side that is None; InputError for one that is not
        there.
        """

        def numbers(wanted: Sequence[str] | None, present: tuple[Channel, ...], key: str) -> list[int]:
            if wanted is None:
                return list(range(len(present)))
            channels = [Channel.parse(text, f"{where} {key}") for text in wanted]
            for channel in channels:
                if channel not in present:
                    found = f"channel {channel} is not in the file"
                    raise InputError(f"{where} {key}", found, "one of " + ", ".join(map(str, present)))
            return [present.index(channel) for channel in channels]

        if outputs is None and inputs is None:
            return self
        return self.pairs(numbers(outputs, self.outputs, "outputs"), numbers(inputs, self.inputs, "inputs"))

    def pairs(self, outputs: list[int], inputs: list[int]) -> FrfSet:
        """The given output and input positions, in that order."""
        pick = np.ix_(range(len(self.frequency_hz)), outputs, inputs)
        return replace(
            self,
            frf=self.frf[pick],
            coherence=None if self.coherence is None else self.coherence[pick],
            noise=None if self.noise is None else self.noise[pick],
            outputs=tuple(self.outputs[i] for i in outputs),
            inputs=tuple(self.inputs[i] for i in inputs),
            simultaneous_inputs=None
            if self.simultaneous_inputs is None
            else tuple(self.simultaneous_inputs[i] for i in inputs),
        )

"""Sampled signals in SI units: forces and responses, in blocks (one block per hit, or one long record)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from identify.core.arrays import Array
from identify.core.errors import InputError
from identify.measured.channel import Channel
from identify.measured.units import Kind, SignalUnit, parse_signal_unit

Units = Mapping[Kind, str]
"""Unit by kind of signal, such as {"acceleration": "g"}, for files that say only the kind."""

_FORCES = ("N", "N m")


@dataclass(frozen=True)
class TimeHistory:
    """data (blocks, samples, signals) in the SI `units` of each signal; channels may repeat, once as force
    and once as response.
    """

    sample_rate_hz: float
    data: Array
    channels: tuple[Channel, ...]
    units: tuple[str, ...]
    source: str = ""
    sha256: str = ""

    def __post_init__(self) -> None:
        if (
            self.data.ndim != 3
            or self.data.shape[2] != len(self.channels)
            or len(self.units) != len(self.channels)
        ):
            raise ValueError(
                f"data {self.data.shape}, {len(self.channels)} channels, {len(self.units)} units do not"
                " belong together"
            )
        if not self.sample_rate_hz > 0:
            raise ValueError("sample_rate_hz must be positive")

    @property
    def forces(self) -> list[int]:
        """Positions of the force and moment signals."""
        return [i for i in self._told if self.units[i] in _FORCES]

    @property
    def responses(self) -> list[int]:
        """Positions of the motion signals."""
        return [i for i in self._told if self.units[i] not in _FORCES]

    @property
    def references(self) -> list[int]:
        """Positions of what excited controllers."""
        return [i for i, channel in enumerate(self.channels) if channel.is_reference]

    @property
    def _told(self) -> list[int]:
        """Positions of all but the references."""
        return [i for i, channel in enumerate(self.channels) if not channel.is_reference]


@dataclass(frozen=True)
class Signal:
    """One block of one signal as it stands in a file: values (n,) in `unit`; where names its place."""

    channel: Channel
    unit: SignalUnit
    values: Array
    where: str


def to_time_history(sample_rate_hz: float, signals: list[Signal], source: str, sha256: str) -> TimeHistory:
    """Signals in SI; a channel of the same kind that comes again is the next block.

    InputError where a value is not finite, a unit does not fit a direction, or signals have different numbers
    of blocks.
    """
    if not signals:
        raise InputError(source, "no time signal in the file", "at least one")
    blocks: dict[tuple[Channel, str], list[Array]] = {}
    for signal in signals:
        if not np.isfinite(signal.values).all():
            sample = int(np.argmin(np.isfinite(signal.values))) + 1
            raise InputError(
                signal.where,
                f"signal {signal.channel} is not finite at sample {sample}",
                "numbers",
                "export it again",
            )
        turns = abs(signal.channel.direction) > 3
        if signal.unit.rotation != turns and not signal.channel.is_reference:
            raise InputError(
                signal.where,
                f"unit {signal.unit.si} at channel {signal.channel}",
                "a unit that fits the direction",
            )
        blocks.setdefault((signal.channel, signal.unit.si), []).append(signal.unit.factor * signal.values)
    counts = {len(values) for values in blocks.values()}
    if len(counts) > 1:
        found = ", ".join(f"{channel} ({unit}): {len(values)}" for (channel, unit), values in blocks.items())
        raise InputError(source, f"different numbers of blocks: {found}", "as many blocks of each signal")
    data = np.stack([np.stack(values) for values in blocks.values()], axis=2)
    return TimeHistory(
        sample_rate_hz, data, tuple(c for c, _ in blocks), tuple(u for _, u in blocks), source, sha256
    )


def sample_rate(time_s: Array, where: str, fix: str = "resample them") -> float:
    """Samples per second of a time axis; InputError where the steps differ by more than a thousandth or there
    is only one sample.
    """
    rate = mean_rate(time_s, where)
    if not evenly_sampled(time_s):
        raise InputError(where, "time steps that are not all alike", "evenly sampled signals", fix)
    return rate


def evenly_sampled(time_s: Array) -> bool:
    """Whether rising times differ in their steps by no more than a thousandth."""
    steps = np.diff(time_s)
    return bool(np.ptp(steps) <= 2e-3 * steps.mean())


def mean_rate(time_s: Array, where: str) -> float:
    """Samples per second of a time axis whose steps may differ; InputError where time does not rise from
    sample to sample.
    """
    steps = np.diff(time_s)
    if len(steps) == 0:
        raise InputError(where, "a single time value", "two or more", "give the whole record")
    if not np.isfinite(steps).all() or steps.min() <= 0:
        row = int(np.argmin(np.where(np.isfinite(steps), steps, -np.inf))) + 2
        found = f"a time that does not rise, at sample {row}"
        raise InputError(where, found, "times that rise from sample to sample", "correct the time axis")
    return float(len(steps) / (time_s[-1] - time_s[0]))


def asked_unit(kind: Kind | None, units: Units, where: str) -> SignalUnit:
    """The unit that the user gives for a kind of signal whose unit the file does not say; InputError where
    neither speaks.
    """
    if kind is None or kind not in units:
        found = f"the file gives no unit for {kind or 'a signal'}"
        raise InputError(
            where, found, "a unit", f"say it, such as units: {{{kind or 'acceleration'}: m/s^2}}"
        )
    unit = parse_signal_unit(units[kind], where)
    if unit.kind != kind:
        raise InputError(where, f"unit {units[kind]!r} for {kind}", f"a unit of {kind}")
    return unit

"""Hidden effects in the measurement: delay, polarity, gain, swapped and turned axes, a window that is not the
one stated.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tests.generator.chain import Chain
from tests.generator.effect import MeasurementEffect
from tests.generator.rigid import Array, turn


@dataclass(frozen=True)
class TimeDelay(MeasurementEffect):
    """All responses come late."""

    seconds: float
    kind = "time-delay"

    @property
    def sentence(self) -> str:
        """The delay."""
        return f"time delay {1e3 * self.seconds:.2f} ms of all responses"

    def alter(self, chain: Chain) -> Chain:
        """A later filter."""
        return replace(chain, delay=chain.delay + self.seconds)


@dataclass(frozen=True)
class ChannelPolarity(MeasurementEffect):
    """One channel upside down."""

    point: str
    axis: str
    kind = "channel-polarity"

    @property
    def sentence(self) -> str:
        """The channel."""
        return f"polarity of {self.point}:{self.axis.upper()}"

    def alter(self, chain: Chain) -> Chain:
        """A sign."""
        return _with_matrix(chain, self.point, _gain(self.axis, -1.0))


@dataclass(frozen=True)
class ChannelGain(MeasurementEffect):
    """One channel too large or too small by a factor."""

    point: str
    axis: str
    factor: float
    kind = "channel-gain"

    @property
    def sentence(self) -> str:
        """Channel and factor."""
        return f"gain {self.factor:.3f} of {self.point}:{self.axis.upper()}"

    def alter(self, chain: Chain) -> Chain:
        """A factor."""
        return _with_matrix(chain, self.point, _gain(self.axis, self.factor))


@dataclass(frozen=True)
class ChannelSwap(MeasurementEffect):
    """Two cables of one sensor exchanged."""

    point: str
    axes: tuple[str, str]
    kind = "channel-swap"

    @property
    def sentence(self) -> str:
        """Point and axes."""
        return f"{self.axes[0].upper()} and {self.axes[1].upper()} of {self.point} swapped"

    def alter(self, chain: Chain) -> Chain:
        """A permutation."""
        order = np.arange(3)
        first, second = ("xyz".index(axis) for axis in self.axes)
        order[[first, second]] = order[[second, first]]
        return _with_matrix(chain, self.point, np.eye(3)[order])


@dataclass(frozen=True)
class TurnedSensor(MeasurementEffect):
    """A sensor mounted askew: turned about one of the link's axes."""

    point: str
    axis: str
    angle_deg: float
    kind = "turned-axes"

    @property
    def sentence(self) -> str:
        """Point and angle."""
        return f"sensor {self.point} turned by {self.angle_deg:.1f} degrees about {self.axis}"

    def alter(self, chain: Chain) -> Chain:
        """The sensor reads along its own, turned axes."""
        return _with_matrix(
            chain, self.point, turn(np.eye(3)["xyz".index(self.axis)], np.radians(self.angle_deg)).T
        )


@dataclass(frozen=True)
class WindowDecay(MeasurementEffect):
    """The exponential window that was really applied decays with `decay_per_s`, not as stated."""

    decay_per_s: float
    kind = "window-decay"

    @property
    def sentence(self) -> str:
        """The true decay."""
        return f"window decay {self.decay_per_s:.3f} 1/s in place of the one stated"

    def alter(self, chain: Chain) -> Chain:
        """Another window."""
        return replace(chain, window_decay=self.decay_per_s)


def _gain(axis: str, factor: float) -> Array:
    values = np.ones(3)
    values["xyz".index(axis)] = factor
    return np.diag(values)


def _with_matrix(chain: Chain, point: str, matrix: Array) -> Chain:
    """The chain with one more linear map behind a sensor."""
    return replace(chain, sensors={**chain.sensors, point: matrix @ chain.sensors.get(point, np.eye(3))})

"""What one simulated hammer test is: the arm, what is hidden, how it is hit, how it is measured."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

from tests.generator.arm import Arm
from tests.generator.effect import Effect
from tests.generator.rigid import Array


@dataclass(frozen=True)
class TestSpec:
    """A hammer test; the same spec gives the same files.

    force_n: mean peak force (N) at level 1, times which levels are hit; None: 180 N on arms from 500 kg, in
    proportion to the mass below. noise_force (N) and noise_response (m/s^2): standard deviations of each
    sample. window_decay_per_s None: as much as brings the slowest mode down to 0.2 % at the end of the
    record, 0.693 at least. struck: names of the drive points (default: the last point).  weighed:
    accelerometers feel gravity, AC-coupled. initial_range: the first guess of stiffness lies within these
    multiples of the truth.  told: the arm as its user knows it (None: as it is); sensors: what channels make
    of true x, y, z, by name of point; held_askew_deg: of the hammer in each posture and direction, the same
    for all averages; pre_trigger_s: how long before the impacts the records begin; noisier: how many times
    the noise the postures have, in their order (further ones: once); linear: whether motions are those of the
    linear model, exact at any step, where many stiff springs would take steps of microseconds.
    """

    __test__: ClassVar[bool] = False

    arm: Arm
    effects: tuple[Effect, ...] = ()
    seed: int = 1
    case: str = "none"
    postures: int = 3
    levels: tuple[float, ...] = (1.0,)
    force_n: float | None = None
    noise_force: float = 0.1
    noise_response: float = 1e-2
    averages: int = 4
    sample_rate_hz: float = 512.0
    duration_s: float = 1.6
    oversampling: int = 16
    window_decay_per_s: float | None = None
    band_hz: tuple[float, float] = (2.5, 80.0)
    direction_error_deg: float = 0.0
    struck: tuple[str, ...] = ()
    weighed: bool = False
    binary: bool = False
    initial_range: tuple[float, float] = (0.6, 1.7)
    told: Arm | None = None
    sensors: Mapping[str, Array] = field(default_factory=dict)
    held_askew_deg: float = 0.0
    pre_trigger_s: float = 0.0
    noisier: tuple[float, ...] = ()
    linear: bool = False

    @property
    def hammer_points(self) -> tuple[str, ...]:
        """Names of the points that are hit, each along x, y and z of its link."""
        return self.struck or (self.arm.points[-1].name,)

    @property
    def peak_n(self) -> float:
        """Mean peak force at level 1, N."""
        mass = sum(link.inertia.mass for link in self.arm.links)
        return self.force_n or min(180.0, 180.0 * mass / 500.0)

"""The cascade with a feedback of each joint's twist and its rate: the conventional controller of the Nagoya
study's section 5.

The paper says "PD position controller including PI velocity control with state feedback and dynamic
feedforward compensator with two-inertia model", and neither the states nor the gains.  Here the states are
those of two inertias: position and velocity of the motor, which the cascade has, and twist and its rate, from
an encoder at the link.  The gains of the last two follow from the place of one pair of poles: the link's own
frequency with its drive held, sqrt(k/J) at the commanded posture, with a damping ratio that is stated.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from pydantic import Field

from identify.core.arrays import Array
from identify.motion.cascade import Cascade, CascadeLaw, CascadeState
from identify.motion.controller import ControlLaw, Feedforward, FeedforwardModel, Sample


class StateFeedback(Cascade):
    """The cascade with feed-forward of two inertias a joint, and a feedback of twist that places a pair of
    poles.
    """

    kind: Literal["state-feedback"] = "state-feedback"  # type: ignore[assignment]
    output: Literal["torque"] = Field("torque", description="what the motor is given")
    pole_damping: float = Field(
        0.5, gt=0, lt=1, description="damping ratio of the poles at the link's frequency with its drive held"
    )
    feedforward: Feedforward = "two-inertia"

    @property
    def model(self) -> FeedforwardModel:
        """As `feedforward` says."""
        return self.feedforward

    @property
    def places_poles(self) -> float:
        """As `pole_damping` says."""
        return self.pole_damping

    def law(self, numbers: Mapping[str, Array]) -> ControlLaw:
        """The cascade's law with the feedback beside it."""
        return StateFeedbackLaw(self.cascade(numbers), self.period_s)


@dataclass(frozen=True)
class FedBack:
    """The cascade's state, and the twist at the last tick beyond that of the command, rad."""

    inner: CascadeState
    twist: Array


@dataclass(frozen=True)
class StateFeedbackLaw(ControlLaw):
    """A cascade less a stiffness times twist and a damping times its rate, both beyond the command's."""

    inner: CascadeLaw
    period_s: float

    def standing_error(self, holding: Array) -> Array:
        """That of the cascade."""
        return self.inner.standing_error(holding)

    def begin(self, sample: Sample, holding: Array) -> FedBack:
        """The integral holds against the twist too."""
        assert sample.twist is not None
        inner = self.inner.begin(sample, holding)
        held = inner.integral + sample.twist.stiffness * sample.twist.value
        return FedBack(replace(inner, integral=held), sample.twist.value)

    def act(self, state: FedBack, sample: Sample) -> tuple[Array, FedBack]:
        """The cascade's command less the feedback."""
        assert sample.twist is not None
        command, inner = self.inner.act(state.inner, sample)
        twist = sample.twist
        rate = (twist.value - state.twist) / self.period_s
        back = twist.stiffness * twist.value + twist.damping * rate
        return command - back / self.inner.ratio, FedBack(inner, twist.value)


@dataclass(frozen=True)
class TwoInertias:
    """A joint by itself, arrays of one shape: drive and link, kg m^2 at the gear output, with a spring, N
    m/rad, and a damper, N m s/rad, between them; no stiffness where the joint is rigid.
    """

    drive: Array
    link: Array
    stiffness: Array
    damping: Array

    def twist_per_torque(self, s: Array, gains: Mapping[str, Array]) -> Array:
        """Twist by torque at the drive, rad/(N m), at complex s, in the loop of a cascade: with C = K_v (1 +
        K_i/s) (s + K_p) and the link's L = J s^2 / (J s^2 + d s + k), L / (J_m s^2 + C + (d s + k) L).
        """
        spring = self.damping * s + self.stiffness
        follows = self.link * s**2 / (self.link * s**2 + spring)
        servo = gains["velocity_gain"] * (1 + gains["velocity_integral"] / s) * (s + gains["position_gain"])
        return np.asarray(follows / (self.drive * s**2 + servo + spring * follows))

    def placed(self, damping_ratio: float, gains: Mapping[str, Array]) -> tuple[Array, Array]:
        """Gains of twist, N m/rad, and of its rate, N m s/rad, with which sqrt(k/J) (-D + j sqrt(1 - D^2)) is
        a pole: (stiffness + damping s) G(s) = -1 there; 0 where the joint is rigid.
        """
        elastic = self.stiffness > 0
        joint = replace(self, stiffness=np.where(elastic, self.stiffness, 1.0))
        s = np.sqrt(joint.stiffness / self.link) * (-damping_ratio + 1j * np.sqrt(1 - damping_ratio**2))
        needed = -1 / joint.twist_per_torque(s, gains)
        damping = needed.imag / s.imag
        return np.where(elastic, needed.real - damping * s.real, 0.0), np.where(elastic, damping, 0.0)

"""Two-degree-of-freedom control of elastic joints (Nagoya section 5): feed-forward from the elastic arm,
feedback shaped by a moving notch.

The paper's block diagram (its Fig. 11) is not in the copy that we could read, so this is built from its
words: the feed-forward is that of the identified flexible two-link model, and a variable notch filter takes
the arm's vibration mode, which moves with the posture, out of the feedback loop.  Each of the two stands
alone too: `feedforward: rigid` with a notch, or no notch; and `feedforward: two-inertia` is that of the
paper's conventional controller, whose state feedback is in `identify.motion.state_feedback`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from pydantic import Field

from identify.core.arrays import Array
from identify.motion.cascade import Cascade, CascadeLaw, CascadeState
from identify.motion.controller import ControlLaw, Feedforward, FeedforwardModel, Sample


class TwoDegreeOfFreedom(Cascade):
    """The cascade with the motor's reference ahead by the windup of the joints, and a notch at the first mode
    of the commanded posture.
    """

    kind: Literal["two-degree-of-freedom"] = "two-degree-of-freedom"  # type: ignore[assignment]
    notch_width: float = Field(0.0, ge=0, description="damping ratio of the notch's poles; 0: no notch")
    notch_depth: float = Field(0.1, ge=0, lt=1, description="gain of the notch at its frequency")

    feedforward: Feedforward = "two-link"

    @property
    def model(self) -> FeedforwardModel:
        """As `feedforward` says."""
        return self.feedforward

    @property
    def knows_mode(self) -> bool:
        """For the notch."""
        return self.notch_width > 0

    def law(self, numbers: Mapping[str, Array]) -> ControlLaw:
        """The cascade's law behind the notch."""
        inner = self.cascade(numbers)
        return (
            NotchedLaw(inner, self.notch_width, self.notch_depth, self.period_s)
            if self.notch_width > 0
            else inner
        )


@dataclass(frozen=True)
class NotchedState:
    """The cascade's state, and what went into the notch and came out at the last two ticks beyond what holds
    at rest.
    """

    inner: CascadeState
    rest: Array
    given: tuple[Array, Array]
    passed: tuple[Array, Array]


@dataclass(frozen=True)
class NotchedLaw(ControlLaw):
    """A cascade whose output passes (s^2 + 2 d w f s + f^2) / (s^2 + 2 w f s + f^2), f the mode, w the width
    and d the depth.
    """

    inner: CascadeLaw
    width: float
    depth: float
    period_s: float

    def standing_error(self, holding: Array) -> Array:
        """That of the cascade."""
        return self.inner.standing_error(holding)

    def begin(self, sample: Sample, holding: Array) -> NotchedState:
        """A notch at rest."""
        zero = np.zeros_like(holding)
        return NotchedState(self.inner.begin(sample, holding), holding, (zero, zero), (zero, zero))

    def act(self, state: NotchedState, sample: Sample) -> tuple[Array, NotchedState]:
        """The cascade's command through the notch, discretised by the bilinear transform warped to be right
        at its frequency.
        """
        command, inner = self.inner.act(state.inner, sample)
        wave = np.tan(np.minimum(np.pi * sample.mode_hz * self.period_s, 1.5))
        top, bottom = (
            (wave**2 + 2 * z * wave + 1, 2 * (wave**2 - 1), wave**2 - 2 * z * wave + 1)
            for z in (self.depth * self.width, self.width)
        )
        new = command - state.rest
        passed = (
            top[0] * new
            + top[1] * state.given[0]
            + top[2] * state.given[1]
            - bottom[1] * state.passed[0]
            - bottom[2] * state.passed[1]
        )
        passed = passed / bottom[0]
        return state.rest + passed, NotchedState(
            inner, state.rest, (new, state.given[0]), (passed, state.passed[0])
        )

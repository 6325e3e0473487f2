"""What a controller is, and the registry of all kinds.

A controller's settings are what the config says.  With numbers for every lane (a lane is one candidate on one
record) they make a law, which holds nothing that changes; what changes is its state, handed out at every
tick. Positions and velocities are the drive's at the gear output: the rotor's over the gear ratio.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Literal

from pydantic import BaseModel, Field

from identify.core.arrays import Array
from identify.core.config import Settings
from identify.core.registry import Registry, parse_kind
from identify.motion.numbers import Number, quantity

CONTROLLERS = Registry(
    "controller",
    "identify.controllers",
    {
        "cascade": "identify.motion.cascade:Cascade",
        "pid-voltage": "identify.motion.pid_voltage:PidVoltage",
        "state-feedback": "identify.motion.state_feedback:StateFeedback",
        "two-degree-of-freedom": "identify.motion.two_degree_of_freedom:TwoDegreeOfFreedom",
    },
    "identify.motion.controller:Controller",
)


FeedforwardModel = Literal["rigid", "two-inertia", "two-link"]
"""The rigid arm; each joint by itself, rotor and link with the joint's spring between, other joints at rest
where they are commanded; the elastic arm."""

Feedforward = Annotated[
    FeedforwardModel,
    Field(
        description="model of reference and torque: `rigid` arm, each joint as `two-inertia`, or elastic"
        " `two-link` arm"
    ),
]
"""The config's word for it, in controllers that let it be chosen."""


@dataclass(frozen=True)
class Twist:
    """A joint's twist, turn of the drive less that of the link, rad, and the gains of a feedback of it, N
    m/rad, and of its rate, N m s/rad.  In a sample the twist is what was measured beyond the command's.
    """

    value: Array
    stiffness: Array
    damping: Array


@dataclass(frozen=True)
class Sample:
    """What a controller sees at a tick, (lanes, joints) each.

    tick: its number; position, velocity: commanded, rad, rad/s; feedforward: torque of the command by inverse
    dynamics at the gear output, N m; turn: measured turn of the drive, rad; current: measured, A; mode_hz:
    the arm's first mode at the commanded posture; twist: where a controller feeds it back.
    """

    tick: int
    position: Array
    velocity: Array
    feedforward: Array
    turn: Array
    current: Array
    mode_hz: Array
    twist: Twist | None = None


class ControlLaw(ABC):
    """A controller with its numbers, (lanes, joints) each."""

    @abstractmethod
    def standing_error(self, holding: Array) -> Array:
        """How far the drive stands behind its command (rad) when the motor is to be given `holding` (V or N
        m) at rest.
        """

    @abstractmethod
    def begin(self, sample: Sample, holding: Array) -> Any:
        """The state of a controller that has long stood at this sample with the motor given `holding`."""

    @abstractmethod
    def act(self, state: Any, sample: Sample) -> tuple[Array, Any]:
        """What the motors are given until the next tick (V or N m, before their limits), and the state
        then.
        """


class Controller(BaseModel, ABC):
    """Settings of a controller of all joints as written in the config."""

    model_config = Settings.model_config
    kind: str = Field(description="which controller")
    period_s: float = Field(1e-3, gt=0, description="time between ticks, a whole number of steps")
    delay_s: float = Field(0.0, ge=0, description="from measuring to the motor, a whole number of steps")
    latency: Number = quantity("s", "further time from measuring to the motor, of any length", 0.0)
    told: dict[str, list[float]] = Field(
        {},
        description="numbers of `motor`, one per joint, that the controller computes with where they are not"
        " those of the study: `{rotor_inertia: [0.012, 0.008]}`",
    )

    @property
    @abstractmethod
    def gives(self) -> str:
        """What it gives the motor: `voltage` or `torque`."""

    @property
    def model(self) -> FeedforwardModel:
        """Of which its reference and feed-forward are: but for `rigid`, the motor's position and torque are
        those that take the link along the command.
        """
        return "rigid"

    @property
    def knows_mode(self) -> bool:
        """Whether it follows the arm's first mode."""
        return False

    @property
    def places_poles(self) -> float:
        """Damping ratio of the poles that a feedback of twist places at each link's frequency with its drive
        held; 0 without such a feedback.
        """
        return 0.0

    @abstractmethod
    def law(self, numbers: Mapping[str, Array]) -> ControlLaw:
        """The law with the numbers of motor, gear and controller (`servo.position_gain`), (lanes, joints)
        each.
        """


def parse_controller(data: Any) -> Controller:
    """A controller from its mapping in the config; raises ValueError for pydantic to report with its key."""
    controller: Controller = parse_kind(CONTROLLERS, data)
    return controller

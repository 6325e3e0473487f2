"""A study of motion: config.yaml with `schema: identify-motion/1` read into settings, every error with its
key, its line and a fix.

What the settings mean is turned into something that moves in `identify.motion.problem`.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal, TypeAlias

from pydantic import BeforeValidator, Field, model_validator

from identify.core.config import ConfigFile, Settings, read_settings
from identify.fitting.plan import StageSettings, as_list
from identify.measured.records import Quantity, SignalSettings, TimeAxis
from identify.model.effects.base import parse_effect
from identify.model.effects.base_compliance import BaseCompliance
from identify.model.effects.joint_compliance import JointCompliance
from identify.model.effects.link_flexibility import LinkFlexibility
from identify.model.laws.friction import Smoothing
from identify.motion.bodies import Balancer, Bodies
from identify.motion.command import Move
from identify.motion.controller import Controller, parse_controller
from identify.motion.excitation import Excitation
from identify.motion.friction import FrictionSettings
from identify.motion.gear import Gear
from identify.motion.motor import Motor
from identify.motion.numbers import Number
from identify.motion.path import Circle, Tool
from identify.robot.settings import RobotSettings

SCHEMA = "identify-motion/1"
WEIGHTS = (
    "motor_position",
    "motor_velocity",
    "motor_torque",
    "motor_current",
    "link_position",
    "link_velocity",
    "tool_position",
)
"""Signals that a fit can compare; the last where a tracker saw the tool."""
Deviation = Annotated[float, Field(gt=0)]
Spring: TypeAlias = JointCompliance | BaseCompliance | LinkFlexibility
"""Effects that have motion."""


def _spring(data: Any) -> Spring:
    effect = parse_effect(data)
    if not isinstance(effect, Spring):
        raise ValueError(
            f"effect {effect.kind!r} has no motion yet; expected joint-compliance, base-compliance or"
            " link-flexibility"
        )
    for key in ("coupled", "shrink", "nonuniform"):
        if getattr(effect, key, False):
            raise ValueError(f"{key} springs have no motion yet; leave `{key}` out")
    return effect


class MeasuredMotion(Settings):
    """Where what was recorded stands."""

    file: Path = Field(description="CSV, MATLAB, HDF5 or universal file with time records")
    time: TimeAxis = Field(TimeAxis(at="time_s"), description="the time axis")
    signals: dict[Quantity, SignalSettings] = Field(
        min_length=1, description="what was measured, by quantity"
    )
    tool: TrackerSettings | None = Field(
        None, description="where the tool was seen, by a laser tracker for example"
    )


class TrackerSettings(Settings):
    """Where the measured places of the tool stand."""

    at: tuple[str, str, str] = Field(description="names of its x, y and z")
    unit: Literal["m", "mm"] = Field("m", description="unit of the places")
    frame: Literal["base", "own"] = Field(
        "base",
        description="own: the tracker's own axes and clock, which are laid on where the drives say that the"
        " tool was, by a rigid motion and an offset in time of at most half a second",
    )
    within_deg: float = Field(
        0.03,
        ge=0,
        description="standard deviation of its axes and of the zeros of the drives: motions of the tool that"
        " such errors, or a shift, explain are not compared",
    )


class RecordSettings(Settings):
    """One motion: where it starts, what is commanded, and what was recorded."""

    name: str = Field(min_length=1, pattern=r"^[^/\\]+$", description="names it in results")
    start_deg: list[float] = Field(description="joint angles at the start, one per joint")
    moves: list[Move] = Field(
        [],
        description="what is commanded, joint by joint; default: the measured command_position, else stand"
        " still",
    )
    path: Circle | None = Field(
        None,
        description="what is commanded of the tool, instead of moves; its paths are then reported and judged",
    )
    excitation: Excitation | None = Field(
        None, description="what is added to the torque that the controller gives, for FRFs"
    )
    duration_s: float = Field(gt=0, description="how long it is simulated")
    recorded_motion_hz: float | None = Field(
        None,
        gt=0,
        description="the recorded motor_position itself moves the drives, with speeds and accelerations up to"
        " this frequency, and torques and currents are what that takes; default: the controller moves them",
    )
    measured: MeasuredMotion | None = Field(None, description="what was recorded, to compare with and to fit")
    phases_s: dict[str, tuple[float, float]] = Field(
        {}, description="parts of the record, such as slow: [0, 6], with errors of their own"
    )
    use: Literal["fit", "validate"] = Field("fit", description="`validate`: never fitted, only predicted")

    @model_validator(mode="after")
    def _one_command(self) -> RecordSettings:
        if self.path is not None and self.moves:
            raise ValueError("moves and path: both given; expected joint moves or a path of the tool")
        return self


class MotionCandidate(Settings):
    """A physical effect that may be missing: numbers that it sets free, springs that it brings, tried after
    the fit.
    """

    name: str = Field(min_length=1, description="what it is, such as Coulomb friction")
    numbers: dict[str, Number] = Field(
        {}, description="by section and key, such as friction.coulomb: {initial: 10, bounds: [0.1, 500]}"
    )
    effects: list[Annotated[Spring, BeforeValidator(_spring)]] = Field(
        [], description="springs that it brings: joint-compliance, base-compliance, link-flexibility"
    )
    smoothing: Smoothing | None = Field(
        None,
        description="how the sign of dry friction passes through zero, beside other candidates with the same"
        " numbers; default: as `friction.smoothing` says",
    )

    def sentence(self) -> str:
        """What it is, as the study says."""
        return self.name

    @model_validator(mode="after")
    def _brings_something(self) -> MotionCandidate:
        if not self.numbers and not self.effects and self.smoothing is None:
            raise ValueError(f"candidate {self.name!r} has neither numbers nor effects; give one of them")
        return self

    def instead_of(self, other: MotionCandidate) -> bool:
        """Whether only one of the two can be added, because they set the same numbers free, or the same
        springs.
        """
        return self._claims == other._claims

    @property
    def _claims(self) -> tuple[frozenset[tuple[str, tuple[int, ...]]], str]:
        numbers = frozenset((key, tuple(one.joints or ())) for key, one in self.numbers.items())
        return numbers, str([effect.model_dump() for effect in self.effects])


class MotionStudy(Settings):
    """What one motion.yaml describes."""

    schema_: Literal["identify-motion/1"] = Field(alias="schema", description="version of this format")
    name: str = Field("motion", min_length=1, pattern=r"^[^/\\]+$", description="names the result file")
    robot: RobotSettings = Field(description="the robot that moves")
    effects: list[Annotated[Spring, BeforeValidator(_spring)]] = Field(
        [],
        description=(
            "elastic coordinates: joint-compliance, base-compliance, link-flexibility; none: a rigid arm"
        ),
    )
    tool: Tool | None = Field(None, description="the point of the robot that a `path` leads")
    motor: Annotated[Motor, Field(discriminator="kind")] = Field(description="motors of all joints")
    gear: Gear = Field(description="gears of all joints")
    friction: FrictionSettings = Field(FrictionSettings(), description="friction of all drives")
    bodies: Bodies = Field(Bodies(), description="how far the links' bodies are off their description")
    balancer: Balancer = Field(Balancer(), description="gravity balancers beside joints")
    inverse_dynamics_hz: float | None = Field(
        None,
        gt=0,
        description="also report which torques and currents the recorded motor_position takes by inverse"
        " dynamics, with speeds and accelerations up to this frequency (rigid arms); default: not",
    )
    encoder_counts: list[int] | None = Field(
        None, description="counts per turn of each motor; default: continuous"
    )
    servo: Annotated[Controller, BeforeValidator(parse_controller)] = Field(
        description="the controller of all joints"
    )
    step_s: float | None = Field(
        None,
        gt=0,
        description="step of integration; default: the controller's period, or less for fast modes",
    )
    extrapolate: bool = Field(
        False,
        description="simulate at half the step too, and extrapolate to none (Richardson): three times the"
        " work, and an error of second order in the step",
    )
    records: list[RecordSettings] = Field(
        min_length=1, description="motions to simulate, and what was recorded of them"
    )
    noise: dict[str, Deviation | list[Deviation]] = Field(
        {}, description="standard deviation of each measured signal that is fitted, SI; one, or one per joint"
    )
    candidates: list[MotionCandidate] = Field(
        [], description="effects that may be missing, tried one by one after a fit"
    )
    optimizer: Annotated[
        list[Annotated[StageSettings, BeforeValidator(StageSettings.parse)]], BeforeValidator(as_list)
    ] = Field([StageSettings.parse("gauss-newton")], description="stages of a fit, one after the other")
    starts: int = Field(1, ge=1, description="starts of a fit")
    start_factor: float = Field(
        3.0, gt=1, description="further starts are drawn within this factor of the initial values"
    )
    target_cost: float = Field(0.0, ge=0, description="a cost at or below this ends the fit")
    seed: int = Field(1, ge=0, lt=2**63, description="seed of all random numbers")

    @model_validator(mode="after")
    def _continuous(self) -> MotionStudy:
        if self.extrapolate and self.encoder_counts is not None:
            raise ValueError(
                "extrapolate: with encoder_counts, whose steps do not fall with it; leave one out"
            )
        return self

    @model_validator(mode="after")
    def _consistent(self) -> MotionStudy:
        wants = "voltage" if self.motor.kind == "dc" else "torque"
        if self.servo.gives != wants:
            raise ValueError(
                f"servo: gives a {self.servo.gives}; expected a controller that gives a {wants} to a motor of"
                f" kind {self.motor.kind}"
            )
        excited = [record.name for record in self.records if record.excitation is not None]
        if excited and wants == "voltage":
            raise ValueError(f"record {excited[0]}: excitation is a torque; expected a motor of kind torque")
        names = [record.name for record in self.records]
        if len(set(names)) < len(names):
            raise ValueError(f"records: names {names}; expected each name once")
        led = [record.name for record in self.records if record.path is not None]
        if led and self.tool is None:
            raise ValueError(
                f"tool: missing, and record {led[0]} has a path; expected the point that is led, such as"
                " tool: {link: link6}"
            )
        unknown = set(self.noise) - set(WEIGHTS)
        if unknown:
            raise ValueError(f"noise: {min(unknown)} cannot be fitted; expected some of {', '.join(WEIGHTS)}")
        return self


class MotionFile(ConfigFile[MotionStudy]):
    """A study of motion with its file."""


def read_motion_study(path: Path) -> MotionFile:
    """The study of motion in a YAML file.

    Raises InputError for a file that cannot be read or is no YAML, and InputErrors with every key that is
    wrong.
    """
    return MotionFile.of(path, *read_settings(path, MotionStudy, SCHEMA))

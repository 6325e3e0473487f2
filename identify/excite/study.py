"""A study of excitation: what is to be known, and within which limits the robot may move; schema
`identify-excite/1`.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, field_validator, model_validator

from identify.core.config import ConfigFile, Settings, read_settings
from identify.robot.settings import Ratio, RobotSettings

SCHEMA = "identify-excite/1"
Target = Literal["base-parameters", "friction", "transmission-error"]
Range = tuple[float, float]
Amount = Annotated[float, Field(ge=0)]


class WorkspaceRegion(Settings):
    """Where a point of the robot has to stay, in the base's axes."""

    frame: str = Field(description="link or frame that carries the point")
    point_m: tuple[float, float, float] = Field((0.0, 0.0, 0.0), description="the point in that frame")
    x_m: Range | None = Field(None, description="least and most; default: anywhere")
    y_m: Range | None = Field(None, description="least and most; default: anywhere")
    z_m: Range | None = Field(None, description="least and most, such as [0.2, 9] above a table")

    @field_validator("x_m", "y_m", "z_m")
    @classmethod
    def _rising(cls, value: Range | None) -> Range | None:
        if value is not None and not value[0] < value[1]:
            raise ValueError(f"{value[0]:g} to {value[1]:g} m; expected least below most")
        return value

    @property
    def ranges(self) -> tuple[Range, Range, Range]:
        """Of x, y and z."""
        anywhere = (-float("inf"), float("inf"))
        return self.x_m or anywhere, self.y_m or anywhere, self.z_m or anywhere


class RecordNoise(Settings):
    """Standard deviations of what will be recorded, a number per joint or one for all."""

    torque_nm: float | list[float] | None = Field(
        None, description="of a torque, at the joint; for base parameters and friction"
    )
    position_deg: float | list[float] = Field(0.0, description="of a motor position, at the joint")
    deflection_deg: float | list[float] | None = Field(
        None, description="of link less motor position; for transmission errors"
    )


class KnownDrives(Settings):
    """What is known of drives, a number per joint: for the rehearsal, and what need not be found."""

    gear_ratio: list[Ratio] | None = Field(None, description="turns of the motor per turn of the joint")
    rotor_inertia_kg_m2: list[Amount] | None = Field(
        None, description="at the motor; default: not known, so that it is found along"
    )
    coulomb_nm: list[Amount] | None = Field(None, description="expected, at the joint; default: none")
    viscous_nm_s_per_rad: list[Amount] | None = Field(None, description="expected; default: none")
    orders: list[float] = Field([1.0, 2.0], description="waves per turn of the motor to be found")
    waves_below_hz: float = Field(
        10.0,
        gt=0,
        description="of transmission errors: faster waves are not counted on, as joints then swing",
    )


class ExciteStudy(Settings):
    """What one config describes."""

    schema_: Literal["identify-excite/1"] = Field(alias="schema", description="version of this format")
    name: str = Field("excite", min_length=1, pattern=r"^[^/\\]+$", description="names the result file")
    robot: RobotSettings = Field(description="the robot that is to move")
    target: Target = Field(description="what is to be known best")
    joints: list[int] | None = Field(None, min_length=1, description="the joints that move; default: all")
    posture_deg: list[float] | None = Field(
        None, description="a posture inside all limits; default: the middle of the joints' angles"
    )
    angle_deg: list[Range] | None = Field(
        None, description="least and most of each joint; default: those of the robot's file"
    )
    speed_deg_per_s: list[float] = Field(description="most of each joint")
    acceleration_deg_per_s2: list[float] = Field(description="most of each joint")
    workspace: list[WorkspaceRegion] = Field([], description="where points of the robot have to stay")
    period_s: float = Field(10.0, gt=0, description="after which the motion begins again")
    periods: int = Field(4, ge=1, le=1000, description="how often it is run and recorded")
    harmonics: int = Field(5, ge=2, le=50, description="of the Fourier series of each joint")
    sample_rate_hz: float = Field(100.0, gt=0, description="of command and records")
    lowpass_hz: float = Field(10.0, gt=0, description="of the filter behind which speed will be taken")
    stationary_below_deg_per_s: float = Field(
        0.1, gt=0, description="a joint below this speed stands, and its samples are not used"
    )
    noise: RecordNoise = Field(description="of the records")
    drives: KnownDrives = Field(KnownDrives(), description="what is known of drives")
    starts: int = Field(3, ge=1, description="random motions that are improved")
    steps: int = Field(40, ge=1, description="steps by which each is improved at most")
    seed: int = Field(1, description="of the random motions and of the rehearsal's noise")

    @model_validator(mode="after")
    def _sampled(self) -> ExciteStudy:
        if self.harmonics / self.period_s > self.sample_rate_hz / 10:
            raise ValueError(
                f"harmonics: the fastest turns {self.harmonics / self.period_s:g} times a second; expected at"
                f" most a tenth of sample_rate_hz, {self.sample_rate_hz:g} Hz"
            )
        if not self.harmonics / self.period_s < self.lowpass_hz < self.sample_rate_hz / 2:
            raise ValueError(
                f"lowpass_hz: {self.lowpass_hz:g} Hz; expected above the fastest harmonic,"
                f" {self.harmonics / self.period_s:g} Hz, and below half of sample_rate_hz"
            )
        return self


class ExciteFile(ConfigFile[ExciteStudy]):
    """A study of excitation with its file."""


def read_excite_study(path: Path) -> ExciteFile:
    """The study in a YAML file; InputError for no such file, InputErrors with every key that is wrong."""
    return ExciteFile.of(path, *read_settings(path, ExciteStudy, SCHEMA))

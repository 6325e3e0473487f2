"""A study of recorded motion: what the config says, read and checked; schema `identify-explain/1`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import ClassVar, Literal

from pydantic import Field, model_validator

from identify.core.config import ConfigFile, Settings, read_settings
from identify.explain.effects.base import MOTION_EFFECTS
from identify.measured.records import Quantity, SignalSettings, TimeAxis
from identify.robot.settings import Ratio, RobotSettings

SCHEMA = "identify-explain/1"
Use = Literal["fit", "validate", "test"]
USES: tuple[Use, ...] = ("fit", "validate", "test")


class Drives(Settings):
    """What is known of the drives, a number per joint."""

    gear_ratio: list[Ratio] = Field(description="turns of the motor per turn of the joint")
    rotor_inertia_kg_m2: list[float] | None = Field(
        None, description="at the motor; default: none, so that it is found as an effect"
    )
    coupling: list[list[float]] | None = Field(
        None,
        description="row i: how far motor i turns, over its gear ratio, with a turn of each joint, 1 with its"
        " own; default: no motor turns with another joint",
    )
    positions_of: Literal["joints", "motors"] = Field(
        "joints",
        description="what recorded positions, speeds and commands are of; `motors`: their turns over the gear"
        " ratio, from which the joints' are found by the coupling",
    )
    torque_constant_nm_per_a: list[float] | None = Field(
        None, description="N m/A, for records of motor currents"
    )


class Record(Settings):
    """One record."""

    file: Path = Field(description="CSV, MATLAB, HDF5 or universal file with time records")
    name: str | None = Field(None, description="default: the file's name")
    use: Use = Field(
        "fit", description="`validate`: the record judges; `test`: it is only reported, nothing depends on it"
    )


class Payload(Settings):
    """Where a payload would sit, for the effect `payload-mass`; default: where the robot's first payload is,
    else the last link's frame.
    """

    link: str = Field(description="link or frame that carries it")
    centre_m: tuple[float, float, float] = Field(
        (0.0, 0.0, 0.0), description="centre of mass in the link's frame"
    )


class BodyUncertainty(Settings):
    """Standard deviations of what is stated of each rigid body, in per cent; 0: as stated."""

    mass_percent: float = Field(5.0, ge=0, le=100, description="of its mass")
    centre_percent: float = Field(
        5.0, ge=0, le=100, description="of its centre of mass, of the distance from the link's frame"
    )
    inertia_percent: float = Field(5.0, ge=0, le=100, description="of each of its moments of inertia")


class ExplainStudy(Settings):
    """What one config describes."""

    RENAMED: ClassVar[Mapping[str, str]] = {"standing_deg_per_s": "stationary_below_deg_per_s"}
    schema_: Literal["identify-explain/1"] = Field(alias="schema", description="version of this format")
    name: str = Field(min_length=1, pattern=r"^[^/\\]+$", description="names the result file")
    robot: RobotSettings = Field(description="the robot that was recorded")
    drives: Drives = Field(description="what is known of motors and gears")
    records: list[Record] = Field(
        min_length=2, description="some to fit, some with `use: validate` to judge by"
    )
    signals: dict[Quantity, SignalSettings] = Field(description="where they stand in the files, by quantity")
    time: TimeAxis | None = Field(None, description="the time axis in the files")
    sample_rate_hz: float | None = Field(None, gt=0, description="where the files have no time axis")
    joint_zero_deg: list[float] | None = Field(
        None, description="the robot's joint angles where the records count zero; default: zero"
    )
    positions: Literal["absolute", "relative"] = Field(
        "absolute", description="`relative`: they count from where each record began"
    )
    joints: list[int] | None = Field(None, description="the joints to explain; default: all")
    lowpass_hz: float = Field(
        20.0, gt=0, description="of the filter behind which speed and acceleration are taken"
    )
    resample_hz: float | None = Field(
        None, gt=0, description="default: as recorded; needed where time stamps are not evenly spaced"
    )
    stationary_below_deg_per_s: float = Field(
        0.1,
        gt=0,
        description="a joint below this speed stands; friction at rest is not determined, so it is left out",
    )
    uncertainty: BodyUncertainty = Field(
        BodyUncertainty(),
        description="of the rigid bodies as stated; errors within it come before any effect",
    )
    payload_at: Payload | None = Field(None, description="where `payload-mass` puts its mass")
    effects: list[str] | None = Field(None, description="kinds of effects to try; default: all")

    @model_validator(mode="after")
    def _consistent(self) -> ExplainStudy:
        if (self.time is None) == (self.sample_rate_hz is None):
            raise ValueError("give either `time` or `sample_rate_hz`")
        if self.drives.positions_of == "motors" and self.drives.coupling is None:
            raise ValueError(
                "drives.positions_of: `motors` needs `coupling`; without it they are the joints'"
            )
        _check_uses(self.records, self.positions)
        unknown = [kind for kind in self.effects or () if kind not in MOTION_EFFECTS.names()]
        if unknown:
            raise ValueError(
                f"effects: unknown kind {unknown[0]!r}; expected some of {', '.join(MOTION_EFFECTS.names())}"
            )
        return self


def _check_uses(records: Sequence[Record], positions: str) -> None:
    """ValueError where records are not enough, or do not fit together."""
    uses = [record.use for record in records]
    if not {"fit", "validate"} <= set(uses):
        raise ValueError("records: expected one with `use: fit` and one with `use: validate`, or more")
    if positions == "relative" and max(uses.count("fit"), uses.count("validate")) > 1:
        raise ValueError(
            "records: expected one to fit and one to validate with `positions: relative`, because waves"
            " over an angle begin elsewhere in each record; give absolute positions, or `use: test`"
        )
    names = [record.name or record.file.stem for record in records]
    twice = [name for name in names if names.count(name) > 1]
    if twice and "test" in uses:
        raise ValueError(f"records: two are called {twice[0]!r}; expected a `name` of its own for each")


class ExplainFile(ConfigFile[ExplainStudy]):
    """A study of recorded motion to explain with its file."""


def read_explain_study(path: Path) -> ExplainFile:
    """The study of recorded motion to explain in a YAML file.

    Raises InputError for a file that cannot be read or is no YAML, and InputErrors with every key that is
    wrong.
    """
    return ExplainFile.of(path, *read_settings(path, ExplainStudy, SCHEMA))

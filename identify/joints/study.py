"""A study of joints: what the config says, read and checked; schema `identify-joints/1`."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import BeforeValidator, Field, model_validator

from identify.core.arrays import Array
from identify.core.config import ConfigFile, Settings, read_settings
from identify.core.errors import InputError
from identify.joints.base import Curve, parse_curve
from identify.joints.data import JointTestData
from identify.measured.records import Quantity, SignalSettings, TimeAxis
from identify.robot.coupling import checked_coupling
from identify.robot.description import Robot
from identify.robot.read import read_robot
from identify.robot.settings import Ratio, RobotSettings

SCHEMA = "identify-joints/1"


class JointStudy(Settings):
    """What one config describes: runs of single joints, or of the whole arm, and the curve to identify from
    each.
    """

    RENAMED: ClassVar[Mapping[str, str]] = {"standing_deg_per_s": "stationary_below_deg_per_s"}
    schema_: Literal["identify-joints/1"] = Field(alias="schema", description="version of this format")
    name: str = Field("joints", min_length=1, pattern=r"^[^/\\]+$", description="names the result file")
    robot: RobotSettings | None = Field(
        None, description="for base parameters, and for stiffness under weights"
    )
    gear_ratio: list[Ratio] = Field(
        min_length=1, description="turns of the motor per turn of the joint, one per joint"
    )
    torque_at: Literal["motor", "joint"] = Field(
        "joint", description="where recorded torques are meant; at the motor: times the ratio"
    )
    coupling: list[list[float]] | None = Field(
        None,
        description="row i: how far motor i turns, over its gear ratio, with a turn of each joint, 1 with its"
        " own; default: no motor turns with another joint; needs `robot`",
    )
    torque_constant_nm_per_a: list[float] | None = Field(
        None, description="N m/A at the motor, for records of motor currents"
    )
    signals: dict[Quantity, SignalSettings] = Field(
        description="where they stand in the files; positions count at the joint"
    )
    time: TimeAxis = Field(TimeAxis(at="time_s"), description="the time axis in the files")
    sample_rate_hz: float | None = Field(None, gt=0, description="where the files have no time axis")
    joint_zero_deg: list[float] | None = Field(
        None, description="the robot's joint angles where the records count zero; default: zero"
    )
    lowpass_hz: float = Field(
        20.0, gt=0, description="of the filter behind which speed and acceleration are taken"
    )
    resample_hz: float | None = Field(
        None, gt=0, description="default: as recorded; needed where time stamps are not evenly spaced"
    )
    stationary_below_deg_per_s: float = Field(
        0.1, gt=0, description="a joint below this speed stands, and its friction is not looked at"
    )
    curves: list[Annotated[Curve, BeforeValidator(parse_curve)]] = Field(
        min_length=1, description="what to identify, a kind each"
    )

    @model_validator(mode="after")
    def _consistent(self) -> JointStudy:
        for key in ("torque_constant_nm_per_a", "joint_zero_deg"):
            values = getattr(self, key)
            if values is not None and len(values) != len(self.gear_ratio):
                raise ValueError(
                    f"{key}: {len(values)} numbers; expected {len(self.gear_ratio)}, one per gear ratio"
                )
        labels = [curve.label for curve in self.curves]
        twice = [label for label in labels if labels.count(label) > 1]
        if twice:
            raise ValueError(f"curves: two are called {twice[0]!r}; expected a `name` of its own for each")
        return self


class JointFile(ConfigFile[JointStudy]):
    """A study of joints with its file."""


def read_joint_study(path: Path) -> JointFile:
    """The study in a YAML file.

    Raises InputError for a file that cannot be read or is no YAML, and InputErrors with every key that is
    wrong.
    """
    return JointFile.of(path, *read_settings(path, JointStudy, SCHEMA))


def bench_of(file: JointFile) -> JointTestData:
    """What the curves need to read their runs; InputError where the robot has other joints than the study has
    gears.
    """
    study = file.study
    unknown = all(curve.kind == "base-parameters" for curve in study.curves)
    robot = None if study.robot is None else read_robot(study.robot, file.path.parent, unknown_bodies=unknown)
    ratio = np.array(study.gear_ratio)
    if robot is not None and len(robot.joints) != len(ratio):
        raise InputError(
            "gear_ratio", f"{len(ratio)} numbers", f"{len(robot.joints)}, one per joint of {robot.name!r}"
        )
    constant = None if study.torque_constant_nm_per_a is None else np.array(study.torque_constant_nm_per_a)
    return JointTestData(
        folder=file.path.parent,
        robot=robot,
        gear_ratio=ratio,
        torque_ratio=ratio if study.torque_at == "motor" or constant is not None else np.ones_like(ratio),
        torque_constant=constant,
        signals=study.signals,
        time=study.time if study.sample_rate_hz is None else study.sample_rate_hz,
        zero=np.radians(study.joint_zero_deg or np.zeros(len(ratio))),
        slow=float(np.radians(study.stationary_below_deg_per_s)),
        lowpass_hz=study.lowpass_hz,
        resample_hz=study.resample_hz,
        settings=study.robot,
        coupling=None if study.coupling is None else _coupling(study.coupling, robot),
    )


def _coupling(rows: list[list[float]], robot: Robot | None) -> Array:
    if robot is None:
        raise InputError("coupling", "no `robot`", "the robot whose motors are coupled", "add `robot:`")
    return checked_coupling(rows, robot, "coupling")

"""What a config says of the robot."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from pydantic import ConfigDict, Field, model_validator

from identify.core.config import Settings
from identify.robot.units import SI, RobotUnits

Ratio = Annotated[float, Field(ge=1)]
"""Turns of a motor per turn of its joint: a number below 1 is the inverse of that."""


class _Finite(Settings):
    """Numbers of a body or a place, none of which can be infinite."""

    model_config = ConfigDict(allow_inf_nan=False)


class Payload(_Finite):
    """A rigid body fixed to a link."""

    link: str = Field(description="link, or frame such as a flange, that carries it")
    mass_kg: float = Field(gt=0, description="its mass")
    centre_m: tuple[float, float, float] = Field(
        (0.0, 0.0, 0.0), description="centre of mass in the link's, or that, frame"
    )
    inertia_kg_m2: tuple[float, float, float, float, float, float] = Field(
        (0.0,) * 6, description="ixx, iyy, izz, ixy, ixz, iyz about that centre; default: a point mass"
    )


class RobotSettings(_Finite):
    """Where the robot is described: a URDF or a Denavit-Hartenberg table."""

    urdf: Path | None = Field(None, description="URDF, xacro or MJCF with inertias")
    dh: Path | None = Field(
        None, description="YAML with a Denavit-Hartenberg table, masses, centres and inertias"
    )
    arguments: dict[str, str] = Field({}, description="arguments of a xacro, such as {ur_type: ur10e}")
    tip: str | None = Field(
        None,
        description="link at the end of the arm, of several in the file; default: of the longest chain",
    )
    lock: dict[str, float] = Field(
        {},
        description="joints that are held, at which value, rad or m: {rail: 1.2}; default: 0 for what"
        " slides or is not part of the arm",
    )
    units: RobotUnits = Field(SI, description="units of the robot file where it is not in kg, m and kg m2")
    mass_kg: float | None = Field(
        None,
        gt=0,
        description="of the whole robot by its data sheet; only compared with the file, by `check`",
    )
    payload: list[Payload] = Field([], description="bodies added to links")
    gravity_m_s2: tuple[float, float, float] | None = Field(
        None,
        description="in the axes of the ground: the root link of a URDF, or what a DH file puts its base on;"
        " default: down z, or as the DH file says",
    )

    mounted_rpy_deg: tuple[float, float, float] | None = Field(
        None,
        description="how the base is mounted: roll, pitch, yaw of its axes in those of the ground, degrees;"
        " [180, 0, 0] from a ceiling, [0, 90, 0] on a wall; default: upright",
    )

    @model_validator(mode="after")
    def _one(self) -> RobotSettings:
        if (self.urdf is None) == (self.dh is None):
            raise ValueError("give either `urdf` or `dh`")
        if self.gravity_m_s2 is not None and self.mounted_rpy_deg is not None:
            raise ValueError("give either `gravity_m_s2` or `mounted_rpy_deg`")
        if self.dh and (self.arguments or self.tip or self.lock or self.units.angle != SI.angle):
            raise ValueError("`arguments`, `tip`, `lock` and `units.angle` are of a `urdf`")
        return self

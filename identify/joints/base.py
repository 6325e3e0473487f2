"""What a curve to identify is, and the registry of all kinds.

A curve's settings say which run of which joint to read; with the bench, which knows drives, signals and
robot, it gives its result.
"""

from __future__ import annotations

from abc import abstractmethod
from pathlib import Path
from typing import Any

from pydantic import BaseModel, Field

from identify.core.config import Settings
from identify.core.registry import Registry, parse_kind
from identify.joints.data import JointTestData
from identify.results.joints import CurveResult

CURVES = Registry(
    "curve",
    "identify.curves",
    {
        "base-parameters": "identify.joints.base_parameters:BaseParameters",
        "friction-constant-velocity": "identify.joints.friction:FrictionConstantVelocity",
        "friction-sinusoidal": "identify.joints.friction:FrictionSinusoidal",
        "rigid-bodies": "identify.joints.rigid_bodies:RigidBodies",
        "stiffness-static": "identify.joints.stiffness:StiffnessStatic",
        "transmission-error": "identify.joints.transmission:TransmissionError",
    },
    "identify.joints.base:Curve",
)


class Curve(BaseModel):
    """One entry of `curves`."""

    model_config = Settings.model_config
    kind: str = Field(description="which curve")
    name: str | None = Field(
        None,
        min_length=1,
        pattern=r"^[^/\\]+$",
        description="names it in results; default: its kind and joint",
    )
    files: list[Path] = Field(min_length=1, description="what was recorded, one file per run")

    @property
    def label(self) -> str:
        """Its name in results."""
        return self.name or self.kind

    @abstractmethod
    def identify(self, bench: JointTestData) -> CurveResult:
        """Read the runs and identify the curve; InputError where they cannot give it."""


class JointCurve(Curve):
    """A curve of one joint, which moves alone."""

    joint: int = Field(ge=1, description="number of the joint that moves, or is loaded")

    @property
    def label(self) -> str:
        """Its name in results."""
        return self.name or f"joint{self.joint} {self.kind}"


def parse_curve(data: Any) -> Curve:
    """The curve of an entry of `curves`; raises ValueError for pydantic to report with its key."""
    curve: Curve = parse_kind(CURVES, data)
    return curve

"""What a user says of how the geometry of a test lies on the robot."""

from __future__ import annotations

from pathlib import Path

from pydantic import Field

from identify.core.config import Settings


class RegistrationSettings(Settings):
    """Of a geometry in the frame of the analyser; everything has a default."""

    geometry: Path | None = Field(
        None,
        description="universal file or CSV with the nodes; default: the first measurement's file with some",
    )
    posture_deg: list[float] | None = Field(
        None,
        description="where the robot stood when they were measured, counted as in the measurements; default:"
        " as in the measurement whose file it is, or the first",
    )
    pairs: Path | None = Field(
        None,
        description="CSV of points: some nodes, three if need be, whose place is roughly known; default: the"
        " shape alone decides",
    )
    pair_error_m: float = Field(
        0.03, ge=0.001, description="of each coordinate of these: one standard deviation"
    )
    angle_error_deg: float = Field(3.0, ge=0.01, description="of each joint angle: one standard deviation")
    length_unit: str | None = Field(
        None, description="of a geometry without a unit: m, mm, cm, in, ft; default: m"
    )

"""A milling tool and its cut, as a YAML file says them: `schema: identify-tool/1`."""

from __future__ import annotations

from pathlib import Path
from typing import Literal, Self

import numpy as np
from pydantic import Field, model_validator

from identify.core.arrays import Array
from identify.core.config import ConfigFile, Settings, read_settings
from identify.core.errors import InputError
from identify.machining.materials import Coefficients, material
from identify.robot.points import Point
from identify.vibration.fitted_model import FittedModel, tool_point

SCHEMA = "identify-tool/1"
_MPA, _N_PER_MM = 1e6, 1e3
_ROUNDED_DEG = 0.05
"""By how much angles may miss a whole turn, or even teeth, as data sheets print them."""


class GivenCoefficients(Settings):
    """Cutting coefficients measured with the tool."""

    tangential_n_per_mm2: float = Field(gt=0, description="tangential force per width and thickness of chip")
    radial_n_per_mm2: float = Field(description="radial force per width and thickness of the chip")
    axial_n_per_mm2: float = Field(0.0, description="axial force per width and thickness of the chip")
    tangential_edge_n_per_mm: float = Field(0.0, ge=0, description="tangential force per width, of the edge")
    radial_edge_n_per_mm: float = Field(0.0, ge=0, description="radial force per width, of the edge")


class Cut(Settings):
    """How the tool engages the workpiece."""

    kind: Literal["up", "down", "slot"] = Field(description="up-milling, down-milling, or a full slot")
    width_mm: float | None = Field(
        None, gt=0, description="radial depth of cut; a slot is the whole diameter"
    )

    @model_validator(mode="after")
    def _width(self) -> Self:
        if (self.width_mm is None) != (self.kind == "slot"):
            raise ValueError("width_mm: expected with up and down, and not with slot")
        return self


class ToolPlace(Settings):
    """A point of a link that is no measurement point."""

    link: str = Field(description="link or frame of the robot that carries the spindle")
    position_m: tuple[float, float, float] = Field(description="the tool's tip in that link's frame")


class ToolMode(Settings):
    """A mode of spindle, holder and tool, whose receptance is added to the arm's: for bodies that are light
    beside the arm and for modes far above its own.
    """

    direction: Literal["radial", "feed", "normal", "axial"] = Field(
        "radial", description="in which the tip moves; radial: the same in feed and normal"
    )
    frequency_hz: float = Field(gt=0, description="natural frequency, of the spindle held still")
    damping_ratio: float = Field(gt=0, lt=1, description="part of critical damping")
    stiffness_n_per_m: float = Field(gt=0, description="modal stiffness at the tip")


class Coupling(Settings):
    """Spindle and tool as measured apart, hanging free, to be coupled where the arm's model ends: at `node`
    or `place`, which is then the flange.  The file's axes are those of the link that carries it.
    """

    file: str = Field(description="FRFs between tip and flange (UFF, HDF5, MATLAB, CSV), beside this file")
    tip: int = Field(
        ge=0, description="node of the tool's tip in the file, measured and hit along x, y and z"
    )
    flange: int = Field(
        ge=0, description="node of the flange in the file, the same way; rotations RX, RY, RZ where there are"
    )


class ToolUncertainty(Settings):
    """What is not known well of cut and posture, as standard deviations; it widens the bands."""

    coefficients: float = Field(0.0, ge=0, lt=1, description="of all cutting coefficients together, relative")
    posture_deg: float = Field(0.0, ge=0, lt=10, description="of each joint angle")


class Tool(Settings):
    """A milling tool, its cut and where it sits on the robot."""

    schema_: Literal["identify-tool/1"] = Field(alias="schema", description="identify-tool/1")
    name: str = Field(min_length=1, description="of the tool, for the report")
    teeth: int = Field(ge=1, le=100, description="number of cutting edges, evenly spaced")
    pitch_deg: tuple[float, ...] = Field(
        (), description="angles from each edge to the one before it, where they are not even: variable pitch"
    )
    diameter_mm: float = Field(ge=0.1, description="of the cutting edges")
    helix_deg: float = Field(0.0, ge=0, lt=80, description="helix angle; semi-discretisation alone sees it")
    lead_angle_deg: float = Field(
        90.0, gt=0, le=90, description="between edge and feed plane: 90 for an end mill, 45 for a face mill"
    )
    node: int | None = Field(
        None, description="measurement point at the tip; default: the last of the points"
    )
    place: ToolPlace | None = Field(None, description="the tip, where it is no measurement point")
    spindle_axis: tuple[float, float, float] = Field(
        description="direction from the spindle to the tip, in the axes of the link that carries it"
    )
    feed: tuple[float, float, float] = Field(description="direction of the feed, in the base's axes")
    cut: Cut = Field(description="how the tool engages the workpiece")
    material: str | None = Field(None, description="of the table in docs/machining.md")
    coefficients: GivenCoefficients | None = Field(None, description="measured with this tool: better")
    spindle_rpm: tuple[float, float] = Field(description="lowest and highest spindle speed")
    max_depth_mm: float = Field(gt=0, description="the length of the edges: depths beyond are not looked at")
    modes: tuple[ToolMode, ...] = Field((), description="modes of spindle, holder and tool beside the arm's")
    coupling: Coupling | None = Field(None, description="spindle and tool, measured apart")
    uncertainty: ToolUncertainty = Field(
        ToolUncertainty(), description="what is not known well of cut and posture"
    )

    @model_validator(mode="after")
    def _whole(self) -> Self:
        low, high = self.spindle_rpm
        wide, pitch, pointing = self.cut.width_mm or 0.0, self.pitch_deg, (self.spindle_axis, self.feed)
        around = abs(sum(pitch) - 360) < _ROUNDED_DEG and min(pitch, default=0) > 0
        expected = (
            (
                (self.material is None) != (self.coefficients is None),
                "material: expected either `material` or `coefficients`",
            ),
            (None in (self.node, self.place), "node: expected either `node` or `place`"),
            (0 < low < high, "spindle_rpm: expected the lower speed first, above 0"),
            (wide <= self.diameter_mm, "cut.width_mm: expected at most the diameter"),
            (self.coupling is None or not self.modes, "coupling: expected either `coupling` or `modes`"),
            (
                not pitch or (len(pitch) == self.teeth and around),
                "pitch_deg: expected an angle for each of the teeth, 360 in all",
            ),
            (all(map(np.any, pointing)), "spindle_axis, feed: expected directions, not zero"),
        )
        for holds, said in expected:
            if not holds:
                raise ValueError(said)
        return self

    @property
    def radius(self) -> float:
        """m."""
        return self.diameter_mm / 2e3

    @property
    def pitches(self) -> tuple[float, ...]:
        """Angles between the edges, rad, where they are uneven."""
        even = all(abs(one - 360 / self.teeth) < _ROUNDED_DEG for one in self.pitch_deg)
        return () if even else tuple(np.radians(self.pitch_deg) * 360 / sum(self.pitch_deg))

    @property
    def engagement(self) -> tuple[float, float]:
        """Entry and exit angle of a tooth, rad, from the normal of the feed, in its sense of rotation
        (Altintas, Manufacturing Automation, chapter 4): a chip begins at zero thickness in up-milling.
        """
        if self.cut.width_mm is None:
            return 0.0, float(np.pi)
        swept = float(np.arccos(1 - 2 * self.cut.width_mm / self.diameter_mm))
        return (0.0, swept) if self.cut.kind == "up" else (float(np.pi) - swept, float(np.pi))

    def cutting(self, where: str = "tool") -> Coefficients:
        """The coefficients, in SI; InputError for an unknown material."""
        given = self.coefficients
        if given is None:
            return material(str(self.material), f"{where}: material")
        return Coefficients(
            _MPA * given.tangential_n_per_mm2,
            _MPA * given.radial_n_per_mm2,
            _MPA * given.axial_n_per_mm2,
            _N_PER_MM * given.tangential_edge_n_per_mm,
            _N_PER_MM * given.radial_edge_n_per_mm,
            "given with the tool",
        )

    def point(self, model: FittedModel, where: str = "tool") -> Point:
        """The tip on the robot; InputError for a node or link that the robot does not have."""
        if self.place is None:
            return tool_point(model, self.node, f"{where}: node")
        known = [link.name for link in model.robot.links] + list(model.robot.frames)
        if self.place.link not in known:
            raise InputError(
                f"{where}: place.link", f"unknown link {self.place.link!r}", "one of " + ", ".join(known)
            )
        return Point(0, "tip", self.place.link, np.array(self.place.position_m), np.eye(3), where)

    def axes(self, carrier: Array, feed: Array | None = None, where: str = "tool") -> Array:
        """(3, 3): feed, normal and axis of the spindle (from the tip to the spindle) in the base's axes, as
        rows; carrier (3, 3): axes of the link that carries it, as columns.

        feed (3,): in place of the tool's own.  The spindle turns clockwise, seen from it to the tip.
        InputError for a feed along the spindle.
        """
        up = -carrier @ np.array(self.spindle_axis)
        up = up / np.linalg.norm(up)
        wanted = np.array(self.feed, dtype=float) if feed is None else feed
        along = wanted - (wanted @ up) * up
        if np.linalg.norm(along) < 0.05 * np.linalg.norm(wanted):
            found = ", ".join(f"{value:.3g}" for value in up)
            raise InputError(
                f"{where}: feed",
                f"a feed along the spindle, which points along ({found}) at this posture",
                "a direction across it",
            )
        along = along / np.linalg.norm(along)
        return np.round(np.stack([along, np.cross(up, along), up]), 15) + 0.0


def read_tool(path: Path) -> ConfigFile[Tool]:
    """The tool of a YAML file; raises InputError or InputErrors with every wrong key, and its line."""
    tool, text = read_settings(path, Tool, SCHEMA)
    if tool.coupling is not None:
        beside = tool.coupling.model_copy(update={"file": str((path.parent / tool.coupling.file).resolve())})
        tool = tool.model_copy(update={"coupling": beside})
    tool.cutting(str(path))
    return ConfigFile[Tool].of(path, tool, text)

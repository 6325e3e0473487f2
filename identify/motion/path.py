"""Commands along a path of the tool: a circle at a feed rate, turned into joint angles by inverse kinematics.

The tool keeps the orientation that it has at the start where the robot has six joints or more; with fewer,
only its point is led.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from identify.core.arrays import Array
from identify.core.config import Settings
from identify.core.errors import InputError
from identify.motion.command import Move
from identify.robot.engine_motion import MovingArm

_PLANES = {"XY": (0, 1), "YZ": (1, 2), "ZX": (2, 0)}
_TOLERANCE = 1e-7
"""Rad: a step of the joints that small ends the search, because Newton's method leaves about its square; the
command is differentiated twice.
"""
_STEPS = 20
_REACH = 0.3
"""Rad: a step that large between two ticks means that the path leaves what the arm can reach."""


class Tool(Settings):
    """The point whose path is commanded and reported: fixed to a link or frame of the robot."""

    link: str = Field(description="link or frame that it is fixed to")
    at_m: tuple[float, float, float] = Field((0.0, 0.0, 0.0), description="where it is in that link's frame")


class Circle(Settings):
    """The tool runs on a circle through its start, which lies in the direction of the plane's first axis from
    the centre.
    """

    kind: Literal["circle"] = Field("circle", description="which path")
    plane: Literal["XY", "YZ", "ZX"] = Field(
        "XY", description="plane of the circle, axes of the base; it runs from the first to the second"
    )
    radius_mm: float = Field(gt=0, description="radius")
    feed_mm_min: float = Field(gt=0, description="speed along the circle")
    turns: float = Field(
        2.0, ge=1, description="how often it goes round; the turn in the middle is the one that is judged"
    )
    clockwise: bool = Field(False, description="true: from the second axis to the first")
    start_s: float = Field(0.0, ge=0, description="when it begins")
    acceleration_mm_s2: float = Field(1000.0, gt=0, description="largest acceleration along the circle")
    smoothing_s: float = Field(0.02, ge=0, description="time over which that builds up")
    glitches: bool = Field(
        False,
        description="also report which joint's turning round makes which glitch, by models without the"
        " friction of each",
    )

    @property
    def sweep(self) -> Move:
        """The angle about the centre, as a move."""
        share = 60 * self.radius_mm
        return Move(
            joint="angle about the centre",
            start_s=self.start_s,
            by_deg=360 * self.turns,
            speed_deg_s=float(np.degrees(self.feed_mm_min / share)),
            acceleration_deg_s2=float(np.degrees(self.acceleration_mm_s2 / self.radius_mm)),
            smoothing_s=self.smoothing_s,
        )

    def points(self, start: Array, time: Array) -> Array:
        """Where the tool is to be, m, (n, 3), at times (n,), s, from its place (3,) at the start."""
        angle, radius = self.sweep.angle(time), self.radius_mm * 1e-3
        first, second = _PLANES[self.plane]
        places = np.tile(start, (len(time), 1))
        places[:, first] += radius * (np.cos(angle) - 1)
        places[:, second] += (-1 if self.clockwise else 1) * radius * np.sin(angle)
        return places

    def flat(self, places: Array) -> Array:
        """The coordinates in the plane, (..., 2), of places (..., 3)."""
        return places[..., _PLANES[self.plane]]

    def judged(self, time: Array) -> NDArray[np.bool_]:
        """Which of the times (n,) belong to the whole turn in the middle of the motion."""
        turned = self.sweep.angle(time) / (2 * np.pi)
        return np.asarray((turned >= (self.turns - 1) / 2) & (turned < (self.turns + 1) / 2))


def joint_path(arm: MovingArm, tool: Tool, start: Array, places: Array, where: str) -> Array:
    """Joint angles (n, joints), rad, of a rigid arm that take the tool through places (n, 3), m, from angles
    (joints,) on, by Newton's method from each place to the next; InputError where the arm cannot follow.
    """
    point = np.array(tool.at_m)
    upright = arm.frame_motion(start, tool.link, point)[1]
    rows = 6 if len(start) >= 6 else 3
    angles, found = start.copy(), np.empty((len(places), len(start)))
    for number, place in enumerate(places):
        if number > 1:  # as fast as it went from the last place but one to the last
            angles = 2 * found[number - 1] - found[number - 2]
        for _ in range(_STEPS):
            at, turn, jacobian = arm.frame_motion(angles, tool.link, point)
            away = np.concatenate([place - at, _tilt(turn, upright)])
            step = np.linalg.lstsq(jacobian[:rows], away[:rows], rcond=1e-8)[0]
            angles = angles + step
            if np.abs(step).max() < _TOLERANCE or np.abs(step).max() > _REACH:
                break
        if np.abs(step).max() > _REACH or np.linalg.norm(away[:3] - jacobian[:3] @ step) > 1e-9:
            raise InputError(
                where,
                f"place {np.round(place, 4).tolist()} m",
                "a path that the arm can follow",
                "another start or radius",
            )
        found[number] = angles
    return found


def _tilt(turn: Array, wanted: Array) -> Array:
    """The rotation vector (3,), to first order, from axes (3, 3) to those wanted."""
    between = wanted @ turn.T
    return np.asarray([between[i, j] - between[j, i] for i, j in ((2, 1), (0, 2), (1, 0))]) / 2

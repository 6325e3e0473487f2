"""Compliance of a mount: between a link and the payload or tool that it carries, such as a gripper on a soft
flange.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Literal, Self

import numpy as np
from pydantic import Field

from identify.core.arrays import Array, cross
from identify.core.errors import InputError
from identify.model.effects.site import Added, Site
from identify.model.effects.springs import Axis, AxisList, Springs
from identify.robot.description import Link, Robot
from identify.robot.points import Point
from identify.robot.posture import AXES, Mechanism


class MountCompliance(Springs):
    """Springs and dampers between a link and one of its payloads, on some of six axes of the link at the
    mount.

    Points of the link stay on the link.  The payload's weight acts as on a rigid mount: its gravity stiffness
    is a thousandth of that of any mount that carries it.
    """

    kind: Literal["mount-compliance"] = "mount-compliance"
    payload: int = Field(1, ge=1, description="number of the payload in `robot.payload`")
    axes: AxisList = Field(
        ["tx", "ty", "tz", "rx", "ry", "rz"], min_length=1, description="axes released, in the link's frame"
    )
    at_m: tuple[float, float, float] = Field(
        (0.0, 0.0, 0.0), description="where the mount is, in the link's frame"
    )

    def sentence(self) -> str:
        """For example: compliance of the mount of payload 1 (rx, ry)."""
        return f"compliance of the mount of payload {self.payload} ({self.axes_told})"

    @classmethod
    def instances(cls, robot: Robot, points: Mapping[int, Point]) -> Iterator[Self]:
        """Of every payload: tilting, turning, sliding and along the flange's axis."""
        groups: tuple[tuple[Axis, ...], ...] = (("rx", "ry"), ("rz",), ("tx", "ty"), ("tz",))
        for number in range(1, len(robot.payloads) + 1):
            for axes in groups:
                yield cls(payload=number, axes=list(axes))

    def _carried(self, robot: Robot) -> tuple[str, Link]:
        """The name of the link, and the payload in its axes."""
        if self.payload > len(robot.payloads):
            found = f"payload {self.payload}, where the robot has {len(robot.payloads)}"
            raise InputError(
                "effects.mount-compliance.payload", found, "the number of one", "add it to `robot.payload`"
            )
        return robot.payloads[self.payload - 1]

    def added_coordinates(self, robot: Robot, mechanism: Mechanism) -> list[Added]:
        """Six of the payload against the link."""
        return [Added(name, self._carried(robot)[0]) for name in self._names(AXES)]

    def _names(self, axes: tuple[str, ...] | list[Axis]) -> list[str]:
        return [f"payload{self.payload}.{axis}" for axis in axes]

    def free_coordinates(self, robot: Robot) -> list[str]:
        """payload1.rx and so on."""
        return self._names(self.axes)

    def consistent_mass(self, robot: Robot, site: Site) -> Array | None:
        """The payload moving with its own coordinates, less the same on the rigid link."""
        link, body = self._carried(robot)
        if link in site.detached:
            return None
        rigid = site.jacobian(link, np.array(self.at_m), "effects.mount-compliance.at_m")
        own = rigid + np.array([site.vector(name) for name in self._names(AXES)])
        return _inertia(body, own, np.array(self.at_m)) - _inertia(body, rigid, np.array(self.at_m))


def _inertia(body: Link, motion: Array, point: Array) -> Array:
    """Mass matrix (n, n) of a body whose point moves by motion (6, n) in its axes."""
    turning = motion[3:]
    moving = motion[:3] + cross(turning.T, body.centre - point).T
    return np.asarray(body.mass * moving.T @ moving + turning.T @ body.inertia @ turning)

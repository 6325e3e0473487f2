"""The robot of the Kobe study (IJAT 15-5, 2021), as far as the paper shows it: six links, two loading masses,
48 points; the rest is ours.

The paper gives no dimensions, masses or stiffnesses: these are of an arc-welding robot of 8 kg payload with
the loads of its Figs. 1 and 2, whose springs put the first modes where the paper finds them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tests.generator.arm import Arm, Point
from tests.generator.makes import Make, build
from tests.generator.rigid import Array, Inertia, box, turn
from tests.generator.tree import at_posture

_MAKE = Make(
    "kobe",
    0.30,
    0.13,
    0.17,
    0.05,
    0.56,
    0.10,
    0.14,
    0.46,
    0.10,
    0.0,
    0.16,
    170.0,
    (1, 1, 1, 1, 1, 1),
    "parallel",
    (10.0,) * 6,
    (0.05,) * 6,
)
POSTURE_DEG = (0.0, 15.0, -10.0, 0.0, 30.0, 0.0)
"""Only joints whose axes are level are turned, so that y of every link is Y of the paper: across the arm's
plane.
"""
AXES = ("tx", "ty", "tz", "rx", "ry", "rz")
_OWN_HZ = {
    1: (80, 70, 95, 16.3, 30, 26),
    2: (85, 75, 90, 26, 44, 35),
    3: (95, 87, 100, 31, 52, 44),
    4: (115, 120, 105, 50, 38, 31),
    5: (130, 120, 140, 60, 65, 52),
    6: (150, 155, 140, 78, 74, 70),
}
"""Hz of each joint coordinate with all that it carries, everything else locked: x, y, z of a frame whose z is
the joint's axis.
"""
_DAMPING_RATIO = (0.025, 0.025, 0.025, 0.025, 0.03, 0.025)
_POINTS = (6, 6, 8, 8, 8, 6, 6)


@dataclass(frozen=True)
class Drive:
    """A motor with its gear and controller: rotor inertia (kg m^2) and velocity gain (N m s/rad) on the motor
    side, loops in 1/s, s, Hz.
    """

    gear_ratio: float
    rotor_inertia: float
    velocity_gain: float
    position_gain: float
    integral_time: float
    current_hz: float


@dataclass(frozen=True)
class Kobe:
    """The arm as its user knows it, and the truth: stiffness and damping (6 joints, 6 axes), drives."""

    arm: Arm
    stiffness: Array
    damping: Array
    drives: tuple[Drive, ...]


def kobe() -> Kobe:
    """The robot of the study."""
    arm = _loaded(replace(build(_MAKE, 36), home=np.array(POSTURE_DEG)))
    arm = replace(arm, points=_points(arm))
    own = np.array([_inertias(arm, joint) for joint in range(1, 7)])
    speed = 2 * np.pi * np.array([_OWN_HZ[joint] for joint in range(1, 7)])
    return Kobe(
        arm,
        own * speed**2,
        2 * np.array(_DAMPING_RATIO) * own * speed,
        tuple(_drive(n, own[n - 1, 5]) for n in range(1, 7)),
    )


def joint_frame(arm: Arm, joint: int) -> Array:
    """x, y, z of a joint's coordinates as columns in the axes of the link that it carries: the shortest turn
    takes z to its axis.
    """
    axis = arm.joints[joint - 1].axis
    cross = np.cross([0.0, 0.0, 1.0], axis)
    return np.eye(3) if axis[2] > 0.5 else np.round(turn(cross, np.pi / 2), 12)


def _inertias(arm: Arm, joint: int) -> list[float]:
    body, frame = at_posture(arm, POSTURE_DEG).outboard(joint), joint_frame(arm, joint)
    return [body.mass] * 3 + [body.about_axis(np.zeros(3), frame[:, axis]) for axis in range(3)]


def _drive(joint: int, inertia: float) -> Drive:
    """A rotor whose inertia at the gear output is 0.4 of what the joint carries, and a velocity loop of 80 Hz
    with both.
    """
    ratio = (120.0, 140.0, 130.0, 100.0, 80.0, 60.0)[joint - 1]
    return Drive(
        ratio, 0.4 * inertia / ratio**2, 2 * np.pi * 80.0 * 1.4 * inertia / ratio**2, 25.0, 0.05, 400.0
    )


def _loaded(arm: Arm) -> Arm:
    """The loading masses: 10 kg on link 3, 8 kg at the tool, as steel plates."""
    links = list(arm.links)
    loads: dict[int, Inertia] = {
        3: box(10.0, [-0.10, 0.02, 0.16], [0.24, 0.16, 0.05]),
        6: box(8.0, [0.22, 0.03, 0.0], [0.12, 0.12, 0.08]),
    }
    for number, load in loads.items():
        links[number] = replace(links[number], inertia=links[number].inertia + load)
    return replace(arm, links=tuple(links))


def _points(arm: Arm) -> tuple[Point, ...]:
    """48 points on the skins of base and links, in pairs left and right along each; the last is the loading
    mass that is struck.
    """
    points: list[Point] = []
    ends = [*(joint.xyz for joint in arm.joints), np.array([0.22, 0.03, 0.0])]
    for number, (link, along, count) in enumerate(zip(arm.links, ends, _POINTS, strict=True)):
        half = np.array([0.11, 0.10, 0.09, 0.09, 0.06, 0.05, 0.05])[number]
        for place in range(count):
            share, side = (place // 2 + 0.4) / (count // 2), (-1) ** place
            off = (
                np.array([0.5 * half, side * half, 0.0])
                if number <= 2
                else np.array([0.0, side * half, 0.6 * half])
            )
            node = len(points) + 1
            name = f"{'base' if number == 0 else link.name}_{place + 1}"
            points.append(Point(node, name, link.name, np.round(share * along + off, 4)))
    points[-1] = replace(points[-1], name="load", xyz=np.array([0.24, 0.09, 0.0]))
    return tuple(points)

"""The machining robot of the fast-chirp study: six links of a Staubli RX160's size, a spindle behind a load
cell; the truth and five zones.

The paper names the robot and gives no dynamic data; lengths are those of the RX160's data sheet, masses and
springs are ours.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tests.generator.arm import Arm, Point
from tests.generator.kobe_arm import Drive
from tests.generator.makes import Make, build
from tests.generator.rigid import Array, Inertia, cylinder
from tests.generator.tree import at_posture

_MAKE = Make(
    "rx160",
    0.30,
    0.25,
    0.15,
    0.04,
    0.825,
    0.0,
    0.18,
    0.445,
    0.11,
    0.0,
    0.10,
    235.0,
    (1, 1, 1, 1, 1, 1),
    "along-axes",
    (10.0,) * 6,
    (0.05,) * 6,
)
ZONES_DEG = {
    "zone1": (-20.0, 25.0, 40.0, 10.0, 35.0, 0.0),
    "zone2": (-5.0, 45.0, 15.0, -5.0, 40.0, 15.0),
    "zone3": (15.0, 30.0, 60.0, 15.0, 10.0, -20.0),
    "zone4": (30.0, 60.0, 5.0, -15.0, 45.0, 30.0),
    "zone5": (8.0, 38.0, 34.0, 5.0, 30.0, 8.0),
}
"""Postures in the middle of the four zones of identification and of the one of validation."""
SPEED_M_PER_S = 0.010
_OWN_HZ = {
    1: (24.0, 26.0, 20.0),
    2: (30.0, 32.0, 21.5),
    3: (42.0, 38.0, 27.0),
    4: (38.0, 40.0, 27.0),
    5: (50.0, 56.0, 33.0),
    6: (80.0, 75.0, 50.0),
}
"""Hz of rx, ry, rz of each joint with all that it carries in zone 5, everything else locked."""
_BASE_HZ = (32.0, 36.0, 40.0)
_DAMPING_RATIO = 0.02
CELL_HZ = (75.0, 75.0, 120.0)
"""The spindle on the load cell alone: x, y, z."""
CELL_M = 0.12
"""Where the load cell is along link 6's z; the spindle is beyond."""
_MIDDLE_M, _FORCE_M = 0.237, 0.28
_FRICTION_SHARE = 0.02


@dataclass(frozen=True)
class Machine:
    """The robot as its user knows it (with the spindle in link 6), the same without spindle, the spindle in
    link 6's axes, and the truth.

    stiffness, damping (6 joints, 3 axes rx, ry, rz); base and cell (2, 3): stiffness, then damping; friction
    (6,), N m at the gear output.
    """

    known: Arm
    bare: Arm
    spindle: Inertia
    stiffness: Array
    damping: Array
    base: Array
    cell: Array
    drives: tuple[Drive, ...]
    friction: Array


def machine() -> Machine:
    """The robot of the study."""
    bare = replace(build(_MAKE, 160), home=np.array(ZONES_DEG["zone5"]), points=_points())
    spindle = _spindle()
    links = (*bare.links[:6], replace(bare.links[6], inertia=bare.links[6].inertia + spindle))
    known = replace(bare, links=links)
    tree = at_posture(known, ZONES_DEG["zone5"])
    own = np.array(
        [[tree.outboard(joint).about_axis(np.zeros(3), axis) for axis in np.eye(3)] for joint in range(1, 7)]
    )
    speed = 2 * np.pi * np.array([_OWN_HZ[joint] for joint in range(1, 7)])
    whole = np.array([tree.outboard(0).about_axis(np.zeros(3), axis) for axis in np.eye(3)])
    return Machine(
        known,
        bare,
        spindle,
        own * speed**2,
        2 * _DAMPING_RATIO * own * speed,
        _springs(whole, np.array(_BASE_HZ)),
        _springs(np.full(3, spindle.mass), np.array(CELL_HZ), 0.01),
        tuple(_drive(joint, own[joint - 1, 2]) for joint in range(1, 7)),
        _FRICTION_SHARE * np.array([300.0, 400.0, 250.0, 60.0, 60.0, 25.0]),
    )


def _springs(moved: Array, hz: Array, ratio: float = _DAMPING_RATIO) -> Array:
    speed = 2 * np.pi * hz
    return np.array([moved * speed**2, 2 * ratio * moved * speed])


def _drive(joint: int, inertia: float) -> Drive:
    """A rotor whose inertia at the gear output is 0.6 of what the joint carries, and a velocity loop of 120
    Hz with both.
    """
    ratio = (110.0, 110.0, 90.0, 70.0, 60.0, 50.0)[joint - 1]
    return Drive(
        ratio, 0.6 * inertia / ratio**2, 2 * np.pi * 120.0 * 1.6 * inertia / ratio**2, 25.0, 0.05, 600.0
    )


def _spindle() -> Inertia:
    """Spindle with holder and tool, 9 kg, beyond the load cell; the offset mass is in it."""
    return cylinder(7.5, [0.0, 0.0, CELL_M], [0.0, 0.0, 0.32], 0.05) + cylinder(
        1.5, [0.0, 0.0, 0.28], [0.0, 0.0, 0.36], 0.025
    )


def _points() -> tuple[Point, ...]:
    """12: the mean of two accelerometers on either side of the spindle, level with its centre of mass, on a
    bracket of the robot's side of the load cell; 14: where the force acts."""
    return (
        Point(12, "bracket", "link6", np.array([0.0, 0.0, _MIDDLE_M])),
        Point(14, "tool", "link6", np.array([0.0, 0.0, _FORCE_M])),
    )

"""What `check` and results say of a robot's description: numbers that no arm has, as of another unit.

No description is refused for them: arms are made up, too.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from identify.core.text import listed
from identify.measured.finding import Finding, as_notes
from identify.measured.quality_places import far_payloads
from identify.robot.description import Joint, Link, Robot

_LONGEST_M = 100.0
"""Arms are shorter; 1/1000 of one that is longer is still an arm."""
_DENSEST = 22_600.0
"""Of osmium, kg/m^3: nothing is denser."""
_TURN = 2 * np.pi * (1 + 1e-3)
"""rad: a pose says no more than once around; what does is 90 or 180 degrees."""
_PULL = (1.0, 30.0)
"""m/s^2: from the Moon's to beyond any planet's on which one could stand; 0 is that of a test without it."""


def check_robot(robot: Robot) -> Iterator[Finding]:
    """Lengths, bodies, angles between axes and gravity that ask for another unit."""
    yield from _length(robot)
    yield from _bodies(robot)
    yield from _twists(robot)
    yield from far_payloads(robot)
    pull = float(np.linalg.norm(robot.gravity))
    if pull and not _PULL[0] <= pull <= _PULL[1]:
        sentence = f"Gravity is {pull:.4g} m/s^2: is `gravity_m_s2` in m/s^2?"
        yield Finding("warn", "gravity", (), sentence, pull)


def in_degrees(robot: Robot) -> bool:
    """Whether the file has angles that only degrees can be."""
    return robot.largest_turn > _TURN


def possible(robot: Robot) -> bool:
    """Whether an arm may be as long, and its bodies as dense and wide."""
    return not [*_length(robot), *_bodies(robot)]


def robot_notes(robot: Robot) -> list[str]:
    """The same as notes of a result."""
    return as_notes(check_robot(robot))


def _length(robot: Robot) -> Iterator[Finding]:
    length = robot.stretched()
    if length > _LONGEST_M:
        sentence = f"The robot is {length:.4g} m long from joint to joint: are its lengths in mm?"
        yield Finding("warn", "robot-size", (), sentence, length)


def _bodies(robot: Robot) -> Iterator[Finding]:
    """Moving links that are denser than anything, or wider than an arm."""
    moving = [link for link in robot.links[1:] if link.mass > 0 and np.trace(link.inertia) > 0]
    dense = [link.name for link in moving if _least_density(link) > _DENSEST]
    if dense:
        worst = max(map(_least_density, moving))
        sentence = (
            f"The body of {listed(dense)} would be denser than any metal, {worst:.2g} kg/m3 at least, by its"
            " mass and inertia: are masses in kg, inertias in kg m2?"
        )
        yield Finding("warn", "robot-density", (), sentence, worst)
    wide = [link.name for link in moving if _gyration(link) > max(robot.stretched(), _LONGEST_M / 10)]
    if wide:
        size = max(map(_gyration, moving))
        sentence = (
            f"The inertia of {listed(wide)} is that of a body with a radius of {size:.3g} m or more: are"
            " inertias in kg mm2?"
        )
        yield Finding("warn", "robot-inertia", (), sentence, size)


def _gyration(link: Link) -> float:
    """Radius about the centre, m, of a sphere's shell of this mass and inertia (sum of m r^2)."""
    return float(np.sqrt(np.trace(link.inertia) / (2 * link.mass)))


def _least_density(link: Link) -> float:
    """kg/m^3: of the most voluminous body of this mass and inertia, a full sphere, whose radius is
    sqrt(5/3) of its radius of gyration.
    """
    return float(link.mass / (4 / 3 * np.pi * (np.sqrt(5 / 3) * _gyration(link)) ** 3))


def _twists(robot: Robot) -> Iterator[Finding]:
    """Neighbouring axes that are turned by pi/2 or pi degrees: radians where degrees were to be; and poses
    that are turned by more than once around: degrees where radians were to be.
    """
    if in_degrees(robot):
        sentence = (
            f"An `rpy` of the robot file is {robot.largest_turn:.4g} rad, more than once around: are they in"
            " degrees?  Then state `robot.units.angle: deg`."
        )
        yield Finding("warn", "robot-angles", (), sentence, robot.largest_turn)
    angles = np.degrees([_between(*pair) for pair in zip(robot.joints, robot.joints[1:], strict=False)])
    right = [a for a in angles if np.isclose(a, np.pi / 2, rtol=2e-3) or np.isclose(a, np.pi, rtol=2e-3)]
    if right:
        sentence = (
            f"Neighbouring axes are turned by {right[0]:.4g} degrees: are angles in radians where degrees go?"
        )
        yield Finding("warn", "robot-angles", (), sentence, float(right[0]))


def _between(first: Joint, second: Joint) -> float:
    """The angle between the axes of a joint and the next, rad."""
    own = first.mount[:3, :3].T @ first.axis
    other = second.origin[:3, :3] @ second.axis
    return float(np.arctan2(np.linalg.norm(np.cross(own, other)), own @ other))

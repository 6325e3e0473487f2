"""Links that bend and twist in motion: each gives way in the middle between its joints, about three axes and
across the link.

There the compliance of a uniform cantilever has no coupling: under whatever loads at its end it turns and
moves as a hinge of EI/L in its middle that also gives way across the link, by 12 EI/L^3.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce

import numpy as np

from identify.model.effects.beam import slices
from identify.model.effects.link_flexibility import LinkFlexibility
from identify.motion.study import Spring
from identify.robot.description import Link, Robot, merge
from identify.robot.engine_motion import MovingArm
from identify.robot.posture import Body

AXES = {"bending_1": ("rx", "ty"), "bending_2": ("ry", "tx"), "torsion": ("rz",)}
"""Of the middle, by what the effect's stiffnesses are called: z along the link."""


def moving_arm(robot: Robot, effects: Sequence[Spring]) -> MovingArm:
    """The arm with what effects release."""
    released, halves = list[str](), dict[str, Body]()
    for effect in effects:
        if isinstance(effect, LinkFlexibility):
            halves[effect.link] = _half(robot, effect)
        else:
            released += effect.free_coordinates(robot)
    return MovingArm(robot, released, halves)


def parts(effect: Spring, robot: Robot) -> dict[str, tuple[str, ...]]:
    """Names of an effect's springs, by the key that has their stiffness."""
    if isinstance(effect, LinkFlexibility):
        bending = tuple(f"{effect.link}.{name}" for name in AXES if name != "torsion")
        return {"bending": bending, "torsion": (f"{effect.link}.torsion",)}
    return {"stiffness": tuple(effect.free_coordinates(robot))}


def damping_of(key: str) -> str:
    """The key of the dampers beside springs."""
    return "damping" if key == "stiffness" else f"{key}_damping"


def coordinates(robot: Robot, effects: Sequence[Spring]) -> dict[str, dict[str, float]]:
    """Of each stiffness of links, by name, its coordinates and how stiff they are per unit, 1/m and 1/m^3."""
    found = dict[str, dict[str, float]]()
    for effect in effects:
        if isinstance(effect, LinkFlexibility):
            length, place = effect.beam(robot).length, f"link{effect.number(robot)}"
            units = {"r": 1 / length, "t": 12 / length**3}
            for name, axes in AXES.items():
                found[f"{effect.link}.{name}"] = {f"{place}.{axis}": units[axis[0]] for axis in axes}
    return found


def _half(robot: Robot, effect: LinkFlexibility) -> Body:
    """What of a link is behind its hinge, mass spread along it as a rod's; its pose in the link's frame."""
    beam, link, pose = effect.beam(robot), robot.link(effect.link), np.eye(4)
    pose[:3, :3] = np.column_stack([*beam.across, beam.axis])
    pose[:3, 3] = (beam.start + beam.end) / 2
    name = f"link{effect.number(robot)}"
    behind = [
        (mass, pose[:3, :3].T @ (centre - pose[:3, 3]), pose[:3, :3].T @ inertia @ pose[:3, :3])
        for mass, centre, inertia in slices(link, beam.axis)
        if (centre - pose[:3, 3]) @ beam.axis > 0
    ]
    nothing = Link(name, 0.0, np.zeros(3), np.zeros((3, 3)))
    half = reduce(merge, (Link(name, *one) for one in behind), nothing)
    return Body(name, -1, pose, half.mass, half.centre, half.inertia)

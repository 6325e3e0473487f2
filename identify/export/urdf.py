"""URDF with elastic joints: behind each joint, joints of massless links for what is elastic there.

The format has dampers and no springs; stiffness stands in `<gazebo>` tags (`springStiffness`), which Gazebo
takes and other readers skip.  Only springs of single coordinates can be said, and no mass beside the links'.
"""

from __future__ import annotations

from typing import ClassVar
from xml.etree import ElementTree as ET

import numpy as np

from identify.core import atomic
from identify.core.arrays import Array
from identify.core.text import listed
from identify.export.base import Exported, Format, Job
from identify.export.linear import LinearModel
from identify.export.springs import JointSprings, joint_springs, moved_body
from identify.robot.description import Link, Robot
from identify.robot.pose import roll_pitch_yaw
from identify.robot.posture import AXES, z_to
from identify.robot.urdf_elements import MOMENTS

_WEIGHTLESS = 1e-6
"""Mass, kg, and inertia, kg m^2, of links between elastic joints: readers refuse those without any."""
_FAR = 1e3
"""Effort and velocity that no joint limits."""


class Urdf(Format):
    """One file, whatever the posture, but for the weights in springs."""

    suffix: ClassVar[str] = ".urdf"

    def write(self, job: Job) -> Exported:
        """The file, and what it cannot say."""
        model = job.model
        springs, said = joint_springs(model), {}
        for name, k, c in zip(model.coordinates, springs.stiffness, springs.damping, strict=True):
            there = moved_body(model, name)
            if k > 0 and there is not None and there[0] is not None and name.endswith(f".{there[1]}"):
                said[name] = (float(k), float(c))
        atomic.write_text(job.path, urdf_text(model.model.robot, said))
        return Exported([job.path], (*model.notes, *_notes(model, said, springs)))


def _notes(model: LinearModel, said: dict[str, tuple[float, float]], springs: JointSprings) -> list[str]:
    notes = ["stiffness is in <gazebo> tags alone, because URDF has no springs"]
    left = [*(name for name in model.coordinates if name not in said), *springs.others]
    return [*notes, f"left out, because URDF cannot say it: {listed(left)}"] if left else notes


def urdf_text(robot: Robot, springs: dict[str, tuple[float, float]]) -> str:
    """A robot with joints for springs and dampers (N/m, N m/rad, N s/m, N m s/rad) at these coordinates."""
    root = ET.Element("robot", name=robot.name)
    base = robot.links[0]
    own = [axis for axis in AXES if f"base.{axis}" in springs]
    if own:
        ET.SubElement(root, "link", name="ground")
        _elastic(root, "base", "ground", base.name, np.eye(4), np.eye(4), own, springs)
    _link(root, base)
    for number, (joint, link) in enumerate(zip(robot.joints, robot.links[1:], strict=True), start=1):
        name = f"joint{number}"
        own = [axis for axis in AXES if f"{name}.{axis}" in springs]
        align = z_to(joint.axis)
        turning = f"{joint.name}.turned" if own or not np.allclose(joint.mount, np.eye(4)) else link.name
        node = _joint(root, joint.name, "revolute", joint.parent, turning, joint.origin, joint.axis)
        lower, upper = (
            repr(float(np.clip(end, -2 * np.pi, 2 * np.pi))) for end in (joint.lower, joint.upper)
        )
        ET.SubElement(node, "limit", lower=lower, upper=upper, effort=repr(_FAR), velocity=repr(_FAR))
        if turning != link.name:
            _link(root, _weightless(turning))
            _elastic(root, name, turning, link.name, align, align.T @ joint.mount, own, springs)
        _link(root, link)
    for frame, (carrier, pose) in robot.frames.items():
        ET.SubElement(root, "link", name=frame)
        _joint(root, f"{frame}.fixed", "fixed", carrier, frame, pose)
    ET.indent(root)
    return '<?xml version="1.0"?>\n' + ET.tostring(root, encoding="unicode") + "\n"


def _elastic(
    root: ET.Element,
    name: str,
    parent: str,
    child: str,
    first: Array,
    last: Array,
    axes: list[str],
    springs: dict[str, tuple[float, float]],
) -> None:
    """Joints along axes of the frame at `first` in the parent, then the child at `last` in it."""
    pose = first
    for axis in axes:
        coordinate = f"{name}.{axis}"
        number = AXES.index(axis)
        kind, between = ("prismatic" if number < 3 else "revolute"), f"{coordinate}.link"
        node = _joint(root, coordinate, kind, parent, between, pose, np.eye(3)[number % 3])
        end = repr(0.1 if number < 3 else np.pi / 2)
        ET.SubElement(node, "limit", lower=f"-{end}", upper=end, effort=repr(_FAR), velocity=repr(_FAR))
        stiffness, damping = springs[coordinate]
        ET.SubElement(node, "dynamics", damping=repr(damping), friction="0.0")
        tag = ET.SubElement(root, "gazebo", reference=coordinate)
        ET.SubElement(tag, "springStiffness").text = repr(stiffness)
        ET.SubElement(tag, "springReference").text = "0.0"
        _link(root, _weightless(between))
        parent, pose = between, np.eye(4)
    _joint(root, f"{name}.fixed", "fixed", parent, child, pose @ last)


def _weightless(name: str) -> Link:
    return Link(name, _WEIGHTLESS, np.zeros(3), _WEIGHTLESS * np.eye(3))


def _link(root: ET.Element, link: Link) -> None:
    node = ET.SubElement(root, "link", name=link.name)
    if link.mass <= 0:
        return
    inertial = ET.SubElement(node, "inertial")
    ET.SubElement(inertial, "origin", xyz=_numbers(link.centre), rpy="0 0 0")
    ET.SubElement(inertial, "mass", value=repr(float(link.mass)))
    ET.SubElement(inertial, "inertia", {key: repr(float(link.inertia[at])) for key, at in MOMENTS.items()})


def _joint(
    root: ET.Element,
    name: str,
    kind: str,
    parent: str,
    child: str,
    pose: Array,
    axis: Array | None = None,
) -> ET.Element:
    node = ET.SubElement(root, "joint", name=name, type=kind)
    ET.SubElement(node, "origin", xyz=_numbers(pose[:3, 3]), rpy=_numbers(roll_pitch_yaw(pose)))
    ET.SubElement(node, "parent", link=parent)
    ET.SubElement(node, "child", link=child)
    if axis is not None:
        ET.SubElement(node, "axis", xyz=_numbers(axis))
    return node


def _numbers(values: Array) -> str:
    return " ".join(repr(float(value)) for value in values)

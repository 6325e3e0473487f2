"""Every spring that may be missing from the model of a study: the physical rivals of all else that may be
wrong.
"""

from __future__ import annotations

from identify.model.effects.base import Effect
from identify.model.effects.base_compliance import BaseCompliance
from identify.model.effects.joint_compliance import JointCompliance
from identify.model.effects.link_flexibility import LinkFlexibility
from identify.model.effects.mount_compliance import MountCompliance
from identify.model.effects.springs import Axis
from identify.model.system import free_coordinates
from identify.robot.posture import AXES
from identify.vibration.problem import Problem


def all_springs(problem: Problem, *, shrink: bool) -> list[Effect]:
    """Of every axis of every joint, of the base and of mounts that the study holds, and of every link that it
    does not bend; shrink: by compliance, rigid to begin with.
    """
    robot, free = problem.robot, free_coordinates(problem.robot, problem.file.study.effects)
    found: list[Effect] = []
    for number in range(1, len(robot.joints) + 1):
        axes = _held(f"joint{number}", free)
        if axes:
            found.append(JointCompliance(joints=[number], axes=axes, shrink=shrink))
    base = _held("base", free) if robot.links[0].mass > 0 else []
    if base:
        found.append(BaseCompliance(axes=base, shrink=shrink))
    for number in range(1, len(robot.payloads) + 1):
        axes = _held(f"payload{number}", free)
        if axes:
            found.append(MountCompliance(payload=number, axes=axes, shrink=shrink))
    for link in LinkFlexibility.instances(robot, problem.points):
        if not free & set(link.free_coordinates(robot)):
            found.append(link.model_copy(update={"shrink": shrink}))
    return found


def _held(body: str, free: set[str]) -> list[Axis]:
    """The axes of a body that nothing frees."""
    axes: tuple[Axis, ...] = AXES  # type: ignore[assignment]
    return [axis for axis in axes if f"{body}.{axis}" not in free]

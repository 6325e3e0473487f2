"""Every spring that may be missing from the model of a study: the physical rivals of all else that may be
wrong.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from identify.core.parameters import DampingValues
from identify.model.effects.base import Effect
from identify.model.effects.base_compliance import BaseCompliance
from identify.model.effects.joint_compliance import JointCompliance
from identify.model.effects.link_flexibility import LinkFlexibility
from identify.model.effects.mount_compliance import MountCompliance
from identify.model.effects.springs import Axis, Springs
from identify.model.system import free_coordinates
from identify.robot.description import Robot
from identify.robot.posture import AXES
from identify.vibration.problem import Problem

_STIFFER, _ARM = 10.0, 0.15
"""A bearing that is about as stiff as they are: ten times its drive in rotation, and that on a lever of
0.15 m; and a link that turns at its end as much as such a bearing does.
"""
_HELD = DampingValues(fixed=True)


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
    mounts = {one.payload: one for one in problem.file.study.effects if isinstance(one, MountCompliance)}
    for number in range(1, len(robot.payloads) + 1):
        axes = _held(f"payload{number}", free)
        if axes:
            at = mounts[number].at_m if number in mounts else _halfway(robot, number)
            found.append(MountCompliance(payload=number, axes=axes, at_m=at, shrink=shrink))
    for link in LinkFlexibility.instances(robot, problem.points):
        if not free & set(link.free_coordinates(robot)):
            found.append(link.model_copy(update={"shrink": shrink}))
    return found


def _halfway(robot: Robot, number: int) -> tuple[float, float, float]:
    """Where the mount of a payload may be, m: between the frame of the link that carries it and its centre.

    Turning about one of these is not turning about the other, and sliding beside that is no substitute.
    """
    x, y, z = (robot.payloads[number - 1][1].centre / 2).round(4).tolist()
    return x, y, z


def usual_springs(
    problem: Problem, values: Mapping[str, float], *, damped: DampingValues = _HELD
) -> tuple[Effect, ...]:
    """All springs by compliance, each with what is usual beside drives at values by name as its standard
    deviation: none of them is rigid, and what it gives way would else be found in its drive.
    """
    springs = all_springs(problem, shrink=True)
    return tuple(one for spring in springs for one in _usual(problem.robot, spring, values, damped))


def _usual(
    robot: Robot, spring: Effect, values: Mapping[str, float], damped: DampingValues
) -> Iterator[Effect]:
    """Of a bearing along axes and about them, which have other units."""
    if isinstance(spring, LinkFlexibility):
        held = {"bending_damping": damped, "torsion_damping": damped}
        yield _within(spring, usual_rigidity(robot, spring, values), held)
    elif isinstance(spring, Springs):
        [body, *_] = spring.free_coordinates(robot)[0].split(".")
        for kind in "tr":
            axes = [axis for axis in spring.axes if axis.startswith(kind)]
            if axes:
                yield _within(spring, usual_stiffness(body, kind, values), {"axes": axes, "damping": damped})


def _within(spring: Effect, usual: float, update: Mapping[str, object]) -> Effect:
    return spring.model_copy(update={**update, "compliance_std": float(f"{1 / usual:.3g}")})


def usual_rigidity(robot: Robot, link: LinkFlexibility, values: Mapping[str, float]) -> float:
    """EI or GJ, N m^2, of a link that turns at its end as much as the bearing of its joint does."""
    return usual_stiffness(f"joint{link.number(robot)}", "r", values) * link.beam(robot).length


def usual_stiffness(body: str, axis: str, values: Mapping[str, float]) -> float:
    """Of a bearing of a body along or about an axis, N/m or N m/rad, by its drive's stiffness among values by
    name; where it has none, by the least of all drives, and of a base by the largest.  The mount of a payload
    gives way as drives do.
    """
    drives = [value for name, value in values.items() if name.endswith(".rz.stiffness")]
    drive = values.get(f"{body}.rz.stiffness", (max if body == "base" else min)(drives, default=1e6))
    stiffer = 1.0 if body.startswith("payload") else _STIFFER
    return stiffer * drive / (_ARM**2 if axis.startswith("t") else 1.0)


def _held(body: str, free: set[str]) -> list[Axis]:
    """The axes of a body that nothing frees."""
    axes: tuple[Axis, ...] = AXES  # type: ignore[assignment]
    return [axis for axis in axes if f"{body}.{axis}" not in free]

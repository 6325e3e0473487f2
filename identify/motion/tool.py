"""Where the tool of a motion was: commanded, as the motors' encoders believe, and in truth (Kobe, section
5.2).
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from identify.core.arrays import Array
from identify.measured.finding import Finding
from identify.measured.quality_places import far_places
from identify.motion.problem import MotionProblem
from identify.motion.recording import PreparedRecord
from identify.robot.engine_motion import MovingArm

COMMAND, FEEDBACK, END = "command", "feedback", "end"
RECORDED_FEEDBACK, RECORDED_END = "recorded feedback", "recorded end"


def tool_paths(problem: MotionProblem, record: PreparedRecord, coordinates: Array) -> dict[str, Array]:
    """Places of the tool (ticks, 3), m, in the base's axes, at coordinates (ticks, n): `command` and
    `feedback` are the drives' commanded and actual angles through the rigid kinematics, `end` is where the
    elastic arm has the tool; nothing without a tool.
    """
    tool, arm = problem.file.study.tool, problem.arm
    if tool is None:
        return {}
    rigid, point = MovingArm(problem.robot), np.array(tool.at_m)
    drives = {COMMAND: record.command.position, FEEDBACK: coordinates[:, arm.drive]}
    paths = {name: rigid.frame_position(angles, tool.link, point) for name, angles in drives.items()}
    return {**paths, END: arm.frame_position(coordinates, tool.link, point)}


def recorded_paths(problem: MotionProblem, record: PreparedRecord) -> dict[str, tuple[Array, Array]]:
    """What was recorded of the same, times (samples,), s, and places (samples, 3), m: `recorded feedback`
    from motor positions through the rigid kinematics, `recorded end` from a tracker.
    """
    tool, measured = problem.file.study.tool, record.measured
    if tool is None or measured is None:
        return {}
    found = {}
    if "motor_position" in measured.signals:
        angles = measured.signals["motor_position"]
        found[RECORDED_FEEDBACK] = (
            measured.time_s,
            MovingArm(problem.robot).frame_position(angles, tool.link, np.array(tool.at_m)),
        )
    if record.tool is not None:
        found[RECORDED_END] = measured.time_s, record.tool
    return found


def far_tool(problem: MotionProblem) -> Iterator[Finding]:
    """A tool that cannot be on the robot."""
    tool = problem.file.study.tool
    if tool is not None:
        yield from far_places(problem.robot, {"tool.at_m": (tool.link, np.array(tool.at_m))})

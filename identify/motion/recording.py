"""One motion of a study: its command at the controller's ticks, from joint moves or a path of the tool, and
what was recorded of it.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from identify.core.arrays import Array
from identify.core.errors import InputError
from identify.measured.record_files import RecordFile
from identify.measured.records import MotionRecord, read_record
from identify.motion.command import Command, Move, moves_command, tabulated
from identify.motion.path import joint_path
from identify.motion.study import MotionFile, RecordSettings, TrackerSettings
from identify.robot.description import Robot
from identify.robot.engine_motion import MovingArm


@dataclass(frozen=True)
class PreparedRecord:
    """One motion: what it is, its command at the controller's ticks, the torque (ticks, joints) that this
    takes at the gear output without rotors, and what was measured, if anything; tool (samples, 3), m: where
    the tool was seen.
    """

    settings: RecordSettings
    command: Command
    torque: Array
    measured: MotionRecord | None
    tool: Array | None = None


def check_record(record: RecordSettings, robot: Robot, where: str) -> None:
    """Raise an InputError for what does not fit the robot or the duration."""
    if len(record.start_deg) != len(robot.joints):
        raise InputError(
            f"{where}.start_deg",
            f"{len(record.start_deg)} angles",
            f"{len(robot.joints)}, one per joint of {robot.name!r}",
        )
    for number, move in enumerate(record.moves):
        robot.joint_number(move.joint, f"{where}.moves.{number}.joint")
        _check_end(move, record.duration_s, f"{where}.moves.{number}", "move")
    if record.excitation is not None:
        robot.joint_number(record.excitation.joint, f"{where}.excitation.joint")
    if record.path is not None:
        _check_end(record.path.sweep, record.duration_s, f"{where}.path", "path")
    for name, (begin, end) in record.phases_s.items():
        if not 0 <= begin < end:
            raise InputError(f"{where}.phases_s.{name}", f"[{begin:g}, {end:g}]", "the beginning first")


def _check_end(move: Move, duration: float, where: str, what: str) -> None:
    end = move.start_s + move.duration_s
    if end > duration:
        raise InputError(where, f"the {what} ends after {end:.3f} s", f"within duration_s of {duration:g}")


def read_recording(file: MotionFile, rigid: MovingArm, settings: RecordSettings) -> PreparedRecord:
    """The command of a record for the rigid arm, and what was measured; raises InputError for what is wrong
    with either.
    """
    robot = rigid.robot
    time = file.study.servo.period_s * np.arange(
        round(settings.duration_s / file.study.servo.period_s) + 1, dtype=float
    )
    command = _command(file, rigid, settings, time)
    torque = rigid.inverse_dynamics(command.position, command.velocity, command.acceleration)
    measured = settings.measured
    if measured is None:
        return PreparedRecord(settings, command, torque, None)
    path, joints = file.resolve(measured.file), len(robot.joints)
    read = read_record(path, settings.name, measured.signals, measured.time, joints, np.zeros(joints))
    if read.time_s[-1] > time[-1] + file.study.servo.period_s / 2:
        raise InputError(
            str(path),
            f"a record of {read.time_s[-1]:g} s",
            f"no more than duration_s of {settings.duration_s:g}",
        )
    return PreparedRecord(settings, command, torque, read, _seen(path, measured.tool, len(read.time_s)))


def _seen(path: Path, tracker: TrackerSettings | None, samples: int) -> Array | None:
    """Places of the tool as measured (samples, 3), m."""
    if tracker is None:
        return None
    file = RecordFile(path)
    columns = [np.ravel(file.array(name)) for name in tracker.at]
    if any(len(column) != samples for column in columns):
        raise InputError(
            f"{path}, measured.tool",
            f"{[len(column) for column in columns]} samples",
            f"{samples}, as many as of the signals",
        )
    return np.stack(columns, axis=1) * (1e-3 if tracker.unit == "mm" else 1.0)


def _command(file: MotionFile, rigid: MovingArm, settings: RecordSettings, time: Array) -> Command:
    start, tool, path = np.radians(settings.start_deg), file.study.tool, settings.path
    if path is None or tool is None:
        return moves_command(
            start, [(rigid.robot.joint_number(move.joint) - 1, move) for move in settings.moves], time
        )
    places = path.points(rigid.frame_position(start, tool.link, np.array(tool.at_m)), time)
    return tabulated(joint_path(rigid, tool, start, places, f"record {settings.name}: path"), time[1])

"""One motion of a study: its command at the controller's ticks, from joint moves or a path of the tool, and
what was recorded of it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.interpolate import PchipInterpolator

from identify.core.arrays import Array
from identify.core.errors import InputError
from identify.measured.record_files import RecordFile
from identify.measured.records import MotionRecord, read_record
from identify.motion.command import Command, Move, moves_command, tabulated
from identify.motion.fed import FedMotion, fed_motion
from identify.motion.path import joint_path
from identify.motion.study import MotionFile, RecordSettings, TrackerSettings
from identify.motion.tool_errors import ToolErrors
from identify.motion.tracker import Registration, registered
from identify.robot.description import Robot
from identify.robot.engine_motion import MovingArm

TOOL = "tool_position"
_CLOCK_S = 0.5
"""How far the clock of a tracker may be off: more than a hand needs to start both."""
_BEGINS = np.radians(0.5)
"""How far from `start_deg`, which is typed, a recorded command may begin."""


@dataclass(frozen=True)
class PreparedRecord:
    """One motion: what it is, its command at the controller's ticks, the torque (ticks, joints) that this
    takes at the gear output without rotors, and what was measured, if anything; tool (samples, 3), m: where
    the tool was seen, and tool_errors: what that may be off by; fed: the recorded motion, where that moves
    the drives; registration: of the tracker, where it has a frame of its own.
    """

    settings: RecordSettings
    command: Command
    torque: Array
    measured: MotionRecord | None
    tool: Array | None = None
    tool_errors: ToolErrors | None = None
    fed: FedMotion | None = None
    registration: Registration | None = None

    @property
    def recorded(self) -> dict[str, Array]:
        """Everything that was measured and can be compared, by quantity, (samples, joints), of the tool
        (samples, 3); SI.
        """
        if self.measured is None:
            return {}
        if self.fed is not None:
            told = ("motor_torque", "motor_current")
            return {q: signal for q, signal in self.measured.signals.items() if q in told}
        return {**self.measured.signals, **({} if self.tool is None else {TOOL: self.tool})}

    def fed_in(self, lowpass_hz: float, period_s: float) -> PreparedRecord:
        """The same with its recorded motion fed into the model; as it is, where no motor was recorded."""
        read, settings = self.measured, self.settings
        if self.fed is not None or read is None or "motor_position" not in read.signals:
            return self
        time, where = period_s * np.arange(len(self.command.position), dtype=float), f"record {settings.name}"
        return replace(self, fed=fed_motion(read, lowpass_hz, np.radians(settings.start_deg), time, where))


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
    measured = settings.measured
    if measured is None:
        if settings.recorded_motion_hz is not None:
            raise InputError(
                f"record {settings.name}: recorded_motion_hz", "no `measured` to follow", "a recorded motion"
            )
        command = _command(file, rigid, settings, time, None)
        return PreparedRecord(settings, command, _torque(rigid, command), None)
    path, joints = file.resolve(measured.file), len(robot.joints)
    read = read_record(path, settings.name, measured.signals, measured.time, joints, np.zeros(joints))
    command = _command(file, rigid, settings, time, read)
    if read.time_s[-1] > time[-1] + file.study.servo.period_s / 2:
        raise InputError(
            str(path),
            f"a record of {read.time_s[-1]:g} s",
            f"no more than duration_s of {settings.duration_s:g}",
        )
    seen = _seen(path, measured.tool, len(read.time_s))
    laid = None
    if measured.tool is not None and measured.tool.frame == "own" and seen is not None:
        laid = registered(seen, read.time_s, _driven(file, rigid, command, time, read), _CLOCK_S)
        seen = laid.places
    errors = None
    if seen is not None and measured.tool is not None and file.study.tool is not None:
        tool = file.study.tool.link, np.array(file.study.tool.at_m)
        wanted, std = _wanted(command, time, read), np.radians(measured.tool.within_deg)
        errors = ToolErrors.of(rigid, wanted, tool, seen, float(std))
    record = PreparedRecord(settings, command, _torque(rigid, command), read, seen, errors, registration=laid)
    if settings.recorded_motion_hz is None:
        return record
    read.signal("motor_position")
    return record.fed_in(settings.recorded_motion_hz, file.study.servo.period_s)


def _driven(file: MotionFile, rigid: MovingArm, command: Command, time: Array, read: MotionRecord) -> Array:
    """Where the drives say that the tool was at the samples of a record, (samples, 3), m: as recorded, or,
    for joints of which nothing was, as commanded.
    """
    tool = file.study.tool
    if tool is None:
        raise InputError("tool", "missing, and a tracker saw it", "the point of the robot that it saw")
    wanted = _wanted(command, time, read)
    angles = read.signals.get("motor_position", wanted)
    angles = np.where(np.isnan(angles), wanted, angles)
    return rigid.frame_position(angles, tool.link, np.array(tool.at_m))


def _wanted(command: Command, time: Array, read: MotionRecord) -> Array:
    """Commanded angles (samples, joints), rad, at the samples of a record."""
    return np.stack([np.interp(read.time_s, time, column) for column in command.position.T], axis=1)


def _torque(rigid: MovingArm, command: Command) -> Array:
    return rigid.inverse_dynamics(command.position, command.velocity, command.acceleration)


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


def _command(
    file: MotionFile, rigid: MovingArm, settings: RecordSettings, time: Array, read: MotionRecord | None
) -> Command:
    """The path of the tool or the moves that the study gives, else what the controller recorded of its
    command, else to stand still.
    """
    start, tool, path = np.radians(settings.start_deg), file.study.tool, settings.path
    if path is not None and tool is not None:
        places = path.points(rigid.frame_position(start, tool.link, np.array(tool.at_m)), time)
        return tabulated(joint_path(rigid, tool, start, places, f"record {settings.name}: path"), time[1])
    recorded = None if read is None else read.signals.get("command_position")
    if read is not None and recorded is not None and not settings.moves:
        return _recorded(read, recorded, start, time)
    moves = [(rigid.robot.joint_number(move.joint) - 1, move) for move in settings.moves]
    return moves_command(start, moves, time)


def _recorded(read: MotionRecord, command: Array, start: Array, time: Array) -> Command:
    """A recorded command (samples, joints), rad, at ticks; joints of which none was recorded stand still, and
    all do after its end.  InputError where it does not begin at the start of the study.
    """
    told = np.where(np.isnan(command), start, command)
    apart = np.abs(told[0] - start)
    if np.max(apart) > _BEGINS:
        joint = int(np.argmax(apart))
        raise InputError(
            f"{read.source}, command_position",
            f"a command that begins at {np.degrees(told[0, joint]):.4g}° of joint {joint + 1}",
            f"start_deg, which is {np.degrees(start[joint]):.4g}°",
            "give start_deg as the command begins, in the angles of the robot file",
        )
    # Without overshoot where a controller holds its command between samples.
    between = PchipInterpolator(read.time_s, told)
    return tabulated(between(np.minimum(time, read.time_s[-1])), time[1])

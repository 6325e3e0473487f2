"""What all curves of a study share: drives, where signals stand in files, the robot; and how a run is
read.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from identify.core.arrays import Array
from identify.core.errors import InputError
from identify.measured.conditioning import ConditionedMotion, condition
from identify.measured.record_files import JOINT, RecordFile
from identify.measured.records import (
    FARTHEST,
    MotionRecord,
    Quantity,
    SignalSettings,
    TimeAxis,
    read_record,
)
from identify.measured.units import parse_signal_unit
from identify.robot.description import Robot
from identify.robot.read import read_robot
from identify.robot.settings import RobotSettings


@dataclass(frozen=True)
class JointTestData:
    """folder: of the config; gear_ratio (joints,); torque_ratio (joints,): what a recorded torque is
    multiplied by to be one at the joint; slow: rad/s up to which a joint stands; coupling (drives, joints),
    or None: `identify.robot.coupling`; settings: what the study says of the robot, where it has one; inputs:
    sha256 of every file read so far, by its name; watch: called with every record that is read.
    """

    folder: Path
    robot: Robot | None
    gear_ratio: Array
    torque_ratio: Array
    torque_constant: Array | None
    signals: dict[Quantity, SignalSettings]
    time: TimeAxis | float
    zero: Array
    slow: float
    lowpass_hz: float
    resample_hz: float | None = None
    coupling: Array | None = None
    settings: RobotSettings | None = None
    inputs: dict[str, str] = field(default_factory=dict)
    watch: Callable[[MotionRecord], None] = lambda record: None

    @property
    def joints(self) -> int:
        """How many joints there are."""
        return len(self.gear_ratio)

    def rigid(self, where: str) -> Robot:
        """The robot; InputError where the study has none."""
        if self.robot is None:
            raise InputError(
                where, "no `robot` in the study", "its URDF or Denavit-Hartenberg table", "add `robot:`"
            )
        return self.robot

    def own_bodies(self, where: str) -> Robot:
        """The robot without payloads."""
        if self.settings is None or not self.settings.payload:
            return self.rigid(where)
        return read_robot(self.settings.model_copy(update={"payload": []}), self.folder)

    def checked(self, joint: int, where: str) -> int:
        """The number of a joint from 0; InputError for a joint that is not there."""
        if joint > self.joints:
            raise InputError(
                f"{where}, key joint", f"{joint}", f"a number from 1 to {self.joints}, one per gear ratio"
            )
        return joint - 1

    def motion(
        self, path: Path, quantities: Sequence[Quantity], joints: Sequence[int], where: str
    ) -> ConditionedMotion:
        """A conditioned run with these quantities of these joints (from 0), others NaN; torques at the
        joints, N m.

        The motor speed is read too where the study says where it stands, and a current in place of a torque.
        """
        extra: tuple[Quantity, ...] = ("motor_velocity",) if "motor_velocity" in self.signals else ()
        named = {quantity: self._at(quantity, joints, where) for quantity in (*quantities, *extra)}
        even = self.resample_hz is None
        record = read_record(
            self.folder / path, path.name, named, self.time, self.joints, self.zero, even=even
        )
        self.inputs[str(path)] = record.sha256
        self.watch(record)
        if not {"motor_torque", "motor_current"} & set(record.signals):
            none = np.full_like(record.signal("motor_position"), np.nan)
            record = replace(record, signals={**record.signals, "motor_torque": none})
        motion = condition(record, self.lowpass_hz, self.resample_hz, self.torque_constant)
        return replace(motion, torque=self.at_joints(motion.torque))

    def at_joints(self, torque: Array) -> Array:
        """Torques at the joints (samples, joints) out of recorded ones; motors that turn with two joints act
        on both (tau = C^T n tau_motor), where torques are recorded at the motors.
        """
        torque = torque * self.torque_ratio
        if self.coupling is None or (self.torque_ratio == 1).all():
            return torque
        return np.asarray(np.where(self.coupling != 0, torque[:, :, None] * self.coupling, 0.0).sum(axis=1))

    def torque_quantity(self) -> Quantity:
        """Which signal the torques come from."""
        return (
            "motor_current"
            if "motor_torque" not in self.signals and "motor_current" in self.signals
            else "motor_torque"
        )

    def column(self, file: RecordFile, at: SignalSettings, joint: int, where: str) -> Array:
        """One joint's numbers (samples,) in SI out of a table without time."""
        unit = parse_signal_unit(at.unit, where)
        read = np.ravel(file.array(at.at, joint + 1, unit))
        values = read if file.in_si else unit.factor * read
        if unit.si == "rad" and np.abs(values).max(initial=0.0) > FARTHEST:
            found = f"angles of up to {np.abs(values).max():.3g} rad: are they degrees?"
            raise InputError(f"{where}, {at.at}", found, "angles of a joint", "correct the unit in `signals`")
        return values

    def at(self, quantity: Quantity, where: str) -> SignalSettings:
        """Where a quantity stands in the files; InputError where the study does not say."""
        if quantity not in self.signals:
            raise InputError(
                f"{where}, key signals",
                f"no {quantity}",
                "where it stands in the files",
                f"add `{quantity}:` to `signals`",
            )
        return self.signals[quantity]

    def _at(self, quantity: Quantity, joints: Sequence[int], where: str) -> SignalSettings:
        settings = self.at(quantity, where)
        present = [joint + 1 for joint in joints]
        missing = [joint for joint in present if settings.joints is not None and joint not in settings.joints]
        if missing:
            raise InputError(
                f"{where}, key signals.{quantity}.joints",
                f"no {quantity} of joint {missing[0]}",
                "one of every joint in use",
            )
        return settings.model_copy(update={"joints": present}) if JOINT in settings.at else settings

"""A study of motion turned into something that moves: the robot read, its numbers listed, commands sampled,
records read.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from pydantic import BaseModel

from identify.core.arrays import Array
from identify.core.errors import InputError
from identify.core.parameters import Parameter
from identify.measured.records import check_different
from identify.model.laws.friction import Smoothing
from identify.model.system import build_site, list_parameters
from identify.motion.controller import ControlLaw, Twist
from identify.motion.fed import FedMotion, fed
from identify.motion.gear import gear_spring
from identify.motion.links import coordinates, moving_arm
from identify.motion.numbers import JointNumber, NumberTable, number_table
from identify.motion.recording import PreparedRecord, check_record, read_recording
from identify.motion.simulate import (
    Orders,
    Plant,
    SimulatedMotion,
    Timing,
    extrapolated,
    side_by_side,
    simulate,
)
from identify.motion.state_feedback import TwoInertias
from identify.motion.study import MotionFile
from identify.robot.description import Robot
from identify.robot.engine_motion import MovingArm, Passive
from identify.robot.read import read_robot

_EVERY = 20
"""Ticks between postures at which what depends on them slowly is computed."""
FASTEST = 0.3
"""Largest step times angular frequency of the fastest mode: leapfrog is stable to 2 and off by (0.3)^2 / 24 =
0.4 % in frequency.
"""


@dataclass(frozen=True)
class MotionProblem:
    """Everything a simulation works on.  parameters: those of the effects in their order, then those of the
    sections.

    freed: numbers by `section.key` that `with_numbers` set free.
    """

    file: MotionFile
    robot: Robot
    arm: MovingArm
    springs: tuple[Parameter, ...]
    table: NumberTable
    records: tuple[PreparedRecord, ...]
    step_s: float
    freed: Mapping[str, JointNumber] = field(default_factory=dict)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """All parameters; those of springs may be fixed."""
        return self.springs + self.table.parameters

    @property
    def initial(self) -> Array:
        """Where a search starts, (parameters,)."""
        return np.array([parameter.initial for parameter in self.parameters])

    def by_name(self, values: Array) -> dict[str, float]:
        """Values (parameters,) by name."""
        return dict(zip((p.name for p in self.parameters), map(float, values), strict=True))

    @cached_property
    def resolution(self) -> Array:
        """Turn of the motor per count of its encoder, rad; 0 where continuous."""
        counts = self.file.study.encoder_counts
        return (
            np.zeros(len(self.robot.joints)) if counts is None else 2 * np.pi / np.array(counts, dtype=float)
        )

    @cached_property
    def continuous(self) -> MotionProblem:
        """The same with encoders that do not count."""
        return self.with_study(encoder_counts=None)

    def with_smoothing(self, smoothing: Smoothing) -> MotionProblem:
        """The same with dry friction smoothed otherwise."""
        friction = self.file.study.friction.model_copy(update={"smoothing": smoothing})
        return self.with_study(friction=friction)

    def with_study(self, **changed: object) -> MotionProblem:
        """The same with other values of keys of the study that neither robot, records nor numbers hang on."""
        study = self.file.study.model_copy(update=changed)
        return replace(self, file=self.file.model_copy(update={"study": study}))

    def rows(self, place: str) -> list[tuple[int, float]]:
        """Numbers of the coordinates that a spring, such as joint1.rz, acts on, and how stiff each is per
        unit of the spring's.
        """
        own = self._links.get(place, {place: 1.0})
        return [(self.arm.names.index(coordinate), unit) for coordinate, unit in own.items()]

    @cached_property
    def _links(self) -> dict[str, dict[str, float]]:
        return coordinates(self.robot, self.file.study.effects)

    def passive(self, values: Array, numbers: Mapping[str, Array]) -> Passive:
        """Rotors, springs and dampers on the coordinates at parameter values (m, parameters)."""
        size = (len(values), len(self.arm.names))
        armature, stiffness, damping = np.zeros(size), np.zeros(size), np.zeros(size)
        armature[:, self.arm.drive] = numbers["gear.ratio"] ** 2 * numbers["motor.rotor_inertia"]
        for column, spring in enumerate(self.springs):
            place, what = spring.name.rsplit(".", 1)
            target = stiffness if what == "stiffness" else damping
            for row, unit in self.rows(place):
                target[:, row] = unit * values[:, column]
        return Passive(armature, stiffness, damping)

    def run(
        self, values: Array, records: Sequence[PreparedRecord], *, near: bool = False, every: int = 1
    ) -> SimulatedMotion:
        """The motion of every candidate (m, parameters) on every record; lanes run through the records of the
        first candidate first; near: the arm of all but the first is linearised beside it; every: ticks from
        one that is kept to the next.

        Extrapolated where the study says so: with an error in proportion to the step, 2 m(h/2) - m(h) has
        none (Richardson 1911).
        """
        once = self._stepped(values, records, near, every)
        if not self.file.study.extrapolate:
            return once
        return extrapolated(once, self.halved._stepped(values, records, near, every))

    @property
    def halved(self) -> MotionProblem:
        """The same with half the step."""
        return replace(self, step_s=self.step_s / 2)

    def _stepped(
        self, values: Array, records: Sequence[PreparedRecord], near: bool, every: int
    ) -> SimulatedMotion:
        """Records that are driven by their controllers side by side, and those that were fed in."""
        driven = [number for number, record in enumerate(records) if record.fed is None]
        if len(driven) == len(records):
            return self._driven(values, records, near, every)
        parts = {
            n: self._fed(values, record.fed, every)
            for n, record in enumerate(records)
            if record.fed is not None
        }
        if driven:
            together = self._driven(values, [records[number] for number in driven], near, every)
            parts |= {n: together.lanes(slice(at, None, len(driven))) for at, n in enumerate(driven)}
        return side_by_side([parts[number] for number in range(len(records))])

    def _fed(self, values: Array, motion: FedMotion, every: int) -> SimulatedMotion:
        return fed(self.plant(values, self.table.arrays(values)), motion).kept(every)

    def _driven(
        self, values: Array, records: Sequence[PreparedRecord], near: bool, every: int
    ) -> SimulatedMotion:
        ticks = max(len(record.command.position) for record in records)
        lanes = np.repeat(values, len(records), axis=0)
        numbers = self.table.arrays(lanes)
        told = {**numbers, **{key: np.tile(row, (len(lanes), 1)) for key, row in self.told.items()}}
        plant, law = self.plant(lanes, numbers), self.law(told)
        orders = self._orders(records, plant, told, len(values), ticks)
        leading = len(records) if near else None
        return simulate(plant, law, orders, replace(self.timing, ticks=ticks, every=every), leading)

    @cached_property
    def told(self) -> dict[str, Array]:
        """What the controller computes with of the motors, (joints,) by `section.key`: what it was told, or
        what the study states, however the motors are; what the study searches it knows.
        """
        study, joints = self.file.study, len(self.robot.joints)
        stated = number_table({"motor": study.motor}, joints)
        known = {key: row for key, row in stated.given.items() if key not in stated.columns}
        return {**known, **{f"motor.{key}": np.array(row) for key, row in study.servo.told.items()}}

    def plant(self, lanes: Array, numbers: dict[str, Array]) -> Plant:
        """What moves, a lane per row of parameter values (lanes, parameters)."""
        study, passive = self.file.study, self.passive(lanes, numbers)
        wound = [
            (joint, self.arm.names.index(name))
            for joint, name in enumerate(self._windups)
            if name in self.arm.names
        ]
        joint, coordinate = np.array(wound, dtype=int).reshape(-1, 2).T
        stiffness = np.zeros((len(lanes), len(self.robot.joints)))
        stiffness[:, joint] = passive.stiffness[:, coordinate]
        spring = gear_spring(study.gear, numbers, stiffness)
        return Plant(
            self.arm,
            passive,
            study.motor.plant(numbers),
            spring,
            numbers,
            np.array([joint, coordinate]),
            self.resolution,
            study.friction.smoothing,
        )

    def law(self, numbers: Mapping[str, Array]) -> ControlLaw:
        """The controller with numbers for every lane."""
        return self.file.study.servo.law(numbers)

    @property
    def timing(self) -> Timing:
        """The step and what the controller's period and delay are in it."""
        servo = self.file.study.servo
        return Timing(self.step_s, round(servo.period_s / self.step_s), round(servo.delay_s / self.step_s), 0)

    @property
    def _windups(self) -> list[str]:
        return [f"joint{number + 1}.rz" for number in range(len(self.robot.joints))]

    def _orders(
        self,
        records: Sequence[PreparedRecord],
        plant: Plant,
        told: Mapping[str, Array],
        candidates: int,
        ticks: int,
    ) -> Orders:
        """Commands of all lanes, by what the controller was told; where the feed-forward is of elastic
        joints, those of the drives that take the links along them.
        """

        def all_lanes(rows: list[Array]) -> Array:
            return np.tile(np.array([_padded(row, ticks) for row in rows]), (candidates, 1, 1))

        position, velocity, acceleration = (
            all_lanes([getattr(r.command, key) for r in records])
            for key in ("position", "velocity", "acceleration")
        )
        servo, mode = self.file.study.servo, np.zeros((*position.shape[:2], 1))
        torque = all_lanes([self._carried(r) for r in records])
        if servo.knows_mode:
            mode = all_lanes([self.first_mode(r.command.position) for r in records])
        windup = np.zeros_like(position)
        if servo.model != "rigid":
            windup = np.moveaxis(plant.spring.windup(np.moveaxis(torque, 1, 0)), 0, 1)
            position = position + windup
            velocity = np.gradient(position, servo.period_s, axis=1)
            acceleration = np.gradient(velocity, servo.period_s, axis=1)
        rotors = told["gear.ratio"] ** 2 * told["motor.rotor_inertia"]
        return Orders(
            position,
            velocity,
            torque + rotors[:, None] * acceleration,
            mode,
            all_lanes([self._excitation(r) for r in records]),
            self._twist(windup, plant, rotors, all_lanes([self._link_inertia(r) for r in records]))
            if servo.places_poles
            else None,
        )

    def _twist(self, windup: Array, plant: Plant, rotors: Array, inertia: Array) -> Twist:
        """Twist that the command takes (lanes, ticks, joints), and the gains of its feedback by the inertia
        of the rotors at the gear output (lanes, joints) and of the links (lanes, ticks, joints).
        """
        joint, wound = plant.wound
        numbers, damping = plant.numbers, np.zeros_like(plant.spring.stiffness)
        damping[:, joint] = plant.passive.damping[:, wound]
        own = (rotors, plant.spring.stiffness, damping)
        drive, stiffness, damping = (np.broadcast_to(part[:, None], inertia.shape) for part in own)
        names = ("position_gain", "velocity_gain", "velocity_integral")
        gains = {name: numbers[f"servo.{name}"][:, None] for name in names}
        joints = TwoInertias(drive, inertia, stiffness, damping)
        return Twist(windup, *joints.placed(self.file.study.servo.places_poles, gains))

    def _link_inertia(self, record: PreparedRecord) -> Array:
        """(ticks, joints), kg m^2: what each joint carries at the commanded posture, the others held."""
        rigid, position = MovingArm(self.robot), record.command.position
        return _between(position, lambda turn: np.diag(rigid.mass_matrix(turn)))

    def _carried(self, record: PreparedRecord) -> Array:
        """(ticks, joints), N m: what the command takes of the links by the model of the feed-forward; of each
        joint by itself, its own acceleration at the inertia of the commanded posture, and weight.
        """
        if self.file.study.servo.model != "two-inertia":
            return record.torque
        rigid, found = MovingArm(self.robot), np.zeros_like(record.torque)
        still, command = np.zeros_like(record.torque), record.command
        for joint in range(found.shape[1]):
            alone = np.where(np.arange(found.shape[1]) == joint, command.acceleration, 0.0)
            found[:, joint] = rigid.inverse_dynamics(command.position, still, alone)[:, joint]
        return found

    def _excitation(self, record: PreparedRecord) -> Array:
        """(ticks, joints), N m at the gear output."""
        torque, excitation = np.zeros_like(record.command.position), record.settings.excitation
        if excitation is not None:
            time = self.file.study.servo.period_s * np.arange(len(torque), dtype=float)
            torque[:, self.robot.joint_number(excitation.joint) - 1] = excitation.torque(time)
        return torque

    def first_mode(self, position: Array) -> Array:
        """(ticks, 1), Hz: the first mode of the arm at its start values, drives free, at commanded positions
        (ticks, joints).
        """

        def first(turn: Array) -> Array:
            modes = _modes(self, turn)
            return np.array([min((omega for omega in modes if omega > 1.0), default=0.0) / 2 / np.pi])

        return _between(position, first)


def load_motion(file: MotionFile) -> MotionProblem:
    """Read and check everything that a study of motion names.  Raises InputError or InputErrors."""
    with file.located():
        return _loaded(file)


def _loaded(file: MotionFile) -> MotionProblem:
    study = file.study
    robot = read_robot(study.robot, file.path.parent)
    for number, record in enumerate(study.records):
        check_record(record, robot, f"records.{number}")
    first = np.radians(study.records[0].start_deg)
    springs: list[Parameter] = []
    if study.effects:
        springs = list_parameters(robot, build_site(robot, first, study.effects), study.effects)
    arm = moving_arm(robot, study.effects)
    table = number_table(sections_of(file), len(robot.joints), len(springs))
    _check_gears(file, arm)
    _check_told(file, len(robot.joints))
    _check_fed(file, arm)
    rigid = MovingArm(robot)
    records = tuple(read_recording(file, rigid, record) for record in study.records)
    check_different([(one.settings.name, one.measured.signals) for one in records if one.measured])
    problem = MotionProblem(file, robot, arm, tuple(springs), table, records, study.servo.period_s)
    return replace(problem, step_s=_step(problem))


def sections_of(file: MotionFile) -> dict[str, BaseModel]:
    """The parts of a study that hold numbers, by the name they have in parameters."""
    study = file.study
    return {
        "motor": study.motor,
        **study.gear.sections(),
        "friction": study.friction,
        "bodies": study.bodies,
        "balancer": study.balancer,
        "servo": study.servo,
    }


def _check_fed(file: MotionFile, arm: MovingArm) -> None:
    """Raise an InputError where motion is fed into an arm that is not rigid."""
    led = [
        f"record {r.name}: recorded_motion_hz" for r in file.study.records if r.recorded_motion_hz is not None
    ]
    led += ["inverse_dynamics_hz"] if file.study.inverse_dynamics_hz is not None else []
    if led and len(arm.elastic):
        found = f"{arm.names[arm.elastic[0]]} is elastic"
        raise InputError(led[0], found, "a rigid arm, whose drives say where all of it is")


def _check_told(file: MotionFile, joints: int) -> None:
    """Raise an InputError where the controller was told what is no number of the motor's joints."""
    known = [key for key, number in file.study.motor if isinstance(number, JointNumber)]
    for key, row in file.study.servo.told.items():
        if key not in known:
            raise InputError("servo.told", f"unknown number {key!r}", "one of " + ", ".join(known))
        if len(row) != joints:
            raise InputError(f"servo.told.{key}", f"{len(row)} values", f"{joints}: one per joint")


def _check_gears(file: MotionFile, arm: MovingArm) -> None:
    gear = file.study.gear
    soft = bool(gear.transmission_error) or any(
        np.any(np.asarray(number.initial) > 0) for number in (gear.cubic_stiffness, gear.backlash)
    )
    elastic = any(name.startswith("joint") and name.endswith(".rz") for name in arm.names)
    if soft and not elastic:
        found = "a gear with hardening, backlash or transmission error, and no joint that is elastic about rz"
        raise InputError("gear", found, "an effect of kind joint-compliance with axes [rz]")
    if file.study.servo.places_poles and not elastic:
        found = f"{file.study.servo.kind}, and no joint that is elastic about rz"
        raise InputError("servo.kind", found, "an effect of kind joint-compliance with axes [rz]")
    if elastic and np.min(file.study.motor.rotor_inertia.initial) <= 0:
        raise InputError(
            "motor.rotor_inertia",
            "0 with a joint that is elastic about rz",
            "that of the rotor, which now moves alone",
        )
    counts = file.study.encoder_counts
    if counts is not None and (len(counts) != len(arm.drive) or min(counts) < 1):
        raise InputError("encoder_counts", f"{counts}", f"{len(arm.drive)} positive numbers, one per joint")


def _step(problem: MotionProblem) -> float:
    """The step: as the study says where that divides the controller's period and resolves the fastest mode,
    else as large as does.
    """
    study = problem.file.study
    period, wanted = study.servo.period_s, study.step_s
    omega = fastest_mode(problem)
    if wanted is None:
        return period / int(np.ceil(max(1.0, period * omega / FASTEST)))
    parts = period / wanted
    if abs(parts - round(parts)) > 1e-6 or parts < 0.5:
        raise InputError("step_s", f"{wanted:g}", f"the controller's period {period:g} or a whole part of it")
    if wanted * omega > 1.0:
        fix = f"at most {FASTEST / omega:.2g} s is advised"
        raise InputError(
            "step_s",
            f"{wanted:g} s with a mode of {omega / 2 / np.pi:.0f} Hz",
            "a step that resolves it",
            fix,
        )
    return period / round(parts)


def fastest_mode(problem: MotionProblem, step_s: float = 0.0) -> float:
    """Angular frequency, rad/s, of the fastest mode of the arm with free drives at the first record's start,
    0 for a rigid arm: undamped, or as it is to a step of so long.

    A step that takes dampers implicitly is stable where it is below 2 over that: k h^2 < 4 m + 2 h d.
    """
    return float(_modes(problem, problem.records[0].command.position[0], step_s).max(initial=0.0))


def _modes(problem: MotionProblem, turn: Array, step_s: float = 0.0) -> Array:
    """Angular frequencies, rad/s, of the arm with free drives at drive angles (joints,) and start values, 0
    for rigid motion: undamped, but for what dampers take of a step.
    """
    values = problem.initial[None]
    passive = problem.passive(values, problem.table.arrays(values))
    position = np.zeros(len(problem.arm.names))
    position[problem.arm.drive] = turn
    mass = problem.arm.mass_matrix(position) + np.diag(passive.armature[0] + step_s / 2 * passive.damping[0])
    squares = np.linalg.eigvals(np.linalg.solve(mass, np.diag(passive.stiffness[0]))).real
    return np.asarray(np.sqrt(np.maximum(squares, 0.0)))


def _between(position: Array, of: Callable[[Array], Array]) -> Array:
    """(ticks, k): what depends on the posture, computed at every twentieth of the positions (ticks, joints),
    and straight lines between.
    """
    rows = np.unique(np.append(np.arange(0, len(position), _EVERY), len(position) - 1))
    found, ticks = np.array([of(row) for row in position[rows]]), np.arange(len(position))
    return np.stack([np.interp(ticks, rows, column) for column in found.T], axis=1)


def _padded(rows: Array, ticks: int) -> Array:
    """A command continued at its last row."""
    return np.concatenate([rows, np.repeat(rows[-1:], ticks - len(rows), axis=0)])

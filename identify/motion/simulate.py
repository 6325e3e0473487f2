"""Simulation of driven arms: controllers at their own rates, motors and gears at every step, the arm by the
engine.

All lanes (a lane is one candidate's numbers on one record) move side by side, as arrays (lanes, joints).
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from identify.core.arrays import Array, Index
from identify.core.interruption import check
from identify.model.laws.friction import Smoothing
from identify.model.laws.gear import GearSpring
from identify.motion.controller import ControlLaw, Sample, Twist
from identify.motion.friction import FrictionDamper
from identify.motion.motor import MotorPlant
from identify.robot.engine_motion import Lanes, MovingArm, Passive
from identify.robot.near_lanes import NearLanes


@dataclass(frozen=True)
class Timing:
    """Step of integration, s; steps between ticks of the controller; steps from measuring to the motor; ticks
    to simulate, and from one that is kept to the next.
    """

    step_s: float
    steps_per_tick: int
    delay_steps: int
    ticks: int
    every: int = 1


@dataclass(frozen=True)
class Plant:
    """What moves: the arm, what hangs on its coordinates, motors, gears and friction (`numbers`), and the
    encoders' steps.

    wound: for each joint with an elastic rz, (joint, its coordinate), (2, j). resolution (joints,): turn of
    the gear output per count of the encoder, rad, times the ratio; 0 where continuous.
    """

    arm: MovingArm
    passive: Passive
    motor: MotorPlant
    spring: GearSpring
    numbers: dict[str, Array]
    wound: Index
    resolution: Array
    smoothing: Smoothing = "root"
    """Of the sign in dry friction."""

    @cached_property
    def counts(self) -> bool:
        """Whether any encoder has steps."""
        return bool(self.resolution.any())

    @cached_property
    def drive(self) -> Index | slice:
        """The coordinates of the drives; a slice, which takes a tenth of the time, where they are evenly
        spaced.
        """
        return _evenly(self.arm.drive)

    @cached_property
    def wound_by(self) -> tuple[Index | slice, Index | slice]:
        """`wound`, with slices in the same way."""
        joint, coordinate = self.wound
        return _evenly(joint), _evenly(coordinate)

    @cached_property
    def gain(self) -> Array:
        """Motor torque over the one that is reported, (lanes, joints)."""
        return self.numbers.get("motor.torque_gain", np.ones_like(self.spring.ratio))

    @cached_property
    def balanced(self) -> bool:
        """Whether any joint has a balancer."""
        return any(bool(np.any(self.numbers[key])) for key in ("balancer.sine", "balancer.cosine"))

    def balance(self, position: Array) -> Array:
        """Forces (lanes, n) of the balancers at coordinates (lanes, n)."""
        joint, coordinate = self.wound_by
        forces, angle = np.zeros(position.shape), position[:, self.drive].copy()
        angle[:, joint] += position[:, coordinate]
        torque = self.numbers["balancer.sine"] * np.sin(angle)
        torque += self.numbers["balancer.cosine"] * np.cos(angle)
        forces[:, self.drive] = torque
        forces[:, coordinate] = torque[:, joint]
        return forces

    def weight(self, position: Array) -> Array:
        """Forces (lanes, n) that hold the arm and its balancers at coordinates (lanes, n)."""
        zero, more = np.zeros_like(position), self.numbers["bodies.mass"]
        held = self.arm.inverse_dynamics(position, zero, zero)
        for row in np.unique(more[more.any(axis=1)], axis=0):  # most lanes share one, and a new load is dear
            lanes = np.flatnonzero((more == row).all(axis=1))
            with self.arm.heavier(row):
                held[lanes] = self.arm.inverse_dynamics(position[lanes], zero[lanes], zero[lanes])
        return held - self.balance(position) if self.balanced else held

    @cached_property
    def rubs(self) -> bool:
        """Whether there is any friction."""
        keys = ("friction.coulomb", "friction.stribeck", "friction.viscous", "motor.viscous")
        return any(np.any(self.numbers[key]) for key in keys)


def _evenly(numbers: Index) -> Index | slice:
    """Rising numbers (n,) as a slice where they are evenly spaced."""
    if len(numbers) == 0:
        return slice(0, 0)
    step = int(numbers[1] - numbers[0]) if len(numbers) > 1 else 1
    evenly = slice(int(numbers[0]), int(numbers[-1]) + 1, step) if step > 0 else slice(0, 0)
    return evenly if np.array_equal(np.arange(numbers[-1] + 1)[evenly], numbers) else numbers


@dataclass(frozen=True)
class Orders:
    """What is commanded, (lanes, ticks, joints): position, velocity, and the torque it takes by inverse
    dynamics, at the gear output.

    mode_hz (lanes, ticks, 1): the first mode at the commanded posture, 0 where no controller asks for it;
    excitation: torque at the gear output that is added to the controller's; twist: of the command, with the
    gains of its feedback, where a controller has one.
    """

    position: Array
    velocity: Array
    feedforward: Array
    mode_hz: Array
    excitation: Array
    twist: Twist | None = None


@dataclass(frozen=True)
class SimulatedMotion:
    """What happened at the ticks, or at one of `every`: coordinates and velocities (lanes, ticks, n); of the
    motors (lanes, ticks, joints) the current, the torque at the gear output before friction, N m, and what
    the controller gave them.
    """

    coordinates: Array
    velocities: Array
    current: Array
    torque: Array
    command: Array
    every: int = field(default=1, kw_only=True)

    def lanes(self, pick: slice) -> SimulatedMotion:
        """Some of the lanes."""
        return SimulatedMotion(*(rows[pick] for rows in self.arrays), every=self.every)

    def kept(self, every: int) -> SimulatedMotion:
        """Of all ticks one of `every`."""
        return SimulatedMotion(*(rows[:, ::every] for rows in self.arrays), every=every)

    @property
    def arrays(self) -> tuple[Array, Array, Array, Array, Array]:
        """All that is (lanes, ticks, ...)."""
        return self.coordinates, self.velocities, self.current, self.torque, self.command


def simulate(
    plant: Plant, law: ControlLaw, orders: Orders, timing: Timing, leading: int | None = None
) -> SimulatedMotion:
    """From standstill at the first commanded position, in equilibrium with gravity, through all ticks; where
    some lanes lead, the arm of the others is linearised beside them (`NearLanes`).
    """
    coordinates, holding = equilibrium(plant, law, orders)
    own = plant.arm, plant.passive, coordinates, timing.step_s, plant.numbers["bodies.mass"]
    lanes = Lanes(*own) if leading is None else NearLanes(*own, leading)
    state, given = plant.motor.holding(holding / plant.gain)
    late = Latency.of(plant.numbers["servo.latency"] / timing.step_s, given)
    control = law.begin(_sample(plant, orders, 0, lanes, state), given)
    waiting, damper = deque([given] * timing.delay_steps), _damper(plant, coordinates, timing.step_s)
    added = orders.excitation / plant.spring.ratio[:, None]
    shape = -(-timing.ticks // timing.every), len(coordinates)
    sizes = [coordinates.shape[1]] * 2 + [holding.shape[1]] * 3
    found = SimulatedMotion(*(np.empty((*shape, size)).swapaxes(0, 1) for size in sizes), every=timing.every)
    for tick in range(timing.ticks):
        check()
        sample = _sample(plant, orders, tick, lanes, state)
        command, control = law.act(control, sample)
        command = command + added[:, tick]
        row, kept = tick // timing.every, tick % timing.every == 0
        if kept:
            found.coordinates[:, row], found.velocities[:, row] = lanes.position, lanes.velocity / 2
            found.current[:, row], found.command[:, row] = plant.motor.current(state), command
            found.torque[:, row] = plant.spring.ratio * plant.motor.torque(state)
        for step in range(timing.steps_per_tick):
            waiting.append(command)
            now = waiting.popleft()
            state = _step(plant, lanes, state, now if late is None else late.passed(now), damper)
            if kept and step == 0:
                found.velocities[:, row] += lanes.velocity / 2
    return found


@dataclass
class Latency:
    """Commands that reach motors late by so many steps, (lanes, joints), parts of one as a mean of two; past:
    those of the last steps, (steps, lanes, joints), in a ring.
    """

    whole: Index
    part: Array
    past: Array
    step: int = 0

    @classmethod
    def of(cls, steps: Array, given: Array) -> Latency | None:
        """With commands that were `given` (lanes, joints) for long; None where nothing is late."""
        if not steps.any():
            return None
        whole = np.floor(steps).astype(int)
        return cls(whole, steps - whole, np.repeat(given[None], int(whole.max()) + 2, axis=0))

    def passed(self, command: Array) -> Array:
        """What arrives as a command (lanes, joints) is given."""
        self.past[self.step % len(self.past)] = command
        rows = (self.step - np.stack([self.whole, self.whole + 1])) % len(self.past)
        new, old = np.take_along_axis(self.past, rows, axis=0)
        self.step += 1
        return np.asarray((1 - self.part) * new + self.part * old)


def side_by_side(motions: Sequence[SimulatedMotion]) -> SimulatedMotion:
    """Motions of as many lanes each, (m, ticks, n), as one whose lanes run through them first (m * motions,
    ...); shorter ones stand still at their end.
    """
    ticks = max(motion.coordinates.shape[1] for motion in motions)

    def together(rows: Sequence[Array]) -> Array:
        longer = [np.pad(row, ((0, 0), (0, ticks - row.shape[1]), (0, 0)), "edge") for row in rows]
        return np.stack(longer, axis=1).reshape(-1, *longer[0].shape[1:])

    parts = zip(*(motion.arrays for motion in motions), strict=True)
    return SimulatedMotion(*(together(rows) for rows in parts), every=motions[0].every)


def extrapolated(coarse: SimulatedMotion, fine: SimulatedMotion) -> SimulatedMotion:
    """A motion to a step of none, out of one at a step and one at half of it."""
    pairs = zip(coarse.arrays, fine.arrays, strict=True)
    return SimulatedMotion(*(2 * half - whole for whole, half in pairs), every=coarse.every)


def equilibrium(plant: Plant, law: ControlLaw, orders: Orders) -> tuple[Array, Array]:
    """Coordinates (lanes, n) at rest under gravity with the controller at its first command; motor torques
    (lanes, joints) that hold.
    """
    arm, ratio, gain = plant.arm, plant.spring.ratio, plant.gain
    coordinates = np.zeros((len(orders.position), len(arm.names)))
    coordinates[:, arm.drive] = orders.position[:, 0]
    joint, wound = plant.wound
    for _ in range(6):
        weight = plant.weight(coordinates)
        coordinates[:, arm.elastic] = -weight[:, arm.elastic] / plant.passive.stiffness[:, arm.elastic]
        turn = coordinates[:, arm.drive]
        error, slope = plant.spring.transmission_error(turn)
        torque = np.zeros_like(turn)
        torque[:, joint] = -weight[:, wound]
        coordinates[:, wound] = (plant.spring.windup(torque) + error)[:, joint]
        holding = (weight[:, arm.drive] - torque * slope) / ratio
        coordinates[:, arm.drive] = orders.position[:, 0] - law.standing_error(
            plant.motor.holding(holding / gain)[1]
        )
    return coordinates, holding


def _damper(plant: Plant, coordinates: Array, step_s: float) -> FrictionDamper | None:
    """The friction of the drives, seen from coordinates (lanes, n); None where there is none."""
    if not plant.rubs:
        return None
    viscous = plant.spring.ratio**2 * plant.numbers["motor.viscous"]
    inertia = _own_inertia(plant, coordinates)
    return FrictionDamper(plant.numbers, viscous, inertia, step_s, plant.smoothing)


def _own_inertia(plant: Plant, coordinates: Array) -> Array:
    """What a push on each drive accelerates while all else gives way, kg m^2, (lanes, joints), at coordinates
    (lanes, n).
    """
    mass = np.array([plant.arm.mass_matrix(row) for row in coordinates])
    mass += np.eye(mass.shape[1]) * plant.passive.armature[:, None]
    return np.asarray(1 / np.linalg.inv(mass)[:, plant.arm.drive, plant.arm.drive])


def _step(plant: Plant, lanes: Lanes, state: Array, command: Array, damper: FrictionDamper | None) -> Array:
    """One step of arm and motors under a command; the motors' state a step later."""
    drive, ratio = plant.drive, plant.spring.ratio
    lanes.force[:] = 0.0
    if plant.balanced:
        lanes.force[:] = plant.balance(lanes.position)
    lanes.force[:, drive] += ratio * plant.gain * plant.motor.torque_at(state, command)
    if plant.spring.nonlinear:
        on_drive, on_windup = _spring_forces(plant, lanes)
        lanes.force[:, drive] += on_drive
        joint, wound = plant.wound_by
        lanes.force[:, wound] += on_windup[:, joint]
    if damper is None:
        lanes.advance()
    else:
        damper.begin()

        def rubbing(velocity: Array) -> Array:
            dampers = np.zeros(velocity.shape)  # takes a tenth of the time of `zeros_like`
            dampers[:, drive] = damper(velocity[:, drive])
            return dampers

        lanes.advance(rubbing)
    return plant.motor.advanced(state, command, ratio * lanes.velocity[:, drive], lanes.step_s)


def _spring_forces(plant: Plant, lanes: Lanes) -> tuple[Array, Array]:
    joint, wound = plant.wound_by
    turn = lanes.position[:, plant.drive]
    delta = np.zeros_like(turn)
    delta[:, joint] = lanes.position[:, wound]
    return plant.spring.beyond_linear(turn, delta)


def _sample(plant: Plant, orders: Orders, tick: int, lanes: Lanes, state: Array) -> Sample:
    turn = lanes.position[:, plant.drive]
    if plant.counts:
        grain = plant.resolution / plant.spring.ratio
        turn = np.where(grain > 0, np.round(turn / np.where(grain > 0, grain, 1.0)) * grain, turn)
    current = plant.motor.current(state)
    position, velocity, feedforward = (
        rows[:, tick] for rows in (orders.position, orders.velocity, orders.feedforward)
    )
    twist = None if orders.twist is None else _twist(plant, orders.twist, tick, lanes, turn)
    return Sample(tick, position, velocity, feedforward, turn, current, orders.mode_hz[:, tick], twist)


def _twist(plant: Plant, ordered: Twist, tick: int, lanes: Lanes, turn: Array) -> Twist:
    """Measured by encoders of motor and link, less what the command takes."""
    link = lanes.position[:, plant.arm.drive].copy()
    joint, wound = plant.wound
    link[:, joint] += lanes.position[:, wound]
    wanted, stiffness, damping = (
        rows[:, tick] for rows in (ordered.value, ordered.stiffness, ordered.damping)
    )
    return Twist(turn - link - wanted, stiffness, damping)

"""What a motion tells: the information of its records on what is to be found, for white noise as stated."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from identify.core.arrays import Array, Mask
from identify.core.errors import InputError
from identify.core.thresholds import SIGMAS_95
from identify.excite.limits import Limits, per_joint
from identify.excite.series import PeriodicMotion
from identify.excite.study import ExciteStudy
from identify.joints.base_set import UNITS, BaseSet, all_columns, at_states, standard_values
from identify.model.laws.gear import harmonic, per_joint_turn
from identify.robot.description import Robot

_STATES = 60


@dataclass(frozen=True)
class Experiment:
    """Parameters (p,) by name and unit, and what is expected of them; wanted: those that are to be known
    best; columns: of a motion, (samples, rows, p), and which samples count, (samples, rows); noise (rows,):
    standard deviation of a sample; rows: joints from 0; chosen: what torques depend on, where they are
    recorded.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    expected: Array
    wanted: Mask
    columns: Callable[[PeriodicMotion], tuple[Array, Mask]]
    noise: Array
    rows: tuple[int, ...]
    chosen: BaseSet | None = None

    def information(self, motion: PeriodicMotion, motions: int = 1) -> Array:
        """(motions, p, p) per sample of the motion, or of several of the same length in a row."""
        columns, used = self.columns(motion)
        weighed = np.where(used[:, :, None], columns / self.noise[:, None], 0.0)
        rows = weighed.reshape(motions, -1, columns.shape[2])
        return np.asarray(np.swapaxes(rows, 1, 2) @ rows) * motions / len(columns)

    def score(self, information: Array) -> Array:
        """(...,): the determinant for what is wanted, all else found along (D_s-optimality, Atkinson, Donev
        and Tobias 2007, section 10.3), natural logarithm; minus infinity where something is not seen.
        """
        scale = 1 / np.sqrt(np.maximum(np.diagonal(information, axis1=-2, axis2=-1), 1e-300))
        unit = information * scale[..., :, None] * scale[..., None, :]
        whole = _log_determinant(unit) - 2 * np.log(scale).sum(axis=-1)
        rest = ~self.wanted
        if not rest.any():
            return np.asarray(whole)
        part = unit[..., rest, :][..., :, rest]
        return np.asarray(whole - (_log_determinant(part) - 2 * np.log(scale[..., rest]).sum(axis=-1)))

    def half(self, information: Array, samples: float) -> Array:
        """(p,): half the 95 % interval by so many samples; infinite where something is not seen."""
        scale = 1 / np.sqrt(np.maximum(np.diag(information), 1e-300))
        unit = information * np.outer(scale, scale)
        if np.linalg.eigvalsh(unit)[0] < 1e-12:
            return np.full(len(unit), np.inf)
        return np.asarray(SIGMAS_95 * scale * np.sqrt(np.diag(np.linalg.inv(unit)) / samples))


def _log_determinant(matrix: Array) -> Array:
    sign, size = np.linalg.slogdet(matrix)
    return np.asarray(np.where(sign > 0, size, -np.inf))


def experiment_of(study: ExciteStudy, robot: Robot, limits: Limits) -> Experiment:
    """What is asked of the motions of a study; InputError where drives or noise do not fit the robot."""
    if study.target == "transmission-error":
        return _waves(study, robot, limits)
    return _torques(study, robot, limits)


def noise_of(given: float | list[float] | None, count: int, key: str) -> Array:
    """(joints,); InputError for another number of them, or for none above zero where one is needed."""
    if given is None:
        raise InputError(
            key, "nothing", "a standard deviation", f"add `{key.rpartition('.')[2]}:` to `noise`"
        )
    return per_joint([given] * count if isinstance(given, (int, float)) else given, count, key)


def true_values(study: ExciteStudy, robot: Robot, names: tuple[str, ...]) -> Array:
    """What is expected of all parameters of the torques, in the order of `all_names`."""
    count, drives = len(robot.joints), study.drives
    per = {
        "fc": per_joint(drives.coulomb_nm or [0.0] * count, count, "drives.coulomb_nm"),
        "fv": per_joint(drives.viscous_nm_s_per_rad or [0.0] * count, count, "drives.viscous_nm_s_per_rad"),
        "ia": rotors_of(study, count),
        "offset": np.zeros(count),
    }
    inertial = standard_values(robot)
    own = []
    for name in names[len(inertial) :]:
        joint, what = name.rsplit(".", 1)
        own.append(per[what][int(joint.removeprefix("joint")) - 1])
    return np.concatenate([inertial, own])


def rotors_of(study: ExciteStudy, count: int) -> Array:
    """Inertia of the rotors at the joints (joints,), kg m^2; zero where none is stated."""
    drives = study.drives
    if drives.rotor_inertia_kg_m2 is None:
        return np.zeros(count)
    if drives.gear_ratio is None:
        raise InputError("drives.gear_ratio", "nothing", "one per joint, for the rotors", "add it")
    ratio = per_joint(drives.gear_ratio, count, "drives.gear_ratio")
    return np.asarray(ratio**2 * per_joint(drives.rotor_inertia_kg_m2, count, "drives.rotor_inertia_kg_m2"))


def _torques(study: ExciteStudy, robot: Robot, limits: Limits) -> Experiment:
    rows = tuple(int(n) for n in limits.moving)
    chosen = _moved_set(robot, limits, study.drives.rotor_inertia_kg_m2 is None)
    slow, kept = np.radians(study.stationary_below_deg_per_s), list(chosen.kept)

    def columns(motion: PeriodicMotion) -> tuple[Array, Mask]:
        found = all_columns(robot, rows, motion.position, motion.velocity, motion.acceleration)
        return found[:, :, kept], np.abs(motion.velocity[:, rows]) > slow

    names = tuple(chosen.names[n] for n in kept)
    units = tuple(UNITS[name.rsplit(".", 1)[1]] for name in names)
    friction = np.array([name.endswith((".fc", ".fv")) for name in names])
    wanted = friction if study.target == "friction" else np.ones(len(names), dtype=bool)
    noise = noise_of(study.noise.torque_nm, len(robot.joints), "noise.torque_nm")[list(rows)]
    expected = chosen.regrouping @ true_values(study, robot, chosen.names)
    noise = _positive(noise, "noise.torque_nm")
    return Experiment(names, units, expected, wanted, columns, noise, rows, chosen)


def _moved_set(robot: Robot, limits: Limits, rotors: bool) -> BaseSet:
    """What the torques of the joints that move depend on while all others stand; rotors: whether their
    inertias are to be found.
    """
    rng, shape, moving = np.random.default_rng(1), (_STATES, len(robot.joints)), limits.moving
    position, velocity, acceleration = np.tile(limits.posture, (_STATES, 1)), np.zeros(shape), np.zeros(shape)
    for values, reach in ((position, 3.0), (velocity, 2.0), (acceleration, 5.0)):
        values[:, moving] = rng.uniform(-reach, reach, (_STATES, len(moving)))
    return at_states(robot, moving.tolist(), (position, velocity, acceleration), rotors)


def _waves(study: ExciteStudy, robot: Robot, limits: Limits) -> Experiment:
    """Link less motor position: a zero, the wind-up by the torque of the links, and waves over the motor."""
    rows, count = tuple(int(n) for n in limits.moving), len(robot.joints)
    if study.drives.gear_ratio is None or not study.drives.orders:
        raise InputError("drives", "no gear_ratio or orders", "both, for transmission errors", "add them")
    ratio = per_joint(study.drives.gear_ratio, count, "drives.gear_ratio")
    orders, below = study.drives.orders, 2 * np.pi * study.drives.waves_below_hz
    inertial = standard_values(robot)
    what = [("zero", "rad"), ("compliance", "rad/(N m)")]
    what += [(f"wave{order:g}.{part}", "rad") for order in orders for part in ("cosine", "sine")]

    def columns(motion: PeriodicMotion) -> tuple[Array, Mask]:
        moved = motion.position, motion.velocity, motion.acceleration
        load = all_columns(robot, rows, *moved)[:, :, : len(inertial)] @ inertial
        found = np.zeros((len(load), len(rows), len(rows) * len(what)))
        for place, row in enumerate(rows):
            turn = [per_joint_turn(order, ratio[row]) for order in orders]
            waves = [wave for order in turn for wave in harmonic(motion.position[:, row], order)]
            first = place * len(what)
            own = np.stack([np.ones(len(load)), load[:, place], *waves], axis=1)
            found[:, place, first : first + len(what)] = own
        fastest = max(orders) * ratio[list(rows)] * np.abs(motion.velocity[:, rows])
        return found, (fastest < below) & (fastest > 0.02 * below)

    names = tuple(f"joint{row + 1}.{name}" for row in rows for name, _ in what)
    wanted = np.array([".wave" in name for name in names])
    noise = np.radians(noise_of(study.noise.deflection_deg, count, "noise.deflection_deg")[list(rows)])
    units = tuple(unit for _ in rows for _, unit in what)
    return Experiment(
        names,
        units,
        np.full(len(names), np.nan),
        wanted,
        columns,
        _positive(noise, "noise.deflection_deg"),
        rows,
    )


def _positive(noise: Array, key: str) -> Array:
    if not (noise > 0).all():
        raise InputError(key, f"{float(noise.min()):g}", "standard deviations above zero")
    return noise

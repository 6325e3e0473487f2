"""Torques of recorded motion of a whole arm, and the columns of `identify.joints.base_set` they are fitted
by: what curves of rigid bodies share.

Joints are weighted by what is left of each (Gautier 1997) in a second pass; speed and acceleration come from
behind the low-pass of the study, torques are as recorded.  Where a rotor's inertia cannot be distinguished
from a link's, it goes to the link's.

Wrist motors that turn with two joints: which samples they move in, and whether what is left of the torques
asks for such a coupling that the study does not state.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pydantic import Field

from identify.core.arrays import Array, Mask
from identify.core.correlated import log_likelihood_gain
from identify.core.errors import InputError
from identify.core.separable import eliminate
from identify.joints.base import Curve
from identify.joints.base_set import BaseSet, all_columns, coupled, motor_columns, of_robot
from identify.joints.data import JointTestData
from identify.measured.conditioning import ConditionedMotion
from identify.measured.records import check_different
from identify.results.joints import Panel, Series
from identify.robot.description import Robot

_WORSE = 1.5
"""RMS of what is left of a run that was not fitted, over that of the fitted ones, from which a reader is
warned.
"""
_WRIST = 3
"""First joint (from 0) of a wrist."""
_SURE, _PART = 10.0, 0.1
"""Gain in log likelihood, and part of the squares left at the two joints, from which a coupling is asked
for.
"""


@dataclass(frozen=True)
class ArmRun:
    """columns (samples, rows, base parameters); torque less that of known rotors, and samples that count,
    (samples, rows).
    """

    motion: ConditionedMotion
    columns: Array
    torque: Array
    used: Mask


@dataclass(frozen=True)
class ArmRegression:
    """All runs of a curve, those that are fitted in a row: columns (samples, rows, b), torque and used
    (samples, rows); values (b,) and weights (rows,) of least squares; rows: joints from 0.
    """

    robot: Robot
    rows: Sequence[int]
    chosen: BaseSet
    runs: list[ArmRun]
    judges: list[ArmRun]
    columns: Array
    torque: Array
    used: Mask
    values: Array
    weights: Array

    def left(self, values: Array) -> Array:
        """(samples, rows), N m: what base parameters (b,) leave; 0 where samples do not count."""
        return np.where(self.used, self.torque - self.columns @ values, 0.0)

    def rms(self, values: Array) -> float:
        """Of what is left, N m."""
        return float(np.sqrt((self.left(values)[self.used] ** 2).mean()))

    def panels(self, values: Array) -> dict[str, Panel]:
        """Measured and identified torque of every joint and run."""
        return {
            f"{run.motion.name}, joint {row + 1}{how}": _panel(run, values, n)
            for run, how in self._judged()
            for n, row in enumerate(self.rows)
        }

    def said(self, values: Array) -> list[str]:
        """What is left of each run, and how it was conditioned."""
        rests = [_rest(run, values, self.rows, how) for run, how in self._judged()]
        return [*rests, *self.runs[0].motion.said]

    def notes(self, values: Array, coupled: bool) -> tuple[str, ...]:
        """Runs that are not foretold, and a coupling that the residual asks for where none is stated."""
        found = _warned(self.judges, values, self.rms(values))
        if coupled:
            return found
        motions = [run.motion for run in self.runs]
        asked = coupling_asked(motions, self.rows, self.columns, self.torque, self.used, self.weights)
        return found + asked

    def _judged(self) -> list[tuple[ArmRun, str]]:
        return [(run, "") for run in self.runs] + [(run, ", not fitted") for run in self.judges]


class ArmMotion(Curve):
    """Motion of the whole arm."""

    joints: list[int] | None = Field(None, description="the joints whose torques are used; default: all")
    judge: list[Path] = Field([], description="runs that are not fitted, to judge by")
    rotor_inertia_kg_m2: list[float] | None = Field(
        None, description="at the motor, where it is known; default: identified"
    )

    def regression(self, bench: JointTestData) -> ArmRegression:
        """The runs and their least squares; InputError where they cannot be read or a joint never moves."""
        robot = bench.rigid(self.label)
        rows = [bench.checked(joint, self.label) for joint in self.joints or range(1, bench.joints + 1)]
        motions, judged = (
            [self._motion(bench, path) for path in paths] for paths in (self.files, self.judge)
        )
        check_different([(run.name, _recorded(run)) for run in (*motions, *judged)])
        stances = np.array([_stance(motion, bench) for motion in motions])
        chosen = of_robot(robot, rows, self.rotor_inertia_kg_m2 is None, bench.coupling, stances)
        runs, judges = (
            [self._run(bench, robot, rows, chosen, motion) for motion in some] for some in (motions, judged)
        )
        columns, torque, used = (
            np.concatenate([getattr(run, what) for run in runs]) for what in ("columns", "torque", "used")
        )
        if not used.any(axis=0).all():
            raise InputError(
                self.label, "a joint that stands all the time", "motion of every joint in use", "see `joints`"
            )
        values, weights = weighted_least_squares(columns, torque, used)
        return ArmRegression(robot, rows, chosen, runs, judges, columns, torque, used, values, weights)

    def _motion(self, bench: JointTestData, path: Path) -> ConditionedMotion:
        return bench.motion(
            path, ("motor_position", bench.torque_quantity()), range(bench.joints), self.label
        )

    def _run(
        self,
        bench: JointTestData,
        robot: Robot,
        rows: Sequence[int],
        chosen: BaseSet,
        motion: ConditionedMotion,
    ) -> ArmRun:
        history = motion.position, motion.velocity, motion.acceleration
        columns = all_columns(robot, rows, *history, bench.coupling)[:, :, list(chosen.kept)]
        torque = motion.torque[:, rows].copy()
        if self.rotor_inertia_kg_m2 is not None:
            if len(self.rotor_inertia_kg_m2) != bench.joints:
                found = f"{len(self.rotor_inertia_kg_m2)} numbers"
                raise InputError(
                    f"{self.label}, key rotor_inertia_kg_m2", found, f"{bench.joints}, one per joint"
                )
            turns = np.eye(bench.joints) if bench.coupling is None else bench.coupling
            drives = (
                bench.gear_ratio**2 * np.array(self.rotor_inertia_kg_m2) * (motion.acceleration @ turns.T)
            )
            torque -= (drives @ turns)[:, rows]
        return ArmRun(motion, columns, torque, moving(motion, rows, bench))


def weighted_least_squares(columns: Array, torque: Array, used: Mask) -> tuple[Array, Array]:
    """Values (b,), joints weighted by one over what the first pass leaves of each, and the weights
    (rows,).
    """
    weights = np.ones(torque.shape[1])
    for _ in range(2):
        values = eliminate((columns * weights[:, None])[used], (torque * weights)[used]).coefficients
        left = np.where(used, torque - columns @ values, 0.0)
        final, weights = weights, 1 / np.maximum(np.sqrt((left**2).sum(axis=0) / used.sum(axis=0)), 1e-12)
    return values, final


def _recorded(motion: ConditionedMotion) -> dict[str, Array]:
    return {"position": motion.position, "torque": motion.torque}


def _stance(motion: ConditionedMotion, bench: JointTestData) -> Array:
    """(joints,), rad: where joints stand through a whole run; NaN of those that move."""
    moves = np.any(motion.inside[:, None] & (np.abs(motion.velocity) > bench.slow), axis=0)
    return np.where(moves, np.nan, motion.position[motion.inside].mean(axis=0))


def _rest(run: ArmRun, values: Array, rows: Sequence[int], judged: str) -> str:
    """What is left of each joint's torque."""
    left = run.torque - run.columns @ values
    parts = []
    for place, row in enumerate(rows):
        used = run.used[:, place]
        rms, whole = float(np.sqrt((left[used, place] ** 2).mean())), float(run.torque[used, place].std())
        parts.append(f"joint {row + 1} {rms:.3g} N m ({100 * rms / whole:.2g} % of its standard deviation)")
    return f"{run.motion.name}{judged}, RMS left: {', '.join(parts)}"


def _warned(judges: Sequence[ArmRun], values: Array, rms: float) -> tuple[str, ...]:
    """A note for each run that is not foretold about as well as those that were fitted."""
    left = {run.motion.name: (run.torque - run.columns @ values)[run.used] for run in judges}
    worse = {name: float(np.sqrt((one**2).mean())) / rms for name, one in left.items()}
    fix = "the fitted motion excites too little, so values may fit errors of the model"
    return tuple(
        f"{name}, not fitted, is predicted {ratio:.2g} times worse; {fix}"
        for name, ratio in worse.items()
        if ratio > _WORSE
    )


def _panel(run: ArmRun, values: Array, place: int) -> Panel:
    used, time_s = run.used[:, place], run.motion.time_s
    measured, model = (
        np.where(used, torque, np.nan) for torque in (run.torque[:, place], (run.columns @ values)[:, place])
    )
    return Panel(
        "Time",
        "s",
        "Torque",
        "N m",
        {"measured": Series("noisy", time_s, measured), "identified": Series("line", time_s, model)},
    )


def moving(motion: ConditionedMotion, rows: Sequence[int], bench: JointTestData) -> Mask:
    """Samples (samples, rows) at which a joint moves, and every coupled motor that acts on it."""
    used = motion.inside[:, None] & (np.abs(motion.velocity[:, rows]) > bench.slow)
    if bench.coupling is not None:
        for drive in coupled(bench.coupling):
            standing = np.abs(motion.velocity @ bench.coupling[drive]) <= bench.slow
            used &= ~(standing[:, None] & (bench.coupling[drive][list(rows)] != 0))
    return np.asarray(used)


def coupling_asked(
    motions: Sequence[ConditionedMotion],
    rows: Sequence[int],
    columns: Array,
    torque: Array,
    used: Mask,
    weights: Array,
) -> tuple[str, ...]:
    """A sentence on the coupling of two wrist joints that explains most of what is left, if one explains
    much; none otherwise.

    columns (samples, rows, p), torque and used (samples, rows) of all motions in a row; weights (rows,).
    """
    velocity, acceleration = (
        np.concatenate([getattr(m, what) for m in motions]) for what in ("velocity", "acceleration")
    )

    def left(wanted: Array) -> Array:
        found = eliminate((wanted * weights[:, None])[used], (torque * weights)[used])
        return np.where(used, torque - wanted @ found.coefficients, 0.0)

    before, best = left(columns), ("", _PART)
    for drive, other, share in _pairs(rows):
        matrix = np.eye(velocity.shape[1])
        matrix[drive, other] = share
        extra = motor_columns(drive, rows, matrix, velocity, acceleration)
        after = left(np.concatenate([columns, extra], axis=2))
        places = [rows.index(drive), rows.index(other)]
        part = 1 - float((after[:, places] ** 2).sum() / (before[:, places] ** 2).sum())
        gain = sum(log_likelihood_gain(before[:, n], after[:, n], used[:, n])[0] for n in places)
        if part > best[1] and gain > _SURE:
            best = _sentence(drive, other, share, part), part
    return (best[0],) if best[0] else ()


def _pairs(rows: Sequence[int]) -> Iterator[tuple[int, int, float]]:
    """Motor, the joint before it that it may turn with besides its own, and how far; either way round, both
    joints feel the same friction of the same sum.
    """
    wrist = [row for row in rows if row >= _WRIST]
    for drive in wrist:
        for other in wrist:
            if other < drive:
                yield from ((drive, other, share) for share in (-1.0, 1.0))


def _sentence(drive: int, other: int, share: float, part: float) -> str:
    return (
        f"if motor {drive + 1} also turns {share:+g} times with joint {other + 1}, its friction and inertia"
        f" explain {100 * part:.0f} % of the squared residual of joints {drive + 1} and {other + 1}: if the"
        " wrist is built so, state `coupling`; otherwise friction and inertia of the two are not reliable"
    )

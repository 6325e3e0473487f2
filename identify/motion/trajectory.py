"""Costs on trajectories: simulated beside recorded signals, their RMS differences (Kawasaki Table 3), and
what optimizers minimise.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import ClassVar

import numpy as np

from identify.core.arrays import Array, Index
from identify.core.errors import InputError
from identify.core.parameters import Scale
from identify.fitting.jackknife import block_jackknife, widening
from identify.fitting.objective import Objective
from identify.fitting.uncertainty import Uncertainty, of_covariance
from identify.motion.problem import MotionProblem
from identify.motion.recording import TOOL, PreparedRecord
from identify.motion.simulate import SimulatedMotion

_BLOCK = 20
"""Samples of a record that are one block of the jackknife: longer than residuals are correlated, and many to
a move.
"""
_LANES = 200
"""Lanes that move side by side at most: enough to spread the cost of a step, little enough to stay in the
cache.
"""
_TOGETHER = 50
"""Lanes up to which a step costs about as much as that of one."""
_AS_FAST = 12
"""Coordinates up to which the engine moves a copy of an arm about as fast as linear algebra does."""
_AT_TICK = 1e-6
"""Part of a tick within which a sample is at it."""
_DIFFERENCE = 1e-3
"""Relative step of differences: well above what sticking makes of a smaller one."""


class TrajectoryObjective(Objective):
    """Simulated less recorded signals over their noise; a whole population moves side by side."""

    expensive: ClassVar[bool] = True

    def __init__(
        self,
        problem: MotionProblem,
        records: Sequence[PreparedRecord],
        noise: Mapping[str, float | list[float] | Array],
    ) -> None:
        self.problem = problem
        self.noise = {quantity: np.asarray(value, dtype=float) for quantity, value in noise.items()}
        """By quantity, () or (joints,)."""
        self._seen = deque[tuple[Array, Index, Array]](maxlen=2)
        """Of the last two: values, what is free, and residuals there and a step along each."""
        self._wanted: Index | None = None
        self.records = [r for r in records if any(q in r.recorded for q in noise)]
        if not self.records:
            found = "no record to be fitted has a signal whose noise is given"
            raise InputError(
                "noise",
                found,
                "the standard deviation of measured signals",
                "add for example `noise: {motor_current: 0.1}`",
            )

    def costs(self, candidates: Array) -> Array:
        """(m,): the RMS of the residuals; inf where the motion runs away.

        Where no encoder counts, of one candidate they are known already where residuals have just been
        computed, and those that will be asked for next, if a step to it is taken, are computed along with it.
        """
        if len(candidates) == 1 and self.problem.file.study.encoder_counts is None:
            known = next((rows for at, _, rows in self._seen if _same(at, candidates[0])), None)
            if known is not None:
                return _rms(known[:1])
            wanted, self._wanted = self._wanted, None  # a step that is not taken asks for none
            if wanted is not None and (len(wanted) + 1) * len(self.records) <= _TOGETHER:
                return _rms(self._beside(candidates[0], wanted)[:1])
        return self.costs_of(self.rows(candidates))

    def costs_of(self, rows: list[list[Array]]) -> Array:
        """Those of `rows`."""
        return _rms(self._flat(rows))

    def residuals(self, values: Array, free: Index) -> tuple[Array, Array]:
        """Residuals over the root of their number, so that their sum of squares is the squared cost, and
        forward differences.

        Both with continuous encoders: a count more or less, at each tick by chance, would drown the
        differences.
        """
        self._wanted = free
        steps = self._steps(values, free)
        rows = self._beside(values, free) / np.sqrt(self.count)
        return rows[0], ((rows[1:] - rows[0]) / steps[:, None]).T

    def _steps(self, values: Array, free: Index) -> Array:
        return np.array([_step(self.problem, number, values[number]) for number in free])

    def _beside(self, values: Array, free: Index) -> Array:
        """Residuals over noise (free + 1, count) at values (parameters,) and a step along each of the free,
        with continuous encoders.
        """
        for at, moved_there, rows in self._seen:
            if _same(at, values) and np.array_equal(moved_there, free):
                return rows
        moved = np.tile(values, (len(free) + 1, 1))
        moved[1 + np.arange(len(free)), free] += self._steps(values, free)
        found = self.near_rows(moved)
        self._seen.append((values.copy(), free.copy(), found))
        return found

    def smooth(self, values: Array) -> Array:
        """Residuals (count,) as `residuals` gives them, without derivatives."""
        return np.asarray(self.near_rows(values[None])[0] / np.sqrt(self.count))

    def near_rows(self, candidates: Array) -> Array:
        """Residuals over noise (m, count) of candidates (m, parameters) near the first, with continuous
        encoders; of an arm of many coordinates all but the first to first order.
        """
        smooth = TrajectoryObjective(self.problem.continuous, self.records, self.noise)
        near = len(candidates) > 1 and len(self.problem.arm.names) > _AS_FAST
        return smooth._flat(smooth._near(candidates) if near else smooth.rows(candidates))

    @property
    def count(self) -> int:
        """How many numbers were measured."""
        return sum(
            int(np.isfinite(measured).sum()) for record in self.records for measured in self._measured(record)
        )

    def rows(self, candidates: Array) -> list[list[Array]]:
        """Residuals over noise, (m, samples, joints) per record and signal, NaN where nothing was
        measured.
        """
        return _joined([self._chunk(chunk) for chunk in self._chunks(candidates)])

    def _near(self, candidates: Array) -> list[list[Array]]:
        """The same, all but the first beside it."""
        first = candidates[:1]
        parts = [self._chunk(np.vstack([first, c]), near=True) for c in self._chunks(candidates[1:])]
        others = [[[signal[1:] for signal in record] for record in part] for part in parts]
        return _joined([[[signal[:1] for signal in record] for record in parts[0]], *others])

    def _chunks(self, candidates: Array) -> list[Array]:
        size = max(1, _LANES // len(self.records))
        return [candidates[first : first + size] for first in range(0, len(candidates), size)]

    def _chunk(self, candidates: Array, *, near: bool = False) -> list[list[Array]]:
        with np.errstate(all="ignore"):  # a lane that runs away is NaN
            motion = self.problem.run(candidates, self.records, near=near, every=self._every)
            return self.of_motion(motion, self.records)

    def of_motion(self, motion: SimulatedMotion, together: Sequence[PreparedRecord]) -> list[list[Array]]:
        """`rows` of a motion in which all records of `together` moved side by side, its own among them."""
        numbers = [next(n for n, one in enumerate(together) if one is record) for record in self.records]
        return [
            [
                beside(quantity, seen, record, self.noise[quantity]) / self.noise[quantity]
                for quantity, seen in simulated(self.problem, motion, record, number, len(together)).items()
                if quantity in self.noise
            ]
            for number, record in zip(numbers, self.records, strict=True)
        ]

    @cached_property
    def _every(self) -> int:
        """Ticks between those of which something was measured, where all samples are at ticks."""
        read = [record for record in self.records if record.measured is not None]
        times = [record.measured.time_s for record in read if record.measured is not None]
        places = np.concatenate(times) / self.problem.file.study.servo.period_s
        ticks = np.round(places).astype(int)
        last = max(len(record.command.position) for record in read) - 1
        at_ticks = np.abs(places - ticks).max() < _AT_TICK and 0 < ticks.max() <= last
        return int(np.gcd.reduce(ticks)) if at_ticks else 1

    def signals(self, row: Array) -> list[Array]:
        """A row (count,) as signals (samples, joints), NaN where nothing was measured."""
        found, first = list[Array](), 0
        for record in self.records:
            for measured in self._measured(record):
                used = np.isfinite(measured)
                signal, last = np.full(measured.shape, np.nan), first + int(used.sum())
                signal[used], first = row[first:last], last
                found.append(signal)
        return found

    def _flat(self, rows: list[list[Array]]) -> Array:
        """(m, count)."""
        found = []
        for record, signals in zip(self.records, rows, strict=True):
            for measured, residual in zip(self._measured(record), signals, strict=True):
                found.append(residual[:, np.isfinite(measured)])
        return np.concatenate(found, axis=1)

    @property
    def blocks(self) -> Index:
        """(count,): the block of time of each number, all signals of a record together."""
        found, first = list[Index](), 0
        for record in self.records:
            [samples] = {len(measured) for measured in self._measured(record)}
            block = first + np.minimum(np.arange(samples) // _BLOCK, max(samples // _BLOCK - 1, 0))
            for measured in self._measured(record):
                found.append(np.broadcast_to(block[:, None], measured.shape)[np.isfinite(measured)])
            first = int(block[-1]) + 1
        return np.unique(np.concatenate(found), return_inverse=True)[1]

    def _measured(self, record: PreparedRecord) -> list[Array]:
        return [signal for quantity, signal in record.recorded.items() if quantity in self.noise]


def _same(one: Array, other: Array) -> bool:
    """Whether values are the same but for the rounding of a logarithmic scale."""
    return bool(np.allclose(one, other, rtol=1e-12, atol=0.0))


def _rms(rows: Array) -> Array:
    costs = np.sqrt(np.mean(rows**2, axis=1))
    return np.where(np.isfinite(costs), costs, np.inf)


def _joined(parts: Sequence[list[list[Array]]]) -> list[list[Array]]:
    """Signals of records, a part of the lanes after the other."""
    signals = zip(*parts, strict=True)
    return [[np.concatenate(one) for one in zip(*record, strict=True)] for record in signals]


def _step(problem: MotionProblem, number: int, value: float) -> float:
    p = problem.parameters[number]
    return _DIFFERENCE * (value if p.log else (p.upper - p.lower) / 10)


def all_signals(problem: MotionProblem, motion: SimulatedMotion) -> dict[str, Array]:
    """Everything that can be measured of a motion, (lanes, ticks, joints): drive and link, rad and rad/s;
    motor torque at the gear output before friction, N m; current, A.  `problem` names the coordinates.
    """
    arm, joints = problem.arm, len(problem.robot.joints)
    windup = [
        arm.names.index(f"joint{n + 1}.rz") if f"joint{n + 1}.rz" in arm.names else -1 for n in range(joints)
    ]
    signals = {}
    for what, coordinates in (("position", motion.coordinates), ("velocity", motion.velocities)):
        turn = coordinates[..., arm.drive]
        signals[f"motor_{what}"] = turn
        signals[f"link_{what}"] = turn + np.where(np.array(windup) >= 0, coordinates[..., windup], 0.0)
    signals["motor_torque"] = motion.torque
    signals["motor_current"] = motion.current
    return signals


def simulated(
    problem: MotionProblem, motion: SimulatedMotion, record: PreparedRecord, number: int, records: int
) -> dict[str, Array]:
    """Signals of a record, the number-th of so many, as measured: (m, samples, joints) at the samples of its
    file, by quantity.
    """
    if record.measured is None:
        return {}
    period = problem.file.study.servo.period_s * motion.every
    ticks = period * np.arange(motion.coordinates.shape[1], dtype=float)
    own, time = motion.lanes(slice(number, None, records)), record.measured.time_s
    signals = all_signals(problem, own)
    found = {q: _at(signals[q], ticks, time) for q in record.recorded if q in signals}
    tool = problem.file.study.tool
    if TOOL in record.recorded and tool is not None:
        at = _at(own.coordinates, ticks, time)
        found[TOOL] = problem.arm.frame_position(at, tool.link, np.array(tool.at_m))
    return found


def beside(quantity: str, seen: Array, record: PreparedRecord, noise: Array) -> Array:
    """Simulated (..., samples, k) less what a record measured of a quantity with this noise, () or (k,); of
    the tool beyond what a tracker and the drives' zeros may be off by.
    """
    difference = seen - record.recorded[quantity]
    if quantity != TOOL or record.tool_errors is None:
        return difference
    return record.tool_errors.beyond(difference, float(np.sqrt(np.mean(np.square(noise)))))


def _at(values: Array, ticks: Array, time: Array) -> Array:
    """Linear interpolation over the second axis."""
    place = np.clip(time / ticks[1], 0, len(ticks) - 1)
    before = np.minimum(np.floor(place + 1e-9).astype(int), len(ticks) - 2)
    share = (place - before)[:, None]
    return np.asarray((1 - share) * values[:, before] + share * values[:, before + 1])


def phase_rms(difference: Array, time: Array, phases: Mapping[str, tuple[float, float]]) -> Array:
    """RMS over the whole record and over each phase, (1 + phases, joints), of a difference (samples, joints);
    NaN where nothing is.
    """
    parts = [
        np.ones(len(time), dtype=bool),
        *((time >= begin) & (time <= end) for begin, end in phases.values()),
    ]
    return np.array(
        [
            np.sqrt(np.mean(difference[part] ** 2, axis=0))
            if part.any()
            else np.full(difference.shape[1], np.nan)
            for part in parts
        ]
    )


def trajectory_trust(
    objective: TrajectoryObjective, scale: Scale, values: Array, seen: tuple[Array, Array]
) -> Uncertainty:
    """What the records say about the free parameters at values (parameters,); seen: residuals and derivatives
    there.

    By the jackknife over blocks of time, so that residuals that are correlated over samples, or that the
    model leaves in one part of a move, widen the intervals, and the more, the fewer blocks a value hangs on.
    """
    residuals, slopes = seen
    root = np.sqrt(objective.count)
    e, j = root * residuals, root * slopes * scale.slope(scale.to_x(values))
    matrix, freedom = block_jackknife(j, e, objective.blocks, scale.prior_information())
    wider = widening(freedom)
    return of_covariance(j.T @ j, matrix * np.outer(wider, wider), objective.count, scale, values)

"""What a test is planned for (parameters, a mode at a posture, or the depth limit of a cut there), and
what it promises: intervals after it, what they would be after tests at random, and what each posture,
impact and sensor is worth.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from identify.core.arrays import Array, Index
from identify.core.errors import InputError
from identify.core.thresholds import SIGMAS_95
from identify.machining.mounted import mounted
from identify.machining.one_limit import limit_at
from identify.machining.tool import Tool
from identify.model.modes import complex_modes, frequency_and_damping_gradient
from identify.planning.design import Chosen
from identify.planning.known import Known
from identify.results.plan import PromisedTable, Worth

Precision = Callable[[Chosen], Array]
"""Of a test, (u + e, u + e): inverse covariance of the unknowns after it, then of nuisance parameters."""
_MODE = re.compile(r"^mode(\d+)\.(frequency|damping)$")
_OTHERS = "mode1.frequency, mode1.damping (of any mode), depth"


@dataclass(frozen=True)
class Looked:
    """What is looked at: rows (t, p), relative derivatives of targets and parameters by the parameters;
    unknowns u: the parameters, and where two models are told apart those of the other and the difference.
    judged (t or t + 1,): which of these the test is for.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    values: Array
    rows: Array
    unknowns: int
    judged: Index

    def half(self, precision: Array) -> Array:
        """(t,): half the 95 % interval, relative; and last that of the difference, if there is one."""
        own, size = self.rows.shape[1], len(precision)
        kept = [*range(own), *range(self.unknowns, size)]
        covariance = np.linalg.inv(precision[np.ix_(kept, kept)])[:own, :own]
        found = SIGMAS_95 * np.sqrt(np.einsum("tp,pq,tq->t", self.rows, covariance, self.rows))
        if self.unknowns == own:
            return np.asarray(found)
        return np.append(found, SIGMAS_95 / np.sqrt(information_of_last(precision, self.unknowns)))

    def median(self, halves: Array) -> float:
        """Of those that the test is for."""
        return float(np.median(halves[..., self.judged]))


def information_of_last(precision: Array, unknowns: int) -> float:
    """What is known of the last of the unknowns, all others being unknown too: a Schur complement."""
    last = unknowns - 1
    others = np.delete(np.arange(len(precision)), last)
    column = precision[others, last]
    return float(precision[last, last] - column @ np.linalg.solve(precision[np.ix_(others, others)], column))


def looked_at(known: Known, targets: Sequence[Target], rival: str, unknowns: int) -> Looked:
    """Targets that are no parameters first, then all parameters, then the difference to a rival, if any."""
    others = [target for target in targets if target.name not in known.names]
    own = known.model.values[known.free]
    rows = np.array([*(one.relative for one in others), *np.diag(known.step / np.abs(own))])
    names = [*(one.name for one in others), *known.names]
    units, values = [*(one.unit for one in others), *known.units], [*(one.value for one in others), *own]
    wanted = {one.name for one in targets}
    judged = [k for k, name in enumerate(names) if not targets or name in wanted]
    if rival:
        judged = [len(names)]
        names, units, values = [*names, f"difference to {rival}"], [*units, "1"], [*values, 1.0]
    return Looked(tuple(names), tuple(units), np.array(values), rows, unknowns, np.array(judged))


def promised(
    looked: Looked, now: Array, precision: Precision, chosen: Chosen, random: Sequence[Chosen]
) -> tuple[PromisedTable, float]:
    """The table, and the median over what the test is for of how many times wider random tests leave it; now
    (u + e, u + e): precision before the test.
    """
    own = looked.half(precision(chosen))
    drawn = np.array([looked.half(precision(one)) for one in random])
    ratio = float(np.median(drawn[:, looked.judged] / own[looked.judged]))
    with np.errstate(divide="ignore"):
        before = looked.half(now)
    table = PromisedTable(looked.names, looked.units, looked.values, before, own, np.median(drawn, axis=0))
    return table, ratio


def worth_of(looked: Looked, precision: Precision, chosen: Chosen) -> Worth:
    """By how much intervals widen, at the median, where one posture, impact or sensor is left out; infinite
    where nothing would be left.
    """
    whole = looked.half(precision(chosen))[looked.judged]

    def without(axis: int, place: int) -> float:
        if len(chosen[axis]) == 1:
            return np.inf
        fewer = list(chosen)
        fewer[axis] = np.delete(chosen[axis], place)
        left = looked.half(precision((fewer[0], fewer[1], fewer[2])))[looked.judged]
        return float(np.median(left / whole))

    return Worth(*(np.array([without(axis, k) for k in range(len(chosen[axis]))]) for axis in range(3)))


def best_single(each: Array, looked: Looked) -> tuple[int, int]:
    """The one posture and impact, by their numbers, that leave the intervals narrowest at the median; each
    (postures, impacts, u, u): what is known after each pair.
    """
    halves = np.array([[np.median(looked.half(one)[looked.judged]) for one in hits] for hits in each])
    posture, impact = np.unravel_index(int(np.argmin(halves)), halves.shape)
    return int(posture), int(impact)


def gain_of(looked: Looked, before: Array, after: Array) -> float:
    """How many times a test narrows the intervals, at the median."""
    return float(np.median(looked.half(before)[looked.judged] / looked.half(after)[looked.judged]))


@dataclass(frozen=True)
class Target:
    """A quantity that is to be known: its value, and its derivatives row (p,) by the free parameters on their
    search scale.
    """

    name: str
    unit: str
    value: float
    row: Array

    @property
    def relative(self) -> Array:
        """(p,), per value."""
        return np.asarray(self.row / self.value)


def targets_of(known: Known, names: tuple[str, ...], tool: Tool | None, posture: Array) -> list[Target]:
    """The targets of these names; modes and depths at a posture (joints,), rad, depths of a tool at its
    highest spindle speed.  InputError for an unknown one.
    """
    found = []
    for name in names:
        mode = _MODE.match(name)
        if name in known.names:
            row = known.names.index(name)
            value = float(known.model.values[known.free[row]])
            step = known.step[row] * np.eye(len(known.names))[row]
            found.append(Target(name, known.units[row], value, step))
        elif mode is not None:
            found.append(_of_mode(known, name, int(mode[1]), mode[2], posture))
        elif name == "depth":
            found.append(_of_depth(known, tool, posture))
        else:
            expected = "one of " + ", ".join(known.names) + ", or " + _OTHERS
            raise InputError("--target", f"no free parameter {name!r}", expected)
    return found


def _of_mode(known: Known, name: str, number: int, what: str, posture: Array) -> Target:
    system = known.model.system(posture)
    modes = complex_modes(*system.matrices(known.model.values))
    if not 1 <= number <= len(modes.eigenvalues):
        raise InputError("--target", f"no mode {number}", f"a number from 1 to {len(modes.eigenvalues)}")
    slopes = frequency_and_damping_gradient(modes, system.factors, len(known.model.values))
    values, of = (modes.frequency_hz, "Hz") if what == "frequency" else (modes.damping_ratio, "1")
    row = slopes[what == "damping"][number - 1, known.free] * known.step
    return Target(name, of, float(values[number - 1]), row)


def _of_depth(known: Known, tool: Tool | None, posture: Array) -> Target:
    if tool is None:
        raise InputError("--target depth", "no milling tool", "`--cutter tool.yaml`")
    on = mounted(known.model, tool, posture, "--cutter")
    rpm = tool.spindle_rpm[1]
    depth, _, exact = limit_at(on, rpm)
    if exact is None:
        found = "no limit there" if np.isinf(depth) else "a limit without slopes"
        raise InputError("--target depth", f"{found}, at {rpm:,.0f} rpm", "a cut that chatters")
    by = on.uncertain.slopes(exact.lines_hz, known.free)
    row = np.einsum("lij,lijp->p", exact.slope, by).real * known.step
    return Target(f"depth limit at {rpm:,.0f} rpm", "m", depth, row)

"""What amplitude has to do with a gap, before anything is fitted: do force levels disagree, and which joint's
torque could explain it?
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations

import numpy as np

from identify.core.arrays import Array, Complex
from identify.core.thresholds import QUIET
from identify.measured.frf_set import POWER
from identify.model.frf import dynamic_stiffness
from identify.vibration.costs.target import FrfTarget
from identify.vibration.given import Given
from identify.vibration.problem import Problem

_NEARLY = 0.25
"""Share of what is above noise, and of what a torque at any other coordinate leaves of it, that a torque at a
coordinate may leave there and be what is missing."""


def level_gap(problem: Problem) -> float:
    """RMS difference of FRFs measured at one posture with impacts of different strength, over its noise; NaN
    where there are none.

    1 is what noise makes of a linear robot, whatever its model.
    """
    differences = list(_differences([m.given for m in problem.measurements]))
    return float(np.sqrt(np.mean(np.concatenate(differences)))) if differences else float("nan")


def _differences(measurements: Sequence[Given]) -> Iterator[Array]:
    """Squares of the differences over their variance, pair by pair of measurements that differ in level
    alone.
    """
    for one, other in combinations(
        [m for m in measurements if m.impact is not None and m.noise is not None], 2
    ):
        if _alike(one, other) and one.noise is not None and other.noise is not None:
            change = one.data.frf - other.data.frf  # type: ignore[union-attr]
            squares = np.abs(change) ** 2 / (2 * (one.noise**2 + other.noise**2))
            yield squares[np.isfinite(squares)]


def _alike(one: Given, other: Given) -> bool:
    """Same posture, robot and channels, impacts of different strength."""
    a, b = (
        (m.posture.tolist(), m.settings.detached, m.data.outputs, m.data.inputs, m.data.frequency_hz.tolist())  # type: ignore[union-attr]
        for m in (one, other)
    )
    return a == b and one.impact != other.impact


def torque_gaps(targets: Sequence[FrfTarget], values: Array) -> dict[str, float]:
    """By coordinate, the gap that would remain if any torque whatever acted at that coordinate, at values
    (parameters,).

    Whatever a joint does beside its model, linear or not, is a torque T there, and changes all FRFs of one
    force by H_T T / F, with H_T from the model: one unknown for each line and force, beside as many knowns as
    there are responses.  Nothing is simulated.
    """
    sums: dict[str, float] = {}
    counts: dict[str, int] = {}
    for target in targets:
        for name, (squares, freedom) in _remains(target, values).items():
            sums[name], counts[name] = sums.get(name, 0.0) + squares, counts.get(name, 0) + freedom
    return {name: float(np.sqrt(total / max(counts[name], 1))) for name, total in sums.items()}


def acting_at(problem: Problem, gap: float) -> str:
    """The coordinate at which something acts that depends on amplitude, whatever its law; empty where levels
    do not differ, or where no torque at one coordinate alone explains nearly all of the gap.

    problem: with the model at its initial values, which leave the gap.
    """
    nonlinear = any(effect.of_amplitude for effect in problem.file.study.effects)
    if nonlinear or gap <= QUIET or not level_gap(problem) > QUIET:
        return ""
    gaps = torque_gaps(problem.targets().frf, problem.initial)
    name = min(gaps, key=lambda one: gaps[one])
    next_best = min((left for other, left in gaps.items() if other != name), default=gap)
    return name if gaps[name] - 1 <= _NEARLY * (min(gap, next_best) - 1) else ""


def _remains(target: FrfTarget, values: Array) -> dict[str, tuple[float, int]]:
    """By coordinate, the sum of squares over noise that no torque there explains, and how many real numbers
    are left to explain it.
    """
    residual, weight = _whitened(target, target.data.frf - target.predict(values))
    known = int(np.count_nonzero(residual))
    result = {}
    for number, name in enumerate(target.system.coordinates):
        driven = _driven(target, values, number) * weight
        power = np.sum(np.abs(driven) ** 2, axis=1, keepdims=True)
        share = np.sum(driven.conj() * residual, axis=1, keepdims=True) / np.where(power > 0, power, 1.0)
        left = residual - driven * share
        result[name] = (float(np.sum(np.abs(left) ** 2)), 2 * (known - int(np.count_nonzero(power))))
    return result


def _whitened(target: FrfTarget, difference: Complex) -> tuple[Complex, Array]:
    """A difference (lines, outputs, inputs) over noise, zero where nothing was measured, and one over the
    noise.
    """
    noise = np.full(difference.shape, np.nan) if target.noise is None else target.noise
    known = np.isfinite(difference) & (noise > 0)
    weight = np.divide(1.0, noise, out=np.zeros(noise.shape), where=known)
    return np.where(known, difference, 0.0) * weight, weight


def _driven(target: FrfTarget, values: Array, number: int) -> Complex:
    """(lines, outputs, 1): FRFs of the set's outputs with a unit torque at a coordinate."""
    target, values = target.at(values)
    s, unit = target.s_at(values), np.zeros((len(target.system.coordinates), 1), dtype=complex)
    unit[number] = 1.0
    moved = np.linalg.solve(
        dynamic_stiffness(*target.system.matrices(values), s), np.broadcast_to(unit, (len(s), *unit.shape))
    )
    h = np.asarray((s ** POWER[target.data.quantity])[:, None, None] * (target.out @ moved), dtype=complex)
    for reading, numbers in target.instruments:
        h = reading.apply(h, values[numbers], s)
    return h[:, : len(target.data.outputs)]

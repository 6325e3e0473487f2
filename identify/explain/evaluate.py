"""A finished explanation from all sides: values with intervals, what each effect is worth, what was not
found, what oscillates and is not in the model, in the result's tables.

Every record is judged by every other one, too: which effects there are was decided by all records to fit
and to judge together; what a single pair says of them shows what hangs on one record.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identify.core.arrays import Array
from identify.core.correlated import white_level
from identify.explain.effects.base import MotionEffect, Target
from identify.explain.gain import record_gain
from identify.explain.intervals import intervals
from identify.explain.loop import Explanation
from identify.explain.problem import UNITS
from identify.explain.regression import Fit, RegressionProblem, aligned, solve
from identify.explain.screen import at_edge
from identify.explain.workbench import rms
from identify.measured.conditioning import slow_part
from identify.results.explain import (
    BoundTable,
    Curves,
    EffectTable,
    Glossary,
    PairTable,
    StepTable,
    TargetResult,
    Unseen,
    ValueTable,
)

_HALF = 0.5
"""Part of the squares from which on it is most of them."""
_NEAR = 0.1
"""How far from its peak a resonance reaches, as a share of its frequency: five times a damping of 2 %."""
_MUCH = 0.05
"""Part of a target's squares below which what is left of it calls for no warning."""
_PERIODS = 10
"""A wave that passes fewer times in a record is too slow for a peak to be distinguished from a drift."""


def evaluated(
    target: Target,
    fitted: RegressionProblem,
    judge: RegressionProblem,
    tests: Sequence[RegressionProblem],
    found: Explanation,
    effects: Sequence[MotionEffect],
    lowpass_hz: float,
) -> TargetResult:
    """Everything that is reported of one target; tests: records that nothing depended on."""
    start = found.start
    return TargetResult(
        target=target,
        unit=UNITS[target],
        joints=np.array(fitted.scene.axes),
        rms_fit_start=rms(fitted, start),
        rms_fit=rms(fitted, found.fit),
        rms_judge_start=rms(judge, start),
        rms_judge=rms(judge, aligned(judge, found.fit)),
        noise=np.array(
            [
                white_level(judge.target[:, row], judge.mask[:, row], judge.scene.velocity[:, joint - 1])
                for row, joint in enumerate(fitted.scene.axes)
            ]
        ),
        tried=found.tried,
        effects=_effect_table(found),
        steps=StepTable(
            tuple(step.option.effect.name for step in found.steps),
            np.array([step.option.gain.log_odds for step in found.steps]),
            _rows([step.option.gain.parts for step in found.steps], fitted),
            _rows([step.rms_fit for step in found.steps], fitted),
            _rows([step.rms_judge for step in found.steps], fitted),
        ),
        values=_value_table(fitted, judge, found),
        bounds=_bound_table(fitted, found, effects),
        curves=_all_curves(
            [("fit", fitted), ("validate", judge), *(("test", test) for test in tests)], start, found.fit
        ),
        glossary=Glossary(
            tuple(effect.name for effect in effects), tuple(effect.sentence() for effect in effects)
        ),
        body_errors=found.fit.body_errors,
        warnings=resonance_warnings(target, judge, aligned(judge, found.fit), lowpass_hz),
        pairs=cross_check(fitted, judge, tests, start, found.fit),
        tests={test.name: Unseen(rms(test, start), rms(test, aligned(test, found.fit))) for test in tests},
    )


def _all_curves(problems: Sequence[tuple[str, RegressionProblem]], start: Fit, fit: Fit) -> dict[str, Curves]:
    """One for each record, by its use; a second one of the same use is `fit 2`."""
    found: dict[str, Curves] = {}
    for use, problem in problems:
        for curves in _curves(problem, use, start, fit if use == "fit" else aligned(problem, fit)):
            count = sum(other.use == use for other in found.values())
            found[use if not count else f"{use} {count + 1}"] = curves
    return found


def _effect_table(found: Explanation) -> EffectTable:
    order = np.argsort([-gain.log_odds for gain in found.gains], kind="stable").tolist()
    effects, gains = [found.fit.effects[n] for n in order], [found.gains[n] for n in order]
    return EffectTable(
        name=tuple(effect.name for effect in effects),
        kind=tuple(effect.kind for effect in effects),
        sentence=tuple(effect.sentence() for effect in effects),
        evidence=np.array([gain.log_odds for gain in gains]),
        chance=np.array([gain.chance for gain in gains]),
        share=np.array([gain.parts for gain in gains]).reshape(len(gains), len(found.fit.weights)),
        rivals=tuple(", ".join(found.rivals[n]) for n in order),
        reading=tuple(effect.reading(found.fit.of(effect)) for effect in effects),
    )


def _value_table(fitted: RegressionProblem, judge: RegressionProblem, found: Explanation) -> ValueTable:
    values, half = intervals(fitted, found.fit)
    other, other_half = intervals(judge, found.other)
    labels, edges = [], []
    for effect in found.fit.effects:
        bounds = effect.parameters(fitted.scene)
        labels += [(effect.name, c.name, c.unit) for c in effect.coefficients] + [
            (effect.name, b.name, b.unit) for b in bounds
        ]
        edges += [False] * len(effect.coefficients)
        edges += list(map(at_edge, bounds, found.fit.nonlinear[found.fit.effects.index(effect)]))
    return ValueTable(
        effect=tuple(label[0] for label in labels),
        name=tuple(label[1] for label in labels),
        unit=tuple(label[2] for label in labels),
        value=values,
        low_95=values - half,
        high_95=values + half,
        other=other,
        other_low_95=other - other_half,
        other_high_95=other + other_half,
        at_edge=np.array(edges, dtype=bool),
    )


def _bound_table(
    fitted: RegressionProblem, found: Explanation, effects: Sequence[MotionEffect]
) -> BoundTable:
    """One coefficient each, added to the fit: what the record would have it be."""
    there = {effect.name for effect in found.fit.effects} | {
        effect.supersedes for effect in found.fit.effects
    }
    rows = []
    for effect in effects:
        if effect.name in there or len(effect.coefficients) > 1 or effect.parameters(fitted.scene):
            continue
        nonlinear = [*found.fit.nonlinear, np.zeros(0)]
        added = solve(fitted, [*found.fit.effects, effect], nonlinear, found.fit.weights)
        values, half = intervals(fitted, added)
        rows.append(
            (
                effect.name,
                effect.coefficients[0].unit,
                values[-1],
                values[-1] - half[-1],
                values[-1] + half[-1],
            )
        )
    names, units, value, low, high = zip(*rows, strict=True) if rows else ((),) * 5
    return BoundTable(
        tuple(names),
        tuple(units),
        np.array(value, dtype=float),
        np.array(low, dtype=float),
        np.array(high, dtype=float),
    )


def _curves(problem: RegressionProblem, use: str, start: Fit, fit: Fit) -> list[Curves]:
    """Measured, known and explained histories; what is known is what the target was measured against, and the
    datum of each record.
    """
    known = _measured(problem) - problem.target + start.predict(problem)
    explained = _measured(problem) - problem.target + fit.predict(problem)
    measured, time_s, mask = _measured(problem), problem.scene.time_s, problem.mask
    return [
        Curves(
            name,
            use,
            time_s[part] - time_s[part][0],
            measured[part],
            known[part],
            explained[part],
            mask[part],
        )
        for name, part in zip(problem.scene.names, problem.scene.records, strict=True)
    ]


def _measured(problem: RegressionProblem) -> Array:
    """The history itself: a torque is compared with what rigid links need, a difference of positions stands
    for itself.
    """
    return (
        problem.target
        if problem.datum != "none"
        else problem.scene.motor_torque[:, [joint - 1 for joint in problem.scene.axes]]
    )


def _rows(values: Sequence[Array], problem: RegressionProblem) -> Array:
    return np.array(values, dtype=float).reshape(len(values), problem.target.shape[1])


def cross_check(
    fitted: RegressionProblem,
    judge: RegressionProblem,
    tests: Sequence[RegressionProblem],
    start: Fit,
    fit: Fit,
) -> PairTable:
    """A row for each pair of records: fitted to one that was there to fit or to judge, judged by any other.

    start: the fit of no effect; parameters inside the columns stay those of `fit`.
    """
    own = [*_single(fitted), *_single(judge)]
    others = [*own, *(one for test in tests for one in _single(test))]
    pairs = [(one, other) for one in own for other in others if other is not one]
    rows = [_judged(one, other, start, fit) for one, other in pairs]
    return PairTable(
        tuple(one.name for one, _ in pairs),
        tuple(other.name for _, other in pairs),
        tuple(effect.name for effect in fit.effects),
        np.array([row[0] for row in rows]),
        np.array([row[1] for row in rows]),
        np.array([row[2] for row in rows]).reshape(len(rows), len(fit.effects)),
    )


def _judged(
    one: RegressionProblem, other: RegressionProblem, start: Fit, fit: Fit
) -> tuple[list[float], list[float], list[float]]:
    """RMS on the other record before and after, per joint, and the part of its squares that each effect takes
    away as it was fitted: with it and without, all else the same, so that nothing else is blamed for its
    absence.
    """
    found = solve(one, fit.effects, fit.nonlinear, fit.weights)
    without = [found.replaced(effect, np.zeros(len(effect.coefficients))) for effect in fit.effects]
    shares = [record_gain(other, less, found, one).explained for less in without]
    return rms(other, start).tolist(), rms(other, aligned(other, found)).tolist(), shares


def _single(problem: RegressionProblem) -> list[RegressionProblem]:
    """The records of a problem, one by one: the others do not count."""
    if len(problem.scene.records) == 1:
        return [problem]
    found = []
    for name, record in zip(problem.scene.names, problem.scene.records, strict=True):
        mask = np.zeros_like(problem.mask)
        mask[record] = problem.mask[record]
        found.append(replace(problem, name=name, mask=mask, remembered={}, searched={}))
    return found


def resonance_warnings(
    target: str, problem: RegressionProblem, fit: Fit, lowpass_hz: float
) -> tuple[str, ...]:
    """Joints of whose target (samples, joints) most lies above the low-pass, or what is left near one
    frequency.
    """
    rate = 1 / float(np.median(np.diff(problem.scene.time_s)))
    counted = np.where(problem.mask, problem.target - problem.datum_of(problem.target), 0.0)
    left = fit.residual(problem)
    said = []
    for row, axis in enumerate(problem.scene.axes):
        whole = float((counted[:, row] ** 2).sum())
        fast = counted[:, row] - slow_part(counted[:, row], lowpass_hz, rate)
        above = float((fast**2).sum()) / max(whole, 1e-300)
        peak, near = _peak(fast, rate)
        if above > _HALF and near > _HALF:
            said.append(
                f"{target}: {100 * above:.0f} % of its squares at joint {axis} lie above lowpass_hz"
                f" ({lowpass_hz:g} Hz), most near {peak:.3g} Hz, where no acceleration is"
                " known; if that is a resonance, give a `lowpass_hz` above it"
            )
            continue
        peak, near = _peak(left[:, row], rate)
        if near > _HALF and float((left[:, row] ** 2).sum()) > _MUCH * whole:
            said.append(
                f"{target}: {100 * near:.0f} % of what is left at joint {axis} lies near {peak:.3g} Hz: the"
                " record excites a resonance that the model lacks, or waves at one speed; without"
                " `link_position` a soft gear or link is not in it"
            )
    return tuple(said)


def _peak(values: Array, rate: float) -> tuple[float, float]:
    """Frequency, Hz, about which most of the squares of values (samples,) lie, and their part."""
    power = np.abs(np.fft.rfft(values)) ** 2
    frequencies = np.fft.rfftfreq(len(values), 1 / rate)
    sums = np.concatenate([[0.0], np.cumsum(power)])
    ends = [np.searchsorted(frequencies, (1 + side * _NEAR) * frequencies) for side in (-1, 1)]
    near = np.where(np.arange(len(power)) < _PERIODS, 0.0, sums[ends[1]] - sums[ends[0]])
    best = int(np.argmax(near))
    highest = ends[0][best] + int(np.argmax(power[ends[0][best] : ends[1][best]]))
    return float(frequencies[highest]), float(near[best] / max(sums[-1], 1e-300))

"""A problem with less data: few frequency lines for quick trials, channels left aside for validation, or what
an effect does to it taken off.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from identify.core.arrays import Mask
from identify.model.effects.base import Effect
from identify.vibration.costs.target import FrfTarget
from identify.vibration.given import Given
from identify.vibration.problem import Measurement, Problem, with_effects

_FRFS, _LINES, _FEWEST = 6300, (42, 84), 21
"""Values of FRFs that quick trials see, at so many frequency lines of all fitted measurements together, and
of each at least, spread evenly over the band: many channels tell no more of what lies between lines.
"""


def decimated(problem: Problem) -> Problem:
    """The same problem with few frequency lines in every measurement that is fitted, and no other
    measurement.
    """

    fitted = [m for m in problem.measurements if m.settings.use == "fit"]
    pairs = max((m.target.sigma.shape[1] for m in fitted if isinstance(m.target, FrfTarget)), default=1)
    wanted = max(_FEWEST, int(np.clip(_FRFS // pairs, *_LINES)) // len(fitted))

    def fewer(m: Measurement) -> Measurement:
        if not isinstance(m.target, FrfTarget):
            return m
        count = len(m.target.data.frequency_hz)
        return _at_lines(m, np.arange(count) % max(1, round(count / wanted)) == 0)

    return replace(problem, measurements=tuple(fewer(m) for m in fitted))


def _at_lines(m: Measurement, lines: Mask) -> Measurement:
    """Some frequency lines (lines,) of a measurement of FRFs."""
    assert isinstance(m.target, FrfTarget)
    target = m.target.at_lines(lines)
    given: Given = replace(m.given, data=target.data)
    return replace(m, given=given, target=target)


def _third(channels: int) -> NDArray[np.bool_]:
    """Which of so many channels, in threes of directions, belong to a third that has all directions."""
    number = np.arange(channels)
    return np.asarray((number + number // 3) % 3 == 1)


def without_amplitude(problem: Problem, effects: Sequence[Effect], values: Mapping[str, float]) -> Problem:
    """A problem with effects at values by name, but those that depend on amplitude: what they do to the FRFs
    there is taken off the data, so that a linear model is left.
    """
    model = with_effects(problem, effects, values)
    linear = [effect for effect in effects if not effect.of_amplitude]
    if len(linear) == len(effects):
        return model
    without = with_effects(problem, linear, values)
    pairs = zip(model.measurements, without.measurements, strict=True)
    corrected = tuple(_less_by(one, other, model, without) for one, other in pairs)
    return with_effects(replace(without, measurements=corrected), linear, values)


def _less_by(one: Measurement, other: Measurement, simulated: Problem, without: Problem) -> Measurement:
    """A measurement less what the effects that `simulated` has and `without` has not do to its FRFs."""
    if not isinstance(one.target, FrfTarget) or not isinstance(other.target, FrfTarget):
        return other
    part = one.target.predict(simulated.initial) - other.target.predict(without.initial)
    data = replace(other.target.data, frf=other.target.data.frf - part)
    return replace(other, given=replace(other.given, data=data))


def left_out(problem: Problem) -> Problem:
    """The same problem with a third of the response channels of every fitted measurement set aside for
    validation.
    """

    def part(m: Measurement, aside: bool) -> Measurement:
        assert isinstance(m.target, FrfTarget)
        chosen = np.flatnonzero(_third(len(m.target.data.outputs)) == aside).tolist()
        noise = None if m.target.noise is None else m.target.noise[:, chosen]
        picked = m.target.data.pairs(chosen, list(range(len(m.target.data.inputs))))
        data = replace(picked, noise=noise)
        use: Literal["fit", "validate"] = "validate" if aside else "fit"
        given = replace(m.given, data=data, settings=m.settings.model_copy(update={"use": use}))
        return replace(m, given=given)

    split = [
        part(m, aside)
        for m in problem.measurements
        if isinstance(m.target, FrfTarget) and m.settings.use == "fit" and len(m.target.data.outputs) > 2
        for aside in (False, True)
    ]
    whole = replace(problem, measurements=tuple(split) or problem.measurements)
    return with_effects(whole, problem.file.study.effects, {})


def count_of(problem: Problem, use: str) -> int:
    """How many real numbers were measured."""
    return sum(2 * target.measured.size for target in problem.targets(use).frf)


def free_of(problem: Problem) -> int:
    found = sum(effect.settings_found for effect in problem.file.study.effects)
    return found + sum(p.free for p in problem.of_effects)

"""Which measurement would tell two models apart that the present data cannot: where and at which posture they
predict different FRFs.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from identify.core.arrays import Array, Complex
from identify.measured.frf_set import POWER
from identify.model.effects.base import Effect
from identify.model.frf import frf
from identify.model.system import assemble, build_site
from identify.vibration.costs.target import FrfTarget
from identify.vibration.problem import Problem

_POSTURES, _REACH_DEG, _LINES = 16, 60.0, 60
_AXES = ("X", "Y", "Z")


@dataclass(frozen=True)
class _Place:
    """A measurement that could be made: at a posture (rad), a response channel and an impact channel; ratio:
    how far apart in noise.
    """

    posture: Array
    new: bool
    output: str
    impact: str
    ratio: float


def advise(
    problem: Problem,
    one: tuple[Sequence[Effect], Mapping[str, float]],
    other: tuple[Sequence[Effect], Mapping[str, float]],
) -> str:
    """Which response, impact and posture would tell two models (effects, values by name) apart, against noise
    like today's.
    """
    target = next(m.target for m in problem.measurements if isinstance(m.target, FrfTarget))
    noise = float(np.median(target.sigma))
    at_hand = [m.given.posture for m in problem.measurements if m.settings.detached is None]
    draws = scipy.stats.qmc.Sobol(len(at_hand[0]), rng=np.random.default_rng(0)).random(_POSTURES)
    others = [at_hand[0] + np.deg2rad(_REACH_DEG) * (2 * draw - 1) for draw in draws]
    tried = [
        _furthest(problem, target, posture, new, (one, other), noise)
        for posture, new in [(p, False) for p in at_hand] + [(p, True) for p in others]
    ]
    here, best = (
        max((p for p in tried if not p.new), key=lambda p: p.ratio),
        max(tried, key=lambda p: p.ratio),
    )
    sentence = (
        f"To tell them apart, measure {here.output} for an impact at {here.impact} in a measured posture"
        f" ({_degrees(here.posture)}): "
    )
    sentence += f"they differ there by up to {here.ratio:.1f} times the noise."
    if best.new and best.ratio > 1.5 * here.ratio:
        sentence += (
            f" Better still, {best.output} for an impact at {best.impact} at joint angles"
            f" {_degrees(best.posture)}: {best.ratio:.1f} times."
        )
    return sentence


def _furthest(
    problem: Problem,
    target: FrfTarget,
    posture: Array,
    new: bool,
    models: tuple[tuple[Sequence[Effect], Mapping[str, float]], ...],
    noise: float,
) -> _Place:
    """Where two models differ most at a posture, over all points and axes."""
    first, second = (_all_frfs(problem, target, posture, effects, values) for effects, values in models)
    apart = np.abs(first - second).max(axis=0) / noise
    output, impact = np.unravel_index(int(np.argmax(apart)), apart.shape)
    names = [f"{point.name}:{axis}" for point in problem.points.values() for axis in _AXES]
    return _Place(posture, new, names[int(output)], names[int(impact)], float(apart[output, impact]))


def _all_frfs(
    problem: Problem,
    target: FrfTarget,
    posture: Array,
    effects: Sequence[Effect],
    values: Mapping[str, float],
) -> Complex:
    """(lines, channels, channels) between all points and axes."""
    site = build_site(problem.robot, posture, effects, points=problem.points)
    system = assemble(problem.robot, site, effects)
    given = np.array([values.get(p.name, p.initial) for p in system.parameters])
    rows = np.concatenate(
        [point.axes @ system.jacobian(point.link, point.position)[:3] for point in problem.points.values()]
    )
    step = max(1, len(target.data.s) // _LINES)
    return frf(*system.matrices(given), target.data.s[::step], rows, rows.T, POWER[target.data.quantity])


def _degrees(posture: Array) -> str:
    return "[" + ", ".join(f"{angle:.0f}" for angle in np.rad2deg(posture)) + "] degrees"

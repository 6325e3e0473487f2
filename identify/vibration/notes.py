"""What a fit says beside its numbers: channels that agree with the model once their sign is reversed or two
are exchanged, in which direction coupled springs are most compliant, records that seem to begin before the
impact; and what results that rest on a fit say of it.

A wrong sign off the drive point breaks no law of physics, so only a model can see it.  With outputs H_i
measured and h_k predicted, each over its own noise, all sums |H_i - s h_k|^2 over lines and inputs follow
from two products of matrices.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from identify.core.arrays import Array
from identify.core.text import listed
from identify.core.thresholds import MATERIAL, MISSING, SIGMAS_95
from identify.fitting.uncertainty import Uncertainty
from identify.measured.channel import Channel
from identify.model.effects.coupling import coupled_with
from identify.model.effects.pre_trigger import PRE_TRIGGER, valleys
from identify.results.fit import FitResult
from identify.vibration.costs.make_target import Targets
from identify.vibration.costs.target import FrfTarget
from identify.vibration.problem import Problem
from identify.vibration.uncertainty import covariance_root, gap

_LEFT = 0.25
"""A fault is reported where at most this share of the channels' squared residual is left with it."""
_ALIKE = 0.5
"""And of their squared FRFs: what does not resemble the model either way has another fault."""
_OPEN = 30.0
"""Half an interval, degrees, from which on a direction is not reported."""


@dataclass(frozen=True)
class Fault:
    """What would make channels agree: one with its sign reversed, or two exchanged; left: share of the
    squared residual that remains.
    """

    channels: tuple[Channel, ...]
    left: float

    def sentence(self, sets: Iterable[str]) -> str:
        """What a report says, with the names of the sets that show it."""
        names = " and ".join(map(str, self.channels))
        how = "if exchanged" if len(self.channels) == 2 else "with its sign reversed"
        where = listed(list(sets))
        return f"{where}: channel {names} would agree with the model {how}: check the cables and settings"


def fault_notes(targets: Iterable[FrfTarget], values: Array) -> list[str]:
    """Sentences about the channels of these sets that have such a fault at parameter values (parameters,)."""
    found: dict[tuple[Channel, ...], list[tuple[str, Fault]]] = defaultdict(list)
    for target in targets:
        for fault in channel_faults(target, values):
            found[fault.channels].append((target.name, fault))
    return [rows[0][1].sentence(name for name, _ in rows) for rows in found.values()]


def channel_faults(target: FrfTarget, values: Array) -> Iterator[Fault]:
    """The faults of one set: reversed signs first, then exchanged pairs of channels of one point or one
    axis.
    """
    plain, crossed = _residuals(target, target.predict(values))
    own, reversed_ = np.diag(plain), np.diag(crossed)
    size = (own + reversed_) / 2  # |H_i|^2 + |h_i|^2
    outputs, named = target.data.outputs, set()
    reversed_alone = (own > 0) & (reversed_ <= _LEFT * own) & (reversed_ <= _ALIKE * size)
    for i in np.flatnonzero(reversed_alone).tolist():
        named.add(i)
        yield Fault((outputs[i],), float(reversed_[i] / own[i]))
    best, moving = np.minimum(plain, crossed), own > 0
    better = moving[:, None] & moving & (best <= _LEFT * own[:, None])
    for i, k in np.argwhere(np.triu(better & better.T, 1)).tolist():
        related = outputs[i].node == outputs[k].node or abs(outputs[i].direction) == abs(outputs[k].direction)
        alike = best[i, k] + best[k, i] <= _ALIKE * (size[i] + size[k])
        if related and alike and not named & {i, k}:
            named |= {i, k}
            yield Fault((outputs[i], outputs[k]), float((best[i, k] + best[k, i]) / (own[i] + own[k])))


def _residuals(target: FrfTarget, predicted: np.ndarray) -> tuple[Array, Array]:
    """Sums of |H_i - h_k|^2 and |H_i + h_k|^2 over lines and inputs in units of the noise of i, (outputs,
    outputs).
    """
    data = target.data
    known = np.broadcast_to(data.measured, data.frf.shape)
    level = np.sqrt(np.mean(np.abs(np.where(known, data.frf, 0.0)) ** 2, axis=(0, 2)))
    noise = np.broadcast_to(level[:, None], data.frf.shape) if target.noise is None else target.noise
    weight = np.divide(1.0, noise, out=np.zeros(data.frf.shape), where=known & (noise > 0))
    flat = [
        np.moveaxis(array, 1, 0).reshape(len(data.outputs), -1) for array in (data.frf, weight, predicted)
    ]
    measured, w, model = np.where(flat[1] > 0, flat[0], 0.0), flat[1], flat[2]
    sizes = np.sum(np.abs(measured * w) ** 2, axis=1)[:, None] + w**2 @ (np.abs(model) ** 2).T
    product = 2 * ((np.conj(measured) * w**2) @ model.T).real
    return sizes - product, sizes + product


def soft_directions(problem: Problem, trusted: Uncertainty, values: Array) -> list[str]:
    """A sentence for each coupled pair at values (unknowns,): for example of a joint's tilt."""
    numbers = {p.name: number for number, p in enumerate(problem.parameters)}
    pairs = [
        [numbers[one] for one in (*pair, name)]
        for name in numbers
        if name.endswith(".stiffness") and (pair := coupled_with(name))
    ]
    if not pairs:
        return []
    free, root = covariance_root(problem, trusted, values)
    every = np.zeros((len(values), root.shape[1]))
    every[free] = root
    between = [problem.parameters[own[-1]] for own in pairs]
    return [_sentence(p.name, p.unit, values[own], every[own]) for p, own in zip(between, pairs, strict=True)]


def _sentence(name: str, unit: str, matrix: Array, root: Array) -> str:
    """matrix (3,): xx, yy, xy; root (3, u) of their covariance."""
    x, y, xy = matrix
    soft, stiff = np.linalg.eigvalsh([[x, xy], [xy, y]])
    across, both = x - y, 2 * xy
    angle = np.degrees(np.arctan2(both, across) / 2) + 90.0
    slope = np.degrees(np.array([-both, both, 2 * across]) / (2 * (across**2 + both**2)))
    half = SIGMAS_95 * float(np.linalg.norm(slope @ root))
    body, axes, _ = name.split(".")
    turns = axes.startswith("r")
    what = f"{body} {'turns most easily about' if turns else 'is most compliant along'}"
    values = f"{soft:.4g} {unit} there, {stiff:.4g} {unit} across it"
    if not half < _OPEN:
        return f"{what} a direction across its z axis that the data do not determine: {values}."
    angle_deg = (angle + 90.0) % 180.0 - 90.0
    return f"{what} a direction {angle_deg:.1f}° ± {half:.2g}° from its x axis towards y: {values}."


def record_notes(targets: Targets, values: Array) -> list[str]:
    """A sentence where the gap falls once the records end that much sooner after the impact, all else at
    values (unknowns,) held.
    """
    known = {p.name for one in targets.frf for p in one.system.parameters}
    ended = any(one.record is not None for one in targets.frf)
    if not ended or PRE_TRIGGER in known or targets.simulated:
        return []
    times = valleys()
    gaps = [
        gap(replace(targets, frf=tuple(_sooner(one, early) for one in targets.frf)), values)
        for early in times
    ]
    best = int(np.argmin(gaps))
    if not gaps[0] - gaps[best] >= MATERIAL:  # nor where noise is not known
        return []
    return [
        f"the gap would be {gaps[best]:.3g} instead of {gaps[0]:.3g} if the records began"
        f" {1e3 * times[best]:.0f} ms before the impacts, as with a pre-trigger: add"
        " `- {kind: pre-trigger}` to the effects to have the time fitted along"
    ]


def _sooner(target: FrfTarget, early: float) -> FrfTarget:
    return target if target.record is None else replace(target, record=target.record - early)


def of_fit(fit: FitResult) -> list[str]:
    """The fit's own notes."""
    return [f"of the fit: {note}" for note in fit.notes]


def of_gap(gap: float, consequence: str) -> list[str]:
    """A note where the fit's gap says that something is missing, and what follows; empty otherwise."""
    if gap <= MISSING:
        return []
    return [
        f"the fit's gap is {gap:.3g}: something is missing from the model, {consequence}; see"
        " `identify discover`"
    ]

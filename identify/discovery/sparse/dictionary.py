"""What enters by a shape of its own, such as a resonator: scored at amplitude zero, without a refit.

An effect whose matrices are all multiplied by t, with E those of its own coordinates, A those of the
others and B between them, changes the FRFs by dH/dt = -s^p S G (A - B E^-1 B') G B at t = 0.  Without
coordinates of its own, each of its parameters has such a t.  With what is in the model already projected
out, the best t and the fall of squares follow (score test: Rao, Proc. Cambridge Phil. Soc. 44 (1948) 50-57).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np

from identify.core.arrays import Array, Complex, Index, Mask
from identify.core.bounded import bounded_step
from identify.core.errors import InputError, InputErrors
from identify.core.parameters import Parameter
from identify.core.plugin import left_out_where_broken
from identify.core.threads import each
from identify.core.thresholds import CLOSED
from identify.discovery.sparse.dense import bodies, relaxations
from identify.discovery.sparse.evidence import price, solved
from identify.discovery.sparse.objective import Penalised
from identify.discovery.sparse.unknowns import Unknowns
from identify.measured.frf_set import POWER
from identify.model.effects.base import EFFECTS, Effect
from identify.model.system import System
from identify.vibration.costs.information import Rows, each_set, over_noise, rows_of
from identify.vibration.costs.target import FrfTarget
from identify.vibration.problem import Problem, systems_with

_FREQUENCIES, _WIDER = 32, 2.0
"""At which a body on a spring is tried over the band, with so many times its own damping, so that no peak
falls between two.
"""
_RANK = 1e-9
"""Share of the largest that is nothing."""
_DAMPED, _ROUNDED = 1e-3, 1e-6
"""Share of the squares of a change that steps are damped by where much is open, and where nothing is."""


@dataclass(frozen=True)
class Candidate:
    """An effect with the values that it would start from, and by how much the fit would gain, in units of
    log likelihood with a free scale.
    """

    effect: Effect
    values: dict[str, float]
    gain: float


@dataclass(frozen=True)
class Beside:
    """A dense fit at x (f,) that what it lacks is scored beside: product (f + 1, f + 1): [J r]'[J r] there;
    sets: its FRF sets about x.
    """

    fit: Penalised
    x: Array
    product: Array
    sets: Sequence[About]

    @classmethod
    def of(cls, unknowns: Unknowns, x: Array, product: Array) -> Beside:
        """Everything there."""
        fit = Penalised(unknowns, price=0.0)
        return cls(fit, x, product, each_set(partial(_about, unknowns=unknowns, x=x), fit.targets))

    def projected(self, crossed: Array) -> tuple[Array, Array]:
        """Of changes with J'd (f, k), and after them of the residual and the pull of priors: J'[d r] of what
        is in the model, and the same times the inverse of its information, both (held, k + 1).

        Errors that are far out leave no residual of what they make up for: they come back where they can.
        """
        held, unknowns = np.flatnonzero(self.fit.unknowns.present(self.x)), self.fit.unknowns
        scale = max(self.product[-1, -1] / self.fit.count, 1.0)
        prior = scale * unknowns.precision_at(self.x)[held]
        information = self.product[np.ix_(held, held)] + np.diag(prior)
        pull = self.product[held, -1] + prior * (self.x - unknowns.reference)[held]
        own = np.column_stack([crossed[held], pull])
        return own, solved(information, own)

    @property
    def gap(self) -> float:
        """What is left, in units of noise."""
        return float(np.sqrt(self.product[-1, -1] / self.fit.count))

    def gain(self, fall: float) -> float:
        """What it gains that the squares fall, in units of log likelihood with a free scale."""
        return gain_of(fall, self.product[-1, -1], self.fit.count)


def candidates(problem: Problem, beside: Beside) -> list[Candidate]:
    """All that the catalogue has of such effects beside a dense fit of a problem: what gains most less the
    price of its parameters first.
    """
    sets, measured = beside.sets, problem.measurements
    fitted = [n for n, m in enumerate(measured) if any(one.target is m.target for one in sets)]
    found = list[Candidate]()
    for some, systems in _models(problem, _instances(problem)):
        every = [(effect, _shapes(systems, problem, n)) for n, effect in enumerate(some, -len(some))]
        new = [(effect, shape) for effect, shape in every if not _there(shape, problem)]
        if not new:
            continue
        shapes = [shape for _, shape in new]
        pairs = [(one, systems[n]) for one, n in zip(sets, fitted, strict=True)]
        parts = each(partial(_scored, shapes=shapes), pairs)
        scores = [_Score.of_all(own) for own in zip(*parts, strict=True)]
        for (effect, shape), left in zip(new, _left(scores, beside), strict=True):
            found += _best(effect, shape, problem, left, beside)
    each_costs = price(beside.fit.count)
    return sorted(found, key=lambda one: each_costs * len(one.values) - one.gain)


@dataclass(frozen=True)
class About:
    """An FRF set about a point of the search: what it says of the free unknowns (numbers; slope: d value /
    d x), and S G (lines, outputs, n) and G B (lines, n, inputs) at s (lines,), at values of the parameters.
    """

    target: FrfTarget
    rows: Rows
    free: Index
    slope: Array
    values: Array
    s: Complex
    ends: tuple[Complex, Complex]


def _about(target: FrfTarget, unknowns: Unknowns, x: Array) -> About:
    values, free = unknowns.to_values(x), unknowns.free
    there, own = target.at(values)
    response = there.response(own)
    slope = np.where(unknowns.log, values[free], 1.0)
    rows = rows_of(target, values, free, over_noise)
    return About(target, rows, free, slope, own, there.s_at(own), (response.to_out, response.motion(0)))


def _models(
    problem: Problem, kinds: Iterator[list[Effect]]
) -> Iterator[tuple[Sequence[Effect], list[System]]]:
    """The systems with all effects of a kind at once, or one by one where they cannot be together."""
    for some in kinds:
        try:
            yield some, systems_with(problem, some)
        except (InputError, InputErrors):
            for one in some:
                with suppress(InputError, InputErrors):
                    yield [one], systems_with(problem, [one])


def _instances(problem: Problem) -> Iterator[list[Effect]]:
    """By kind, those that are nothing where all their parameters are: they free no coordinate of the robot's,
    and the model does not have them.  Bodies and relaxation are amplitudes of the dense model.
    """
    own = {name for m in problem.measurements for name in m.system.site.engine.mechanism.coordinates}
    present = problem.file.study.effects
    dense = {one.kind for one in (*bodies(problem), *relaxations(problem))}
    for name, kind in EFFECTS.usable().items():
        if name in dense:
            continue
        late = kind.of_amplitude or kind.needs_levels or kind.last_resort or kind.of_measurement
        if late or kind.consistent_mass is not Effect.consistent_mass:
            continue
        with left_out_where_broken():
            every = list(kind.instances(problem.robot, problem.points))
            freed = [one.free_coordinates(problem.robot) for one in every]
            free = [one for one, names in zip(every, freed, strict=True) if not own & set(names)]
            if rest := [one for one in free if one not in present]:
                yield rest


@dataclass(frozen=True)
class _Shape:
    """An effect of a model: its parameters and their numbers there, the values (m, terms) that it is tried
    with, and whether these add up: each row may be taken as often as it likes beside the others.
    """

    parameters: Sequence[Parameter]
    numbers: Index
    starts: Array
    adding: bool = False


def _there(shape: _Shape, problem: Problem) -> bool:
    """Whether the model has one of its parameters, as a servo has the rotor of its joint, and one spring from
    a link to the ground is another.
    """
    known = {p.name for p in problem.measurements[0].system.parameters}
    return not known.isdisjoint(p.name for p in shape.parameters)


def _shapes(systems: Sequence[System], problem: Problem, which: int) -> _Shape:
    """Of an effect of the systems of all measurements beyond the problem: where its link was taken off for a
    test, it touches nothing there.
    """
    numbers = systems[0].effects[which][1]
    own = [systems[0].parameters[n] for n in numbers]
    present = {name for m in problem.measurements for name in m.system.coordinates}
    touched = {
        system.coordinates[n]
        for system in systems
        for n in np.flatnonzero(_touched(_stacks(system, numbers)))
    }
    if touched <= present:
        usual = {p.unit: max(q.initial for q in own if q.unit == p.unit) for p in own}
        return _Shape(own, numbers, np.diag([usual[p.unit] or 1.0 for p in own]), adding=True)
    return _Shape(own, numbers, _over_the_band(problem, own))


def _over_the_band(problem: Problem, own: Sequence[Parameter]) -> Array:
    """(m, parameters): the usual values; of a body on a spring, resonances all over the band."""
    start = np.array([p.initial for p in own])
    damped = np.array([".damping" in p.name for p in own])
    stiff = np.array([".stiffness" in p.name for p in own])
    masses = np.array([p.name.endswith(".mass") for p in own])
    if not (stiff.any() and masses.any()):
        return start[None]
    low, high = _band(problem)
    usual = np.sqrt(start[stiff][0] / start[masses][0]) / (2 * np.pi)
    faster = np.geomspace(low, high, _FREQUENCIES) / usual
    rows = [np.where(stiff, start * f**2, np.where(damped, _WIDER * start * f, start)) for f in faster]
    return np.array(rows)


def _band(problem: Problem) -> tuple[float, float]:
    lines = [m.target.data.frequency_hz for m in problem.measurements if isinstance(m.target, FrfTarget)]
    return min(one[0] for one in lines), max(one[-1] for one in lines)


class _Score(NamedTuple):
    """Of changes d by each of k starts of a shape, in units of noise: J'd (f, k), d'd (k, k), d'r (k,)."""

    crossed: Array
    own: Array
    pull: Array

    @classmethod
    def of_all(cls, sets: Sequence[_Score]) -> _Score:
        """Of several sets together."""
        return cls(*(np.sum(part, axis=0) for part in zip(*sets, strict=True)))


def _scored(pair: tuple[About, System], shapes: Sequence[_Shape]) -> list[_Score]:
    """Each shape in a set."""
    one, system = pair
    target, rows = one.target, one.rows
    place = [system.coordinates.index(name) for name in target.system.coordinates]
    power = -(one.s ** POWER[target.data.quantity])[:, None, None, None]
    found = list[_Score]()
    for shape in shapes:
        changes = np.stack(list(_changes(system, shape, place, one.s, one.ends)), axis=-1)
        d = np.moveaxis(target.read(power * changes, one.values), -1, 0) * rows.weight
        flat = np.ascontiguousarray(d.reshape(len(d), -1), dtype=complex).view(float)
        residual = np.ascontiguousarray(rows.residual.ravel()).view(float)
        found.append(_Score((one.slope * rows.pull(d, one.free)).T, flat @ flat.T, flat @ residual))
    return found


def _changes(
    system: System, shape: _Shape, place: Sequence[int], s: Complex, ends: tuple[Complex, Complex]
) -> Iterator[Complex]:
    """S G (A - B E^-1 B') G B (lines, outputs, inputs) for each start of a shape."""
    stacks = _stacks(system, shape.numbers)
    inner = [n for n in np.flatnonzero(_touched(stacks)) if n not in place]
    outer = [one[:, place] for one in stacks.values()]
    basis = _span(np.concatenate([part.transpose(1, 0, 2).reshape(len(place), -1) for part in outer], axis=1))
    left, right = ends[0] @ basis, basis.T @ ends[1]
    line = s[:, None, None]
    project = np.zeros((basis.shape[1] + len(inner), len(system.coordinates)))
    project[: basis.shape[1], place] = basis.T
    project[np.arange(len(inner)) + basis.shape[1], inner] = 1.0
    small = {role: project @ stack @ project.T for role, stack in stacks.items()}
    for row in shape.starts:
        k, c, m, h = (np.tensordot(row, small[role], axes=1) for role in stacks)
        z, cut = k + 1j * h + line * c + line**2 * m, basis.shape[1]
        inside = z[:, :cut, :cut]
        if inner:
            inside = inside - z[:, :cut, cut:] @ np.linalg.solve(z[:, cut:, cut:], z[:, cut:, :cut])
        yield left @ inside @ right


def _span(columns: Array) -> Array:
    """An orthonormal basis (n, r) of columns."""
    touched = np.flatnonzero(columns.any(axis=1))
    some = columns[touched][:, columns.any(axis=0)]
    u, size, _ = np.linalg.svd(some, full_matrices=False)
    kept = size > _RANK * max(size.max(initial=0.0), 1e-300)
    found = np.zeros((len(columns), int(kept.sum())))
    found[touched] = u[:, kept]
    return found


def _stacks(system: System, numbers: Index) -> dict[str, Array]:
    """The terms (m, n, n) of some parameters, by role."""
    return {role: every[numbers] for role, every in system.terms.items()}


def _touched(stacks: Mapping[str, Array]) -> Mask:
    """(n,): the coordinates that terms (m, n, n) by role touch."""
    return np.asarray(np.any([np.any(one, axis=(0, 1)) for one in stacks.values()], axis=0))


class _Left(NamedTuple):
    """Of changes by each of k starts of a shape, in units of noise: their squares (k,), and with what is in
    the model projected out their products (k, k) and those with the residual (k,).
    """

    size: Array
    products: Array
    slope: Array


def _left(scores: Sequence[_Score], beside: Beside) -> Iterator[_Left]:
    """Of each shape, solved for all at once."""
    told, solved_for = beside.projected(np.concatenate([one.crossed for one in scores], axis=1))
    ends = np.cumsum([0, *(len(one.pull) for one in scores)])
    for one, mine in zip(scores, map(slice, ends, ends[1:]), strict=True):
        own = told[:, mine].T
        slope = one.pull - own @ solved_for[:, -1]
        yield _Left(np.diag(one.own), one.own - own @ solved_for[:, mine], slope)


def _best(effect: Effect, shape: _Shape, problem: Problem, score: _Left, beside: Beside) -> list[Candidate]:
    """The effect at the start that gains most, as much of it as there would be; nothing where none gains."""
    size, left, slope = score
    own, most = shape.parameters, _most(problem, shape)
    if shape.adding:
        least = [0.0 if p.log else p.lower / s for p, s in zip(own, np.diag(shape.starts), strict=True)]
        damped = left + np.diag(damping(beside.gap) * size + _RANK * size.max(initial=1e-300))
        amount = bounded_step(damped, -slope, np.array(least), most)
    else:
        alone = np.clip(-slope / np.maximum(np.diag(left), 1e-300), 0.0, most)
        row = int(np.argmax(-2 * alone * slope - alone**2 * np.diag(left)))
        amount = np.where(np.arange(len(alone)) == row, alone, 0.0)
    gain = beside.gain(float(-2 * amount @ slope - amount @ left @ amount))
    values = {
        p.name: float(np.clip(value, p.lower, p.upper))
        for p, value in zip(own, amount @ shape.starts, strict=True)
    }
    return [Candidate(effect, values, gain)] if np.any(amount) else []


def damping(gap: float) -> float:
    """Share of the squares of a change by which a step to first order is damped.

    Far from the data such steps stay short.  Near them they hold as far as errors that are far out come back,
    which make up for all but a thousandth of a rotor, say: what is left is what it would gain.
    """
    return _ROUNDED if gap < CLOSED else _DAMPED


def gain_of(fall: float, squares: float, count: int) -> float:
    """What it gains that the squares fall, in units of log likelihood with a free scale."""
    return float(-0.5 * count * np.log1p(-min(fall / squares, 0.999)))


def _most(problem: Problem, shape: _Shape) -> Array:
    """(m,): how many times each start may be taken before a parameter is at its bound, or a body has half the
    mass of the moving arm.
    """
    arm = 0.5 * sum(link.mass for link in problem.robot.links[1:])
    upper = np.array([min(p.upper, arm) if p.unit == "kg" else p.upper for p in shape.parameters])
    with np.errstate(all="ignore"):
        times = np.where(shape.starts > 0, upper / shape.starts, np.inf)
    return np.asarray(times.min(axis=1))

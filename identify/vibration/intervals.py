"""The intervals of a fit of vibration, whichever cost it has.

The likelihood fits nuisance parameters along, so that its intervals are marginal over them.  No other
cost says how an error in kg is to be weighed against its residuals, in Hz or m/N: it is fitted as published,
with what was stated taken as exact, and its optimum is a function of the errors p that were not fitted.  By
the implicit function theorem

    dx/dp = -(J'J)^-1 J' dr/dp

with r the cost's own residuals and J their derivatives (Gauss-Newton: the squares that gradient methods
minimise; a sum of moduli of residuals that scatter alike has the same optimum, on average), and the stated
errors widen the intervals by it, linearly.

What a link that bends leaves open of the joints at its ends: how it bends right beside them is what they
do, so that no data tell it from their own compliance.

A hinge of compliance c at the end of a link, about the axis of a spring k of the joint there, makes of it
k / (1 + c k), and takes twice that share off its damper.  A beam has no such hinge, and a link of castings,
flanges and housings has one that nobody knows: its compliance is a share of the link's own, L / EI, whose
standard deviation is stated (`flexible_links.ends`).  Beside that spring it changes no prediction, and
where there is none, it is what a bearing would be called that gives way there.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from identify.core.arrays import Array, Index
from identify.core.parameters import Scale
from identify.fitting.objective import Objective
from identify.fitting.uncertainty import Uncertainty, propagated_uncertainty, with_more
from identify.model.effects.base import Effect
from identify.model.effects.link_flexibility import LinkFlexibility
from identify.model.system import System
from identify.robot.description import Robot
from identify.vibration.costs.make_target import Targets
from identify.vibration.nuisances.settings import FORMS_ALONE
from identify.vibration.problem import Problem
from identify.vibration.uncertainty import by_residuals, uncertainty

_TURNS = ("rx", "ry", "rz")
_OF = {"stiffness": 1.0, "damping": 2.0}
"""How many times its share of a joint's compliance changes each of the joint's numbers."""


def intervals(problem: Problem, values: Array) -> Uncertainty:
    """Of the parameters at values (unknowns,), the optimum of the study's cost."""
    targets, cost = problem.targets(), problem.file.study.cost
    if cost.likelihood or not targets.nuisances:
        return uncertainty(targets, Scale(problem.parameters), values)
    return _propagated(targets, cost.objective(targets), problem, values)


def _propagated(targets: Targets, objective: Objective, problem: Problem, values: Array) -> Uncertainty:
    own, values_of_effects = Scale(problem.of_effects), values[: problem.size]
    exact = Targets(targets.frf, targets.modal)
    found, wider, notes = by_residuals(exact, own, values_of_effects)
    moved = _moved(objective, Scale(problem.parameters), values, len(own.free), own, found.product)
    given = found.count, own, values_of_effects, notes, wider
    return propagated_uncertainty(found.product, found.variance, moved, *given)


def _moved(
    objective: Objective, every: Scale, values: Array, count: int, own: Scale, information: Array
) -> Array:
    """(f, e): how far each error moves the optimum, on the search scale.

    What the cost does not determine stays where the bounds put it.  They are weighed against the cost's
    residuals, which have no unit of noise, as if these said as much in all as the data do.
    """
    slope = every.slope(every.to_x(values))
    product = objective.product(values, every.free)[:-1, :-1] * np.outer(slope, slope)
    data = product[:count, :count]
    unit = np.trace(information) / max(np.trace(data), np.finfo(float).tiny)
    determined = unit * data + np.diag(own.prior_information())
    return np.asarray(-np.linalg.solve(determined, unit * product[:count, count:]))


def with_left_open(
    problem: Problem,
    trusted: Uncertainty,
    values: Array,
    unnamed: Mapping[str, float] | None = None,
) -> Uncertainty:
    """The uncertainty of a fit with what links that bend leave open of the joints at their ends; values
    (unknowns,).  unnamed: standard deviations of logarithms by name that come from what gives way without a
    name.
    """
    parameters = problem.of_effects
    scale, found = Scale(parameters), values[: problem.size]
    free = [parameters[number] for number in scale.free]
    ends = left_open(problem, values)[scale.free]
    others = np.array([(unnamed or {}).get(p.name, 0.0) for p in free])
    sources = (
        (
            ends,
            "bending of a link right beside a joint cannot be told from the joint",
            " (`flexible_links.ends`)",
        ),
        (others, "bearings and links too stiff to be named may be as compliant as they usually are", ""),
    )
    notes = []
    determined = np.array(trusted.status) == "determined"
    for std, cause, key in sources:
        if np.any(determined & (std > trusted.std)):
            most = int(np.argmax(np.where(determined, std / trusted.std, 0.0)))
            more = f"{100 * std[most]:.2g} % of uncertainty to {free[most].name}{key}"
            notes.append(f"{cause}: this adds {more}, more than the noise does; intervals include it")
    return with_more(trusted, np.hypot(ends, others), scale, found, *notes)


def left_open(problem: Problem, values: Array) -> Array:
    """(parameters,): the standard deviation of the logarithm of each parameter that the ends of links leave;
    none of what is fitted on another scale.
    """
    parameters = problem.of_effects
    value_of = {p.name: value for p, value in zip(parameters, values[: problem.size].tolist(), strict=True)}
    std = dict.fromkeys(value_of, 0.0)
    for coordinate, hinge in _hinges(problem, values).items():
        stiffness = value_of.get(f"{coordinate}.stiffness", 0.0)
        for what, times in _OF.items():
            if f"{coordinate}.{what}" in std:
                std[f"{coordinate}.{what}"] = times * hinge * stiffness
    return np.array([std[p.name] if p.log else 0.0 for p in parameters])


def odds_over_ends(problem: Problem, values: Array, effect: Effect) -> float:
    """Log odds at most of an effect of a problem, at values (unknowns,), over a link that bends and has a
    hinge at its end that does as much; infinite where none could.
    """
    system, hinges = problem.measurements[0].system, _hinges(problem, values)
    names = effect.free_coordinates(problem.robot)
    if not names or not set(names) <= set(hinges):
        return np.inf
    own = next(numbers for one, numbers in system.effects if one == effect)
    compliance = np.diag(_compliance(system, names, own, values))
    std = np.array([hinges[name] for name in names])
    return float(0.5 * np.sum((compliance / np.maximum(std, 1e-300)) ** 2))


def _compliance(system: System, names: Sequence[str], own: Index, values: Array) -> Array:
    """(c, c): of a link's coordinates; its parameters, numbers `own`, are stiffnesses or compliances."""
    at = np.array([system.coordinates.index(name) for name in names])
    stiffness = np.tensordot(values[own], system.terms["stiffness"][own], axes=1)[np.ix_(at, at)]
    if system.compliances is None or stiffness.any():
        return np.asarray(np.linalg.inv(stiffness))
    springs = system.compliances
    mine = np.isin(springs.compliance[springs.owner], own)
    motions = springs.columns[np.ix_(at, np.flatnonzero(mine))]
    return np.asarray((springs.at(values)[0][mine] * motions) @ motions.T)


def _hinges(problem: Problem, values: Array) -> dict[str, float]:
    """Of each rotation of a joint at an end of a link that bends the standard deviation of the compliance
    that the link's end may have about its axis, rad/(N m).
    """
    settings = problem.file.study.uncertainty or FORMS_ALONE
    share, found = settings.std("flexible_links", "ends"), dict[str, float]()
    robot, system = problem.robot, problem.measurements[0].system
    for effect, own in system.effects:
        if isinstance(effect, LinkFlexibility):
            for coordinate, compliance in _of_link(robot, system, effect, own, values):
                found[coordinate] = float(np.hypot(found.get(coordinate, 0.0), share * compliance))
    return found


def _of_link(
    robot: Robot, system: System, effect: LinkFlexibility, own: Index, values: Array
) -> Iterator[tuple[str, float]]:
    """Each rotation of a joint at an end of a link that bends, and the whole link's compliance about its
    axis; nothing of a link that was taken off for the test.
    """
    site = system.site
    names = [name for name in effect.free_coordinates(robot) if name in system.coordinates]
    if not names:
        return
    ends = names[-4], names[-2], names[-1]  # the two slopes and the twist of the end
    whole = np.diag(_compliance(system, names, own, values))[[-4, -2, -1]]
    number = effect.number(robot)
    turns = site.jacobian(robot.links[number + 1].name, np.zeros(3), "effects")[3:]
    about = turns[:, [site.number(name) for name in ends]]
    for joint in (number, number + 1):
        for axis in _TURNS:
            coordinate = f"joint{joint}.{axis}"
            if coordinate in system.coordinates:
                axes = about.T @ turns[:, site.number(coordinate)]
                yield coordinate, float(axes**2 @ whole)

"""Profile likelihood of one parameter: the best gap that the others can reach for each of its values.

Where the curve is a parabola in ln value, the interval of `identify.fitting.uncertainty` is right; where it
is flat to one side, the data give only a bound (Raue et al., Bioinformatics 25, 2009).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identify.core.arrays import Array
from identify.core.errors import InputError
from identify.core.parameters import Scale
from identify.fitting.optimizers.base import Search, minimized, parse_optimizer
from identify.fitting.uncertainty import Uncertainty
from identify.results.fit import ProfileCurve
from identify.vibration.costs.base import parse_cost
from identify.vibration.problem import Problem

_LEVEL = 3.841  # 95 % of chi-square with one degree of freedom


def profile(problem: Problem, best: Array, trusted: Uncertainty, name: str, points: int = 13) -> ProfileCurve:
    """Profile a free parameter around the optimum `best` (parameters,), 4 standard deviations either side;
    the rise of chi-square is over the inflation of the intervals squared.

    Needs FRFs with known noise.  An unknown or fixed parameter is an InputError.
    """
    check_profiled(problem, [name])
    scale = Scale(problem.parameters)
    free = [problem.parameters[number].name for number in scale.free]
    objective = parse_cost("frf-least-squares").objective(problem.targets())
    position = free.index(name)
    number, centre, std = int(scale.free[position]), scale.to_x(best)[position], trusted.std[position]
    lower, upper = (bound[position] for bound in scale.bounds())
    grid = np.clip(centre + std * np.linspace(-4, 4, points), lower, upper)
    count = sum(2 * target.sigma.size for target in problem.targets().frf)
    base = _chi_square(objective.costs(best[None])[0], count)
    inflation = std / trusted.independent_std[position]
    values, rise = np.zeros(points), np.zeros(points)
    for order in (range(points // 2, -1, -1), range(points // 2, points)):
        warm = best
        for step in order:
            x = scale.to_x(warm)
            x[position] = grid[step]
            values[step] = scale.to_values(x)[number]
            held = replace(problem.parameters[number], initial=values[step], free=False)
            parameters = tuple(held if n == number else p for n, p in enumerate(problem.parameters))
            search = Search(objective, Scale(parameters), 60)
            begun = np.delete(x, position)
            minimized(parse_optimizer("gauss-newton"), search, begun, np.random.default_rng(0))
            rise[step] = (_chi_square(search.best_cost, count) - base) / inflation**2
            if search.best_x is not None:
                warm = search.scale.to_values(search.best_x)
    middle = points // 2
    return ProfileCurve(
        values,
        rise,
        _crossing(values[: middle + 1][::-1], rise[: middle + 1][::-1]),
        _crossing(values[middle:], rise[middle:]),
    )


def check_profiled(problem: Problem, names: Sequence[str]) -> None:
    """Raise the InputError of `profile` for these names before anything is fitted."""
    free = [p.name for p in problem.parameters if p.free]
    for name in names:
        if name not in free:
            raise InputError("--profile", f"no free parameter {name!r}", "one of " + ", ".join(free))
    for target in problem.targets().frf if names else ():
        _ = target.sigma
    if names and not problem.targets().frf:
        raise InputError("--profile", "no measurement with FRFs is fitted", "at least one with `file`")


def _chi_square(gap: float, count: int) -> float:
    return float(gap**2 * count)


def _crossing(values: Array, rise: Array) -> float:
    """Where the rise first crosses the 95 % level, by interpolation in ln value (or value); NaN where it does
    not.
    """
    above = np.flatnonzero(rise > _LEVEL)
    if not above.size or above[0] == 0:
        return float("nan")
    last, first = above[0] - 1, above[0]
    share = (_LEVEL - rise[last]) / (rise[first] - rise[last])
    return float(values[last] + share * (values[first] - values[last]))

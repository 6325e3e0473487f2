"""Coupled springs and dampers across z: directions of most and least compliance anywhere in the plane.

Of a bearing's tilt, K = [[k_x, k_xy], [k_xy, k_y]] about the joint's x and y: two stiffnesses k_1, k_2 in
directions turned by an angle a have k_xy = (k_1 - k_2) sin(a) cos(a).  All three enter the model linearly, as
k_1, k_2 and a would not.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import product

import numpy as np

from identify.core.arrays import Array
from identify.core.parameters import Parameter, Values, parameter
from identify.model.effects.base import Term
from identify.model.effects.site import Site

PAIRS = (("rx", "ry"), ("tx", "ty"))
"""Axes that can be coupled."""
BETWEEN = ("_plus_", "_minus_")
"""In names of places halfway between two axes."""
_REACH = 100.0
"""How many times the start of both coupled springs (their geometric mean) the coupling reaches."""
_UNLIKE, _DIRECTIONS = (10.0, 100.0), np.pi / 8 * np.arange(8)
"""Ratios of the stiffest to the softest direction, and directions, to start from."""


def coupling_terms(
    site: Site, own: Sequence[Term], pairs: Sequence[tuple[str, str]], keys: tuple[str, str]
) -> Iterator[Term]:
    """A stiffness and a damping off the diagonal for each pair of axes of each body, zero to begin with.

    own: the terms on the diagonal, by name such as joint3.rx.stiffness; keys: those of stiffness and damping
    in the config.
    """
    parameters = {term.parameter.name: term.parameter for term in own}
    bodies = dict.fromkeys(name.partition(".")[0] for name in parameters)
    for body, (x, y) in product(bodies, pairs):
        both = np.outer(site.vector(f"{body}.{x}"), site.vector(f"{body}.{y}"))
        stiffness, damping = (
            _between(
                parameters[f"{body}.{x}.{role}"],
                parameters[f"{body}.{y}.{role}"],
                f"{body}.{x}_{y}.{role}",
                key,
            )
            for role, key in zip(("stiffness", "damping"), keys, strict=True)
        )
        yield Term(stiffness, stiffness=both + both.T)
        yield Term(damping, damping=both + both.T)


def diagonals(
    site: Site, places: Sequence[tuple[str, str, Array]], pairs: Sequence[tuple[str, str]]
) -> Iterator[tuple[str, str, Array]]:
    """Places halfway between the axes of pairs, such as joint3.rx_plus_ry and joint3.rx_minus_ry: compliances
    of these and of the axes make up whatever lies anywhere in the plane, and none of them is below zero.
    """
    units = {name: unit for name, unit, _ in places}
    for body, (x, y) in product(dict.fromkeys(name.partition(".")[0] for name in units), pairs):
        along, across = (site.vector(f"{body}.{axis}") for axis in (x, y))
        for between, sign in zip(BETWEEN, (1, -1), strict=True):
            vector = (along + sign * across) / np.sqrt(2)
            yield f"{body}.{x}{between}{y}", units[f"{body}.{x}"], np.outer(vector, vector)


def first_of(place: str) -> str:
    """joint3.rx of joint3.rx_plus_ry, and any other place itself."""
    return min((place.partition(between)[0] for between in BETWEEN), key=len)


def soft_axes(places: Iterable[str]) -> tuple[set[str], bool]:
    """The axes that places are along or between, and whether any is between."""
    apart = [place.replace(BETWEEN[1], BETWEEN[0]).split(BETWEEN[0]) for place in places]
    return {axis for one in apart for axis in one}, any(len(one) > 1 for one in apart)


def from_diagonals(
    values: Mapping[str, float], body: str, pair: tuple[str, str], rigid: float
) -> dict[str, float]:
    """Stiffnesses and dampings of a coupled pair of axes of a body, by name, that compliances and retardation
    times of these and of what lies between them are; rigid: a compliance that counts as none.
    """
    x, y = pair
    compliance, late = rigid * np.eye(2), np.zeros((2, 2))
    half = np.sqrt(0.5)
    names = (x, y, *(f"{x}{between}{y}" for between in BETWEEN))
    for name, vector in zip(names, ([1, 0], [0, 1], [half, half], [half, -half]), strict=True):
        own = values[f"{body}.{name}.compliance"] * np.outer(vector, vector)
        compliance, late = compliance + own, late + values[f"{body}.{name}.retardation_time"] * own
    stiffness = np.linalg.inv(compliance)
    found = {"stiffness": stiffness, "damping": stiffness @ late @ stiffness}
    places = ((x, 0, 0), (y, 1, 1), (f"{x}_{y}", 0, 1))
    return {
        f"{body}.{name}.{role}": float(matrix[row, column])
        for role, matrix in found.items()
        for name, row, column in places
    }


def _between(one: Parameter, other: Parameter, name: str, key: str) -> Parameter:
    reach = _REACH * float(np.sqrt(one.initial * other.initial))
    values = Values(initial=0.0, bounds=(-reach, reach), fixed=not one.free)
    return parameter(name, one.unit, 0.0, values, key, log=False)


def with_directions(starts: Array, parameters: Sequence[Parameter]) -> Array:
    """Starts (m, parameters) without coupling, then each also stiffer in one direction and softer across it,
    where bounds let it be; as they are where the parameters are not whole pairs.
    """
    names = [p.name for p in parameters]
    couplings = {name: pair for name in names if (pair := coupled_with(name))}
    if not couplings or not {one for pair in couplings.values() for one in pair} <= set(names):
        return starts
    found = [starts]
    for ratio, angle in product(_UNLIKE, _DIRECTIONS):
        turned = starts.copy()
        for name, pair in couplings.items():
            own = [names.index(one) for one in (*pair, name)]
            unlike = np.sqrt(ratio) if name.endswith(".damping") else ratio
            turned[:, own] = _turned(turned[:, own[:2]], unlike, angle)
        found.append(turned)
    every = np.concatenate(found)
    lower, upper = (np.array([getattr(p, side) for p in parameters]) for side in ("lower", "upper"))
    return np.asarray(every[np.all((lower <= every) & (every <= upper), axis=1)])


def coupled_with(name: str) -> tuple[str, str] | None:
    """joint3.rx.stiffness and joint3.ry.stiffness of joint3.rx_ry.stiffness; None of any other name."""
    body, _, rest = name.partition(".")
    axes, _, role = rest.partition(".")
    if tuple(axes.split("_")) not in PAIRS:
        return None
    first, second = axes.split("_")
    return f"{body}.{first}.{role}", f"{body}.{second}.{role}"


def _turned(diagonal: Array, ratio: float, angle: float) -> Array:
    """(m, 3): xx, yy and xy of two springs (m, 2) made unlike by a ratio in directions turned by an angle."""
    stiff, soft, c, s = ratio**0.5, ratio**-0.5, np.cos(angle), np.sin(angle)
    x, y = diagonal.T
    return np.column_stack(
        [
            x * (c * c * stiff + s * s * soft),
            y * (s * s * stiff + c * c * soft),
            np.sqrt(x * y) * c * s * (stiff - soft),
        ]
    )

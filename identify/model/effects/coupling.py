"""Coupled springs and dampers across z: directions of most and least compliance anywhere in the plane.

Of a bearing's tilt, K = [[k_x, k_xy], [k_xy, k_y]] about the joint's x and y: two stiffnesses k_1, k_2 in
directions turned by an angle a have k_xy = (k_1 - k_2) sin(a) cos(a).  All three enter the model linearly, as
k_1, k_2 and a would not.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import product

import numpy as np

from identify.core.arrays import Array
from identify.core.parameters import Parameter, Values, parameter
from identify.model.effects.base import Term
from identify.model.effects.site import Site

PAIRS = (("rx", "ry"), ("tx", "ty"))
"""Axes that can be coupled."""
_BETWEEN_DEG = (22.5, 45.0, 67.5, 112.5, 135.0, 157.5)
"""Directions from the first axis of a pair to the second and on: with the axes, every 22.5 degrees."""
_BETWEEN = re.compile(r"_\d+_([rt]y)$")
SHARE = 1 / len(_BETWEEN_DEG)
"""What each of them counts as: all together are one more entry of a symmetric matrix."""
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
    """Places between the axes of pairs, such as joint3.rx_45_ry at 45 degrees: of compliances in these
    directions and along the axes, none of which is below zero, any two across each other can be made that
    differ by a factor of up to 25, cot^2(11.25 degrees), and nearly so where they differ by more.
    """
    units = {name: unit for name, unit, _ in places}
    for body, (x, y) in product(dict.fromkeys(name.partition(".")[0] for name in units), pairs):
        along, across = (site.vector(f"{body}.{axis}") for axis in (x, y))
        for name, (c, s) in _directions(x, y).items():
            vector = c * along + s * across
            yield f"{body}.{name}", units[f"{body}.{x}"], np.outer(vector, vector)


def _directions(x: str, y: str) -> dict[str, tuple[float, float]]:
    """Cosine and sine of the directions between two axes, by name."""
    return {f"{x}_{deg:.0f}_{y}": (np.cos(np.radians(deg)), np.sin(np.radians(deg))) for deg in _BETWEEN_DEG}


def is_between(place: str) -> bool:
    """Whether a place lies between two axes."""
    return bool(_BETWEEN.search(place))


def first_of(place: str) -> str:
    """joint3.rx of joint3.rx_45_ry, and any other place itself."""
    return _BETWEEN.sub("", place)


def soft_axes(places: Iterable[str]) -> tuple[set[str], bool]:
    """The axes that places are along or between, and whether any is between."""
    found, coupled = set[str](), False
    for place in places:
        found.add(first_of(place))
        if between := _BETWEEN.search(place):
            found.add(between[1])
            coupled = True
    return found, coupled


def from_diagonals(
    values: Mapping[str, float], body: str, pair: tuple[str, str], rigid: float
) -> dict[str, float]:
    """Stiffnesses and dampings of a coupled pair of axes of a body, by name, that compliances and retardation
    times of these and of what lies between them are; rigid: a compliance that counts as none.
    """
    x, y = pair
    compliance, late = rigid * np.eye(2), np.zeros((2, 2))
    for name, vector in {x: (1.0, 0.0), y: (0.0, 1.0), **_directions(x, y)}.items():
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

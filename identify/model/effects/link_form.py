"""In what a link that bends may differ from the beam that stands for it.

Sections jump where parts are bolted together, and motors sit anywhere along a link: its sensors follow its
end by other shapes than a beam's, and its mass moves with other sections than a rod's.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial

import numpy as np

from identify.core.arrays import Array, cross
from identify.model.effects.beam import Beam
from identify.model.effects.place import Form, What
from identify.model.effects.rigid_body import MOMENTS, rigid_body
from identify.model.effects.site import Site
from identify.robot.description import Link
from identify.robot.points import Point

_STATIONS = {"third": 1 / 3, "two_thirds": 2 / 3, "end": 1.0}
"""Where along the link bodies may be that the rod of the model lacks or has too much of."""
_MOMENTS = MOMENTS[:4]
"""Of a body there: its mass and first moments."""
_RAMP = 3.0
"""One over the share of the length, from either end, within which shapes come to differ."""
_IN_PLANE = (
    "deflection_{}_by_deflection",
    "deflection_{}_by_slope",
    "slope_{}_by_deflection",
    "slope_{}_by_slope",
)


def link_form(
    link: Link,
    beam: Beam,
    names: Sequence[str],
    points: Mapping[int, Point],
    spread: Callable[[Site], Array] | None,
) -> Form:
    """Errors of a link's form; names: of the coordinates of its beam, those of the end last; spread: inertia
    where all of the link's mass moves evenly with its sections, less where it moves with its own; None
    of a link of which that is a parameter.

    The mass of a body at each of three stations is in units of the link's, its first moments in those of the
    link's times half its length; the rigid link stays as it was.  Second moments of their own would let
    sections have less than no inertia, and say little.
    The slope at a sensor is off in units of the end's slope, or of its deflection over the length; its
    deflection by a third of that.  At the start of the beam and at its end nothing is off.
    """
    own = {node: points[node] for node in sorted(points) if points[node].link == link.name}
    shapes = [f"{one}_at_{node}" for node in own for one in _shape_names()]
    masses = [f"{name}_at_{station}" for station in _STATIONS for name in _MOMENTS]
    errors: list[tuple[str, What]] = [(name, "shape") for name in shapes]
    errors += [(name, "mass") for name in masses]
    errors += [] if spread is None else [("even_share", "spread")]
    return Form(link.name, tuple(errors), partial(_changes, link, beam, tuple(names), own, spread))


def _shape_names() -> list[str]:
    return [*(name.format(plane) for plane in (1, 2) for name in _IN_PLANE), "twist"]


def _changes(
    link: Link,
    beam: Beam,
    names: tuple[str, ...],
    points: Mapping[int, Point],
    spread: Callable[[Site], Array] | None,
    site: Site,
) -> tuple[Array, Mapping[int, Array]]:
    """As `Form` has it."""
    size, shapes = len(site.coordinates), len(_shape_names())
    each = len(points) * shapes
    last = each + len(_STATIONS) * len(_MOMENTS)
    mass = np.zeros((last + (spread is not None), size, size))
    motion = {node: np.zeros((len(mass), 6, size)) for node in points}
    if link.name in site.detached:
        return mass, motion
    end = np.array([site.vector(name) for name in Beam.of_end(names)])
    for number, (node, point) in enumerate(points.items()):
        motion[node][number * shapes : (number + 1) * shapes] = _off(beam, point.position, end)
    sizes = link.mass * (beam.length / 2) ** np.array([0, 1, 1, 1])[:, None, None]
    places = [beam.start + share * (beam.end - beam.start) for share in _STATIONS.values()]
    bodies = [bodies_at(site, link.name, names, place)[: len(_MOMENTS)] for place in places]
    mass[each:last] = np.concatenate([sizes * body for body in bodies])
    if spread is not None:
        mass[last] = spread(site)
    return mass, motion


def _off(beam: Beam, at: Array, end: Array) -> Array:
    """(9, 6, n): what shapes that differ move at a point (3,) of the link; end (5, n): the coordinates of the
    beam's end.
    """
    along = float(np.clip((at - beam.start) @ beam.axis / beam.length, 0.0, 1.0))
    lever = at - beam.start - along * beam.length * beam.axis
    much = min(1.0, _RAMP * along, _RAMP * (1 - along))

    def turned(about: Array) -> Array:
        return np.concatenate([cross(about, lever), about])

    found = []
    for plane, about in enumerate(beam.across):
        deflection, slope = end[2 * plane] / beam.length, end[2 * plane + 1]
        aside = np.concatenate([cross(about, beam.axis), np.zeros(3)]) * beam.length / 3
        found += [np.outer(moved, by) for moved in (aside, turned(about)) for by in (deflection, slope)]
    return much * np.array([*found, np.outer(turned(beam.axis), end[4])])


def bodies_at(site: Site, link: str, names: Sequence[str], place: Array) -> Array:
    """(10, n, n): inertia per unit of each of `MOMENTS` of a body that moves with the link's section at a
    place (3,), less what it has on the rigid link; names: of the coordinates by which the link deforms.
    """
    moving = site.jacobian(link, place, "effects.link-flexibility.link")
    rigid = moving.copy()
    if link not in site.detached:
        rigid[:, [site.number(name) for name in names]] = 0.0
    there, here = (rigid_body(motion[:3], motion[3:]) for motion in (moving, rigid))
    return np.array(there) - np.array(here)

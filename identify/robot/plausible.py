"""Whether the bodies of a description can be those of a robot: its masses beside meshes and data sheet.

Many public descriptions have placeholders where bodies should be, and nothing else in a study shows it: every
stiffness is then as wrong as the masses are.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from identify.core.arrays import Array
from identify.core.errors import InputError
from identify.core.text import listed
from identify.robot.description import Link, Robot
from identify.robot.mesh_body import Shape, shapes

_DENSITY = (500.0, 2500.0)
"""kg/m^3 of the moving links over the convex hulls of their meshes: of 50 robots whose bodies are known it is
710 to 1800, the median 1020 (docs/mesh_bodies.md)."""
_EVEN, _WATER = 0.02, 1000.0
"""Spread of density over links below which all are of one material; that of water, which CAD takes where none
is chosen."""
_ROUND = 1e-3
"""Difference of the principal moments over their sum, below which a body is as a ball."""
_FEW = 3
_MOVING = (0.3, 1.0)
"""Moving mass over that of a data sheet."""


@dataclass(frozen=True)
class Masses:
    """What a description says of masses: sentence with total and moving mass; doubts about them."""

    sentence: str
    doubts: tuple[str, ...]


def masses(robot: Robot, data_sheet_kg: float | None = None) -> Masses:
    """The masses of a robot, without payloads, and what is plainly wrong with them."""
    links = _without_payloads(robot)
    base, moving = links[0].mass, sum(link.mass for link in links[1:])
    said = f"the moving links have {moving:.4g} kg together ({_each(links)})"
    said += f", the base {base:.4g} kg" if base else "; the mass of the base is not stated"
    known = [link for link in links[1:] if link.mass > 0 and np.any(link.inertia)]
    found = dict[str, Shape]()
    if len(known) == len(links) - 1:
        found = {name: shape for name, shape in shapes(robot).items() if name in {k.name for k in known}}
    doubts = [*_against_sheet(moving, base, data_sheet_kg), *_alike(known)]
    if len(found) == len(known) and known:
        doubts += _dense(known, found)
    return Masses(said, tuple(doubts))


def _without_payloads(robot: Robot) -> list[Link]:
    """Links with the masses that the file says."""
    more = {
        link: sum(body.mass for name, body in robot.payloads if name == link) for link, _ in robot.payloads
    }
    return [
        Link(link.name, link.mass - more.get(link.name, 0.0), link.centre, link.inertia)
        for link in robot.links
    ]


def _each(links: list[Link]) -> str:
    return ", ".join(f"{link.name} {link.mass:.3g}" for link in links[1:])


def _against_sheet(moving: float, base: float, sheet: float | None) -> Iterator[str]:
    if sheet is None:
        return
    share = moving / sheet
    if share > _MOVING[1] or share < _MOVING[0] or (base and not 0.8 < (moving + base) / sheet < 1.25):
        whole = f", {moving + base:.4g} kg with the base" if base else ""
        yield (
            f"the moving links have {moving:.4g} kg{whole}, but the data sheet says {sheet:.4g} kg: the"
            " masses of the file are wrong, or it is another robot"
        )


def _alike(known: list[Link]) -> Iterator[str]:
    """Bodies that nobody has weighed: several as balls, or all the same."""
    balls = [link.name for link in known if _is_ball(link.inertia)]
    if len(balls) >= _FEW:
        yield f"the inertias of {listed(balls)} are those of balls: placeholders, not of these links"
    same = [(link.mass, *np.round(link.inertia.ravel(), 12)) for link in known]
    if len(same) >= _FEW and len(set(same)) == 1:
        yield "all moving links have the same mass and inertia: placeholders, not of these links"


def _is_ball(inertia: Array) -> bool:
    principal = np.linalg.eigvalsh(inertia)
    return float(np.ptp(principal)) < _ROUND * float(principal.sum())


def _dense(known: list[Link], found: Mapping[str, Shape]) -> Iterator[str]:
    try:
        hull = sum(found[link.name].hull.size for link in known)
        each = np.array([link.mass / found[link.name].solid.size for link in known])
    except InputError:
        return
    density = sum(link.mass for link in known) / hull
    if not _DENSITY[0] < density < _DENSITY[1]:
        yield (
            f"by their meshes the moving links would have {density:.3g} kg per m3, where robots have 700 to"
            " 1800: the masses or the meshes are wrong"
        )
    elif len(each) >= _FEW and np.ptp(each) < _EVEN * each.mean() and abs(each.mean() / _WATER - 1) < _EVEN:
        yield (
            "every link has the density of water in its mesh: the masses are what CAD makes where no"
            " material is chosen, not those of the robot"
        )

"""A link that bends and twists between its joint and the next, as a cantilever whose end carries the rest of
the arm.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from typing import ClassVar, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from identify.core.arrays import Array, cross
from identify.core.errors import InputError
from identify.core.parameters import DampingValues, Parameter, Values, parameter
from identify.model.effects.base import Effect, Term
from identify.model.effects.beam import Beam, evenly, slices
from identify.model.effects.link_form import bodies_at, link_form
from identify.model.effects.place import Form
from identify.model.effects.rigid_body import MOMENTS
from identify.model.effects.site import Added, Site
from identify.model.effects.springs import ComplianceStd, check_shrinks, compliance_terms, spring_terms
from identify.robot.description import Robot
from identify.robot.points import Point
from identify.robot.posture import AXES, Mechanism

_PARTS = 3
"""Of a nonuniform link: three stiffnesses say all that loads at an end ask of a plane."""
_REACH = 10.0
_STIFFNESSES = ("bending_1", "bending_2", "torsion")
_AT_END = MOMENTS[:4]
"""Of a body at the end: its mass and first moments."""
_ROUNDING = 1e-9
"""Share of the largest eigenvalue of a part's compliance below which it is rounding."""
_SHORT = 0.05
"""Links shorter than this share of the arm are stubs, not beams: no place for discovery."""


class LinkFlexibility(Effect):
    """Euler-Bernoulli bending in two planes with stiffnesses EI, and Saint-Venant torsion GJ; five
    coordinates at the far end, and three between the ends.

    In each plane the end's deflection w and slope t have K = EI/L^3 [[12, -6 L], [-6 L, 4 L^2]]; the twist
    has GJ/L.  The damping is proportional: the same matrices with a viscous EI' and GJ'.  In between the link
    deforms as under loads at its end (cubic, linear) and, as its own inertia makes it, by one more shape in
    each plane and in torsion; its own mass moves with it (consistent mass matrix), its weight acts as on a
    rigid link.

    The first plane is that in which the joint swings the link, or, where the link lies along its joint's
    axis, the next one.

    A nonuniform link has three parts of equal length, with coordinates at the end of each; in each plane and
    in torsion the first and the last are stiffer or softer than the middle: a rib, a flange, a thinner half.
    Its mass does not only move with the section where it sits, because motors and housings overhang: a share
    of all of it goes evenly with all sections, and a mass that is missing elsewhere on the link goes with the
    end, so that the rigid link stays as it was.
    """

    RENAMED: ClassVar[Mapping[str, str]] = {"uneven": "nonuniform"}
    kind: Literal["link-flexibility"] = "link-flexibility"
    link: str = Field(description="a link between two joints")
    flexible_share: float = Field(
        1.0,
        gt=0,
        le=1,
        description=(
            "share of the length, in the middle, that deforms; less where the joints' housings are stiff"
        ),
    )
    shrink: bool = Field(
        False, description="true: compliances, zero unless the data ask for more; only of a uniform link"
    )
    compliance_std: ComplianceStd = Field(
        None,
        description=(
            "with `shrink`: standard deviation of 1/EI and of 1/GJ about zero, 1/(N m^2); default: nothing is"
            " known of them"
        ),
    )
    nonuniform: bool = Field(
        False, description="stiffness and mass are not spread evenly over the length: 11 more parameters"
    )
    bending: Values = Field(
        Values(),
        description="EI, or one per plane, N m^2; default start: 20 Hz with what it carries, all else held",
    )
    bending_damping: DampingValues = Field(DampingValues(), description="EI', N m^2 s")
    torsion: Values = Field(Values(), description="GJ, N m^2; default start likewise")
    torsion_damping: DampingValues = Field(DampingValues(), description="GJ', N m^2 s")

    @model_validator(mode="after")
    def _shrinks(self) -> Self:
        check_shrinks(self.compliance_std, self.shrink)
        return self

    def sentence(self) -> str:
        """For example: flexibility of link2 (bending, torsion)."""
        return f"flexibility of {self.link} (bending, torsion{', nonuniform' if self.nonuniform else ''})"

    @classmethod
    def instances(cls, robot: Robot, points: Mapping[int, Point]) -> Iterator[Self]:
        """Every moving link that reaches from joint to joint."""
        spans = [np.linalg.norm(np.subtract(*_ends(robot, number))) for number in range(1, len(robot.joints))]
        for number, span in enumerate(spans, start=1):
            if span > _SHORT * sum(spans):
                yield cls(link=robot.links[number].name)

    def variants(self) -> list[Self]:
        """Nonuniform instead of uniform, and the other way round."""
        return [self.model_copy(update={"nonuniform": not self.nonuniform})]

    @property
    def _where(self) -> str:
        return f"effects.{self.kind}.link"

    def number(self, robot: Robot) -> int:
        """Of the link among the robot's, and of the joint that carries it."""
        number = robot.links.index(robot.link(self.link, self._where))
        if number == len(robot.joints):
            raise InputError(
                self._where, f"{self.link} carries no further joint", "a link between two joints"
            )
        return number

    def beam(self, robot: Robot) -> Beam:
        """What deforms of the link, in its frame."""
        number = self.number(robot)
        start, end = _ends(robot, number)
        if np.linalg.norm(end - start) < 1e-6:
            raise InputError(
                self._where, f"{self.link} has no length: the joints at its ends meet", "a longer link"
            )
        rigid = (1 - self.flexible_share) / 2 * (end - start)
        return Beam.between(start + rigid, end - rigid, _swing(robot, number, end - start), self._parts)

    @property
    def _parts(self) -> int:
        return _PARTS if self.nonuniform else 1

    def _names(self) -> list[str]:
        return [f"{self.link}.{name}" for name in Beam.names(self._parts)]

    def added_coordinates(self, robot: Robot, mechanism: Mechanism) -> list[Added]:
        """Deflections and slopes of the end in two planes, and its twist; the next joint's frame goes with
        them.
        """
        number = self.number(robot)
        following, joint = f"joint{number + 1}", _ends(robot, number)[1]
        turn = next((body.pose[:3, :3].T for body in mechanism.bodies if body.name == following), None)
        added = []
        for name, deformation in zip(self._names(), self.beam(robot).deformations(), strict=True):
            engine: dict[str, float] = {}
            if turn is not None:
                into = turn @ mechanism.frames[self.link][1][:3, :3]
                moved = deformation(joint).reshape(2, 3) @ into.T
                engine = dict(
                    zip((f"{following}.{axis}" for axis in AXES), moved.ravel().tolist(), strict=True)
                )
            added.append(Added(name, self.link, engine, deformation))
        return added

    def consistent_mass(self, robot: Robot, site: Site) -> Array | None:
        """The link's mass in slices along the beam that move as it deforms, less the same slices on the rigid
        link.
        """
        return self._moving(robot, site, self._slices(robot))

    def _slices(self, robot: Robot) -> list[tuple[Array, float, Array, Array]]:
        """The link's mass, each slice to move with the section where it sits."""
        parts = slices(robot.link(self.link), self.beam(robot).axis, self._parts)
        return [(centre, mass, centre, inertia) for mass, centre, inertia in parts]

    def _moving(self, robot: Robot, site: Site, bodies: Sequence[tuple[Array, float, Array, Array]]) -> Array:
        """Mass matrix of bodies that move with the sections at some points (3,), each with its mass, centre
        and inertia about it, less that of the same bodies on the rigid link.

        First by the motion of the link's frame, then of the beam's coordinates.
        """
        if self.link in site.detached:
            return np.zeros((len(site.coordinates),) * 2)
        names = self._names()
        rigid = site.jacobian(self.link, np.zeros(3), self._where)
        rigid[:, [site.number(name) for name in names]] = 0.0
        motion = np.vstack([rigid, [site.vector(name) for name in names]])
        points = np.array([at for at, *_ in bodies]).reshape(-1, 3)
        bent = np.stack([moved(points) for moved in self.beam(robot).deformations()], axis=-1)
        total = np.zeros((len(motion),) * 2)
        for (at, mass, centre, inertia), own in zip(bodies, bent, strict=True):
            moving = np.hstack([np.eye(6), own])
            moving[:3, :6] += cross(moving[3:, :6].T, centre).T
            moving[:3, 6:] += cross(own[3:].T, centre - at).T
            inertias = mass * moving[:3].T @ moving[:3] + moving[3:].T @ inertia @ moving[3:]
            inertias[:6, :6] = 0.0
            total += inertias
        return np.asarray(motion.T @ total @ motion)

    def forms(self, robot: Robot, points: Mapping[int, Point]) -> list[Form]:
        """How its sensors move with its end, and where along it its mass is."""
        spread = None if self.nonuniform else partial(self._spread, robot)
        return [link_form(robot.link(self.link), self.beam(robot), self._names(), points, spread)]

    def free_coordinates(self, robot: Robot) -> list[str]:
        """All coordinates of its beam."""
        return self._names()

    def terms(self, robot: Robot, site: Site, where: str) -> list[Term]:
        """EI and EI' of the two planes, GJ, GJ', with the beam's matrices as stiffness and as damping; of a
        nonuniform link then what its first and last part have more, and where its mass is.
        """
        names, beam = self._names(), self.beam(robot).stiffness()
        motion = np.array([site.vector(name) for name in names])
        numbers = [site.reference.number(name) for name in names]
        mass = site.reference.mass[np.ix_(numbers, numbers)]
        # The slowest motion of each group on its own has w^2 = k / moved, k the stiffness to be identified.
        moved = np.array([_largest(matrix, mass) for matrix in beam.sum(axis=1)])
        parts = motion.T @ beam @ motion
        places = [
            (f"{self.link}.{name}", "N m^2", matrix)
            for name, matrix in zip(_STIFFNESSES, parts.sum(axis=1), strict=True)
        ]
        bending, torsion = ((f"{where}.{what}", f"{where}.{what}_damping") for what in ("bending", "torsion"))
        if self.shrink and self.nonuniform:
            return [*self._by_part(parts, moved, bending, torsion), *self._masses(robot, site, where)]
        make = partial(compliance_terms, std=self.compliance_std) if self.shrink else spring_terms
        even = [
            *make(places[:2], moved[:2], self.bending, self.bending_damping, bending),
            *make(places[2:], moved[2:], self.torsion, self.torsion_damping, torsion),
        ]
        if not self.nonuniform:
            return even
        starts = [term.parameter.initial for term in even[::2]]
        return [*even, *_further(self.link, parts, starts, where), *self._masses(robot, site, where)]

    def _by_part(
        self, parts: Array, moved: Array, bending: tuple[str, str], torsion: tuple[str, str]
    ) -> list[Term]:
        """A compliance 1/EI and a retardation time of each part of a nonuniform link (3, parts, n, n),
        one behind the other: a part adds K^-1 K_part K^-1 to the compliance of the end, K of all parts.
        """
        found, keys = list[Term](), (bending, bending, torsion)
        values = (self.bending, self.bending, self.torsion)
        dampers = (self.bending_damping, self.bending_damping, self.torsion_damping)
        for plane, (name, own) in enumerate(zip(_STIFFNESSES, parts, strict=True)):
            whole = np.linalg.pinv(own.sum(axis=0), hermitian=True)
            for number, part in enumerate(own, start=1):
                place = (
                    f"{self.link}.{name}.part_{number}",
                    "N m^2",
                    np.linalg.pinv(whole @ part @ whole, rcond=_ROUNDING, hermitian=True),
                )
                given = values[plane], dampers[plane], keys[plane], self.compliance_std
                found += compliance_terms([place], moved[[plane]], *given)
        return found

    def _masses(self, robot: Robot, site: Site, where: str) -> list[Term]:
        """The share of the link that moves evenly with all sections, and what a body no heavier and no longer
        than it has at its end.
        """
        link, beam = robot.link(self.link), self.beam(robot)
        reaches = (1.0, link.mass, *[link.mass * beam.length] * 3)
        names, units = ("even_share", *(f"end_{name}" for name in _AT_END)), ("1", "kg", *["kg m"] * 3)
        end = bodies_at(site, self.link, self._names(), _ends(robot, self.number(robot))[1])
        inertias = [self._spread(robot, site), *end[: len(_AT_END)]]
        return [
            Term(_within(f"{self.link}.{name}", unit, reach, where), mass=inertia)
            for name, unit, reach, inertia in zip(names, units, reaches, inertias, strict=True)
        ]

    def _spread(self, robot: Robot, site: Site) -> Array:
        """Inertia of the link's mass where it moves evenly with all sections, less where each moves with its
        own.
        """
        link, beam = robot.link(self.link), self.beam(robot)
        stations = [(beam.start + x * (beam.end - beam.start), share) for x, share in evenly(self._parts)]
        even = [(at, share * link.mass, link.centre, share * link.inertia) for at, share in stations]
        own = [(at, -mass, centre, -inertia) for at, mass, centre, inertia in self._slices(robot)]
        return self._moving(robot, site, [*even, *own])


def _within(name: str, unit: str, reach: float, where: str) -> Parameter:
    return parameter(name, unit, 0.0, Values(initial=0.0, bounds=(-reach, reach)), where, log=False)


def _further(link: str, parts: Array, starts: Sequence[float], where: str) -> list[Term]:
    """What the first and the last part (3, parts, n, n) have more in each plane and in torsion, within some
    multiple of the start.
    """
    return [
        Term(_within(f"{link}.{name}.{end}_stiffness", "N m^2", _REACH * start, where), stiffness=own[part])
        for name, own, start in zip(_STIFFNESSES, parts, starts, strict=True)
        for end, part in (("near", 0), ("far", -1))
    ]


def _ends(robot: Robot, number: int) -> tuple[Array, Array]:
    """Origins of the joint frames at the near and the far end of a link, in the link's frame."""
    mount = robot.joints[number - 1].mount if number else np.eye(4)
    return -mount[:3, :3].T @ mount[:3, 3], robot.joints[number].origin[:3, 3]


def _swing(robot: Robot, number: int, along: Array) -> Array:
    """The axis (3,) of the link's joint in the link's frame, or the next joint's, or any: the first that is
    across the link.
    """
    axes = [robot.joints[number].origin[:3, :3] @ robot.joints[number].axis, *np.eye(3)]
    if number:
        own = robot.joints[number - 1]
        axes.insert(0, own.mount[:3, :3].T @ own.axis)
    return next(axis for axis in axes if np.linalg.norm(cross(axis, along)) > 0.5 * np.linalg.norm(along))


def _largest(stiffness: Array, mass: Array) -> float:
    """Largest m/k over the coordinates that a stiffness (n, n) holds."""
    held = np.ix_(np.any(stiffness, axis=0), np.any(stiffness, axis=0))
    return float(np.linalg.eigvals(np.linalg.solve(stiffness[held], mass[held])).real.max())

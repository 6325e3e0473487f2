"""Springs that a model of motion lacks: classes of coordinates, so stiff to begin with that the step resolves
them, and the effects that a study names.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy

from identify.core.arrays import Array, Mask
from identify.core.parameters import Values
from identify.core.text import listed
from identify.model.effects.base_compliance import BaseCompliance
from identify.model.effects.joint_compliance import JointCompliance
from identify.model.effects.link_flexibility import LinkFlexibility
from identify.model.effects.springs import START_HZ
from identify.motion.changed import with_effects
from identify.motion.links import AXES, parts
from identify.motion.problem import MotionProblem
from identify.motion.study import MotionCandidate, Spring

_STEP, _RESOLVED = 6.25e-5, 0.25
"""Step of integration, s, at most, and that times the angular frequency at which each spring resonates alone:
as stiff as can be simulated with ease.
"""
_SOFTEST_HZ = 3.0
"""Alone, no spring of an arm resonates lower."""
_GEAR, _JOINT, _BASE = ("rz",), ("rx", "ry"), ("rx", "ry", "rz", "tx", "ty", "tz")


@dataclass(frozen=True)
class SpringKind:
    """Coordinates (n,) of a class that are rigid, and stiffness of each, from which its compliance is near
    zero, and at which it is as soft as may be; whole: all coordinates of a place, a link, give way together.
    """

    name: str
    coordinates: tuple[str, ...]
    stiff: Array
    soft: Array
    whole: bool = False

    def of(self, able: Mask, stiff: Array, soft: Array) -> SpringKind:
        """Those of its coordinates that are able (n,) to be springs, of whole places only, with stiffness."""
        if self.whole:
            places = [name.rpartition(".")[0] for name in self.coordinates]
            rigid = {place for place, can in zip(places, able, strict=True) if not can}
            able = np.array([place not in rigid for place in places])
        kept = tuple(name for name, can in zip(self.coordinates, able, strict=True) if can)
        return replace(self, coordinates=kept, stiff=stiff[able], soft=soft[able])

    def candidate(self, picked: Sequence[int]) -> MotionCandidate:
        """As an effect of some of its coordinates."""
        places = {self.coordinates[n].rpartition(".")[0] for n in picked}
        if self.whole:
            picked = [n for n, name in enumerate(self.coordinates) if name.rpartition(".")[0] in places]
        names = [self.coordinates[n] for n in picked]
        stiff = {self.coordinates[n]: float(f"{self.stiff[n]:.6g}") for n in picked}
        bounds = (
            float(f"{self.soft[list(picked)].min():.3g}"),
            float(f"{4 * self.stiff[list(picked)].max():.3g}"),
        )
        effects = []
        for place in dict.fromkeys(name.rpartition(".")[0] for name in names):
            own = {name.rpartition(".")[2]: stiff[name] for name in names if name.startswith(f"{place}.")}
            effects.append(_effect(place, own, bounds))
        said = sorted(places) if self.whole else names
        return MotionCandidate(name=f"{self.name} ({listed(said)})", effects=effects)


def rigid(problem: MotionProblem, values: Array) -> list[tuple[SpringKind, MotionProblem]]:
    """The classes that a problem does not have, each with the problem that has all of it at its stiffest.

    A base whose mass is not known cannot move.
    """
    told = dict(zip([p.name for p in problem.parameters], map(float, values), strict=True))
    step, found = min(problem.step_s, _STEP), []
    for group in _groups(problem, values):
        own = group.coordinates
        effects = [_usual(coordinate) for coordinate in own]
        softer = with_effects(problem, [e for n, e in enumerate(effects) if e not in effects[:n]], told)
        usual = {p.name.rpartition(".")[0]: p.initial for p in softer.springs if p.name.endswith("stiffness")}
        start = np.array([usual[coordinate] for coordinate in own])
        stiff = _stiffest(softer, own, start, step)
        soft = (_SOFTEST_HZ / START_HZ) ** 2 * start
        kind = group.of(stiff > soft, stiff, soft)
        if kind.coordinates:
            effects = kind.candidate(range(len(kind.coordinates))).effects
            found.append((kind, with_effects(problem, effects, told)))
    return found


def _groups(problem: MotionProblem, values: Array) -> list[SpringKind]:
    """Springs that a problem does not have, by class, of no stiffness yet."""
    robot, released = problem.robot, {p.name.rpartition(".")[0] for p in problem.springs}
    joints = [f"joint{n + 1}" for n in range(len(robot.joints))]
    turns = np.min(problem.table.arrays(values[None])["motor.rotor_inertia"]) > 0  # alone, behind a spring
    links = [parts(link, robot).values() for link in LinkFlexibility.instances(robot, {})]
    classes = [
        (
            "compliance of the gear",
            [f"{joint}.{axis}" for joint in joints if weighs for axis in _GEAR],
            False,
        ),
        ("tilt compliance", [f"{one}.{axis}" for one in joints for axis in _JOINT], False),
        ("compliance of the base", [f"base.{axis}" for axis in _BASE if robot.links[0].mass > 0], False),
        ("flexibility of links", [name for link in links for own in link for name in own], True),
    ]
    left = [(name, tuple(c for c in own if c not in released), whole) for name, own, whole in classes]
    return [SpringKind(name, own, np.zeros(0), np.zeros(0), whole) for name, own, whole in left if own]


def _stiffest(problem: MotionProblem, own: Sequence[str], start: Array, step: float) -> Array:
    """Stiffness of coordinates (n,) so that a step resolves all modes, from what each has alone: while one is
    too fast, what bends most in it gives way.
    """
    arm, passive = (
        problem.arm,
        problem.passive(problem.initial[None], problem.table.arrays(problem.initial[None])),
    )
    rows, units = np.array([problem.row(name) for name in own]).T
    rows = rows.astype(int)
    position = np.zeros(len(arm.names))
    position[arm.drive] = problem.records[0].command.position[0]
    mass = arm.mass_matrix(position) + np.diag(passive.armature[0])
    stiffness, limit = passive.stiffness[0].copy(), _RESOLVED / step
    stiffness[rows] = units * start * (limit / (2 * np.pi * START_HZ)) ** 2
    for _ in range(20 * len(own)):
        squares, shapes = scipy.linalg.eigh(np.diag(stiffness), mass)
        bent = stiffness[rows] * shapes[rows, -1] ** 2
        if squares[-1] <= (1.2 * limit) ** 2 or bent.max() < 0.1 * squares[-1]:
            break
        stiffness[rows[int(np.argmax(bent))]] *= limit**2 / squares[-1]
    return np.asarray(stiffness[rows] / units)


def _effect(place: str, own: Mapping[str, float], bounds: tuple[float, float]) -> Spring:
    """Springs of a joint, the base or a link, by their names there, with stiffness to start from."""
    values, axes = Values(initial=list(own.values()), bounds=bounds), list(own)
    if place == "base":
        return BaseCompliance.model_validate({"axes": axes, "stiffness": values})
    if set(own) == set(AXES):
        *bending, torsion = own.values()
        two, one = Values(initial=bending, bounds=bounds), Values(initial=torsion, bounds=bounds)
        return LinkFlexibility(link=place, bending=two, torsion=one)
    joint = int(place.removeprefix("joint"))
    return JointCompliance.model_validate({"joints": [joint], "axes": axes, "stiffness": values})


def _usual(coordinate: str) -> Spring:
    place, _, axis = coordinate.rpartition(".")
    if axis in AXES:
        return LinkFlexibility(link=place)
    if place == "base":
        return BaseCompliance.model_validate({"axes": [axis]})
    return JointCompliance.model_validate({"joints": [int(place.removeprefix("joint"))], "axes": [axis]})

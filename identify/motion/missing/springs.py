"""Springs that a model of motion lacks: classes of coordinates, so stiff to begin with that the step resolves
them, and the effects that a study names.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from identify.core.arrays import Array
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
_CLASSES = (("compliance of the gear", ("rz",)), ("tilt compliance", ("rx", "ry")))
LINKS = "flexibility of links"


@dataclass(frozen=True)
class SpringKind:
    """Coordinates (n,) of a class that are rigid, and stiffness of each, from which its compliance is near
    zero, and at which it is as soft as may be.
    """

    name: str
    coordinates: tuple[str, ...]
    stiff: Array
    soft: Array

    def candidate(self, picked: Sequence[int]) -> MotionCandidate:
        """As an effect of some of its coordinates."""
        places = {self.coordinates[n].rpartition(".")[0] for n in picked}
        if self.name == LINKS:  # all of a link gives way
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
        said = sorted(places) if self.name == LINKS else names
        return MotionCandidate(name=f"{self.name} ({listed(said)})", effects=effects)


def rigid(problem: MotionProblem, values: Array) -> list[tuple[SpringKind, MotionProblem]]:
    """The classes that a problem does not have, each with the problem that has all of it at its stiffest.

    A base whose mass is not known cannot move.
    """
    told = dict(zip([p.name for p in problem.parameters], map(float, values), strict=True))
    step, found = min(problem.step_s, _STEP), []
    for name, own in _groups(problem, values).items():
        effects = [_usual(coordinate) for coordinate in own]
        softer = with_effects(problem, [e for n, e in enumerate(effects) if e not in effects[:n]], told)
        usual = {p.name.rpartition(".")[0]: p.initial for p in softer.springs if p.name.endswith("stiffness")}
        start = np.array([usual[coordinate] for coordinate in own])
        stiff = _stiffest(softer, own, start, step)
        soft = (_SOFTEST_HZ / START_HZ) ** 2 * start
        able = stiff > soft
        if name == LINKS:
            able = np.repeat(able.reshape(-1, len(AXES)).all(axis=1), len(AXES))
        kept = tuple(name for name, can in zip(own, able, strict=True) if can)
        kind = SpringKind(name, kept, stiff[able], soft[able])
        if able.any():
            effects = kind.candidate(range(len(kind.coordinates))).effects
            found.append((kind, with_effects(problem, effects, told)))
    return found


def _groups(problem: MotionProblem, values: Array) -> dict[str, list[str]]:
    """Names of springs that a problem does not have, by class."""
    robot, released = problem.robot, {p.name.rpartition(".")[0] for p in problem.springs}
    groups = {
        name: [f"joint{n + 1}.{a}" for n in range(len(robot.joints)) for a in axes] for name, axes in _CLASSES
    }
    if robot.links[0].mass > 0:
        groups["compliance of the base"] = [f"base.{a}" for a in ("rx", "ry", "rz", "tx", "ty", "tz")]
    links = LinkFlexibility.instances(robot, {})
    groups[LINKS] = [name for link in links for own in parts(link, robot).values() for name in own]
    if np.min(problem.table.arrays(values[None])["motor.rotor_inertia"]) <= 0:
        groups.pop(_CLASSES[0][0])  # a rotor that weighs nothing cannot move alone
    left = {name: [one for one in group if one not in released] for name, group in groups.items()}
    return {name: own for name, own in left.items() if own}


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

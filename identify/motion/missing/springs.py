"""Springs that a model of motion lacks: classes of coordinates, so stiff to begin with that the step resolves
them, and the effects that a study names.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

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

_STIFFER = 1e3
"""Stiffness over a spring's usual start, from which its compliance is near zero."""
_SOFTEST_HZ = 3.0
"""Alone, no spring of an arm resonates lower."""
_ACROSS = ("rx", "ry", "tx", "ty")
"""Of these, the two that are tilts, and the two that are not, give way together: mounts and bearings are
much the same all round.
"""
_GEAR, _JOINT, _BASE = ("rz",), ("rx", "ry"), ("rx", "ry", "rz", "tx", "ty", "tz")


@dataclass(frozen=True)
class SpringKind:
    """Coordinates (n,) of a class that are rigid, stiffness and damping that each usually starts from, and by
    how long, s, springs lag at least, a step: with such a damper steps are stable, however stiff the spring
    and light what it carries; whole: all coordinates of a place, a link, give way together.
    """

    name: str
    coordinates: tuple[str, ...]
    stiffness: Array
    damping: Array
    lag_s: float = 0.0
    whole: bool = False

    @property
    def stiff(self) -> Array:
        """From where compliances (n,) are near zero."""
        return _STIFFER * self.stiffness

    @property
    def soft(self) -> Array:
        """As soft as may be (n,)."""
        return (_SOFTEST_HZ / START_HZ) ** 2 * self.stiffness

    def starts(self, compliance: Mapping[int, float]) -> dict[str, float]:
        """Where springs start, by name, of compliances by coordinate, one of none as stiff as the stiffest
        beside it, with dampers by which they lag as usual.
        """
        found, lag = dict[str, float](), np.maximum(self.damping / self.stiffness, self.lag_s)
        for place in self.places:
            own = {n: compliance[n] for n in place if n in compliance}
            least = min((one for one in own.values() if one > 0), default=0.0)
            for n, one in own.items():
                k = float(np.clip(1 / max(one, least, 1 / self.stiff[n]), self.soft[n], self.stiff[n]))
                found[f"{self.coordinates[n]}.stiffness"] = k
                found[f"{self.coordinates[n]}.damping"] = float(lag[n] * k)
        return found

    def away(self, values: Mapping[str, float], place: int) -> Array:
        """Compliances (k,) of a place over those that springs usually start from, at values by name."""
        own = [n for n in self.places[place] if f"{self.coordinates[n]}.stiffness" in values]
        return np.array(
            [self.stiffness[n] / values[f"{self.coordinates[n]}.stiffness"] for n in own], dtype=float
        )

    @property
    def places(self) -> list[list[int]]:
        """Numbers of the coordinates that give way together."""
        own = [self._together(name) for name in self.coordinates]
        return [[n for n, name in enumerate(own) if name == place] for place in dict.fromkeys(own)]

    def _together(self, coordinate: str) -> str:
        place, _, axis = coordinate.rpartition(".")
        if self.whole:
            return place
        return f"{place}.{axis[0]}" if axis in _ACROSS else coordinate

    def candidate(self, picked: Sequence[int]) -> MotionCandidate:
        """As an effect of some of its places."""
        numbers = [n for place in picked for n in self.places[place]]
        names = [self.coordinates[n] for n in numbers]
        stiff = {self.coordinates[n]: float(f"{self.stiff[n]:.6g}") for n in numbers}
        bounds = float(f"{self.soft[numbers].min():.3g}"), float(f"{4 * self.stiff[numbers].max():.3g}")
        effects, links = [], list(dict.fromkeys(name.rpartition(".")[0] for name in names))
        for link in links:
            own = {name.rpartition(".")[2]: stiff[name] for name in names if name.startswith(f"{link}.")}
            effects.append(_effect(link, own, bounds))
        return MotionCandidate(
            name=f"{self.name} ({listed(links if self.whole else names)})", effects=effects
        )


def rigid(problem: MotionProblem, values: Array) -> tuple[list[SpringKind], MotionProblem]:
    """The classes that a problem does not have, and the problem that has all of them at their stiffest, each
    spring beside a damper by which it lags by one step.
    """
    told, groups = problem.by_name(values), _groups(problem, values)
    effects = [_usual(coordinate) for _, own, _ in groups for coordinate in own]
    softer = with_effects(problem, [e for n, e in enumerate(effects) if e not in effects[:n]], told)
    usual = {parameter.name: parameter.initial for parameter in softer.springs}
    kinds = [
        SpringKind(
            title,
            own,
            np.array([usual[f"{coordinate}.stiffness"] for coordinate in own]),
            np.array([usual[f"{coordinate}.damping"] for coordinate in own]),
            problem.step_s,
            whole,
        )
        for title, own, whole in groups
    ]
    for kind in kinds:
        stiff = zip(kind.coordinates, kind.stiff.tolist(), strict=True)
        told |= {f"{coordinate}.damping": kind.lag_s * k for coordinate, k in stiff}
    stiffest = [effect for kind in kinds for effect in kind.candidate(range(len(kind.places))).effects]
    return kinds, with_effects(problem, stiffest, told)


def _groups(problem: MotionProblem, values: Array) -> list[tuple[str, tuple[str, ...], bool]]:
    """Springs that a problem does not have, by class, and whether a place's give way together.

    A base whose mass is not known cannot move.
    """
    robot, released = problem.robot, {p.name.rpartition(".")[0] for p in problem.springs}
    joints = [f"joint{n + 1}" for n in range(len(robot.joints))]
    turns = np.min(problem.table.arrays(values[None])["motor.rotor_inertia"]) > 0  # alone, behind a spring
    links = [parts(link, robot).values() for link in LinkFlexibility.instances(robot, {})]
    classes = [
        ("compliance of the gear", [f"{one}.{axis}" for one in joints if turns for axis in _GEAR], False),
        ("tilt compliance", [f"{one}.{axis}" for one in joints for axis in _JOINT], False),
        ("compliance of the base", [f"base.{axis}" for axis in _BASE if robot.links[0].mass > 0], False),
        ("flexibility of links", [name for link in links for own in link for name in own], True),
    ]
    left = [(name, tuple(c for c in own if c not in released), whole) for name, own, whole in classes]
    return [one for one in left if one[1]]


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

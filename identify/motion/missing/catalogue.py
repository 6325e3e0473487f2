"""Everything that may be missing from a model of motion, or may not be as stated, each as numbers of the
simulator that are zero or as the study says, or as springs that are rigid.

What is believed of amplitudes before any data.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from identify.core.arrays import Array
from identify.core.text import listed
from identify.motion.bodies import LIGHTEST
from identify.motion.missing.springs import SpringKind
from identify.motion.numbers import JointNumber
from identify.motion.problem import MotionProblem
from identify.motion.study import MotionCandidate


def log_prior(kind: Kind | SpringKind, places: Sequence[int], values: Mapping[str, float]) -> float:
    """How much less likely amplitudes of a kind at some of its places are before any data than ones of
    nothing, natural logarithm, at values by name.

    A Cauchy prior as wide as what is usual (Jeffreys, Theory of Probability, 1961, section 5.2): where
    records cannot tell effects apart, such as a rotor and the first body of an arm, the usual one is named.
    """
    return -sum(float(np.sum(np.log1p(kind.away(values, place) ** 2))) for place in places)


OFF = 100.0
"""Bounds: of an amplitude, over its size; of a number that is not as stated, a factor either way."""
_LATE_S = 1e-3
_SMALL, _JUMP = 0.01, 0.3
"""Steps that are tried, over the size: of what acts in proportion, and of what changes the rest at once."""
_MOVES = 1e-3
"""Share of the fastest joint's speed below which a joint stands still."""


@dataclass(frozen=True)
class Kind:
    """An effect of one or more numbers a joint (`where`, section and key).

    present: as they are, one row per number (numbers, joints); size (joints,): a unit of its amplitude, NaN
    where it cannot be; relative: the number is not as stated, and its amplitude the logarithm of how much;
    least: of its amplitude; probe: the step that is tried, over the size.
    """

    name: str
    where: tuple[str, ...]
    present: Array
    size: Array
    relative: bool = False
    least: float = 0.0
    probe: float = _SMALL

    def candidate(self, joints: Sequence[int]) -> MotionCandidate:
        """As an effect of some joints (from 1), as a study names it."""
        of = f"joint{'s' if len(joints) > 1 else ''} {listed(list(map(str, joints)))}"
        said = f"{self.name} of {of} not as stated" if self.relative else f"{self.name} of {of}"
        rows = zip(self.where, self.present, strict=True)
        return MotionCandidate(name=said, numbers={key: self._number(row, joints) for key, row in rows})

    def away(self, values: Mapping[str, float], joint: int) -> Array:
        """How far the numbers (k,) of a joint (from 0) are from where they are absent or as stated, in their
        sizes, at values by name.
        """
        now = np.array([values[f"joint{joint + 1}.{key}"] for key in self.where])
        present = self.present[:, joint]
        moved = np.log(now / present) if self.relative else now - present
        return np.asarray(moved / self.size[joint])

    def _number(self, present: Array, joints: Sequence[int]) -> JointNumber:
        at = np.array(joints) - 1
        if self.relative:
            bounds = float(present[at].min() / OFF), float(present[at].max() * OFF)
        else:
            most = OFF * float(np.nanmax(self.size[at]))
            bounds = max(-most, self.least), most
        bounds = tuple(float(f"{bound:.3g}") for bound in bounds)  # type: ignore[assignment]
        return JointNumber(initial=[float(v) for v in present], bounds=bounds, joints=list(joints))


@dataclass(frozen=True)
class Loads:
    """What sizes are measured by, (joints,): torque that the commands take, N m, and speed, rad/s, RMS over
    what is commanded; stiffness of the gears, N m/rad, NaN where rigid.
    """

    torque: Array
    speed: Array
    stiffness: Array


def loads(problem: MotionProblem, values: Array) -> Loads:
    """Of a problem at parameter values (parameters,)."""
    torque, speed = (
        np.sqrt(np.mean(np.concatenate(parts) ** 2, axis=0))
        for parts in (
            [record.torque for record in problem.records],
            [record.command.velocity for record in problem.records],
        )
    )
    torque = np.maximum(torque, 1e-3 * max(float(torque.max()), 1e-9))
    speed = np.where(speed > _MOVES * speed.max(initial=0.0), speed, np.nan)
    stiffness = np.full(len(torque), np.nan)
    for parameter, value in zip(problem.springs, values, strict=False):
        joint, axis, what = (*parameter.name.split("."), "", "")[:3]
        if (axis, what) == ("rz", "stiffness") and joint.startswith("joint"):
            stiffness[int(joint.removeprefix("joint")) - 1] = value
    return Loads(torque, speed, stiffness)


def kinds(problem: MotionProblem, values: Array) -> list[Kind]:
    """All of a problem at parameter values (parameters,) but what is searched already of a joint: the same
    number has not another name then.
    """
    load, arrays = loads(problem, values), problem.table.arrays(values[None])
    present = {where: rows[0] for where, rows in arrays.items()}
    found = []
    for kind in [*_absent(present, load), *_stated(present, load)]:
        size = kind.size.copy()
        for joints, _ in (problem.table.columns[key] for key in kind.where if key in problem.table.columns):
            size[joints] = np.nan
        found.append(replace(kind, size=size))
    return [kind for kind in found if np.isfinite(kind.size).any()]


def _absent(present: dict[str, Array], load: Loads) -> list[Kind]:
    """Those that are zero, where they are."""
    one = np.ones(len(load.torque))
    windup = load.torque / load.stiffness
    free = -np.inf
    zero: list[tuple[str, str | tuple[str, str], Array, float, float]] = [
        ("Coulomb friction", "friction.coulomb", load.torque + 0 * load.speed, 0, _SMALL),
        ("viscous friction", "friction.viscous", load.torque / load.speed, 0, _SMALL),
        ("Stribeck friction", "friction.stribeck", load.torque + 0 * load.speed, 0, _SMALL),
        ("hardening of the gear", "gear.cubic_stiffness", load.stiffness / windup**2, 0, _SMALL),
        ("backlash of the gear", "gear.backlash", windup, 0, _SMALL),
        ("mass beyond the description", "bodies.mass", 0.1 * one, LIGHTEST, _SMALL),
        ("gravity balancer", ("balancer.sine", "balancer.cosine"), load.torque, free, _SMALL),
        ("integral action", "servo.integral_gain", present.get("servo.position_gain", one), 0, _JUMP),
        ("integral action of the velocity loop", "servo.velocity_integral", 10 * one, 0, _JUMP),
        ("velocity feed-forward", "servo.velocity_feedforward", one, 0, _SMALL),
        ("torque feed-forward", "servo.torque_feedforward", one, 0, _SMALL),
        ("delay of the controller", "servo.latency", _LATE_S * one, 0, _SMALL),
    ]
    found = []
    for name, told, size, least, probe in zero:
        where = (told,) if isinstance(told, str) else told
        if all(key in present for key in where):
            rows = np.array([present[key] for key in where])
            absent = np.where((rows == 0).all(axis=0), size, np.nan)
            found.append(Kind(name, where, rows, absent, least=least, probe=probe))
    return found


_NEEDS = {
    "friction.stribeck_velocity": ("friction.stribeck",),
    "friction.creep_velocity": ("friction.coulomb", "friction.stribeck"),
}
_SIGNED = ("bodies", "balancer")
_NEVER = ("gear.ratio", "motor.voltage_limit", "motor.torque_limit")
"""What is printed on the gear, and limits, which nothing shows until they are reached."""


def _stated(present: dict[str, Array], load: Loads) -> list[Kind]:
    """Those that the study says, and may be otherwise."""
    found, there = [], {key for key, row in present.items() if np.any(row)}
    for where, row in present.items():
        section, _, key = where.rpartition(".")
        known = np.isfinite(row) & (row > 0)
        known &= np.isfinite(load.speed) if section == "friction" else True
        if where in _NEVER or section in _SIGNED or section.startswith("gear.") or not acts(where, there):
            continue
        size = np.where(known, 1.0, np.nan)
        found.append(Kind(_named(section, key), (where,), row[None], size, relative=True))
    return found


def _named(section: str, key: str) -> str:
    """A number as an engineer would say it: `motor rotor inertia`, `Coulomb friction`."""
    words = key.removesuffix("_hz").replace("_", " ").replace("feedforward", "feed-forward")
    words = words.replace("coulomb", "Coulomb").replace("stribeck", "Stribeck")
    law = " friction" if key in ("coulomb", "viscous", "stribeck") else ""
    return f"{'motor ' if section == 'motor' else ''}{words}{law}"


def acts(where: str, there: Collection[str]) -> bool:
    """Whether a number does anything beside those that are there, by section and key."""
    return where not in _NEEDS or any(key in there for key in _NEEDS[where])

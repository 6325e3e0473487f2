"""What the robot's description says of its bodies: units of masses, lengths and inertias, the payload,
gravity.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import permutations, product

import numpy as np

from identify.core.arrays import Array
from identify.measured.quality_robot import in_degrees
from identify.robot.units import SI
from identify.setup.edits import Change, Edit
from identify.setup.hypothesis import Hypothesis
from identify.setup.score import Score
from identify.setup.stated import Stated

_UNITS: tuple[tuple[dict[str, str], str], ...] = (
    ({"mass": "lb"}, "the masses of the robot file are in pounds"),
    ({"mass": "g"}, "the masses of the robot file are in grams"),
    ({"inertia": "kg cm2"}, "the inertias of the robot file are in kg cm2"),
    ({"inertia": "kg mm2"}, "the inertias of the robot file are in kg mm2"),
    ({"inertia": "lb in2"}, "the inertias of the robot file are in lb in2"),
    ({"inertia": "lb m2"}, "the inertias of the robot file are in lb m2"),
    ({"inertia": "g mm2"}, "the inertias of the robot file are in g mm2"),
    ({"mass": "g", "inertia": "g mm2"}, "the robot file is in g and g mm2"),
    ({"mass": "lb", "inertia": "lb in2"}, "the robot file is in lb and lb in2"),
    ({"length": "mm"}, "the lengths of the robot file are in mm"),
    ({"length": "cm"}, "the lengths of the robot file are in cm"),
    ({"length": "in"}, "the lengths of the robot file are in inches"),
)
_DEGREES = ({"angle": "deg"}, "the angles (`rpy`) of the robot file are in degrees")
_SIDES = {"+x": (9.81, 0, 0), "-x": (-9.81, 0, 0), "+y": (0, 9.81, 0), "-y": (0, -9.81, 0)}
_CARRIED = 0.02
"""Share of the arm's mass that a payload begins with."""


def units(stated: Stated, plain: Score) -> Iterator[Hypothesis]:
    """Robot files that are not in kg, m and kg m2, as far as they say what a body can be."""
    told = stated.study.robot.units
    for change, sentence in (*_UNITS, *([_DEGREES] if in_degrees(stated.robot) else [])):
        if all(getattr(told, key) == getattr(SI, key) for key in change):
            edits = tuple(Edit(("robot", "units", key), value) for key, value in change.items())
            yield Hypothesis("robot-units", sentence, edits, "units")


def payload(stated: Stated, plain: Score) -> Iterator[Hypothesis]:
    """A body at the end of the arm that the study does not have, somewhere within what its points span."""
    link = stated.robot.links[-1]
    if any(getattr(effect, "link", "") == link.name for effect in stated.study.effects):
        return
    at = [point.position for point in stated.points.values() if point.link == link.name]
    size = max([float(np.linalg.norm(one)) for one in (*at, link.centre)])
    places = [np.zeros(3), *(size / 2 * sign * axis for axis in np.eye(3) for sign in (1, -1))]
    for place in places:
        yield _carried(stated, place, size)


def _carried(stated: Stated, place: Array, size: float) -> Hypothesis:
    """A payload with its centre at a place (3,), m, of the last link, whose points span a size, m."""
    link, at_m = stated.robot.links[-1].name, [round(float(x), 4) for x in place]
    heaviest = sum(one.mass for one in stated.robot.links[1:])
    mass = {"initial": _CARRIED * heaviest, "bounds": [0.0, heaviest]}
    body = {"kind": "added-mass", "link": link, "at_m": at_m, "mass": mass}

    def settle(score: Score) -> tuple[Change, ...]:
        one = {"link": link, "mass_kg": float(f"{_value(score, 'mass'):.3g}"), "centre_m": at_m}
        return (Edit(("robot", "payload"), [*(stated.data["robot"].get("payload") or []), one]),)

    def moved(numbers: Array) -> Hypothesis:
        return _carried(stated, numbers, size)

    sentence = f"{link} carries a payload that the study does not have"
    edits = (Edit(("effects",), [*_effects(stated), body]),)
    return Hypothesis("payload", sentence, edits, "payload", settle, 1, place, size / 4, moved)


def payload_frame(stated: Stated, plain: Score) -> Iterator[Hypothesis]:
    """A payload whose centre is given in other axes."""
    for number, one in enumerate(stated.study.robot.payload):
        seen: set[tuple[float, ...]] = {one.centre_m}
        for order, signs in product(permutations(range(3)), product((1, -1), repeat=3)):
            new = tuple(sign * one.centre_m[n] for n, sign in zip(order, signs, strict=True))
            if new in seen:
                continue
            seen.add(new)
            edit = Edit(("robot", "payload", number, "centre_m"), list(new))
            sentence = (
                f"the centre of the payload on {one.link} is given in other axes than those of the link"
            )
            yield Hypothesis("payload-frame", sentence, (edit,), "payload-frame")


def gravity(stated: Stated, plain: Score) -> Iterator[Hypothesis]:
    """A robot on a wall or under a ceiling."""
    if stated.study.robot.gravity_m_s2 is not None:
        return
    edit = Edit(("robot", "gravity_m_s2"), [0, 0, 9.81])
    yield Hypothesis("gravity", "the robot hangs from a ceiling", (edit,), "gravity")
    for side, pull in _SIDES.items():
        edit = Edit(("robot", "gravity_m_s2"), list(pull))
        yield Hypothesis("gravity", f"the robot is on a wall, with weight along {side}", (edit,), "gravity")


def window(stated: Stated, plain: Score) -> Iterator[Hypothesis]:
    """An exponential window that the study does not state."""
    if any(one.window_decay_per_s for one in stated.measured):
        return
    if any(effect.kind == "window-decay" for effect in stated.study.effects):
        return

    def settle(score: Score) -> tuple[Change, ...]:
        decay = float(f"{_value(score, 'decay'):.3g}")
        numbers = range(len(stated.study.measurements))
        return tuple(Edit(("measurements", number, "window_decay_per_s"), decay) for number in numbers)

    effects = [*_effects(stated), {"kind": "window-decay"}]
    sentence = "the records have an exponential window that the study does not state"
    yield Hypothesis("window", sentence, (Edit(("effects",), effects),), "window", settle)


def _effects(stated: Stated) -> list[object]:
    return list(stated.data.get("effects") or [{"kind": "joint-compliance"}])


def _value(score: Score, what: str) -> float:
    """The value of the last parameter whose name has this."""
    return next(
        float(score.values[n])
        for n, parameter in reversed(list(enumerate(score.problem.of_effects)))
        if what in parameter.name
    )

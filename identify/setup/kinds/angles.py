"""How joint angles are counted: sign, zero, order, unit, and joints counted from the ground."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from itertools import combinations

import numpy as np

from identify.core.arrays import Array
from identify.setup.edits import Edit
from identify.setup.hypothesis import Hypothesis
from identify.setup.score import Score
from identify.setup.stated import Stated

_TURNS = (90, -90, 180)
_PARTS = (15, -15, 30, -30, 45, -45, 60, -60)
"""Offsets in degrees that are tried: by which controllers and robot files differ, and those between."""
STEP_DEG = 8.0
"""From offsets between to the next that is tried."""


def _edit(key: str, value: object) -> tuple[Edit, ...]:
    return (Edit(("joint_angles", key), value),)


def _count(stated: Stated) -> int:
    return len(stated.robot.joints)


def signs(stated: Stated, plain: Score) -> Iterator[Hypothesis]:
    """One joint, or all, counted the other way."""
    count, told = _count(stated), stated.study.joint_angles
    now = told.sign or [1] * count
    for number in range(count):
        new = [-one if n == number else one for n, one in enumerate(now)]
        sentence = f"the angles of joint {number + 1} have the other sign"
        yield Hypothesis("joint-sign", sentence, _edit("sign", new), f"sign{number}")
    yield Hypothesis(
        "joint-sign", "all joint angles have the other sign", _edit("sign", [-one for one in now]), "sign"
    )


def zeros(stated: Stated, plain: Score) -> Iterator[Hypothesis]:
    """Joints whose zero is elsewhere, by a right angle or two."""
    count = _count(stated)
    now = np.array(stated.study.joint_angles.offset_deg or [0.0] * count)
    for number in range(count):
        for turn in _TURNS:
            sentence = (
                f"joint {number + 1} of the robot file is at {_word(turn)} where the controller shows 0"
            )
            yield _zero(now, {number: turn}, sentence)
    for one, other in combinations(range(count), 2):
        for first in _TURNS[:2]:
            for second in _TURNS[:2]:
                sentence = (
                    f"joints {one + 1} and {other + 1} of the robot file are at {_word(first)} and"
                    f" {_word(second)} where the controller shows 0"
                )
                if other == one + 1:
                    yield _zero(now, {one: first, other: second}, sentence)


def offsets(stated: Stated, plain: Score) -> Iterator[Hypothesis]:
    """Joints whose zero is elsewhere, by any angle."""
    count = _count(stated)
    now = np.array(stated.study.joint_angles.offset_deg or [0.0] * count)
    for number in range(count):
        for turn in _PARTS:
            yield _offset(now, number, turn)


def _offset(now: Array, number: int, turn: float) -> Hypothesis:
    def moved(numbers: Array) -> Hypothesis:
        return _offset(now, number, float(numbers[0]))

    sentence = f"the zero of joint {number + 1} is off by about {turn:.3g} degrees"
    about = _zero(now, {number: turn}, sentence, "joint-offset")
    return replace(about, numbers=np.array([turn]), reach=STEP_DEG, moved=moved)


def _zero(now: Array, turns: Mapping[int, float], sentence: str, code: str = "joint-zero") -> Hypothesis:
    new = now.copy()
    for number, turn in turns.items():
        new[number] += turn
    about = "zero" + ",".join(map(str, turns))
    edits = _edit("offset_deg", new.tolist())
    return Hypothesis(code, sentence, edits, about, count=len(turns))


def _word(turn: int) -> str:
    return f"{turn} degrees"


def radians(stated: Stated, plain: Score) -> Iterator[Hypothesis]:
    """Angles in radians."""
    angles = np.array([one.posture_deg for one in stated.study.measurements])
    if stated.study.joint_angles.unit == "deg" and np.abs(angles).max() <= 2 * np.pi:
        yield Hypothesis("radians", "the joint angles are in radians", _edit("unit", "rad"), "unit")


def order(stated: Stated, plain: Score) -> Iterator[Hypothesis]:
    """Angles from the last joint to the first, or two that follow each other exchanged."""
    count = _count(stated)
    now = stated.study.joint_angles.order or list(range(1, count + 1))
    yield Hypothesis(
        "joint-order",
        "the joint angles are listed from the last joint to the first",
        _edit("order", now[::-1]),
        "order",
    )
    for n in range(count - 1):
        new = [*now[:n], now[n + 1], now[n], *now[n + 2 :]]
        sentence = f"the angles of joints {n + 1} and {n + 2} are exchanged"
        yield Hypothesis("joint-order", sentence, _edit("order", new), "order")


def from_ground(stated: Stated, plain: Score) -> Iterator[Hypothesis]:
    """Joint 3 counted from the ground, as by controllers of arms with a parallelogram."""
    if _count(stated) < 3 or stated.study.joint_angles.coupling:
        return
    for times in (-1.0, 1.0):
        sentence = "joint 3 is counted from the ground, not from link 2" + (
            "" if times < 0 else ", against the sense of joint 2"
        )
        yield Hypothesis("from-ground", sentence, _edit("coupling", {3: {2: times}}), "ground")

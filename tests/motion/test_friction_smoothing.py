"""How the sign of dry friction passes through zero: a drive that is pushed by less than its friction creeps
as its law says, in closed form.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
import pytest

from identify.motion.friction import FrictionDamper
from identify.motion.study import MotionCandidate

CREEP, COULOMB, INERTIA, STEP = 2e-4, 70.0, 9.0, 1e-3
Law = Literal["root", "tanh"]


def _numbers() -> dict[str, np.ndarray]:
    values = {"coulomb": COULOMB, "creep_velocity": CREEP, "viscous": 0.0, "stribeck": 0.0}
    return {f"friction.{key}": np.full((1, 1), value) for key, value in values.items()} | {
        "friction.stribeck_velocity": np.full((1, 1), 0.05)
    }


def _stepped(law: Law, velocity: float, push: float) -> float:
    """One step of a mass under a push, with friction in two passes as the simulation has it."""
    inertia = np.full((1, 1), INERTIA)
    damper = FrictionDamper(_numbers(), np.zeros((1, 1)), inertia, STEP, law)
    found = np.full((1, 1), velocity)
    for _ in range(2):
        found = (inertia * velocity + STEP * push) / (inertia + STEP * damper(found))
    return float(found[0, 0])


def _creeping(law: Law, push: float) -> float:
    velocity = 0.0
    for _ in range(400):
        velocity = _stepped(law, velocity, push)
    return velocity


@pytest.mark.parametrize("part", [0.3, 0.9, -0.98])
def test_a_drive_creeps_as_its_law_says(part: float) -> None:
    assert _creeping("tanh", part * COULOMB) == pytest.approx(CREEP * np.arctanh(part), rel=1e-6)
    assert _creeping("root", part * COULOMB) == pytest.approx(CREEP * part, rel=0.05), "its slope at zero"


@pytest.mark.parametrize("push", [30.0, 69.0, 71.0, 400.0])
def test_a_step_from_rest_solves_its_equation(push: float) -> None:
    velocity = _stepped("tanh", 0.0, push)
    friction = COULOMB * np.tanh(velocity / CREEP)
    assert INERTIA * velocity == pytest.approx(STEP * (push - friction), rel=1e-6, abs=1e-12)


def test_two_laws_of_the_same_numbers_stand_in_place_of_each_other() -> None:
    numbers = {"friction.coulomb": {"initial": 10, "bounds": [0.1, 500]}}
    other = {"friction.viscous": {"initial": 10, "bounds": [0.1, 500]}}
    root, tanh, viscous = (
        MotionCandidate.model_validate({"name": name, "numbers": one, **more})
        for name, one, more in (
            ("root", numbers, {}),
            ("tanh", numbers, {"smoothing": "tanh"}),
            ("viscous", other, {}),
        )
    )
    assert tanh.instead_of(root)
    assert not tanh.instead_of(viscous)

"""What holds of every registered controller: nothing in a law or an old state changes, and unknown keys are
refused.
"""

from __future__ import annotations

import copy
import dataclasses
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from identify.motion.controller import CONTROLLERS, Sample, Twist, parse_controller
from identify.motion.gear import Gear
from identify.motion.motor import DcMotor, TorqueMotor
from identify.motion.numbers import number_table

GIVEN: dict[str, dict[str, Any]] = {
    "pid-voltage": {"position_gain": 300.0, "derivative_gain": 5.0, "integral_gain": 100.0},
    "cascade": {"position_gain": 8.0, "velocity_gain": 60.0, "velocity_integral": 4.0},
    "state-feedback": {"position_gain": 8.0, "velocity_gain": 60.0, "velocity_integral": 4.0},
    "two-degree-of-freedom": {
        "position_gain": 8.0,
        "velocity_gain": 60.0,
        "velocity_integral": 4.0,
        "notch_width": 0.5,
    },
}


def law_of(kind: str) -> Any:
    controller = parse_controller({"kind": kind, **GIVEN[kind]})
    dc = DcMotor(torque_constant=1.0, back_emf=0.3, resistance=0.2, inductance=0.004)  # type: ignore[arg-type]
    motor = dc if controller.gives == "voltage" else TorqueMotor()
    table = number_table({"motor": motor, "gear": Gear(ratio=50.0), "servo": controller}, 2)  # type: ignore[arg-type]
    return controller.law(table.arrays(np.zeros((3, 0))))


def sample(tick: int, turn: float) -> Sample:
    full = np.ones((3, 2))
    twist = Twist(0.01 * turn * full, 500.0 * full, 3.0 * full)
    return Sample(
        tick, 0.5 * full, 0.1 * full, 20.0 * full, turn * full, 2.0 * full, 9.0 * full[:, :1], twist
    )


def assert_same(state: Any, before: Any) -> None:
    for field in dataclasses.fields(state):
        now, then = getattr(state, field.name), getattr(before, field.name)
        if dataclasses.is_dataclass(now):
            assert_same(now, then)
        else:
            np.testing.assert_array_equal(now, then)


@pytest.mark.parametrize("kind", CONTROLLERS.names())
def test_laws_and_states_do_not_change(kind: str) -> None:
    law = law_of(kind)
    state = law.begin(sample(0, 0.5), np.full((3, 2), 1.5))
    before = copy.deepcopy(state)
    first, after = law.act(state, sample(1, 0.45))
    again, _ = law.act(before, sample(1, 0.45))
    np.testing.assert_array_equal(first, again)
    assert_same(state, before)
    assert after is not state


@pytest.mark.parametrize("kind", CONTROLLERS.names())
def test_a_controller_that_stands_goes_on_holding(kind: str) -> None:
    """At its standing error, with no motion, the first output is what it held."""
    law, holding = law_of(kind), np.full((3, 2), 1.5)
    error = law.standing_error(holding)
    still = Sample(
        0,
        np.full((3, 2), 0.5),
        np.zeros((3, 2)),
        np.zeros((3, 2)),
        0.5 - error,
        np.full((3, 2), 2.0),
        np.full((3, 1), 9.0),
        Twist(*(np.full((3, 2), value) for value in (0.01, 500.0, 3.0))),
    )
    given, _ = law.act(law.begin(still, holding), still)
    np.testing.assert_allclose(given, holding, rtol=1e-9)


@pytest.mark.parametrize("kind", CONTROLLERS.names())
def test_unknown_keys_are_refused(kind: str) -> None:
    with pytest.raises(ValidationError):
        parse_controller({"kind": kind, **GIVEN[kind], "gain": 1.0})

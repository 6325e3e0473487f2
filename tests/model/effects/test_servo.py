"""Servo loops: the added coordinate is the controller exactly, stiff loops lock the rotor, and loops that
cannot be are refused.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from identify.core.errors import InputError
from identify.model.effects.base import parse_effect
from identify.model.frf import dynamic_stiffness, frf, frf_by_solve
from identify.model.system import assemble, build_site, list_parameters
from identify.robot.description import Robot
from tests.arms import arm, initial
from tests.robot.random_arm import random_posture
from tests.targets import model, predictor

DRIVES = parse_effect({"kind": "joint-compliance"})
LOOPS: dict[str, Any] = {
    "kind": "servo",
    "joints": [2, 3],
    "gear_ratio": [120, 90],
    "inertia": {"initial": [2e-3, 1e-3]},
    "velocity_gain": {"initial": [1.5, 0.9]},
    "position_gain_per_s": [25, 40],
    "integral_time_s": 0.05,
    "current_bandwidth_hz": [300, 500],
}
S = 2j * np.pi * np.array([0.5, 4.0, 20.0, 100.0, 600.0]) + 0.7


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> Robot:
    """One arm for all."""
    return arm(tmp_path_factory.mktemp("arm"))


def _servo(**changes: Any) -> Any:
    return parse_effect({**LOOPS, **changes})


def test_without_its_coordinate_the_rotor_feels_the_cascade_of_loops(robot: Robot) -> None:
    system, parameters = model(robot, [DRIVES, _servo()])
    z = dynamic_stiffness(*system.matrices(initial(parameters)), S)
    for joint, ratio, inertia, gain, position, current in (
        (2, 120, 2e-3, 1.5, 25, 300),
        (3, 90, 1e-3, 0.9, 40, 500),
    ):
        rotor, state = (system.coordinates.index(f"joint{joint}.{name}") for name in ("rotor", "servo"))
        left = z[:, rotor, rotor] - z[:, rotor, state] * z[:, state, rotor] / z[:, state, state]
        # What a controller does, read off the block diagram: current = lag of PI of (position loop's command
        # - rate).
        lag = 2 * np.pi * current / (S + 2 * np.pi * current)
        torque_per_angle = lag * gain * (1 + 1 / (0.05 * S)) * (position + S)
        body = system.site.inertia(f"joint{joint}.rz")
        gravity = system.stiffness[rotor, rotor]
        assert left == pytest.approx(
            S**2 * body + gravity + ratio**2 * (S**2 * inertia + torque_per_angle), rel=1e-9
        )


def test_fast_route_agrees_with_a_solve_per_line(robot: Robot) -> None:
    system, parameters = model(robot, [DRIVES, _servo()])
    target = predictor(system)
    at = (*system.matrices(initial(parameters)), target.data.s, target.out, target.force, 2)
    assert frf(*at) == pytest.approx(frf_by_solve(*at), rel=1e-8, abs=1e-12)


def test_a_stiff_loop_holds_the_rotor_and_a_soft_one_does_not(robot: Robot) -> None:
    bare, parameters = model(robot, [DRIVES])
    locked = predictor(bare).predict(initial(parameters))
    apart = []
    for factor in (1e4, 1.0):
        system, parameters = model(
            robot, [DRIVES, _servo(velocity_gain={"initial": [1.5 * factor, 0.9 * factor]})]
        )
        h = predictor(system).predict(initial(parameters))
        apart.append(np.linalg.norm(h - locked) / np.linalg.norm(locked))
    assert apart[0] < 1e-3
    assert apart[1] > 0.05


def test_its_gains_are_known_unless_freed(robot: Robot) -> None:
    site = build_site(robot, random_posture(1), [DRIVES, _servo()])
    assert not any(
        p.free
        for p in list_parameters(
            robot,
            site,
            [
                _servo(
                    inertia={"initial": [2e-3, 1e-3], "fixed": True},
                    velocity_gain={"initial": [1.5, 0.9], "fixed": True},
                )
            ],
        )
    )
    assert all(p.free for p in list_parameters(robot, site, [_servo()]))


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"current_bandwidth_hz": 5.0}, "slower than an outer loop"),
        ({"integral_time_s": [0.05, 0.05, 0.05]}, "3 values for 2 joints"),
        ({"gear_ratio": [100.0]}, "1 ratios for 2 joints"),
        ({"position_gain_per_s": -1.0}, "greater than 0"),
    ],
)
def test_loops_that_cannot_be_are_refused(changes: dict[str, Any], sentence: str) -> None:
    with pytest.raises(ValidationError, match=sentence):
        _servo(**changes)


def test_a_rotor_without_inertia_and_a_rotor_claimed_twice_are_refused(robot: Robot) -> None:
    nothing = _servo(inertia={})
    with pytest.raises(InputError, match="data sheet"):
        list_parameters(robot, build_site(robot, random_posture(1), [DRIVES, nothing]), [nothing])
    held = parse_effect(
        {"kind": "rotor-inertia", "joints": [2], "gear_ratio": [120], "inertia": {"initial": 2e-3}}
    )
    twice = [DRIVES, held, _servo()]
    with pytest.raises(InputError, match=r"joint2\.rotor\.inertia is claimed"):
        list_parameters(robot, build_site(robot, random_posture(1), twice), twice)


def _rotor(**changes: Any) -> Any:
    held = {"kind": "rotor-inertia", "joints": [2], "gear_ratio": [100], "inertia": {"initial": 2e-3}}
    return parse_effect({**held, **changes})


def test_a_rotor_held_by_a_compliance_is_one_held_by_its_stiffness(robot: Robot) -> None:
    """And one of no compliance is held fast, whatever it weighs."""
    k, d = 4e5, 3e3
    stiff, parameters = model(
        robot,
        [DRIVES, _rotor(holding_stiffness={"initial": k}, holding_damping={"initial": d})],
    )
    h = predictor(stiff).predict(initial(parameters))
    soft, parameters = model(robot, [DRIVES, _rotor(holding_stiffness={}, shrink=True)])
    values = initial(parameters)
    names = [p.name for p in parameters]
    own = [names.index(f"joint2.rotor.{what}") for what in ("inertia", "compliance", "retardation_time")]
    values[own] = 2e-3, 1 / k, d / k
    assert predictor(soft).predict(values) == pytest.approx(h, rel=1e-8)
    values[own] = 5e-2, 0.0, d / k
    bare, parameters = model(robot, [DRIVES])
    assert predictor(soft).predict(values) == pytest.approx(
        predictor(bare).predict(initial(parameters)), rel=1e-8
    )


def test_a_rotor_that_nothing_holds_has_no_compliance() -> None:
    with pytest.raises(ValidationError, match="nothing holds the rotor"):
        _rotor(shrink=True)


def test_no_compliance_holds_a_rotor_whose_torque_is_an_input(robot: Robot) -> None:
    effects = [DRIVES, _rotor(holding_stiffness={}, shrink=True)]
    site = build_site(robot, random_posture(1), effects)
    held, loose = (
        assemble(robot, site, effects, driven=joints) for joints in (frozenset[int](), frozenset({2}))
    )
    assert held.compliances is not None
    assert loose.compliances is None
    assert "joint2.rotor" in loose.coordinates


def test_a_joint_that_was_taken_off_takes_its_controller_along(robot: Robot) -> None:
    effects = [DRIVES, _servo()]
    system = assemble(robot, build_site(robot, random_posture(1), effects, "link3"), effects)
    assert {name for name in system.coordinates if "servo" in name or "rotor" in name} == {
        "joint2.rotor",
        "joint2.servo",
    }

"""Drives and controllers against closed forms: motors, friction, gears, saturation, delays, encoders."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import expm

from identify.core.errors import InputError, InputErrors
from identify.model.laws.friction import friction_torque
from identify.model.laws.gear import GearSpring
from identify.motion.simulate import SimulatedMotion
from tests.motion import arms

Array = NDArray[np.float64]

DC = {
    "kind": "dc",
    "torque_constant": 0.97,
    "back_emf": 0.32,
    "resistance": 0.22,
    "inductance": 0.0037,
    "rotor_inertia": 0.0012,
}
PD = {"kind": "pid-voltage", "position_gain": 300.0, "derivative_gain": 6.0}
TURN = [{"name": "turn", "start_deg": [0.0], "duration_s": 1.0, "moves": [arms.move(1, 30, 90)]}]


def run(folder: Path, robot: dict[str, object], **keys: object) -> SimulatedMotion:
    problem = arms.study(folder, robot, **keys)
    return problem.run(problem.initial[None], problem.records)


def test_a_sampled_pd_motor_moves_as_its_exact_discretisation(tmp_path: Path) -> None:
    """Winding, back-EMF and inertia are linear, so the sampled loop has a closed form: exp(A T) between
    ticks.
    """
    problem = arms.study(
        tmp_path, arms.one_link(0.0), motor=DC, servo={**PD, "period_s": 1e-3}, step_s=2e-4, records=TURN
    )
    motion, command = (
        problem.run(problem.initial[None], problem.records),
        problem.records[0].command.position[:, 0],
    )
    ratio, inertia = 50.0, arms.ABOUT_JOINT + 50.0**2 * DC["rotor_inertia"]
    a = np.zeros((4, 4))  # angle, velocity, current, voltage
    a[0, 1], a[1, 2] = 1.0, ratio * DC["torque_constant"] / inertia
    a[2, 1:] = (
        -ratio * DC["back_emf"] / DC["inductance"],
        -DC["resistance"] / DC["inductance"],
        1 / DC["inductance"],
    )
    hold, state, error, angles, currents = expm(a * 1e-3), np.zeros(4), 0.0, [], []
    for wanted in command:
        angles.append(state[0])
        currents.append(state[2])
        new = wanted - state[0]
        state[3] = PD["position_gain"] * new + PD["derivative_gain"] * (new - error) / 1e-3
        state, error = hold @ state, new
    np.testing.assert_allclose(motion.coordinates[0, :, 0], angles, atol=1e-4 * np.ptp(angles))
    np.testing.assert_allclose(motion.current[0, :, 0], currents, atol=2e-3 * np.ptp(currents))


def test_work_of_motor_is_lifted_and_rubbed_away(tmp_path: Path) -> None:
    """From standstill to standstill: motor work less friction is the potential energy gained."""
    friction = {"coulomb": 8.0, "viscous": 3.0, "stribeck": 4.0, "stribeck_velocity": 0.2}
    record = [{"name": "lift", "start_deg": [0.0], "duration_s": 2.0, "moves": [arms.move(1, 60, 80)]}]
    motion = run(tmp_path, arms.one_link(9.81), friction=friction, records=record, step_s=2.5e-4)
    angle, velocity, torque = (
        part[0, :, 0] for part in (motion.coordinates, motion.velocities, motion.torque)
    )
    rubbed = friction_torque(
        velocity,
        *(np.array(friction[key]) for key in ("coulomb", "viscous", "stribeck", "stribeck_velocity")),
    )
    work = np.trapezoid((torque - rubbed) * velocity, dx=1e-3)
    lifted = arms.MASS * 9.81 * arms.LENGTH * (np.sin(angle[-1]) - np.sin(angle[0]))
    assert abs(velocity[-1]) < 1e-3
    assert work == pytest.approx(lifted, rel=5e-3)
    assert np.trapezoid(rubbed * velocity, dx=1e-3) > 0.2 * lifted


def test_dry_friction_sticks_below_its_level_and_slides_above(tmp_path: Path) -> None:
    """An open loop: all gains but the feed-forward of a wrong arm's torque are zero, so a heavy command
    pushes with a known torque.
    """
    for share, slides in ((0.9, False), (1.5, True)):
        level = 10.0
        push = {
            "kind": "cascade",
            "position_gain": 1.0,
            "velocity_gain": share * level / np.radians(1.0),
            "velocity_every": 1,
        }
        record = [
            {
                "name": "push",
                "start_deg": [0.0],
                "duration_s": 0.3,
                "moves": [arms.move(1, 1, 1000, start_s=0.0)],
            }
        ]
        motion = run(
            tmp_path,
            arms.one_link(0.0),
            servo=push,
            friction={"coulomb": level},
            records=record,
            step_s=2.5e-4,
        )
        turned = motion.coordinates[0, -1, 0]
        assert bool(turned > 1e-3) is slides
        if not slides:
            assert turned < 2e-4


@pytest.mark.parametrize(("command", "step"), [(1e-3, 1e-3), (4e-3, 1e-3)])
def test_delay_and_period_shift_the_motor(tmp_path: Path, command: float, step: float) -> None:
    base = run(
        tmp_path, arms.one_link(0.0), servo={**arms.CASCADE, "period_s": command}, step_s=step, records=TURN
    )
    late = run(
        tmp_path,
        arms.one_link(0.0),
        servo={**arms.CASCADE, "period_s": command, "delay_s": 4e-3},
        step_s=step,
        records=TURN,
    )
    first = [int(np.argmax(np.abs(motion.torque[0, :, 0]) > 1e-6)) for motion in (base, late)]
    assert (first[1] - first[0]) * command == pytest.approx(4e-3)


def test_torque_and_voltage_stay_within_their_limits(tmp_path: Path) -> None:
    fast = [{"name": "fast", "start_deg": [0.0], "duration_s": 3.0, "moves": [arms.move(1, 60, 400)]}]
    free = run(tmp_path, arms.one_link(0.0), records=fast)
    limited = run(tmp_path, arms.one_link(0.0), motor={**arms.PLAIN_MOTOR, "torque_limit": 0.3}, records=fast)
    assert np.abs(free.torque).max() > 20.0
    assert np.abs(limited.torque).max() == pytest.approx(0.3 * 50.0)
    assert limited.coordinates[0, -1, 0] == pytest.approx(
        np.radians(60), abs=0.05
    )  # no windup of the integral


def test_an_encoder_makes_steps_and_a_coarse_one_a_wrong_angle(tmp_path: Path) -> None:
    still = [{"name": "still", "start_deg": [0.4], "duration_s": 0.5}]
    fine = run(tmp_path, arms.one_link(9.81), encoder_counts=[131072], records=still)
    coarse = run(tmp_path, arms.one_link(9.81), encoder_counts=[8], records=still)
    assert np.degrees(fine.coordinates[0, -1, 0]) == pytest.approx(0.4, abs=1e-4)
    assert abs(np.degrees(coarse.coordinates[0, -1, 0]) - 0.4) > 0.01
    assert abs(np.degrees(coarse.coordinates[0, -1, 0]) - 0.4) < 360 / 8 / 50


def test_a_heavy_elastic_arm_begins_at_rest(tmp_path: Path) -> None:
    """Springs, hardening, backlash and transmission error are in equilibrium with gravity at the start."""
    gear = {
        "ratio": 50.0,
        "cubic_stiffness": 1e9,
        "backlash": 2e-4,
        "transmission_error": [{"order": 1, "amplitude": 1e-4, "phase": 0.3}],
    }
    spring = [
        {
            "kind": "joint-compliance",
            "stiffness": {"initial": 3e4, "fixed": True},
            "damping": {"initial": 30.0, "fixed": True},
        }
    ]
    for gear_ in ({"ratio": 50.0}, gear):
        motion = run(
            tmp_path,
            arms.one_link(9.81),
            gear=gear_,
            effects=spring,
            records=[{"name": "s", "start_deg": [20.0], "duration_s": 0.5}],
        )
        assert np.abs(motion.velocities[0, :, 1]).max() < 2e-4
        link = motion.coordinates[0, :, 0] + motion.coordinates[0, :, 1]
        assert abs(link[-1] - link[0]) < 2e-6
        assert link[0] < np.radians(20.0) - 5e-4


def test_a_cascade_with_a_current_loop_drives_a_dc_motor(tmp_path: Path) -> None:
    loops = {
        "velocity_gain": 300.0,
        "output": "voltage",
        "current_gain": 1.5,
        "current_integral": 60.0,
        "period_s": 2.5e-4,
        "velocity_every": 4,
        "position_every": 8,
    }
    motion = run(
        tmp_path,
        arms.one_link(9.81),
        motor=DC,
        servo={**arms.CASCADE, "torque_feedforward": 1.0, **loops},
        records=[{**TURN[0], "duration_s": 2.5}],
    )
    assert np.degrees(motion.coordinates[0, -1, 0]) == pytest.approx(30.0, abs=0.02)
    held = arms.MASS * 9.81 * arms.LENGTH * np.cos(np.radians(30))
    assert motion.current[0, -1, 0] == pytest.approx(held / 50 / 0.97, rel=0.01)


def spring(**numbers: float) -> GearSpring:
    def one(key: str, default: float = 0.0) -> Array:
        return np.array([[numbers.get(key, default)]])

    ripples = ((2, one("amplitude"), one("phase")),) if "amplitude" in numbers else ()
    return GearSpring(one("ratio", 30.0), one("stiffness", 2e4), one("cubic"), one("backlash"), ripples)


@pytest.mark.parametrize("torque", [-300.0, -1.0, 5.0, 400.0])
def test_windup_is_the_inverse_of_the_spring_torque(torque: float) -> None:
    gear = spring(cubic=5e8, backlash=1e-3)
    windup = gear.windup(np.array([[torque]]))
    assert gear.torque(windup)[0, 0] == pytest.approx(torque, rel=1e-9)
    assert gear.torque(np.array([[4e-4]]))[0, 0] == 0.0  # within the backlash


def test_gear_forces_are_the_slope_of_one_energy() -> None:
    """Transmission error acts back on the rotor: both forces are minus the derivative of the spring's
    energy.
    """
    gear, step = spring(cubic=5e8, amplitude=2e-4, phase=0.7), 1e-6

    def energy(turn: float, delta: float) -> float:
        e = delta - gear.transmission_error(np.array([[turn]]))[0][0, 0]
        return 2e4 * e**2 / 2 + 5e8 * e**4 / 4 - 2e4 * delta**2 / 2  # beyond the engine's own linear spring

    turn, delta = 0.4, 1.3e-3
    on_drive, on_windup = gear.beyond_linear(np.array([[turn]]), np.array([[delta]]))
    assert on_drive[0, 0] == pytest.approx(
        -(energy(turn + step, delta) - energy(turn - step, delta)) / 2 / step, rel=1e-5
    )
    assert on_windup[0, 0] == pytest.approx(
        -(energy(turn, delta + step) - energy(turn, delta - step)) / 2 / step, rel=1e-5
    )


def test_an_unstable_controller_is_reported_not_crashed(tmp_path: Path) -> None:
    motion = run(tmp_path, arms.one_link(0.0), motor=DC, servo={**PD, "derivative_gain": 400.0}, records=TURN)
    assert np.isnan(motion.coordinates[0, -1, 0])


def test_wrong_studies_are_refused_with_the_key_and_a_fix(tmp_path: Path) -> None:
    robot = arms.one_link(0.0)
    spring = [{"kind": "joint-compliance", "stiffness": {"initial": 3e6}}]
    wrong: list[tuple[dict[str, object], str]] = [
        ({"motor": DC}, "gives a torque"),
        ({"gear": {"ratio": [50, 60]}}, "gear.ratio: 2 values"),
        ({"gear": {"ratio": {"initial": 50}}}, "gear.ratio.bounds: missing"),
        ({"gear": {"ratio": {"initial": 50, "bounds": [60, 70]}}}, "within its bounds"),
        ({"gear": {"ratio": 50, "backlash": 1e-3}}, "no joint that is elastic"),
        ({"friction": {"coulomb": -1.0}}, "friction.coulomb: value -1"),
        ({"friction": {"colomb": 1.0}}, "did you mean `coulomb`"),
        ({"servo": {"kind": "pd"}}, "unknown controller 'pd'"),
        ({"effects": spring, "motor": {"kind": "torque"}}, "motor.rotor_inertia"),
        ({"effects": [{"kind": "sensor-mass"}]}, "effect"),
        ({"effects": spring, "step_s": 1e-3}, "a step that resolves it"),
        ({"step_s": 3e-4}, "step_s"),
        (
            {"records": [{"name": "a", "start_deg": [0, 0], "duration_s": 1.0}]},
            "yaml line 1: records.0.start_deg: 2 angles",
        ),
        (
            {
                "records": [
                    {"name": "a", "start_deg": [0], "duration_s": 0.2, "moves": [arms.move(1, 90, 10)]}
                ]
            },
            "the move ends after",
        ),
        ({"noise": {"command_position": 1.0}}, "cannot be fitted"),
    ]
    for keys, sentence in wrong:
        with pytest.raises((InputError, InputErrors)) as caught:
            arms.study(tmp_path, robot, **keys)
        assert sentence in str(caught.value), (keys, str(caught.value))

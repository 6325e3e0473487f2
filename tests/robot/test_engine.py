"""The dynamics engine and the posture it is built from: closed forms, conventions, names, the ground and
plates.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest

from identify.core.errors import InputError
from identify.robot.description import Joint, Link, Robot
from identify.robot.engine import Engine, _compiled, compile_mechanism
from identify.robot.posture import AXES, at_posture
from identify.robot.urdf import read_urdf
from tests.robot.random_arm import general_arm, random_posture, write


def pendulum(base_mass: float = 3.0) -> tuple[Robot, float, float, float]:
    """A rod's mass (kg), centre distance (m) and inertia about the centre (kg m^2), hung on a horizontal axis
    along y.
    """
    mass, length, inertia = 2.0, 0.7, 0.11
    rod = Link("rod", mass, np.array([0, 0, -length]), np.diag([inertia, inertia, 0.02]))
    base = Link("base", base_mass, np.zeros(3), base_mass * np.eye(3))
    return (
        Robot(
            "pendulum", (base, rod), (Joint("hinge", "base", "rod", np.eye(4), np.array([0.0, 1.0, 0.0])),)
        ),
        mass,
        length,
        inertia,
    )


@pytest.mark.parametrize("angle", [0.0, 0.6, np.pi])
def test_pendulum_has_its_closed_form(angle: float) -> None:
    robot, mass, length, inertia = pendulum()
    engine = Engine(at_posture(robot, np.array([angle])))
    swing = engine.mechanism.coordinate("joint1.rz", "test")
    assert engine.mass_matrix()[swing, swing] == pytest.approx(inertia + mass * length**2, rel=1e-12)
    assert engine.gravity_stiffness()[swing, swing] == pytest.approx(
        mass * 9.81 * length * np.cos(angle), rel=1e-8
    )
    assert engine.jacobian("rod", np.array([0, 0, -length]))[:, swing] == pytest.approx(
        [-length, 0, 0, 0, 1, 0], abs=1e-12
    )
    assert engine.axes("rod") == pytest.approx(
        np.array([[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]])
    )
    assert engine.position("rod", np.array([0, 0, -length])) == pytest.approx(
        [-length * np.sin(angle), 0, -length * np.cos(angle)]
    )


def test_z_of_a_joint_frame_is_the_joint_axis(tmp_path: Path) -> None:
    robot = read_urdf(write(tmp_path, general_arm(5)))
    engine = Engine(at_posture(robot, random_posture(5)))
    for number, joint in enumerate(robot.joints, start=1):
        turn = engine.jacobian(joint.child, np.zeros(3))[
            :, engine.mechanism.coordinate(f"joint{number}.rz", "test")
        ]
        shift = engine.jacobian(joint.child, np.zeros(3))[
            :, engine.mechanism.coordinate(f"joint{number}.tz", "test")
        ]
        assert turn[3:] == pytest.approx(joint.axis, abs=1e-12)
        assert turn[:3] == pytest.approx(np.zeros(3), abs=1e-12)
        assert shift[:3] == pytest.approx(joint.axis, abs=1e-12)


def test_opposite_axes_give_opposite_drive_directions() -> None:
    robot, *_ = pendulum()
    for axis in ([0, 0, 1.0], [0, 0, -1.0], [1e-13, 0, -1.0]):
        turned = replace(robot, joints=(replace(robot.joints[0], axis=np.array(axis)),))
        engine = Engine(at_posture(turned, np.array([0.4])))
        assert engine.jacobian("rod", np.zeros(3))[3:, -1] == pytest.approx(axis, abs=1e-9)


def test_coordinates_are_named_in_order_and_the_base_moves_everything() -> None:
    robot, *_ = pendulum()
    mechanism = at_posture(robot, np.array([0.3]))
    assert mechanism.coordinates[:7] == (
        "base.tx",
        "base.ty",
        "base.tz",
        "base.rx",
        "base.ry",
        "base.rz",
        "joint1.tx",
    )
    assert Engine(mechanism).mass_matrix()[0, 0] == pytest.approx(5.0)


def test_a_plate_keeps_its_inertia() -> None:
    """The largest moment of a plate is the sum of the others: rounding must not make the engine replace them
    by their mean.
    """
    robot, *_ = pendulum()
    rng = np.random.default_rng(1)
    for _ in range(20):
        turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        a, b = rng.uniform(0.1, 1, 2)
        plate = turn @ np.diag([a, b, a + b]) @ turn.T
        plate = (plate + plate.T) / 2
        rod = replace(robot.links[1], centre=np.zeros(3), inertia=plate)
        upright = replace(
            robot, links=(robot.links[0], rod), joints=(replace(robot.joints[0], axis=np.array([0, 0, 1.0])),)
        )
        mass = Engine(at_posture(upright, np.zeros(1))).mass_matrix()
        assert mass[9:, 9:] == pytest.approx(plate, abs=1e-12)


def test_a_base_without_inertia_is_the_ground() -> None:
    loose, fixed = (Engine(at_posture(pendulum(mass)[0], np.array([0.6]))) for mass in (3.0, 0.0))
    assert fixed.mechanism.coordinates == loose.mechanism.coordinates[6:]
    assert fixed.mass_matrix() == pytest.approx(loose.mass_matrix()[6:, 6:], abs=1e-12)
    assert fixed.gravity_stiffness() == pytest.approx(loose.gravity_stiffness()[6:, 6:], abs=1e-8)
    assert fixed.jacobian("rod", np.ones(3)) == pytest.approx(
        loose.jacobian("rod", np.ones(3))[:, 6:], abs=1e-12
    )
    assert not fixed.jacobian("base", np.ones(3)).any()
    assert fixed.position("base", np.ones(3)) == pytest.approx(np.ones(3))
    with pytest.raises(InputError, match=r"'base\.rx' moves the base, which has no inertia"):
        fixed.mechanism.coordinate("base.rx", "effects[1]")


def test_unknown_coordinate_and_bad_postures_are_refused() -> None:
    robot, *_ = pendulum()
    with pytest.raises(
        InputError, match=r"unknown coordinate 'joint2.rz'; expected BODY.AXIS, BODY one of base, joint1"
    ):
        at_posture(robot, np.zeros(1)).coordinate("joint2.rz", "effects[0]")
    with pytest.raises(InputError, match="posture_deg: 2 angles; expected 1, one per joint"):
        at_posture(robot, np.zeros(2))
    with pytest.raises(InputError, match="expected finite numbers"):
        at_posture(robot, np.array([np.nan]))


def test_what_is_remembered_cannot_be_written_to() -> None:
    """One engine serves many models: a caller that changed a motion would change it for all of them."""
    engine = Engine(at_posture(pendulum()[0], np.array([0.3])))
    frame = "rod"
    near, far = (engine.jacobian(frame, np.array([0.0, 0.0, z])) for z in (0.1, 0.2))
    again = Engine(engine.mechanism).jacobian(frame, np.array([0.0, 0.0, 0.1]))
    assert np.array_equal(engine.jacobian(frame, np.array([0.0, 0.0, 0.1])), again)
    assert not np.array_equal(near, far)
    for known in (near, engine.gravity_stiffness(), engine.weight_stiffness(frame, np.zeros(3))):
        with pytest.raises(ValueError, match="read-only"):
            known[0, 0] = 1.0


def test_gravity_stiffness_is_the_derivative_of_the_weights(tmp_path: Path) -> None:
    """Of the bodies, and of a point mass: against central differences of their potential."""
    robot = read_urdf(write(tmp_path, general_arm(2)))
    mechanism, point = at_posture(robot, random_posture(2)), np.array([0.1, -0.2, 0.3])
    engine = Engine(mechanism)
    model = compile_mechanism(mechanism, {body.name: AXES for body in mechanism.bodies})
    data, step = mujoco.MjData(model), 1e-4
    body, pose = mechanism.frame("link4", "test")
    inside = pose[:3, :3] @ point + pose[:3, 3]

    def potentials(displacement: np.ndarray) -> np.ndarray:
        data.qpos[:] = displacement
        mujoco.mj_kinematics(model, data)
        weights = model.body_mass @ data.xipos
        one = data.xpos[body + 1] + data.xmat[body + 1].reshape(3, 3) @ inside
        return -np.array([weights, one]) @ mechanism.gravity

    unit, count = step * np.eye(model.nv), model.nv
    expected = np.zeros((2, count, count))
    for row in range(count):
        for column in range(row + 1):
            corners = [
                one * other * potentials(one * unit[row] + other * unit[column])
                for one in (1, -1)
                for other in (1, -1)
            ]
            expected[:, row, column] = expected[:, column, row] = np.sum(corners, axis=0) / (4 * step**2)
    found = engine.gravity_stiffness(), engine.weight_stiffness("link4", point)
    for one, other in zip(found, expected, strict=True):
        assert one == pytest.approx(other, abs=1e-5 * np.abs(other).max())


def test_engines_at_other_postures_share_what_is_compiled_and_nothing_else(tmp_path: Path) -> None:
    robot = read_urdf(write(tmp_path, general_arm(2)))
    first, second = (at_posture(robot, random_posture(seed)) for seed in (3, 4))
    rates, at = np.linspace(0.1, 1.0, 6 * len(first.bodies)), np.array([0.1, 0.0, 0.2])

    def told(engine: Engine) -> list[np.ndarray]:
        turned = engine.turning(2, "link5", at)
        return [engine.mass_matrix(), engine.gravity_stiffness(), engine.coriolis(rates), *turned]

    _compiled.cache_clear()
    one = Engine(first)
    other = Engine(second)
    assert _compiled.cache_info().misses == 1
    shared = told(other), told(one)
    for engine, mechanism in zip(shared, (second, first), strict=True):
        _compiled.cache_clear()
        for found, expected in zip(engine, told(Engine(mechanism)), strict=True):
            assert found == pytest.approx(expected, rel=1e-10, abs=1e-10 * np.abs(expected).max())
    heavier = replace(robot, links=(*robot.links[:-1], replace(robot.links[-1], mass=99.0)))
    assert Engine(at_posture(heavier, random_posture(3))).mass_matrix() != pytest.approx(shared[1][0])

"""The arm in motion against closed forms and a second engine."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.special import ellipk

from identify.robot.dh import read_dh
from identify.robot.engine_motion import Lanes, MovingArm, Passive
from tests.motion import arms

pinocchio = pytest.importorskip("pinocchio")
Array = NDArray[np.float64]


def arm(folder: Path, robot: dict[str, object], *released: str) -> MovingArm:
    (folder / "robot.yaml").write_text(json.dumps(robot))
    return MovingArm(read_dh(folder / "robot.yaml"), released)


def bare(lanes: int, size: int) -> Passive:
    return Passive(*(np.zeros((lanes, size)) for _ in range(3)))


def second_engine(moving: MovingArm) -> pinocchio.Model:
    """The arm with its drives alone, from the description's numbers."""
    model, parent, place = pinocchio.Model(), 0, pinocchio.SE3.Identity()
    for joint, link in zip(moving.robot.joints, moving.robot.links[1:], strict=True):
        origin = pinocchio.SE3(joint.origin[:3, :3], joint.origin[:3, 3])
        parent = model.addJoint(
            parent, pinocchio.JointModelRevoluteUnaligned(joint.axis), place * origin, joint.name
        )
        place = pinocchio.SE3(joint.mount[:3, :3], joint.mount[:3, 3])
        model.appendBodyToJoint(parent, pinocchio.Inertia(link.mass, link.centre, link.inertia), place)
    model.gravity.linear = moving.robot.gravity
    return model


def test_inverse_dynamics_and_mass_matrix_are_those_of_the_second_engine(tmp_path: Path) -> None:
    moving, rng = arm(tmp_path, arms.three_links()), np.random.default_rng(1)
    model = second_engine(moving)
    q, v, a = rng.normal(size=(3, 5, 3))
    ours = moving.inverse_dynamics(q, v, a)
    for row in range(5):
        theirs = pinocchio.rnea(model, model.createData(), q[row], v[row], a[row])
        np.testing.assert_allclose(ours[row], theirs, rtol=1e-9, atol=1e-9)
        upper = np.triu(pinocchio.crba(model, model.createData(), q[row]))
        np.testing.assert_allclose(
            moving.mass_matrix(q[row]), upper + np.triu(upper, 1).T, rtol=1e-9, atol=1e-9
        )


def swing(moving: MovingArm, start: Array, step: float, duration: float, rotors: float = 0.0) -> Array:
    """Free motion from rest; the last position."""
    passive = Passive(np.full((1, len(start)), rotors), *(np.zeros((1, len(start))) for _ in range(2)))
    lanes = Lanes(moving, passive, start[None], step)
    for _ in range(round(duration / step)):
        lanes.advance()
    return lanes.position[0]


def test_free_motion_converges_with_the_square_of_the_step_to_the_second_engine(tmp_path: Path) -> None:
    """Forward dynamics of Pinocchio, integrated by scipy to 1e-10, from rest, with rotors on the joints."""
    moving, start, rotors = arm(tmp_path, arms.three_links()), np.array([0.3, 0.6, -0.9]), 1.5
    model = second_engine(moving)
    model.armature = np.full(3, rotors)
    data = model.createData()

    def slope(_: float, y: Array) -> Array:
        return np.concatenate([y[3:], pinocchio.aba(model, data, y[:3], y[3:], np.zeros(3))])

    truth = solve_ivp(
        slope, (0, 0.5), np.concatenate([start, np.zeros(3)]), "DOP853", rtol=1e-10, atol=1e-11
    ).y[:3, -1]
    errors = [
        float(np.abs(swing(moving, start, step, 0.5, rotors) - truth).max()) for step in (2e-3, 1e-3, 5e-4)
    ]
    assert errors[2] < 2e-6
    assert errors[0] > 3.5 * errors[1] > 12 * errors[2]


def test_pendulum_swings_with_the_period_of_the_elliptic_integral(tmp_path: Path) -> None:
    moving, amplitude, step = arm(tmp_path, arms.one_link(9.81)), np.radians(60), 1e-3
    lanes = Lanes(moving, bare(1, 1), np.array([[amplitude - np.pi / 2]]), step)
    angles = [amplitude]
    for _ in range(4000):
        lanes.advance()
        angles.append(lanes.position[0, 0] + np.pi / 2)
    signs = np.flatnonzero(np.diff(np.sign(angles)))
    crossings = [step * (n + angles[n] / (angles[n] - angles[n + 1])) for n in signs]
    small = np.sqrt(arms.ABOUT_JOINT / (arms.MASS * 9.81 * arms.LENGTH))
    assert 2 * np.mean(np.diff(crossings)) == pytest.approx(
        4 * small * ellipk(np.sin(amplitude / 2) ** 2), rel=1e-5
    )


def test_energy_of_a_free_elastic_arm_stays_where_it_is(tmp_path: Path) -> None:
    """Springs of a kHz mode included; over many swings the energy wavers with the step and does not drift."""
    released = ["joint2.rz", "joint2.rx", "joint3.ty"]
    moving = arm(tmp_path, arms.three_links(), *released)
    size = len(moving.names)
    stiffness = np.zeros((1, size))
    for name, k in zip(released, (2e5, 5e5, 1e8), strict=True):
        stiffness[0, moving.names.index(name)] = k
    start = np.zeros((1, size))
    start[0, moving.drive] = [0.2, 0.9, -0.4]
    armature = np.zeros((1, size))
    armature[0, moving.drive] = 1.5
    lanes = Lanes(moving, Passive(armature, stiffness, np.zeros((1, size))), start, 5e-5)
    energies = [lanes.energy()]
    for _ in range(10):
        for _ in range(800):
            lanes.advance()
        energies.append(lanes.energy())
    fallen = 40 * 9.81 * 0.5
    assert np.abs(np.array(energies) - energies[0]).max() < 2e-3 * fallen


def test_two_masses_on_a_spring_move_as_the_closed_form_says(tmp_path: Path) -> None:
    """A rotor and a link, a constant torque on the rotor: rigid motion plus a vibration at sqrt(k (1/J_r +
    1/J_l)).
    """
    moving = arm(tmp_path, arms.one_link(0.0), "joint1.rz")
    k, rotor, link, torque, step = 4e4, 3.0, arms.ABOUT_JOINT, 50.0, 1e-4
    lanes = Lanes(
        moving,
        Passive(np.array([[rotor, 0.0]]), np.array([[0.0, k]]), np.zeros((1, 2))),
        np.zeros((1, 2)),
        step,
    )
    for _ in range(2000):
        lanes.force[0, 0] = torque
        lanes.advance()
    t, omega = 2000 * step, np.sqrt(k * (1 / rotor + 1 / link))
    windup = -torque / (rotor * omega**2) * (1 - np.cos(omega * t))
    middle = torque * t**2 / 2 / (rotor + link)
    assert lanes.position[0, 1] == pytest.approx(windup, rel=1e-3)
    assert lanes.position[0, 0] == pytest.approx(middle - windup * link / (rotor + link), rel=1e-4)


def test_a_lane_that_runs_away_is_nan_and_the_others_go_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And the engine leaves no file of its own where the user is."""
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    moving = arm(tmp_path, arms.one_link(0.0))
    lanes = Lanes(moving, bare(2, 1), np.zeros((2, 1)), 1e-3)
    for _ in range(100):
        lanes.force[:, 0] = [1e12, 1.0]
        lanes.advance()
    assert np.isnan(lanes.position[0, 0])
    assert lanes.position[1, 0] == pytest.approx(0.1**2 / 2 / arms.ABOUT_JOINT, rel=0.02)
    assert list(Path().iterdir()) == []

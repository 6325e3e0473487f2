"""The dynamics engine against a second one (Pinocchio), which reads the file by itself, on random arms."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from identify.model.frf import frf
from identify.robot.engine import Engine
from identify.robot.posture import at_posture
from identify.robot.urdf import read_urdf
from tests.robot.random_arm import general_arm, industrial_arm, random_posture, write

pytest.importorskip("pinocchio", reason="the second engine (pin) has no wheel here")
from tests.robot.pinocchio_reference import Reference

Array = NDArray[np.float64]
ARMS = [*((general_arm, seed) for seed in range(16)), *((industrial_arm, seed) for seed in range(8))]


def relative(got: Array, expected: Array) -> float:
    """Largest difference over the largest entry of what is expected."""
    return float(np.abs(got - expected).max() / np.abs(expected).max())


@pytest.fixture(params=ARMS, ids=lambda arm: f"{arm[0].__name__}{arm[1]}")
def arm(request: pytest.FixtureRequest, tmp_path: Path) -> tuple[Engine, Reference]:
    make, seed = request.param
    text, posture = make(seed), random_posture(seed)
    return Engine(at_posture(read_urdf(write(tmp_path, text)), posture)), Reference(
        text, posture, "base_link"
    )


def in_reference_gravity(engine: Engine, reference: Reference) -> None:
    """Pinocchio keeps the file's world axes; ours are the base's: both must mean the same direction."""
    down = reference.body_frames[0].rotation.T @ reference.model.gravity.linear
    assert relative(engine.mechanism.gravity, down) < 1e-12


def test_mass_gravity_and_jacobians_equal_the_second_engine(arm: tuple[Engine, Reference]) -> None:
    engine, reference = arm
    in_reference_gravity(engine, reference)
    assert relative(engine.mass_matrix(), reference.mass_matrix()) < 1e-8
    assert relative(engine.gravity_stiffness(), reference.gravity_stiffness()) < 1e-8
    rng = np.random.default_rng(3)
    for frame in engine.mechanism.frames:
        point = rng.uniform(-1, 1, 3)
        assert relative(engine.jacobian(frame, point), reference.jacobian(frame, point)) < 1e-8


def test_frfs_equal_those_of_the_second_engine(arm: tuple[Engine, Reference]) -> None:
    """All 42 coordinates on springs and dampers: Z^-1 by the other engine's matrices, assembled and inverted
    here.
    """
    engine, reference = arm
    rng, size = np.random.default_rng(5), 6 * len(engine.mechanism.bodies)
    stiffness, damping = 10 ** rng.uniform(5, 7, size), 10 ** rng.uniform(1, 3, size)
    frames, s = list(engine.mechanism.frames), 0.7 + 2j * np.pi * np.linspace(1, 100, 25)
    points = [(frames[-1], rng.uniform(-0.5, 0.5, 3)), (frames[len(frames) // 2], rng.uniform(-0.5, 0.5, 3))]
    ours, theirs = (np.vstack([side.jacobian(link, at)[:3] for link, at in points]) for side in arm)
    found = frf(
        engine.mass_matrix(),
        np.diag(damping),
        np.diag(stiffness) + engine.gravity_stiffness(),
        s,
        ours,
        ours.T,
        2,
    )
    constant = np.diag(stiffness) + reference.gravity_stiffness()
    mass = reference.mass_matrix()
    expected = np.array(
        [
            line**2 * theirs @ np.linalg.inv(constant + line * np.diag(damping) + line**2 * mass) @ theirs.T
            for line in s
        ]
    )
    assert np.abs(found - expected).max() < 1e-8 * np.abs(expected).max()


def test_drive_rotations_alone_are_the_rigid_arm(arm: tuple[Engine, Reference]) -> None:
    engine, reference = arm
    drives = [6 * number + 5 for number in range(1, 7)]
    assert relative(engine.mass_matrix()[np.ix_(drives, drives)], reference.rigid_mass_matrix()) < 1e-8


def test_mass_is_symmetric_positive_definite_and_gravity_stiffness_symmetric(
    arm: tuple[Engine, Reference],
) -> None:
    engine, _ = arm
    mass, gravity = engine.mass_matrix(), engine.gravity_stiffness()
    assert relative(mass, mass.T) < 1e-14
    assert np.linalg.eigvalsh(mass)[0] > 0
    assert np.array_equal(gravity, gravity.T)


def test_a_wrong_inertia_is_noticed_by_the_comparison(tmp_path: Path) -> None:
    text, posture = general_arm(0), random_posture(0)
    robot = read_urdf(write(tmp_path, text))
    heavier = replace(robot.links[3], mass=robot.links[3].mass * (1 + 1e-6))
    wrong = replace(robot, links=(*robot.links[:3], heavier, *robot.links[4:]))
    reference = Reference(text, posture, "base_link")
    assert relative(Engine(at_posture(wrong, posture)).mass_matrix(), reference.mass_matrix()) > 1e-8

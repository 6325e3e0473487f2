"""A payload on a soft mount."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from identify.core.errors import InputError
from identify.model.effects.joint_compliance import JointCompliance
from identify.model.effects.mount_compliance import MountCompliance
from identify.model.system import assemble, build_site
from tests.arms import arm

INERTIA, CENTRE, MASS = np.diag([0.02, 0.03, 0.04]), np.array([0.05, 0.0, 0.1]), 4.0
POSTURE = np.radians([0.0, 20.0, 40.0, 10.0, 50.0, 0.0])


def test_the_payload_moves_as_a_body_of_its_own_and_a_rigid_mount_changes_nothing(tmp_path: Path) -> None:
    """Its own six coordinates have the inertia of the body about the mount; the arm's are as without it."""
    robot = arm(tmp_path).with_payload("link6", MASS, CENTRE, INERTIA)
    mount = MountCompliance(at_m=(0.0, 0.0, 0.02))
    effects = [JointCompliance(joints="all", axes=["rz"]), mount]
    system = assemble(robot, build_site(robot, POSTURE, effects), effects)
    plain = assemble(robot, build_site(robot, POSTURE, effects[:1]), effects[:1])
    own = [n for n, name in enumerate(system.coordinates) if name.startswith("payload1")]
    arms = [n for n in range(len(system.coordinates)) if n not in own]
    assert system.mass[np.ix_(arms, arms)] == pytest.approx(plain.mass)
    lever = CENTRE - [0.0, 0.0, 0.02]
    about = INERTIA + MASS * (lever @ lever * np.eye(3) - np.outer(lever, lever))
    moved = system.mass[np.ix_(own, own)]
    assert moved[:3, :3] == pytest.approx(MASS * np.eye(3))
    assert moved[3:, 3:] == pytest.approx(about)
    assert moved[:3, 3:] == pytest.approx(-MASS * np.cross(np.eye(3), lever))
    assert np.linalg.eigvalsh(system.mass).min() > 0


def test_two_springs_of_a_mount_are_one_with_the_axes_of_both(tmp_path: Path) -> None:
    """What is usual along axes and about them has other units, so that they are effects of their own."""
    robot = arm(tmp_path).with_payload("link6", MASS, CENTRE, INERTIA)
    both = [MountCompliance(axes=["tx"]), MountCompliance(axes=["ry"])]
    one = [MountCompliance(axes=["tx", "ry"])]
    apart, together = (assemble(robot, build_site(robot, POSTURE, e), e) for e in (both, one))
    assert apart.coordinates == together.coordinates
    np.testing.assert_array_equal(apart.mass, together.mass)
    assert {p.name for p in apart.parameters} == {p.name for p in together.parameters}


def test_a_payload_that_is_not_there_and_a_mount_at_two_places_are_refused(tmp_path: Path) -> None:
    robot = arm(tmp_path).with_payload("link6", MASS, CENTRE, INERTIA)
    with pytest.raises(InputError, match="payload 2, where the robot has 1"):
        build_site(robot, POSTURE, [MountCompliance(payload=2)])
    there = MountCompliance(axes=["ry"], at_m=(0.0, 0.0, 0.01))
    with pytest.raises(InputError, match="elsewhere than in an effect above"):
        build_site(robot, POSTURE, [MountCompliance(axes=["rx"]), there])
    twice = [MountCompliance(axes=["rx"]), MountCompliance(axes=["rx"])]
    with pytest.raises(InputError, match="claimed by an effect above"):
        assemble(robot, build_site(robot, POSTURE, twice), twice)

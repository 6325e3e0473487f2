"""Payload, detached links, names and inertias that no body can have."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from identify.core.errors import InputError
from identify.robot.description import Link, Robot, inertia_fault, merge
from identify.robot.engine import Engine
from identify.robot.posture import at_posture
from identify.robot.urdf import read_urdf
from tests.robot.random_arm import general_arm, random_posture, write


@pytest.fixture
def arm(tmp_path: Path) -> Robot:
    return read_urdf(write(tmp_path, general_arm(9)))


POSTURE = random_posture(9)


def test_a_payload_adds_its_mass_as_its_jacobian_says(arm: Robot) -> None:
    """M grows by J^T m J for a body at its centre, whatever the link: an independent route to the merged
    inertia.
    """
    mass, centre, inertia = (
        12.0,
        np.array([0.1, 0.2, -0.3]),
        np.array([[0.5, 0.1, 0], [0.1, 0.6, 0], [0, 0, 0.4]]),
    )
    bare, loaded = (
        Engine(at_posture(robot, POSTURE))
        for robot in (arm, arm.with_payload("link4", mass, centre, inertia))
    )
    jacobian = bare.jacobian("link4", centre)
    added = mass * jacobian[:3].T @ jacobian[:3] + jacobian[3:].T @ inertia @ jacobian[3:]
    assert loaded.mass_matrix() - bare.mass_matrix() == pytest.approx(added, abs=1e-10)


def test_a_point_mass_is_a_payload(arm: Robot) -> None:
    loaded = arm.with_payload("link6", 5.0, np.array([0, 0, 0.1]), np.zeros((3, 3)))
    assert loaded.links[6].mass == arm.links[6].mass + 5
    assert arm.links[6].mass != loaded.links[6].mass


@pytest.mark.parametrize(
    ("link", "mass", "inertia", "sentence"),
    [
        ("link9", 5.0, np.eye(3), "payload: unknown link 'link9'; expected one of base_link, link1"),
        ("link6", -5.0, np.eye(3), "payload on link 'link6': mass -5 kg is not positive"),
        ("link6", 0.0, np.eye(3), "mass 0 kg is not positive"),
        ("link6", float("nan"), np.eye(3), "payload on link 'link6'"),
        ("link6", 5.0, np.diag([1.0, 1.0, 1000.0]), "the largest exceeds the sum"),
    ],
)
def test_payloads_that_cannot_be(
    arm: Robot, link: str, mass: float, inertia: np.ndarray, sentence: str
) -> None:
    with pytest.raises(InputError, match=sentence):
        arm.with_payload(link, mass, np.zeros(3), inertia, "payload")


def test_a_payload_on_a_link_of_unknown_inertia_is_refused(arm: Robot) -> None:
    unknown = replace(arm, links=(Link("base_link", 0.0, np.zeros(3), np.zeros((3, 3))), *arm.links[1:]))
    with pytest.raises(InputError, match="a payload on link 'base_link', whose own inertia is not known"):
        unknown.with_payload("base_link", 5.0, np.zeros(3), np.eye(3))


def test_detaching_takes_off_a_link_and_all_beyond_it(arm: Robot) -> None:
    rest = arm.detach("link4")
    assert [link.name for link in rest.links] == ["base_link", "link1", "link2", "link3"]
    assert [joint.name for joint in rest.joints] == ["joint1", "joint2", "joint3"]
    assert set(rest.frames) == {"world", "bracket1", "bracket3"}
    whole, part = Engine(at_posture(arm, POSTURE)), Engine(at_posture(rest, POSTURE[:3]))
    assert part.position("link3", np.ones(3)) == pytest.approx(whole.position("link3", np.ones(3)))
    assert part.mass_matrix()[0, 0] == pytest.approx(sum(link.mass for link in arm.links[:4]))


def test_detaching_what_is_not_there_or_the_base_is_refused(arm: Robot) -> None:
    with pytest.raises(InputError, match="unknown link 'wrist'; expected one of"):
        arm.detach("wrist")
    with pytest.raises(InputError, match="cannot detach the base link 'base_link'"):
        arm.detach("base_link")


def test_joints_are_found_by_number_and_name(arm: Robot) -> None:
    assert (arm.joint_number(3), arm.joint_number("joint3")) == (3, 3)
    for wrong in (0, 7, "joint7"):
        with pytest.raises(InputError, match="unknown joint"):
            arm.joint_number(wrong)


def test_two_halves_make_a_rod() -> None:
    half = Link("half", 1.0, np.array([0.5, 0, 0]), np.diag([0, 1 / 12, 1 / 12]))
    whole = merge(half, replace(half, centre=-half.centre))
    assert (whole.mass, whole.centre.tolist()) == (2.0, [0, 0, 0])
    assert whole.inertia == pytest.approx(np.diag([0, 2 * 4 / 12, 2 * 4 / 12]))


@pytest.mark.parametrize(
    ("mass", "inertia", "sentence"),
    [
        (0.0, np.eye(3), "mass 0 kg"),
        (-1.0, np.eye(3), "mass -1 kg"),
        (np.nan, np.eye(3), "mass nan kg"),
        (1.0, np.diag([1, 1, np.inf]), "not finite"),
        (1.0, np.array([[1, 0.5, 0], [0, 1, 0], [0, 0, 1]]), "not symmetric"),
        (1.0, np.diag([1, -1, 1.0]), "not all positive"),
        (1.0, np.zeros((3, 3)), "not all positive"),
        (1.0, np.diag([1, 1, 2.3]), "largest exceeds the sum"),
    ],
)
def test_inertias_no_body_has(mass: float, inertia: np.ndarray, sentence: str) -> None:
    assert sentence in (inertia_fault(Link("link", mass, np.zeros(3), inertia)) or "")


def test_a_plate_and_rounded_tables_are_bodies() -> None:
    assert inertia_fault(Link("plate", 1.0, np.zeros(3), np.diag([1, 1, 2.0]))) is None
    assert inertia_fault(Link("rounded", 1.0, np.zeros(3), np.diag([0.101, 0.102, 0.2031]))) is None


def test_a_payload_adds_the_gravity_stiffness_of_its_weight(arm: Robot) -> None:
    mass, centre = 12.0, np.array([0.1, 0.2, -0.3])
    bare, loaded = (
        Engine(at_posture(robot, POSTURE))
        for robot in (arm, arm.with_payload("link4", mass, centre, np.zeros((3, 3))))
    )
    added = loaded.gravity_stiffness() - bare.gravity_stiffness()
    assert mass * bare.weight_stiffness("link4", centre) == pytest.approx(added, abs=1e-5)
    assert np.abs(added).max() > 10

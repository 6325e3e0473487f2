"""What is said of masses that cannot be a robot's."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from identify.robot.description import Robot
from identify.robot.mesh_body import Wanted, made_bodies
from identify.robot.plausible import masses
from tests.robot.test_mesh_body import arm


def with_bodies(folder: Path, mass_kg: float) -> Robot:
    """An arm of boxes whose bodies have this mass together; at 7.2 kg it has the density of robots."""
    robot = arm(folder)
    bodies = {body.name: body for body in made_bodies(robot, Wanted(mass_kg))}
    return replace(robot, links=tuple(bodies[link.name] for link in robot.links))


def test_masses_are_said_and_nothing_else_of_a_robot_that_can_be(tmp_path: Path) -> None:
    found = masses(with_bodies(tmp_path, 7.2), 7.2)
    assert found.doubts == ()
    assert found.sentence.startswith(
        "the moving links have 6.05 kg together (one 2.09, two 3.96), the base 1.15 kg"
    )


@pytest.mark.parametrize("factor", [0.05, 20.0])
def test_a_density_that_no_robot_has(tmp_path: Path, factor: float) -> None:
    found = masses(with_bodies(tmp_path, 7.2 * factor))
    assert len(found.doubts) == 1
    assert "kg per m3, where robots have 700 to 1800" in found.doubts[0]


def test_a_data_sheet_that_says_otherwise(tmp_path: Path) -> None:
    robot = with_bodies(tmp_path, 7.2)
    for wrong in (3.0, 40.0):
        assert "the data sheet says" in masses(robot, wrong).doubts[0]


def test_placeholders(tmp_path: Path) -> None:
    robot = with_bodies(tmp_path, 7.2)
    one = robot.links[1]
    third = replace(one, name="three", inertia=0.01 * np.eye(3))
    balls = replace(robot, links=(robot.links[0], third, third, third))
    found = masses(replace(balls, visuals=()))
    assert any("those of balls" in doubt for doubt in found.doubts)
    assert any("the same mass and inertia" in doubt for doubt in found.doubts)


def test_the_density_of_water_is_that_of_cad_without_a_material(tmp_path: Path) -> None:
    robot = arm(tmp_path, shapes="base one two")
    found = []
    for density in (1000.0, 1300.0):
        links = [robot.links[0]]
        for link, length in zip((*robot.links[1:], robot.links[2]), (2.0, 4.0, 4.0), strict=True):
            links.append(replace(link, mass=1e-3 * length * density, inertia=np.diag([1.0, 1.1, 0.5])))
        more = replace(robot, links=(*links[:3], replace(links[3], name="two2")))
        looks = (*robot.visuals, replace(robot.visuals[2], link="two2"))
        found.append(masses(replace(more, visuals=looks)).doubts)
    assert any("density of water" in doubt for doubt in found[0])
    assert not any("density of water" in doubt for doubt in found[1])


def test_payloads_are_not_counted(tmp_path: Path) -> None:
    robot = with_bodies(tmp_path, 7.2)
    loaded = robot.with_payload("two", 50.0, np.zeros(3), np.eye(3))
    assert masses(loaded, 7.2) == masses(robot, 7.2)

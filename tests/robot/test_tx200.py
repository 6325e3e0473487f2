"""The estimated Staubli TX200 in data/: made by its script, posed as in the paper, and dynamically near
it.
"""

from __future__ import annotations

import importlib.util
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from ruamel.yaml import YAML
from scipy.linalg import eigh

from identify.robot.description import Robot
from identify.robot.dh import read_dh
from identify.robot.engine import Engine
from identify.robot.points import check_links, read_points
from identify.robot.posture import at_posture

FOLDER = Path(__file__).parents[2] / "data" / "umons_tx200"
POSTURE = np.radians([-90, 28.47, 127.53, 0, -66.06, 0])  # Table 1
STIFFNESS = np.array([1.358e6, 2.175e6, 0.722e6, 1.559e6, 0.377e6, 1.560e6])  # Table 2
PEDESTAL = np.array([0, 0, 0.6])


@pytest.fixture(scope="module")
def script() -> ModuleType:
    spec = importlib.util.spec_from_file_location("make_robot", FOLDER / "make_robot.py")
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def robot() -> Robot:
    gripper = YAML(typ="safe").load(FOLDER / "gripper.yaml")
    return read_dh(FOLDER / "robot.yaml").with_payload(
        gripper["link"],
        gripper["mass_kg"],
        np.array(gripper["centre_m"]),
        np.diag(gripper["inertia_kg_m2"][:3]),
    )


def test_files_are_what_the_script_makes(script: ModuleType) -> None:
    assert (FOLDER / "robot.yaml").read_text(encoding="utf-8") == script.robot_yaml()
    assert (FOLDER / "gripper.yaml").read_text(encoding="utf-8") == script.gripper_yaml()


def test_solids_have_their_closed_forms(script: ModuleType) -> None:
    """A tube is the outer cylinder less the inner one; a box and a cylinder by integration on a grid."""
    tube, outer, inner = (
        script.cylinder(2, 0.5, size, 1000.0, (0, 0, 0), wall)
        for size, wall in ((0.3, 0.02), (0.3, None), (0.26, None))
    )
    assert tube[0] == pytest.approx(outer[0] - inner[0])
    assert tube[2] == pytest.approx(outer[2] - inner[2])
    size = np.array([0.2, 0.3, 0.4])
    grid = (
        np.stack(np.meshgrid(*[np.arange(40) + 0.5] * 3, indexing="ij"), axis=-1).reshape(-1, 3) / 40 - 0.5
    ) * size
    for solid, inside in (
        (script.box(tuple(size), 1000.0, (0, 0, 0)), np.full(len(grid), True)),
        (script.cylinder(2, 0.4, 0.2, 1000.0, (0, 0, 0)), np.hypot(grid[:, 0], grid[:, 1]) < 0.1),
    ):
        cells, cell = grid[inside], 1000.0 * np.prod(size) / len(grid)
        expected = cell * (np.sum(cells**2) * np.eye(3) - cells.T @ cells)
        assert solid[0] == pytest.approx(cell * len(cells), rel=0.02)
        assert solid[2] == pytest.approx(expected, rel=0.02, abs=1e-9)


def test_mass_and_reach_are_the_published_ones(robot: Robot) -> None:
    gripper = 5.0
    assert sum(link.mass for link in robot.links) - gripper == pytest.approx(1000, rel=0.05)
    stretched = Engine(at_posture(robot, np.radians([0, 90, 0, 0, 0, 0])))
    assert stretched.position("flange", np.zeros(3))[0] == pytest.approx(2.194)
    upright = Engine(at_posture(robot, np.zeros(6)))
    assert upright.position("flange", np.zeros(3)) == pytest.approx([0.25, 0, 0.642 + 0.95 + 0.8 + 0.194])


def test_posture_of_table_1_has_the_elbow_at_two_metres_and_a_level_tool(robot: Robot) -> None:
    engine = Engine(at_posture(robot, POSTURE))
    elbow, wrist, flange = (
        engine.position(name, np.zeros(3)) + PEDESTAL
        for name in ("proximal_forearm", "wrist_housing", "flange")
    )
    assert elbow[2] == pytest.approx(2.08, abs=0.01)
    assert flange[2] == pytest.approx(wrist[2], abs=1e-3)
    assert [elbow[0], wrist[0], flange[0]] == pytest.approx([0, 0, 0], abs=1e-12)
    assert 0 > elbow[1] > wrist[1] > flange[1]


def test_the_accelerometer_measures_along_the_axes_of_the_paper(robot: Robot) -> None:
    points = read_points(FOLDER / "points.csv")
    check_links(points, robot)
    engine, wrist = Engine(at_posture(robot, POSTURE)), points[1]
    in_ground_axes = wrist.axes @ engine.jacobian(wrist.link, wrist.position)[:3, :3]  # under base.tx, ty, tz
    assert in_ground_axes == pytest.approx(np.eye(3), abs=2e-3)
    assert engine.position(wrist.link, wrist.position)[2] > engine.position(wrist.link, np.zeros(3))[2] + 0.07


def test_modes_with_table_2_are_near_table_3_and_in_its_order(robot: Robot) -> None:
    engine = Engine(at_posture(robot, POSTURE))
    drives = [engine.mechanism.coordinate(f"joint{number}.rz", "test") for number in range(1, 7)]
    grid = np.ix_(drives, drives)
    square, shapes = eigh(np.diag(STIFFNESS) + engine.gravity_stiffness()[grid], engine.mass_matrix()[grid])
    frequency = np.sqrt(square) / (2 * np.pi)
    assert frequency[:5] == pytest.approx([12.05, 16.66, 27.39, 151.9, 238.1], rel=0.15)
    assert frequency[3] > 100
    assert [int(np.argmax(abs(shape))) + 1 for shape in shapes.T] == [1, 2, 3, 5, 4, 6]


@pytest.mark.parametrize(("name", "damping"), [("measured", [12.3, 4, 3.55]), ("rebalanced", [6.5, 7.2, 8])])
def test_mode_tables_are_those_of_the_paper(name: str, damping: list[float]) -> None:
    modes = YAML(typ="safe").load(FOLDER / f"modes_{name}.yaml")["modes"]
    assert [mode["frequency_hz"] for mode in modes] == [12.05, 16.66, 27.39]
    assert [mode["damping_percent"] for mode in modes] == damping

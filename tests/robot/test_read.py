"""What a config says of the robot, whichever file describes it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from identify.robot.read import read_robot
from identify.robot.settings import RobotSettings
from tests.robot.dh_arms import random_table, write_table
from tests.robot.random_arm import write
from tests.robot.test_urdf import ARM, BASE, HINGE, fixed, robot

DOWN_X = (9.81, 0.0, 0.0)


def test_gravity_is_told_in_the_axes_of_the_ground_in_config_and_files_alike(tmp_path: Path) -> None:
    """The base stands on its side: what pulls along the ground's x pulls along its z."""
    stand = fixed("world", "base", '<origin xyz="0 0 2" rpy="0 1.5707963267948966 0"/>')
    urdf = write(tmp_path, robot('<link name="world"/>', BASE, ARM, stand, HINGE))
    table = random_table(2, "modified")
    table["base_pose"], table["gravity_m_s2"] = {"rpy_deg": [0, 90, 0]}, [0, 0, -9.81]
    dh, folder = write_table(tmp_path, table), tmp_path / "told"
    folder.mkdir()
    told = write_table(folder, {**table, "gravity_m_s2": list(DOWN_X)})
    for settings in (
        RobotSettings(urdf=urdf, gravity_m_s2=DOWN_X),
        RobotSettings(dh=dh, gravity_m_s2=DOWN_X),
        RobotSettings(dh=told),
    ):
        assert read_robot(settings, tmp_path).gravity == pytest.approx([0, 0, 9.81])
    down = [read_robot(one, tmp_path).gravity for one in (RobotSettings(urdf=urdf), RobotSettings(dh=dh))]
    np.testing.assert_allclose(*down, atol=1e-12)


@pytest.mark.parametrize(
    ("mounted", "down"),
    [
        ((0.0, 0.0, 45.0), (0.0, 0.0, -9.81)),
        ((180.0, 0.0, 0.0), (0.0, 0.0, 9.81)),
        ((0.0, 90.0, 0.0), (9.81, 0.0, 0.0)),
        ((90.0, 0.0, 0.0), (0.0, -9.81, 0.0)),
    ],
)
def test_a_base_on_a_wall_or_a_ceiling(
    tmp_path: Path, mounted: tuple[float, float, float], down: tuple[float, float, float]
) -> None:
    """The base's z lies along the wall's normal: pitched by 90 degrees its x points down."""
    urdf = write(tmp_path, robot(BASE, ARM, HINGE))
    assert read_robot(RobotSettings(urdf=urdf, mounted_rpy_deg=mounted), tmp_path).gravity == pytest.approx(
        down, abs=1e-9
    )
    with pytest.raises(ValueError, match="either `gravity_m_s2` or `mounted_rpy_deg`"):
        RobotSettings(urdf=urdf, mounted_rpy_deg=mounted, gravity_m_s2=DOWN_X)


def test_a_payload_as_a_controller_tells_it_in_the_frame_of_the_flange(tmp_path: Path) -> None:
    flange = fixed("arm", "flange", '<origin xyz="0 0 1" rpy="0 1.5707963267948966 0"/>')
    urdf = write(tmp_path, robot(BASE, ARM, '<link name="flange"/>', HINGE, flange))
    load = {"mass_kg": 2.0, "centre_m": (0.0, 0.0, 0.5), "inertia_kg_m2": (0.1, 0.2, 0.3, 0, 0, 0)}
    told = RobotSettings.model_validate({"urdf": urdf, "payload": [{"link": "flange", **load}]})
    found = read_robot(told, tmp_path).payloads[0]
    assert found[0] == "arm"
    assert found[1].centre == pytest.approx([0.5, 0, 1])
    assert np.diag(found[1].inertia) == pytest.approx([0.3, 0.2, 0.1])


@pytest.mark.parametrize(
    "said", [{"mounted_rpy_deg": [180, 0, "nan"]}, {"payload": [{"link": "a", "mass_kg": float("inf")}]}]
)
def test_numbers_of_a_robot_are_finite(said: dict[str, Any]) -> None:
    with pytest.raises(ValidationError, match="finite number"):
        RobotSettings.model_validate({"urdf": "a.urdf", **said})

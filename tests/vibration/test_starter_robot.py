"""`identify init` of whatever describes a robot: bodies out of meshes, what is stated of them, and masses."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest
import yaml  # type: ignore[import-untyped]

from identify.core.errors import InputError
from identify.robot.chain import Choice
from identify.robot.mesh_body import Wanted
from identify.robot.urdf import read_urdf
from identify.vibration.fitted_model import _described
from identify.vibration.nuisances.meshes import CENTRE, LIGHT, made_of_mesh
from identify.vibration.nuisances.nuisance import list_nuisances
from identify.vibration.nuisances.settings import UncertaintySettings
from identify.vibration.provenance import description_of
from identify.vibration.starter import write_starter
from identify.vibration.starter_robot import RobotOptions, new_robot
from identify.vibration.study import read_study
from tests.robot.test_mesh_body import arm, inertial

ROOT = Path(__file__).parents[2]


def test_a_robot_of_meshes_gets_bodies_and_says_how_sure_they_are(tmp_path: Path) -> None:
    (tmp_path / "source").mkdir()
    arm(tmp_path / "source")
    told = RobotOptions(wanted=Wanted(7.2))
    done = write_starter(tmp_path / "source/arm.urdf", [], tmp_path / "config.yaml", None, None, told)
    config = yaml.safe_load((tmp_path / "config.yaml").read_text())
    assert config["uncertainty"] == "meshes"
    assert config["robot"] == {"urdf": "arm_bodies.urdf", "mass_kg": 7.2}
    robot = read_urdf(tmp_path / "arm_bodies.urdf")
    assert sum(link.mass for link in robot.links) == pytest.approx(7.2)
    assert any("bodies of base, one and two made of their meshes" in said for said in done.to_do)
    with pytest.raises(InputError, match="the file exists"):
        write_starter(tmp_path / "source/arm.urdf", [], tmp_path / "other.yaml", None, None, told)


def test_without_a_mass_it_is_asked_for(tmp_path: Path) -> None:
    arm(tmp_path)
    with pytest.raises(InputError, match=r"no mass or inertia of one and two; .* `--mass-kg`"):
        new_robot(tmp_path / "arm.urdf", tmp_path, RobotOptions())


def test_what_the_file_knows_is_as_sure_as_usual(tmp_path: Path) -> None:
    arm(tmp_path, {"one": inertial(2.0, 0.01), "two": inertial(3.0, 0.0)})
    new = new_robot(tmp_path / "arm.urdf", tmp_path, RobotOptions())
    stated = UncertaintySettings.model_validate(yaml.safe_load(new.uncertainty.replace(":", ": ")))
    made = made_of_mesh(new.robot, new.robot.link("two"))
    assert stated.of_link("two", "inertia", made) == pytest.approx(made["inertia"], rel=0.05)
    assert (stated.of_link("two", "mass", made), stated.of_link("one", "inertia", made)) == (0.05, 0.15)


def test_a_plain_robot_is_read_where_it_is(tmp_path: Path) -> None:
    arm(tmp_path, {"one": inertial(2.0, 0.01), "two": inertial(3.0, 0.02)})
    new = new_robot(tmp_path / "arm.urdf", tmp_path, RobotOptions(Choice("two", {}), wanted=Wanted(20.0)))
    assert (new.file, new.uncertainty) == (tmp_path / "arm.urdf", "")
    assert new.keys == ', tip: "two", mass_kg: 20.0'
    assert any("the data sheet says 20 kg" in said for said in new.said)


def test_light_links_are_less_sure(tmp_path: Path) -> None:
    arm(tmp_path, {"one": inertial(100.0, 1.0), "two": inertial(100 * LIGHT / 2, 0.01)})
    robot = read_urdf(tmp_path / "arm.urdf")
    listed = list_nuisances(UncertaintySettings(like="meshes"), robot, {}, [])
    found = {(one.place, one.change): one.std for one in listed.entries if one.group == "link"}
    assert (found["one", "mass"], found["two", "mass"]) == (0.29, 0.6)
    assert (found["one", "inertia_1"], found["two", "product_12"]) == (0.4, 0.4)
    assert found["one", "centre_x"] == pytest.approx(CENTRE * (3.0 / 2 / 100) ** 0.5)


def test_what_is_said_goes_before_the_level(tmp_path: Path) -> None:
    arm(tmp_path, {"one": inertial(100.0, 1.0), "two": inertial(50, 0.01)})
    robot = read_urdf(tmp_path / "arm.urdf")
    said = {"like": "meshes", "links": {"inertia": 0.1, "each": {"two": {"mass": 0.02}}}}
    listed = list_nuisances(UncertaintySettings.model_validate(said), robot, {}, [])
    found = {(one.place, one.change): one.std for one in listed.entries}
    assert (found["one", "mass"], found["two", "mass"], found["two", "inertia_2"]) == (0.29, 0.02, 0.1)


def test_a_study_may_name_a_xacro_and_its_result_holds_what_it_stood_for(tmp_path: Path) -> None:
    """Of which it is read again without the xacro, its packages or its arguments."""
    data = ROOT / "data" / "arm_hammer_test"
    text = (data / "robot.urdf").read_text()
    robot = text.replace("<robot ", '<robot xmlns:xacro="http://ros.org/wiki/xacro" ', 1)
    heavy = re.sub(r'<mass value="[^"]*"', '<mass value="$(arg kg)"', robot, count=1)
    (tmp_path / "robot.xacro").write_text(heavy)
    config = (ROOT / "configs/arm_hammer_test.yaml").read_text().replace("../data", str(ROOT / "data"))
    config = re.sub(r"urdf: [^}\n]*robot\.urdf", "urdf: robot.xacro, arguments: {kg: '321'}", config)
    (tmp_path / "config.yaml").write_text(config)
    file = read_study(tmp_path / "config.yaml")
    description = description_of(file, {})
    assert "$(arg" not in description.robot
    again, _ = _described(file.study, description)
    assert again.links[0].mass == 321


@pytest.mark.parametrize("wanted", [Wanted(motors={"1": 3.0}), Wanted(20.0, base_kg=4.0)])
def test_what_is_told_of_bodies_that_are_not_made_is_refused(tmp_path: Path, wanted: Wanted) -> None:
    arm(tmp_path, {"one": inertial(2.0, 0.01), "two": inertial(3.0, 0.02)})
    with pytest.raises(InputError, match="no body is made of a mesh"):
        new_robot(tmp_path / "arm.urdf", tmp_path, RobotOptions(wanted=wanted))


def test_a_posture_has_an_angle_for_each_joint(tmp_path: Path) -> None:
    arm(tmp_path, {"one": inertial(2.0, 0.01), "two": inertial(3.0, 0.02)})
    with pytest.raises(InputError, match="--posture: 3 angles; expected 2, one per joint"):
        write_starter(tmp_path / "arm.urdf", [], tmp_path / "c.yaml", None, posture=(1.0, 2.0, 3.0))
    assert not (tmp_path / "c.yaml").exists()


def test_the_command_for_points_can_be_typed_as_it_is_said(tmp_path: Path) -> None:
    folder = tmp_path / "test stand"
    folder.mkdir()
    arm(folder, {"one": inertial(2.0, 0.01), "two": inertial(3.0, 0.02)})
    frfs = ROOT / "data/arm_hammer_test/posture1.uff"
    told = RobotOptions(Choice("two", {"rail": 1.2}), {}, Wanted())
    assert told.words() == ["--tip", "two", "--lock", "rail=1.2"]
    done = write_starter(
        folder / "arm.urdf", [frfs], tmp_path / "c.yaml", None, None, RobotOptions(Choice("two", {}))
    )
    said = next(one for one in done.to_do if "identify points" in one)
    command = shlex.split(said.split("`")[1])
    assert command[2] == str(folder / "arm.urdf")
    assert command[-4:] == ["--tip", "two", "--out", str(folder / "points.csv")]

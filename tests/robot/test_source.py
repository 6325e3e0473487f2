"""URDF out of xacro and MJCF: what it stands for, and what cannot be."""

from __future__ import annotations

from codecs import BOM_UTF8, BOM_UTF16_BE, BOM_UTF16_LE
from pathlib import Path

import mujoco
import numpy as np
import pytest

from identify.core.errors import InputError
from identify.robot.chain import Choice
from identify.robot.engine import Engine
from identify.robot.posture import AXES, at_posture
from identify.robot.source import read_source
from identify.robot.urdf import read_urdf
from identify.robot.visual import mesh_place

MACRO = """
<robot xmlns:xacro="http://ros.org/wiki/xacro">
<xacro:property name="half" value="${0.5 * 2 / 2}"/>
<xacro:macro name="part" params="name kg">
  <link name="${name}"><inertial><mass value="${kg}"/>
  <inertia ixx="${half * kg}" iyy="${half * kg}" izz="${half * kg}"
  ixy="0" ixz="0" iyz="0"/></inertial></link>
</xacro:macro>
</robot>
"""
ARM = """
<robot name="arm" xmlns:xacro="http://ros.org/wiki/xacro">
<xacro:include filename="$(find parts_support)/urdf/part_macro.xacro"/>
{argument}
<xacro:part name="base" kg="1"/><xacro:part name="arm" kg="$(arg kg)"/>
<joint name="hinge" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 0 1"/></joint>
</robot>
"""


def package(folder: Path, default: str = "", name: str = "parts_support") -> Path:
    """Two packages beside each other, as in the repositories of ROS."""
    for each, text in ((f"{name}/urdf/part_macro.xacro", MACRO), ("arm_support/urdf/arm.xacro", ARM)):
        path = folder / "repository" / each
        path.parent.mkdir(parents=True)
        argument = f'<xacro:arg name="kg" {default}/>' if default else ""
        path.write_text(text.replace("{argument}", argument))
    return path


def test_a_xacro_is_expanded(tmp_path: Path) -> None:
    arm = read_urdf(package(tmp_path, 'default="3"'))
    assert (arm.name, arm.links[1].mass, arm.links[1].inertia[0, 0]) == ("arm", 3, 1.5)


def test_arguments_of_a_xacro_are_given_or_asked_for(tmp_path: Path) -> None:
    path = package(tmp_path)
    assert read_urdf(path, arguments={"kg": "4"}).links[1].mass == 4
    with pytest.raises(InputError, match=r"arm.xacro: it needs the argument 'kg'"):
        read_urdf(path)
    with pytest.raises(InputError, match=r"arm.xacro: it does not take the argument 'mass'"):
        read_urdf(path, arguments={"kg": "4", "mass": "4"})


def test_a_package_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="it needs the package 'parts_support', which is neither beside it"):
        read_urdf(package(tmp_path, 'default="3"', name="other"))


def test_a_renamed_folder_is_known_by_its_manifest(tmp_path: Path) -> None:
    path = package(tmp_path, 'default="3"')
    held = path.parents[1] / "part_macro.xacro"
    (tmp_path / "repository/parts_support/urdf/part_macro.xacro").rename(held)
    (tmp_path / "repository/parts_support/urdf").rmdir()
    (tmp_path / "repository/parts_support").rmdir()
    (held.parent / "package.xml").write_text("<package><name>parts_support</name></package>")
    held.rename(held.parent / "urdf" / held.name)
    assert read_urdf(path).links[1].mass == 3


def test_an_error_on_the_way_is_one_sentence(tmp_path: Path) -> None:
    path = package(tmp_path, 'default="3"')
    for old, new in (
        ("$(arg kg)", "${1 / 0}"),
        ("part_macro.xacro", "lost.xacro"),
        ("xacro:part", "xacro:whole"),
    ):
        (tmp_path / "bad.xacro").write_text(path.read_text().replace(old, new))
        with pytest.raises(InputError) as caught:
            read_urdf(tmp_path / "bad.xacro")
        assert caught.value.where == "bad.xacro"


def test_arguments_of_a_mujoco_model_are_refused(tmp_path: Path) -> None:
    (tmp_path / "arm.xml").write_text("<mujoco><worldbody/></mujoco>")
    with pytest.raises(InputError, match=r"arguments \(a\) of a file without macros"):
        read_source(tmp_path / "arm.xml", {"a": "b"})


def test_arguments_of_a_plain_file_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "arm.urdf"
    path.write_text('<robot name="a"><link name="a"/></robot>')
    with pytest.raises(InputError, match=r"arguments \(kg\) of a file without macros"):
        read_source(path, {"kg": "1"})


MODEL = """
<mujoco model="arm"><compiler angle="degree"/>
<worldbody>
  <body name="base"><geom type="box" size=".1 .1 .1"/>
    <body name="upper" pos="0 0 .3" euler="10 20 30">
      <joint name="one" axis="0 1 0" range="-90 90" limited="true"/>
      <inertial pos=".01 .02 .2" mass="5" fullinertia=".2 .21 .1 .01 .02 .03"/>
      <body name="lower" pos="0 .1 .5"><joint name="two" axis="1 1 0" pos="0 0 .05"/>
        <geom type="capsule" size=".05 .2" pos="0 0 .2"/>
        <body name="finger" pos="0 0 .5"><joint name="grip" type="slide" axis="1 0 0"/>
          <geom type="sphere" size=".03"/></body>
      </body></body></body>
</worldbody>
<equality><connect body1="finger" body2="base" anchor="0 0 0"/></equality>
</mujoco>
"""


def test_a_mujoco_model_has_the_same_mass_matrix(tmp_path: Path) -> None:
    """Against MuJoCo's own, of the model in which the finger stands still."""
    path = tmp_path / "arm.xml"
    path.write_text(MODEL)
    arm = read_urdf(path)
    assert [joint.name for joint in arm.joints] == ["one", "two"]
    assert arm.joints[0].upper == pytest.approx(np.pi / 2)
    assert any("loops were cut" in note for note in arm.notes)
    posture = np.array([0.4, -0.7])
    model = mujoco.MjModel.from_xml_string(
        MODEL.replace('<joint name="grip" type="slide" axis="1 0 0"/>', "")
    )
    data = mujoco.MjData(model)
    data.qpos[:] = posture
    mujoco.mj_forward(model, data)
    expected = np.zeros((2, 2))
    mujoco.mj_fullM(model, data, expected)
    engine = Engine(at_posture(arm, posture))
    drives = [6 + AXES.index("rz"), 12 + AXES.index("rz")]
    assert engine.mass_matrix()[np.ix_(drives, drives)] == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize(
    ("name", "mark", "encoding"),
    [
        ("utf-8", BOM_UTF8, "utf-8"),
        ("iso-8859-1", b"", "iso-8859-1"),
        ("utf-16", BOM_UTF16_LE, "utf-16-le"),
        ("utf-16", BOM_UTF16_BE, "utf-16-be"),
        ("", BOM_UTF16_LE, "utf-16-le"),
        ("", b"", "utf-8"),
    ],
)
def test_the_text_of_a_description_is_that_of_its_encoding(
    tmp_path: Path, name: str, mark: bytes, encoding: str
) -> None:
    declaration = f'<?xml version="1.0" encoding="{name}"?>' if name else ""
    path = tmp_path / "arm.urdf"
    path.write_bytes(mark + f'{declaration}<robot name="Süd"/>'.encode(encoding))
    text = read_source(path).text()
    assert text.endswith('<robot name="Süd"/>') and text.count("UTF-8") == bool(name)


def test_a_model_that_mujoco_refuses_is_refused_in_its_words(tmp_path: Path) -> None:
    path = tmp_path / "arm.xml"
    path.write_text("<mujoco><worldbody><bodi/></worldbody></mujoco>")
    with pytest.raises(InputError, match=r"arm\.xml: MuJoCo says: .*bodi"):
        read_urdf(path)


def test_a_model_without_its_meshes_is_read_where_bodies_are_written(tmp_path: Path) -> None:
    path = tmp_path / "arm.xml"
    mesh = '<asset><mesh name="m" file="lost.stl"/></asset><worldbody>'
    geom = '<geom type="mesh" mesh="m"/><inertial pos=".01'
    text = MODEL.replace("<worldbody>", mesh).replace('<inertial pos=".01', geom)
    path.write_text(text)
    arm = read_urdf(path, choice=Choice("lower"))
    assert arm.links[1].mass == 5
    assert "read without its meshes" in arm.notes[0]


def test_a_mesh_of_a_package_beside_another_is_found(tmp_path: Path) -> None:
    mesh = tmp_path / "repository/arm_support/meshes/a.stl"
    mesh.parent.mkdir(parents=True)
    mesh.write_text("")
    (tmp_path / "repository/other/urdf").mkdir(parents=True)
    place = mesh_place(tmp_path / "repository/other/urdf", "package://arm_support/meshes/a.stl")
    assert place == mesh

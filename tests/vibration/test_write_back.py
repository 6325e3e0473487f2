"""What a fit found of the robot and points, written back: the same data then give the same model."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
import yaml  # type: ignore[import-untyped]
from typer.testing import CliRunner

from identify.cli import app
from identify.core.errors import InputErrors
from identify.results.fit import FitResult
from identify.robot.description import inertia_fault
from identify.robot.points import points_text, read_points
from identify.robot.pseudo_inertia import pseudo_inertia
from identify.robot.read import read_robot
from identify.robot.rewrite import with_bodies
from identify.robot.settings import RobotSettings
from identify.robot.urdf import read_urdf
from identify.vibration import write_back
from identify.vibration.problem import load_problem
from identify.vibration.run import run_fit
from identify.vibration.study import read_study
from identify.vibration.write_back import CORRECTIONS, LEFT, Corrections
from tests.generator.dirt import CAREFUL, soil
from tests.generator.generate import generate
from tests.generator.makes import MAKES
from tests.generator.spec import TestSpec
from tests.hidden import config_of

pytestmark = pytest.mark.usefixtures("no_measured_modes")

_STATED = """uncertainty:   # of a careful laboratory
  like: careful
  kinematics: {position_m: 0.0005}
starts: 1
"""
_WRITTEN = ("masses", "centres of mass", "inertias", "places of points", "directions of sensors")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("write_back")


@pytest.fixture(scope="module")
def true(folder: Path) -> TestSpec:
    arm = MAKES["random"](3)
    spec = TestSpec(arm=arm.at_points([4, 6, 8, 10, 12, 14]), seed=3, postures=2, binary=True, linear=True)
    dirty = soil(spec, CAREFUL)
    generate(dirty, folder / "case")
    return dirty


@pytest.fixture(scope="module")
def fits(folder: Path, true: TestSpec) -> tuple[FitResult, FitResult]:
    """Of the study, and of the one that it wrote."""
    config = config_of(folder / "case", folder, extra=_STATED)
    first, written = run_fit(config, folder / "first.h5", {}, write_back=folder / "new")
    names = {path.name for path in written[1:]}
    assert names == {"case.yaml", "robot.urdf", "points.csv", CORRECTIONS, LEFT}
    again, _ = run_fit(folder / "new" / "case.yaml", folder / "again.h5", {})
    return first, again


def _by_kind(result: FitResult) -> dict[str, np.ndarray]:
    """Fitted errors in units of what was stated."""
    stated = result.uncertainty
    assert stated is not None
    kinds = np.array(stated.kind)
    return {kind: stated.shift[kinds == kind] for kind in stated.kinds}


def test_the_study_that_was_written_has_the_same_model_and_errors_near_zero(
    fits: tuple[FitResult, FitResult],
) -> None:
    first, again = fits
    assert again.name == "case_corrected"
    stiff = [n for n, name in enumerate(first.parameters.name) if name.endswith("stiffness")]
    std = first.parameters.std[stiff]
    off = np.log(again.parameters.value[stiff] / first.parameters.value[stiff])
    assert np.abs(off / std).max() < 0.5
    assert again.parameters.std[stiff] == pytest.approx(std, rel=0.1)
    assert again.gap <= first.gap
    before, after = _by_kind(first), _by_kind(again)
    for kind in _WRITTEN:
        size, left = (float(np.sqrt(np.mean(one[kind] ** 2))) for one in (before, after))
        assert left < 0.5 * size, kind


def test_corrections_hold_what_was_really_wrong(
    folder: Path, true: TestSpec, fits: tuple[FitResult, FitResult]
) -> None:
    assert fits
    with (folder / "new" / CORRECTIONS).open() as file:
        rows = {(row["where"], row["what"]): row for row in csv.DictReader(file)}
    assert true.told is not None
    links = {(link.name, "mass"): link.inertia.mass for link in true.arm.links}
    points = {
        (str(point.node), axis): point.xyz[n] for point in true.arm.points for n, axis in enumerate("xyz")
    }
    told = {(link.name, "mass"): link.inertia.mass for link in true.told.links}
    told |= {(str(p.node), axis): p.xyz[n] for p in true.told.points for n, axis in enumerate("xyz")}
    inside, narrowed = [], 0
    for place, value in {**links, **points}.items():
        row = rows[place]
        off = value / told[place] - 1 if place in links else value - told[place]
        inside.append(float(row["low_95"]) <= off <= float(row["high_95"]))
        narrowed += float(row["std_left"]) < 0.5 * float(row["stated_std"])
        assert row["written_to"] == ("robot.urdf" if place in links else "points.csv")
    assert np.mean(inside) > 0.9
    assert narrowed >= 8
    assert rows["12:+X", "gain"]["written_to"] == ""


def test_what_is_left_uncertain_is_a_statement_for_other_tests(
    folder: Path, fits: tuple[FitResult, FitResult]
) -> None:
    stated = fits[0].uncertainty
    assert stated is not None
    text = (folder / "new" / "case.yaml").read_text()
    kept = text[: text.index("uncertainty:")] + (folder / "new" / LEFT).read_text()
    path = folder / "new" / "other.yaml"
    path.write_text(kept)
    entries = {(one.place, one.change): one.std for one in load_problem(read_study(path)).nuisances.entries}
    for n, place in enumerate(stated.place):
        if stated.kind[n] in ("masses", "sensitivities"):
            left = stated.stated[n] * stated.spread[n]
            assert entries[place, stated.change[n]] == pytest.approx(left, rel=1e-3)
    turned = [n for n, place in enumerate(stated.place) if place == "12" and stated.change[n][0] == "r"]
    rms = np.sqrt(np.mean((stated.stated[turned] * stated.spread[turned]) ** 2))
    assert entries["12", "rx"] == pytest.approx(rms, rel=1e-3)


@pytest.mark.parametrize(
    ("stated", "to", "said"),
    [
        ("", "new", "nothing is stated uncertain"),
        ("uncertainty: careful", ".", "an input, which would be overwritten"),
        ("uncertainty: {points: {each: {99: {position_m: 0.001}}}}", "new", "unknown point 99"),
        ("uncertainty: {channels: {each: {'12:-Z': {gain: 0.01}}}}", "new", "expected '12:+Z'"),
    ],
)
def test_what_cannot_be_written_is_refused_before_the_fit(
    folder: Path, true: TestSpec, tmp_path: Path, stated: str, to: str, said: str
) -> None:
    assert true
    config = config_of(folder / "case", tmp_path, extra=stated)
    out = str(tmp_path / "fit.h5")
    done = CliRunner().invoke(app, ["fit", str(config), "--out", out, "--write-back", str(tmp_path / to)])
    assert done.exit_code != 0
    assert said in str(done.exception)
    assert not (tmp_path / "fit.h5").exists()


def _found(folder: Path, fit: FitResult, more: str = "", shift: float | None = None) -> Corrections:
    """Of the robot with more settings; shift: of the largest moment of link 2, over what was stated."""
    stated, path = fit.uncertainty, folder / "found.yaml"
    assert stated is not None
    path.write_text((folder / "case.yaml").read_text().replace("robot.urdf'}", f"robot.urdf'{more}}}"))
    if shift is not None:
        shifts = stated.shift.copy()
        shifts[list(zip(stated.place, stated.change, strict=True)).index(("link2", "inertia_3"))] = shift
        stated = replace(stated, shift=shifts)
    return Corrections.of(read_study(path), replace(fit, uncertainty=stated))


def test_a_payload_stays_in_the_study_and_out_of_the_robot(
    folder: Path, fits: tuple[FitResult, FitResult]
) -> None:
    payload = ", payload: [{link: link6, mass_kg: 2.5, centre_m: [0.0, 0.1, 0.2]}]"
    found = _found(folder, fits[0], payload)
    assert found.nominal.link("link6").mass > 2.5
    text = folder / "unloaded.urdf"
    text.write_text(found.robot_text(folder))
    settings = found.file.study.robot.model_copy(update={"urdf": text})
    for link in read_robot(settings, folder).links:
        expected = pseudo_inertia(found.robot.link(link.name))
        np.testing.assert_allclose(pseudo_inertia(link), expected, atol=1e-6 * np.trace(expected))
    heavier = payload.replace("2.5", "1.0e-3").replace("0.2]", "0.2], inertia_kg_m2: [9, 9, 9, 0, 0, 0]")
    kept = _found(folder, fits[0], heavier)
    with pytest.raises(InputErrors, match="payload on link6"):
        assert kept.bodies


def test_a_body_that_cannot_be_is_replaced_by_the_nearest_that_can(
    folder: Path, fits: tuple[FitResult, FitResult]
) -> None:
    found = _found(folder, fits[0], shift=40.0)
    assert inertia_fault(found.robot.link("link2")) is not None
    body, changed = found.bodies["link2"]
    assert changed
    principal = np.linalg.eigvalsh(body.inertia)
    assert principal[2] < principal[0] + principal[1]
    assert [name for name, (_, changed) in found.bodies.items() if changed] == ["link2"]


_URDF = """<?xml version="1.0" encoding="ISO-8859-1"?>
<!-- Pr\xfcfling > 3 -->
<robot name="arm">
  <link name="base"/>
  <link name="one">   <!-- heavy -->
    <visual><geometry><mesh filename="meshes/one.stl" scale="1 1 1"/></geometry></visual>
    <inertial>
      <origin xyz="0.1 0 0" rpy="0.3 0 0"/>
      <mass value="3"/>
      <inertia ixx="0.02" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.02"/>
    </inertial>
  </link>
  <link name="plate"><inertial><mass value="1"/>
    <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial></link>
  <link name="two"><inertial><mass value="2"/>
    <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial></link>
  <joint name="j1" type="revolute"><parent link="base"/><child link="one"/><axis xyz="0 0 1"/>
    <limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
  <joint name="glue" type="fixed"><parent link="one"/><child link="plate"/>
    <origin xyz="0.2 0 0" rpy="0 0 1.5707963267948966"/></joint>
  <joint name="j2" type="revolute"><parent link="plate"/><child link="two"/><axis xyz="0 1 0"/>
    <origin rpy="0.1 0.2 0.3" xyz="0 0.1 0"/>
    <limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
</robot>
"""


def test_a_robot_is_written_with_other_bodies_and_places_of_joints_and_all_else_as_it_was(
    tmp_path: Path,
) -> None:
    (tmp_path / "robot.urdf").write_bytes(_URDF.encode("latin-1"))
    settings = RobotSettings(urdf=Path("robot.urdf"))
    robot = read_robot(settings, tmp_path)
    body = replace(robot.links[1], mass=5.0, centre=np.array([0.11, 0.01, 0.0]))
    new = tmp_path / "new" / "robot.urdf"
    new.parent.mkdir()
    shifts = {"j1": np.array([0.0, 0.0, 0.003]), "j2": np.array([0.001, 0.002, 0.003])}
    new.write_text(with_bodies(settings, tmp_path, robot, [body], shifts, new.parent), encoding="utf-8")
    again = read_urdf(new)
    assert again.links[1].mass == pytest.approx(5.0)
    np.testing.assert_allclose(again.links[1].centre, body.centre)
    np.testing.assert_allclose(again.links[1].inertia, body.inertia, atol=1e-15)
    np.testing.assert_array_equal(again.links[2].inertia, robot.links[2].inertia)
    for one, other in zip(again.joints, robot.joints, strict=True):
        np.testing.assert_allclose(one.origin[:3, 3], other.origin[:3, 3] + shifts[one.name], atol=1e-9)
        np.testing.assert_array_equal(one.origin[:3, :3], other.origin[:3, :3])
    text = new.read_text(encoding="utf-8")
    assert 'encoding="UTF-8"' in text
    assert '"../meshes/one.stl"' in text
    kept = [line for line in _URDF.splitlines() if "origin" not in line and "mesh" not in line]
    for line in (*kept[1:5], *kept[-2:]):
        assert line in text


def test_points_keep_what_is_not_corrected(tmp_path: Path) -> None:
    path = tmp_path / "points.csv"
    path.write_text('link,node,x_m,y_m,z_m,name\n# by hand\none,7,0.1000,0,0,"a, b"\ntwo,9,0,0.5,0,c\n')
    told = read_points(path)
    moved = {7: replace(told[7], position=np.array([0.1, 0.002, 0.0]))}
    path.with_name("same.csv").write_text(points_text(path, {}))
    assert path.with_name("same.csv").read_text() == path.read_text()
    path.with_name("moved.csv").write_text(points_text(path, moved))
    assert path.with_name("moved.csv").read_text().splitlines()[1:] == [
        "# by hand",
        'one,7,0.1,0.002,0,"a, b"',
        "two,9,0,0.5,0,c",
    ]
    axes = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]])
    path.with_name("turned.csv").write_text(points_text(path, {9: replace(told[9], axes=axes)}))
    again = read_points(path.with_name("turned.csv"))
    np.testing.assert_allclose(again[9].axes, axes, atol=1e-9)
    np.testing.assert_array_equal(again[7].axes, np.eye(3))
    np.testing.assert_array_equal(again[7].position, told[7].position)


def test_a_xacro_is_written_back_without_its_arguments(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What is written is the URDF that they made; which part of it is the arm, and how it stands, is kept."""
    path = tmp_path / "study.yaml"
    path.write_text("""schema: identify/1
name: rail
robot:
  {urdf: rail.xacro, arguments: {kg: "3"}, tip: arm, lock: {lift: 1.2},
   mounted_rpy_deg: [180, 0, 0], mass_kg: 9}
measurements: [{file: a.uff, posture_deg: [30], averages: 4}]
effects: [{kind: joint-compliance, axes: [rz]}]
uncertainty: careful
""")
    found = SimpleNamespace(bodies={}, posture=lambda angles: angles)
    monkeypatch.setattr(write_back, "_inside", lambda result: {})
    back = write_back.WriteBack(read_study(path), tmp_path / "new")
    said = yaml.safe_load(back._study_text(cast(Any, found), cast(Any, None)))["robot"]
    kept = {"tip": "arm", "lock": {"lift": 1.2}, "mounted_rpy_deg": [180, 0, 0], "mass_kg": 9}
    assert said == {"urdf": "rail.urdf", **kept}
    assert back.robot == tmp_path / "new" / "rail.urdf"

"""Universal files, URDF and the script for Simulink: read back by identify, pyuff and the URDF reader."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
import pyuff
from scipy.io import loadmat

from identify.export.run import Wanted, run_export
from identify.measured.channel import Channel
from identify.measured.loaders import FrfFileOptions, load_frf_set
from identify.measured.uff.geometry import read_geometry
from identify.measured.uff.shapes import read_shapes
from identify.modes.run import run_modes
from identify.results.discovery import fit_of
from identify.robot.engine import Engine
from identify.robot.posture import at_posture
from identify.robot.urdf import read_urdf
from tests.export.conftest import Result
from tests.export.model import model_of

DECAY = 1.226


@pytest.fixture(scope="module")
def universal(result: Result, tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Shapes, fitted and measured FRFs at the first posture."""
    folder = tmp_path_factory.mktemp("uff")
    return run_export(result("plain"), Wanted("uff"), folder / "arm.uff").written


def test_frfs_come_back_as_they_were_fitted_and_measured(result: Result, universal: list[Path]) -> None:
    kept = fit_of(result("plain")).measurements["posture1"].frf
    assert kept is not None
    for path, values in zip(universal[1:], (kept.fitted, kept.measured), strict=True):
        read = load_frf_set(path, FrfFileOptions(window_decay_per_s=DECAY))
        assert read.quantity == "accelerance"
        for pair, (output, force) in enumerate(zip(kept.output, kept.input, strict=True)):
            at = read.outputs.index(Channel.parse(output)), read.inputs.index(Channel.parse(force))
            np.testing.assert_array_equal(read.frf[:, at[0], at[1]], values[:, pair])
    assert {one["type"] for one in pyuff.UFF(str(universal[1])).read_sets()} == {58}


@pytest.mark.parametrize("posture", ["posture1", "0,30,-60,0,45,0"])
def test_the_modes_of_the_fitted_frfs_have_the_modal_masses_of_the_shapes(
    result: Result, tmp_path: Path, posture: str
) -> None:
    """By `identify modes`, whose shapes have modal masses of 1 kg, as those of the file: to five digits where
    no records ended before the robot stood still; their end is no mode's, and moves what is found.
    """
    run_export(result("plain"), Wanted("uff", [posture], band_hz=(3.0, 80.0)), tmp_path / "arm.uff")
    measured = posture == "posture1"
    forces = ["14:+X", "14:+Y", "14:+Z"]
    options = FrfFileOptions(window_decay_per_s=DECAY if measured else None, inputs=forces)
    found, _ = run_modes(tmp_path / "arm_fitted.uff", tmp_path / "m.h5", options)
    [modes] = found.measurements.values()
    shapes = read_shapes(tmp_path / "arm.uff")
    assert shapes.shapes is not None and len(modes.modes.frequency_hz) >= 5
    for row, frequency in enumerate(modes.modes.frequency_hz):
        mode = int(np.argmin(np.abs(shapes.frequency_hz - frequency)))
        assert shapes.frequency_hz[mode] == pytest.approx(frequency, rel=1e-3 if measured else 1e-4)
        assert shapes.damping_ratio[mode] == pytest.approx(
            modes.modes.damping_ratio[row], rel=0.05 if measured else 1e-3
        )
        columns = [modes.modes.channels.index(str(channel)) for channel in shapes.channels]
        own, other = modes.modes.shapes[row][columns], shapes.shapes[mode]
        own = own * np.sign((own * other.conj()).sum().real)
        size = np.abs(other).max()
        np.testing.assert_allclose(own, other, rtol=0, atol=(0.03 if measured else 1e-5) * size)


def test_pyuff_reads_shapes_with_modal_a_and_the_geometry(result: Result, universal: list[Path]) -> None:
    sets = pyuff.UFF(str(universal[0])).read_sets()
    kinds = [one["type"] for one in sets]
    model = model_of(result("plain"))
    modes = [one for one in sets if one["type"] == 55]
    assert {164, 2411, 2412} <= set(kinds) and len(modes) == len(model.modes.eigenvalues)
    for one, pole in zip(modes, model.modes.eigenvalues, strict=True):
        assert one["eig"] == pytest.approx(pole, rel=1e-5)
        assert one["modal_a"] == pytest.approx(2j * pole.imag, rel=1e-5), "of a modal mass of 1 kg"
    nodes = next(one for one in sets if one["type"] == 2411)
    geometry = read_geometry(universal[0])
    np.testing.assert_allclose(nodes["x"], geometry.position_m[:, 0], atol=1e-12)
    assert tuple(nodes["node_nums"].astype(int)) == geometry.nodes
    rods = next(one for one in sets if one["type"] == 2412)[11]
    assert [tuple(one["nodes_nums"]) for one in rods] == list(geometry.lines)


def test_the_geometry_is_that_of_the_robot_at_the_posture(result: Result, universal: list[Path]) -> None:
    """With the directions of the channels: 2420 systems that nodes of 2411 refer to; lines are rods."""
    model, read = model_of(result("plain")), read_geometry(universal[0])
    engine = model.system.site.engine
    for point in model.points:
        n = read.nodes.index(point.node)
        np.testing.assert_allclose(
            read.position_m[n], engine.position(point.link, point.position), atol=1e-12
        )
        np.testing.assert_allclose(read.axes[n], point.axes @ engine.axes(point.link).T, atol=1e-12)
    assert len(read.lines) == len(model.points) - 1


def test_at_a_posture_without_data_frfs_are_the_models(result: Result, tmp_path: Path) -> None:
    posture = "0,30,-60,0,45,0"
    done = run_export(result("plain"), Wanted("uff", [posture], band_hz=(5.0, 45.0)), tmp_path / "arm.uff")
    assert len(done.written) == 2 and any("nothing was measured at this posture" in n for n in done.notes)
    read = load_frf_set(done.written[1])
    right = model_of(result("plain"), posture).receptance(read.frequency_hz)
    assert read.quantity == "receptance"
    np.testing.assert_allclose(read.frf, right, rtol=1e-12)


def test_the_urdf_has_a_joint_for_each_spring_and_the_same_inertia(result: Result, tmp_path: Path) -> None:
    """Its mass matrix about the elastic joints is that of the model, but for the links without weight."""
    done = run_export(result("shrink"), Wanted("urdf"), tmp_path / "arm.urdf")
    model = model_of(result("shrink"))
    robot = read_urdf(tmp_path / "arm.urdf")
    names = [joint.name for joint in robot.joints]
    assert set(model.coordinates) <= set(names) and any("<gazebo>" in note for note in done.notes)
    posture = np.zeros(len(names))
    for joint, angle in zip(model.model.robot.joints, model.posture, strict=True):
        posture[names.index(joint.name)] = angle
    engine = Engine(at_posture(robot, posture))
    numbers = [6 * names.index(name) + 5 for name in model.coordinates]  # rz, of bodies in order
    offset = 6 * (engine.mechanism.bodies[0].name == "base")
    mass = engine.mass_matrix()[np.ix_(*2 * [[offset + n for n in numbers]])]
    np.testing.assert_allclose(mass, model.mass, rtol=1e-3, atol=1e-5 * np.abs(model.mass).max())
    text = (tmp_path / "arm.urdf").read_text()
    values = dict(zip([p.name for p in model.system.parameters], model.model.values, strict=True))
    tag = re.search(r'reference="joint4\.rz">\s*<springStiffness>([^<]*)<', text)
    assert tag is not None and float(tag[1]) == pytest.approx(values["joint4.rz.stiffness"])


def test_what_urdf_cannot_say_is_named(result: Result, tmp_path: Path) -> None:
    notes = " ".join(run_export(result("rich"), Wanted("urdf"), tmp_path / "arm.urdf").notes)
    for name in ("link3.resonator_y", "joint2.rx_ry.stiffness", "link6.mass", "joint2.rotor.inertia"):
        assert name in notes
    assert "joint4.rz" not in notes


def test_the_script_for_simulink_names_its_matrices(result: Result, tmp_path: Path) -> None:
    script, matrices = run_export(
        result("plain"), Wanted("simscape", modes=3), tmp_path / "6-axis arm.m"
    ).written
    assert script.name == "m_6_axis_arm.m", "MATLAB runs no script with other letters"
    text = script.read_text()
    assert f"'{matrices.name}'" in text and "model.A_reduced" in text
    assert {"A_reduced", "outputs", "mass"} <= loadmat(matrices).keys()

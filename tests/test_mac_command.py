"""`identify mac`: modes of any files side by side; arrays named on the command line of `identify modes`."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import savemat
from typer.testing import CliRunner

from identify.cli import app
from identify.core.errors import InputError
from identify.measured.channel import Channel
from identify.measured.geometry import MeasuredGeometry
from identify.measured.modal_tables import ModalTable, write_modal_table
from identify.measured.uff.blocks import has_shapes_alone
from identify.measured.uff.shapes import write_shapes
from identify.measured.uff.write import write_uff58
from identify.modes.compare_shapes import compare_modes, read_modes
from identify.results import file as result_file
from identify.results.modes import ModesResult
from tests.reports.modes_sample import modes_result
from tests.shared import shared
from tests.test_modes_command import frf_set

CHANNELS = tuple(Channel(node, 3) for node in (1, 2, 3, 4))
TABLE = ModalTable(
    frequency_hz=np.array([10.0, 25.0]),
    damping_ratio=np.array([0.04, 0.01]),
    channels=CHANNELS,
    shapes=np.array([[1.0, 2.0, 3.0, 4.0], [1.0, 0.5, -1.0, 0.0]], dtype=complex),
)
TURNED = tuple(Channel(node, -3) for node in (4, 3, 2, 1))
OTHER = ModalTable(
    frequency_hz=np.array([10.2, 24.0, 70.0]),
    damping_ratio=np.array([0.05, 0.01, 0.02]),
    channels=TURNED,
    shapes=np.array([[-4, -3, -2, -1.2], [0, 1, -0.5, -1], [1, -1, 1, -1]], dtype=complex),
)
"""The same first two modes, nearly, at channels that look the other way in another order, and one more."""


def invoke(*arguments: object) -> Any:
    return CliRunner().invoke(app, [*map(str, arguments)], catch_exceptions=False)


@pytest.fixture
def files(tmp_path: Path) -> tuple[Path, Path]:
    write_modal_table(tmp_path / "a.yaml", TABLE)
    write_shapes(tmp_path / "b.unv", OTHER, None)
    return tmp_path / "a.yaml", tmp_path / "b.unv"


def test_a_file_of_shapes_opens_in_modes(files: tuple[Path, Path], tmp_path: Path) -> None:
    said = invoke("modes", files[1])
    assert said.exit_code == 0
    assert "Modes of b.unv" in said.output and "as they are" in said.output
    assert "70.0" in said.output
    write_uff58(tmp_path / "frf.unv", frf_set())
    both = tmp_path / "both.unv"
    both.write_bytes(files[1].read_bytes() + (tmp_path / "frf.unv").read_bytes())
    assert [has_shapes_alone(path) for path in (files[1], tmp_path / "frf.unv", both)] == [True, False, False]


def test_two_sets_of_modes_are_paired_without_a_robot(files: tuple[Path, Path]) -> None:
    found = compare_modes(*map(str, files))
    assert [found.pairs.a.tolist(), found.pairs.b.tolist()] == [[0, 1], [0, 1]]
    assert found.pairs.unpaired_b.tolist() == [2]
    assert found.mac is not None and found.comac is not None
    assert found.mac[1, 1] == pytest.approx(1.0)
    assert 0.99 < found.mac[0, 0] < 0.9999
    named = dict(zip(map(str, found.pairs.channels), found.comac, strict=True))
    assert min(named, key=named.get) == "1:+Z", "the channel that differs"  # type: ignore[arg-type]


def turned_twin(path: Path, table: ModalTable, axes: np.ndarray) -> None:
    """The shapes of a table, told along common axes at nodes 1, 2, ..., along others, in a file with them."""
    assert table.shapes is not None
    vectors = table.shapes.reshape(len(table), -1, 3)
    nodes = tuple(range(1, len(axes) + 1))
    local = np.einsum("nac,mnc->mna", axes, vectors).reshape(len(table), -1)
    write_shapes(path, replace(table, shapes=local), MeasuredGeometry(nodes, np.eye(len(axes), 3), axes))


@pytest.fixture
def places() -> ModalTable:
    """Shapes of three modes at three nodes in three directions."""
    random = np.random.default_rng(3)
    channels = tuple(Channel(node, direction) for node in (1, 2, 3) for direction in (1, 2, 3))
    shapes = random.normal(size=(3, 9)) + 0.1j * random.normal(size=(3, 9))
    return ModalTable(np.array([11.0, 23.0, 42.0]), np.full(3, 0.01), channels, shapes)


def test_local_coordinate_systems_are_turned_before_shapes_are_compared(
    places: ModalTable, tmp_path: Path
) -> None:
    general = np.linalg.qr(np.random.default_rng(4).normal(size=(3, 3)))[0]
    turned = np.stack([np.eye(3), general * np.linalg.det(general), np.eye(3)[[1, 2, 0]]])
    turned_twin(tmp_path / "a.unv", places, np.stack([np.eye(3)] * 3))
    turned_twin(tmp_path / "b.unv", places, turned)
    for first, second in (("a.unv", "b.unv"), ("b.unv", "a.unv")):
        found = compare_modes(str(tmp_path / first), str(tmp_path / second))
        assert found.mac is not None and len(found.pairs.channels) == 9
        np.testing.assert_allclose(np.diag(found.mac), 1, atol=1e-8)
        assert found.notes == (
            "the channels of the two files look in different directions at nodes 2, 3: shapes were turned",
        )


def test_a_sensor_of_one_direction_is_compared_along_it(places: ModalTable, tmp_path: Path) -> None:
    """The other file, which has all directions, is turned; what cannot be determined along it is left out."""
    assert places.shapes is not None
    axes = np.stack([np.eye(3), np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))[0], np.eye(3)])
    turned_twin(tmp_path / "a.unv", places, np.stack([np.eye(3)] * 3))
    turned_twin(tmp_path / "b.unv", places, axes)
    full = read_modes(tmp_path / "b.unv")
    assert full.shapes is not None
    one = replace(
        full, channels=(*full.channels[:4], full.channels[8]), shapes=full.shapes[:, [0, 1, 2, 3, 8]]
    )
    write_shapes(tmp_path / "c.unv", one, MeasuredGeometry((1, 2, 3), np.eye(3), axes))
    found = compare_modes(str(tmp_path / "a.unv"), str(tmp_path / "c.unv"))
    assert found.mac is not None and len(found.pairs.channels) == 5
    np.testing.assert_allclose(np.diag(found.mac), 1, atol=1e-8)


def test_reported_shapes_in_local_systems() -> None:
    names = ("mac_fe_global.unv", "mac_test_two_nodes_turned.unv")
    found = compare_modes(*(str(shared("reported", name)) for name in names))
    assert found.mac is not None
    np.testing.assert_allclose(np.diag(found.mac), 1, atol=1e-4)


def test_the_command_shows_pairs_and_draws_the_matrix(files: tuple[Path, Path], tmp_path: Path) -> None:
    said = invoke("mac", *files, "--out", tmp_path / "mac.png")
    assert said.exit_code == 0
    assert "only in b.unv: 70.00 Hz" in said.output
    assert "4 channels in common" in said.output
    assert (tmp_path / "mac.png").read_bytes().startswith(b"\x89PNG")


def test_damped_and_undamped_frequency_are_told_apart(files: tuple[Path, Path]) -> None:
    said = invoke("mac", files[0]).output
    assert "10.000" in said and f"{10 * np.sqrt(1 - 0.04**2):.4f}"[:6] in said
    assert "Undamped (Hz)" in said and "Damped (Hz)" in said


def test_a_result_with_several_measurements_wants_one_named(tmp_path: Path) -> None:
    path = tmp_path / "modes.h5"
    result_file.write(modes_result(), path)
    first, *rest = modes_result().measurements
    assert rest
    with pytest.raises(InputError, match=f"2 measurements; expected one; add `:NAME`, of {first}"):
        compare_modes(str(path))
    assert len(compare_modes(f"{path}:{first}").a) == len(
        modes_result().measurements[first].modes.frequency_hz
    )
    with pytest.raises(InputError, match="no measurement 'x'"):
        compare_modes(f"{path}:x")


@pytest.mark.parametrize("suffix", ["tif", "png2"])
def test_a_picture_of_another_kind_is_refused(files: tuple[Path, Path], suffix: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"one of \.png, \.svg, \.pdf"):
        invoke("mac", *files, "--out", tmp_path / f"mac.{suffix}")


def test_arrays_of_a_mat_file_are_named_on_the_command_line(tmp_path: Path) -> None:
    data = frf_set()
    savemat(tmp_path / "lab.mat", {"test": {"f": data.frequency_hz, "H": data.frf}})
    words = ["modes", tmp_path / "lab.mat", "--no-report", "--quiet", "--out", tmp_path / "m.h5"]
    named = ["--variable", "frequency_hz=test.f", "--variable", "frf=test.H", "--unit", "m/s^2/N"]
    sides = ["--outputs", "1:+Z, 2:+Z,3:+Z,4:+Z", "--inputs", "1:+Z,4:+Z", "--window-decay", "0.9"]
    assert invoke(*words, *named, *sides).exit_code == 0
    kept = result_file.read(tmp_path / "m.h5", ModesResult)
    assert kept.measurements["lab"].modes.frequency_hz == pytest.approx([12.0, 31.0, 47.5], rel=2e-3)
    with pytest.raises(InputError, match=r"frequency_hz: test\.f, frf: test\.H.*--variable NAME=PLACE"):
        invoke(*words)
    with pytest.raises(InputError, match="--variable: 'frf'"):
        invoke(*words, "--variable", "frf")

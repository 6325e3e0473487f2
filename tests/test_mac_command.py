"""`identify mac`: modes of any files side by side; arrays named on the command line of `identify modes`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import savemat
from typer.testing import CliRunner

from identify.cli import app
from identify.core.errors import InputError
from identify.measured.channel import Channel
from identify.measured.modal_table import ModalTable
from identify.measured.modal_tables import write_modal_table
from identify.measured.uff.blocks import has_shapes_alone
from identify.measured.uff.shapes import write_shapes
from identify.measured.uff.write import write_uff58
from identify.modes.compare_shapes import compare_modes
from identify.results import file as result_file
from identify.results.modes import ModesResult
from tests.reports.modes_sample import modes_result
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
    with pytest.raises(InputError, match="--variable frequency_hz=f"):
        invoke(*words)
    with pytest.raises(InputError, match="--variable: 'frf'"):
        invoke(*words, "--variable", "frf")

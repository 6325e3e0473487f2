"""`identify mac` by place in space and with rigid modes: a plate whose points have other numbers in another
file."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from identify.cli import app
from identify.core.errors import InputError
from identify.measured.channel import Channel
from identify.measured.geometry import MeasuredGeometry
from identify.measured.modal_tables import ModalTable
from identify.measured.uff.shapes import write_shapes
from identify.modal.turned import contained, rigid_part
from identify.modes.compare_shapes import compare_modes

X, Y = (grid.ravel() for grid in np.meshgrid(np.linspace(0, 0.8, 5), np.linspace(0, 0.6, 4)))
PLACES = np.stack([X, Y, np.zeros(20)], axis=1)
SHAPES = np.array(
    [np.cos(np.pi * X / 0.8), np.cos(np.pi * X / 0.8) * np.cos(np.pi * Y / 0.6), np.cos(2 * np.pi * X / 0.8)]
)
RIGID = np.array([np.ones(20), X - 0.4, Y - 0.3])


def write(path: Path, numbers: np.ndarray, places: np.ndarray, hz: list[float], shapes: np.ndarray) -> Path:
    """Shapes across a plate, unit axes, at nodes of these numbers and places."""
    order = np.argsort(numbers)
    channels = tuple(Channel(int(n), 3) for n in numbers[order])
    damping = np.full(len(hz), 0.01)
    table = ModalTable(np.array(hz), damping, channels, shapes[:, order].astype(complex))
    nodes = tuple(int(n) for n in numbers[order])
    axes = np.repeat(np.eye(3)[None], len(nodes), axis=0)
    write_shapes(path, table, MeasuredGeometry(nodes, places[order], axes))
    return path


@pytest.fixture
def files(tmp_path: Path) -> tuple[Path, Path]:
    rng = np.random.default_rng(3)
    first = write(tmp_path / "test.unv", np.arange(1, 21), PLACES, [20.0, 31.0, 55.0], SHAPES)
    moved = PLACES + rng.uniform(-0.004, 0.004, size=(20, 3))
    second = write(tmp_path / "fe.unv", 100 + rng.permutation(20), moved, [20.4, 30.2, 56.0], 3 * SHAPES)
    return first, second


def test_points_of_other_numbers_are_paired_by_where_they_are(files: tuple[Path, Path]) -> None:
    found = compare_modes(*map(str, files))
    assert len(found.pairs.channels) == 20
    assert found.pairs.mac == pytest.approx(1.0)
    assert "20 points of 20 were paired by place" in found.notes[0]
    with pytest.raises(InputError, match="no point within 1e-06 m"):
        compare_modes(*map(str, files), "place", 1e-6)
    by_number = compare_modes(*map(str, files), "node")
    assert by_number.pairs.mac_matrix is None, "negative control: no number is in both"


def test_numbers_that_stand_elsewhere_are_said_and_places_put_it_right(tmp_path: Path) -> None:
    first = write(tmp_path / "a.unv", np.arange(1, 21), PLACES, [20.0, 31.0, 55.0], SHAPES)
    turned = np.arange(20, 0, -1)
    second = write(tmp_path / "b.unv", turned, PLACES, [20.0, 31.0, 55.0], np.abs(SHAPES) + X)
    by_number = compare_modes(str(first), str(second))
    assert any("stand at other places" in note and "--by place" in note for note in by_number.notes)
    same = write(tmp_path / "c.unv", np.arange(1, 21), PLACES, [20.0, 31.0, 55.0], SHAPES)
    assert not compare_modes(str(first), str(same)).notes, "negative control"
    third = write(tmp_path / "d.unv", turned, PLACES, [20.0, 31.0, 55.0], SHAPES)
    assert compare_modes(str(first), str(third), "place").pairs.mac == pytest.approx(1.0)


def test_half_of_the_points_are_left_where_the_other_file_has_none(tmp_path: Path) -> None:
    first = write(tmp_path / "a.unv", np.arange(1, 21), PLACES, [20.0, 31.0, 55.0], SHAPES)
    some = np.arange(0, 20, 2)
    far = np.vstack([PLACES[some], PLACES[some] + [0, 0, 0.5]])
    shapes = np.hstack([SHAPES[:, some], np.ones((3, 10))])
    second = write(tmp_path / "b.unv", np.arange(50, 70), far, [20.0, 31.0, 55.0], shapes)
    found = compare_modes(str(first), str(second))
    assert len(found.pairs.channels) == 10
    assert found.pairs.mac == pytest.approx(1.0)


def test_rigid_modes_compare_as_a_space(tmp_path: Path) -> None:
    mix = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    first = write(
        tmp_path / "fe.unv", np.arange(1, 21), PLACES, [0, 0, 0, 20.0], np.vstack([RIGID, SHAPES[:1]])
    )
    ropes = np.vstack([mix @ RIGID, SHAPES[:1]])
    second = write(tmp_path / "test.unv", np.arange(1, 21), PLACES, [1.1, 1.6, 2.3, 20.1], ropes)
    found = compare_modes(str(first), str(second))
    assert any("of the 3 modes of fe.unv the 3 of test.unv hold 100 %" in note for note in found.notes)
    assert any("3 modes at 0 Hz (rigid motion) are not listed" in note for note in found.notes)
    assert found.a.frequency_hz == pytest.approx([20.0], rel=1e-4)
    assert found.rigid_b[:3] == pytest.approx(1.0)
    assert found.rigid_b[3] < 0.99
    lost = np.vstack([mix[:2] @ RIGID, SHAPES[1], SHAPES[0]])
    third = write(tmp_path / "two.unv", np.arange(1, 21), PLACES, [1.1, 1.6, 2.3, 20.1], lost)
    said = " ".join(compare_modes(str(first), str(third)).notes)
    assert "the 2 of two.unv hold" in said and "100 %" not in said, "negative control: one rigid mode is gone"


def test_rigid_parts_of_mixtures_and_of_too_few_channels() -> None:
    geometry = MeasuredGeometry(tuple(range(1, 21)), PLACES, np.repeat(np.eye(3)[None], 20, axis=0))
    bent = SHAPES[1] - RIGID.T @ np.linalg.lstsq(RIGID.T, SHAPES[1], rcond=None)[0]
    shape = RIGID[1] / np.linalg.norm(RIGID[1]) + bent / np.linalg.norm(bent)
    channels = tuple(Channel(n, -3 if n % 2 else 3) for n in range(1, 21))
    signed = shape * [c.sign for c in channels]
    table = ModalTable(np.array([5.0]), np.array([0.01]), channels, signed[None].astype(complex))
    assert rigid_part(table, geometry) == pytest.approx(0.5)
    few = ModalTable(np.array([5.0]), np.array([0.01]), channels[:2], table.shapes[:, :2])  # type: ignore[index]
    assert np.isnan(rigid_part(few, geometry)).all()
    assert contained(np.array([[1.0, 1.0, 0.0]]), np.array([[1.0, 0.0, 0.0]])) == pytest.approx(0.5)


def test_the_command_takes_places_and_refuses_nonsense(files: tuple[Path, Path], tmp_path: Path) -> None:
    def invoke(*words: object) -> Any:
        return CliRunner().invoke(app, ["mac", *map(str, words)])

    said = invoke(*files, "--by", "place", "--within", 0.02)
    assert said.exit_code == 0 and "paired by place" in said.output and "Rigid" in said.output
    for words, found in ((("--by", "name"), "node or place"), (("--within", "0.1"), "--by place")):
        assert found in str(invoke(*files, *words).exception)

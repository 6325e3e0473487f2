"""Shapes and geometry through universal files: round trips, pyuff as the other reader and writer, measured
files, damage.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import pyuff
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from identify.core.errors import InputError
from identify.measured.channel import Channel
from identify.measured.geometry import MeasuredGeometry, displacements
from identify.measured.modal_tables import ModalTable
from identify.measured.uff.geometry import read_geometry
from identify.measured.uff.shapes import read_shapes, write_shapes
from tests.shared import shared

RANDOM = np.random.default_rng(0)
CHANNELS = tuple(Channel(node, direction) for node in (3, 7, 12) for direction in (1, -2, 3))
TABLE = ModalTable(
    frequency_hz=np.array([12.05, 16.66, 27.39]),
    damping_ratio=np.array([0.065, 0.072, 0.0001]),
    channels=CHANNELS,
    shapes=RANDOM.normal(size=(3, 9)) + 1j * RANDOM.normal(size=(3, 9)),
)
TURN = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
GEOMETRY = MeasuredGeometry(
    (3, 7, 12),
    np.array([[0.0, 0.1, 2.05], [1.0, -0.25, 0.5], [0.3, 0.0, 0.0]]),
    np.stack([np.eye(3), TURN, np.eye(3)]),
    ((3, 7, 12), (7, 3)),
)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "modes.uff"


def text_of(path: Path) -> str:
    return path.read_bytes().decode("ascii")


def test_shapes_come_back_with_their_signs_turned_to_positive_axes(path: Path) -> None:
    write_shapes(path, TABLE, GEOMETRY)
    found = read_shapes(path)
    np.testing.assert_allclose(found.frequency_hz, TABLE.frequency_hz, rtol=1e-5)
    np.testing.assert_allclose(found.damping_ratio, TABLE.damping_ratio, rtol=1e-5)
    assert found.channels == tuple(Channel(c.node, abs(c.direction)) for c in CHANNELS)
    np.testing.assert_allclose(found.shapes, TABLE.shapes * [c.sign for c in CHANNELS], rtol=1e-5)
    assert len(found.sha256) == 64


def test_channels_that_were_not_measured_do_not_come_back_as_zero(path: Path) -> None:
    some = replace(TABLE, channels=CHANNELS[:4], shapes=TABLE.shapes[:, :4])
    write_shapes(path, some)
    assert [str(c) for c in read_shapes(path).channels] == ["3:+X", "3:+Y", "3:+Z", "7:+X"]


@pytest.mark.parametrize("direction", [0, -5])
def test_scalar_and_rotation_channels(path: Path, direction: int) -> None:
    channels = (Channel(1, direction), Channel(2, direction))
    write_shapes(path, replace(TABLE, channels=channels, shapes=TABLE.shapes[:, :2]))
    found = read_shapes(path)
    assert found.channels == tuple(Channel(node, abs(direction)) for node in (1, 2))
    np.testing.assert_allclose(found.shapes, TABLE.shapes[:, :2] * (-1 if direction < 0 else 1), rtol=1e-5)


def test_the_geometry_comes_back(path: Path) -> None:
    write_shapes(path, TABLE, GEOMETRY)
    found = read_geometry(path)
    assert found.nodes == GEOMETRY.nodes
    np.testing.assert_allclose(found.position_m, GEOMETRY.position_m, atol=1e-6)
    np.testing.assert_allclose(found.axes, GEOMETRY.axes, atol=1e-6)
    assert found.lines == GEOMETRY.lines


def test_pyuff_reads_what_we_write(path: Path) -> None:
    write_shapes(path, TABLE, GEOMETRY)
    sets = pyuff.UFF(str(path)).read_sets()
    assert [s["type"] for s in sets] == [164, 18, 15, 82, 82, 55, 55, 55]
    np.testing.assert_allclose(sets[2]["x"], GEOMETRY.position_m[:, 0], atol=1e-6)
    assert list(sets[2]["disp_cs"]) == [0, 2, 0]
    first = sets[5]
    assert first["node_nums"].tolist() == [3, 7, 12]
    np.testing.assert_allclose(abs(first["eig"]) / (2 * np.pi), 12.05, rtol=1e-5)
    np.testing.assert_allclose(-first["eig"].real / abs(first["eig"]), 0.065, rtol=1e-5)
    np.testing.assert_allclose(first["r2"], -TABLE.shapes[0, 1::3], rtol=1e-5)


def test_we_read_what_pyuff_writes(path: Path) -> None:
    writer = pyuff.UFF(str(path))
    real = RANDOM.normal(size=(3, 2))
    writer.write_sets(
        pyuff.prepare_15([1, 2], [0, 0], [0, 0], [1, 1], [0.0, 1.0], [0.5, 0.25], [0.0, -3.0]), "add"
    )
    writer.write_sets(pyuff.prepare_82(1, 3, 1, "line", np.array([1, 0, 2])), "add")
    for mode, frequency in ((2, 31.5), (1, 12.25)):
        head = {
            "model_type": 1,
            "id1": "a",
            "id2": "b",
            "id3": "c",
            "id4": "d",
            "id5": "e",
            "data_ch": 2,
            "spec_data_type": 8,
            "load_case": 1,
        }
        values = {"r1": real[0] * mode, "r2": real[1], "r3": real[2], "node_nums": [1, 2], "mode_n": mode}
        modal = {
            "analysis_type": 2,
            "freq": frequency,
            "modal_m": 1.0,
            "modal_damp_vis": 0.03,
            "modal_damp_his": 0.0,
        }
        writer.write_sets({"type": 55, **head, **values, **modal}, "add")
    found = read_shapes(path)
    np.testing.assert_allclose(found.frequency_hz, [12.25, 31.5])
    np.testing.assert_allclose(found.damping_ratio, 0.03)
    np.testing.assert_allclose(found.shapes[1], (real * [[2], [1], [1]]).T.ravel(), rtol=1e-5)
    geometry = read_geometry(path, "m")
    np.testing.assert_allclose(geometry.position_m, [[0, 0.5, 0], [1, 0.25, -3]])
    assert geometry.lines == ()


def dataset(number: int, *lines: str) -> str:
    return "\n".join(["    -1", f"{number:6d}", *lines, "    -1", ""])


def integers(*values: int) -> str:
    return "".join(f"{value:10d}" for value in values)


def wide(*values: float) -> str:
    return "".join(f"{value:25.16E}".replace("E", "D") for value in values)


def narrow(*values: float) -> str:
    return "".join(f"{value:13.5E}" for value in values)


def test_2411_and_2420_by_hand(path: Path) -> None:
    systems = [
        "         1",
        "part",
        integers(5, 0, 1),
        "turned",
        wide(0, 1, 0),
        wide(-1, 0, 0),
        wide(0, 0, 1),
        wide(1000, 0, 0),
    ]
    nodes = [integers(9, 5, 5, 1), wide(10, 20, 30)]
    units = ["         5mm                          2", wide(1000, 1, 1), wide(273.15)]
    path.write_text(dataset(164, *units) + dataset(2420, *systems) + dataset(2411, *nodes))
    found = read_geometry(path)
    # Local (10, 20, 30) mm: x along +Y and y along -X, from (1000, 0, 0) mm.
    np.testing.assert_allclose(found.position_m, [[0.98, 0.01, 0.03]])
    np.testing.assert_allclose(found.axes[0], TURN)


def shape_2414(location: int = 1) -> str:
    ints = [integers(1, 0, 0, 0, 0, 1, 0, 0), integers(0)]
    lines = [integers(1), "name", integers(location), *"abcde", integers(1, 2, 2, 8, 2, 3), *ints]
    return dataset(
        2414, *lines, narrow(0, 45.5, 0, 1, 0, 0.02), narrow(*[0] * 6), integers(4), narrow(1, -2, 0.5)
    )


def test_2414_by_hand_with_a_loss_factor(path: Path) -> None:
    path.write_text(shape_2414() + shape_2414(location=2))
    found = read_shapes(path)
    assert found.frequency_hz.tolist() == [45.5]
    assert found.damping_ratio.tolist() == [0.01]
    np.testing.assert_allclose(found.shapes, [[1, -2, 0.5]])


def normal_mode(*last: str, quantity: int = 8, damping: float = 0.0) -> str:
    head = [
        *"abcde",
        integers(1, 2, 2, quantity, 2, 3),
        integers(2, 4, 1, 1),
        narrow(10.0, 1.0, damping, 0.0),
    ]
    return dataset(55, *head, integers(4), *(last or (narrow(1, -2, 0.5),)))


def test_no_damping_is_unknown_and_accelerations_become_displacements(path: Path) -> None:
    path.write_text(normal_mode(quantity=12))
    found = read_shapes(path)
    assert np.isnan(found.damping_ratio[0])
    np.testing.assert_allclose(found.shapes, -np.array([[1, -2, 0.5]]) / (2 * np.pi * 10) ** 2)
    with pytest.raises(InputError, match="unknown damping"):
        write_shapes(path, found)


@pytest.mark.parametrize(
    "change",
    [
        lambda t: t.replace("\n", "\r\n"),
        lambda t: t.replace("E+", "D+").replace("E-", "D-"),
        lambda t: t + "\n\n",
    ],
)
def test_habits_of_other_writers(path: Path, change) -> None:
    write_shapes(path, TABLE, GEOMETRY)
    path.write_bytes(change(text_of(path)).encode())
    np.testing.assert_allclose(read_shapes(path).frequency_hz, TABLE.frequency_hz, rtol=1e-5)
    assert read_geometry(path).nodes == GEOMETRY.nodes


@pytest.mark.parametrize(
    ("last", "message"),
    [
        (("  1.00000E+00 -2.00000E+00",), r"line 12.*at least 3 numbers"),
        ((" 1.00000E+00 -2.00000E+00  5.00000E-01",), r"line 12.*at least 3 numbers E13"),
        (("  1.00000E+00 -2.0000XE+00  5.00000E-01",), r"line 12"),
        (("          NaN -2.00000E+00  5.00000E-01",), r"line 12"),
        (("  1.0000E+999 -2.00000E+00  5.00000E-01",), r"too large"),
        ((narrow(1, -2, 0.5), integers(4), narrow(1, 1, 1)), "a second time"),
        ((narrow(1, -2, 0.5), integers(5)), "ends too early"),
    ],
)
def test_damaged_values_are_errors_with_their_line(path: Path, last: tuple[str, ...], message: str) -> None:
    path.write_text(normal_mode(*last))
    with pytest.raises(InputError, match=message):
        read_shapes(path)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "no dataset"),
        (normal_mode()[:-80], "ends inside a dataset"),
        (dataset(151, "a"), "no mode shapes"),
        (normal_mode() + normal_mode(narrow(1, 2, 3), integers(7), narrow(1, 1, 1)), "other nodes"),
        ("hello\n", "between datasets"),
        (
            normal_mode().replace(integers(1, 2, 2, 8, 2, 3), integers(1, 2, 4, 8, 2, 6)),
            "data characteristic 4",
        ),
    ],
)
def test_files_without_readable_shapes(path: Path, text: str, message: str) -> None:
    path.write_text(text)
    with pytest.raises(InputError, match=message):
        read_shapes(path)


def node(number: int, definition: int = 0, displacement: int = 0) -> str:
    return integers(number, definition, displacement, 1) + narrow(1, 2, 3)


@pytest.mark.parametrize(
    ("text", "unit", "message"),
    [
        (dataset(15, node(1)), None, "no units"),
        (dataset(15, node(1)), "parsec", "one of m, mm"),
        (dataset(151, "x"), "m", "no nodes"),
        (dataset(15, node(1, displacement=7)), "m", "system 7 is used and not defined"),
        (dataset(15, node(1), node(1, displacement=1)), "m", "a second time"),
        (dataset(15, node(1)) + dataset(82, integers(1, 2, 1), "x", integers(1, 8)), "m", "through node 8"),
        (
            dataset(18, integers(3, 2, 0, 1, 1), "s", narrow(0, 0, 0, 1, 0, 0), narrow(0, 0, 1))
            + dataset(15, node(1, 3)),
            "m",
            "kind 2",
        ),
        (
            dataset(18, integers(3, 1, 0, 1, 1), "c", narrow(0, 0, 0, 1, 0, 0), narrow(0, 0, 1))
            + dataset(18, integers(4, 0, 3, 1, 1), "in it", narrow(0, 0, 0, 1, 0, 0), narrow(0, 0, 1))
            + dataset(15, node(1, 4)),
            "m",
            "system 3, which system 4 stands in, is of kind 1",
        ),
        (
            dataset(18, integers(3, 0, 0, 1, 1), "c", narrow(0, 0, 0, 1, 0, 0), narrow(2, 0, 0))
            + dataset(15, node(1)),
            "m",
            "on a line",
        ),
        (
            dataset(18, integers(3, 0, 3, 1, 1), "c", narrow(0, 0, 0, 1, 0, 0), narrow(0, 0, 1))
            + dataset(15, node(1, 3)),
            "m",
            "refers to itself",
        ),
        (dataset(15, node(1)[:-1]), "m", "line 3.*numbers E13"),
        (dataset(15, node(1)[1:]), "m", "line 3.*numbers I10"),
    ],
)
def test_geometry_that_cannot_be_read(path: Path, text: str, unit: str | None, message: str) -> None:
    path.write_text(text)
    with pytest.raises(InputError, match=message):
        read_geometry(path, unit)


def test_a_cylindrical_system(path: Path) -> None:
    """r, theta, z about an axis along the common x through (0, 0, 5); theta is counted from the common y."""
    system = dataset(18, integers(3, 1, 0, 1, 1), "c", narrow(0, 0, 5, 0, 1, 5), narrow(1, 0, 5))
    nodes = integers(1, 3, 3, 1) + narrow(2, 30, 7), integers(2, 0, 3, 1) + narrow(9, -4, 5)
    path.write_text(system + dataset(15, *nodes))
    found = read_geometry(path, "m")
    c, s = np.cos(np.pi / 6), 0.5
    np.testing.assert_allclose(found.position_m, [[7, 2 * c, 5 + 2 * s], [9, -4, 5]], atol=1e-12)
    np.testing.assert_allclose(found.axes[0], [[0, c, s], [0, -s, c], [1, 0, 0]], atol=1e-12)
    np.testing.assert_allclose(found.axes[1], [[0, -1, 0], [0, 0, -1], [1, 0, 0]], atol=1e-12)


def test_a_cylindrical_system_of_dataset_2420(path: Path) -> None:
    rows = [wide(*row) for row in ((1, 0, 0), (0, 1, 0), (0, 0, 1), (0, 0, 0))]
    system = dataset(2420, integers(1), "part", integers(3, 1, 8) + "\ncylinder", *rows)
    path.write_text(system + dataset(15, integers(1, 3, 0, 1) + narrow(2, 90, 7)))
    found = read_geometry(path, "m")
    np.testing.assert_allclose(found.position_m, [[0, 2, 7]], atol=1e-12)
    np.testing.assert_array_equal(found.axes[0], np.eye(3))


def test_a_curved_system_that_no_node_uses_is_no_matter(path: Path) -> None:
    curved = dataset(18, integers(3, 1, 0, 1, 1), "c", narrow(0, 0, 0, 1, 0, 0), narrow(0, 0, 1))
    path.write_text(curved + dataset(15, node(1)))
    assert read_geometry(path, "m").nodes == (1,)


def test_rigid_motion_at_0_hz_is_left_out_with_a_note(path: Path) -> None:
    rigid = normal_mode().replace(narrow(10.0, 1.0, 0.0, 0.0), narrow(0.0, 1.0, 0.0, 0.0))
    path.write_text(rigid + normal_mode() + rigid)
    found = read_shapes(path)
    assert found.frequency_hz.tolist() == [10.0]
    assert found.notes == ("2 modes at 0 Hz (rigid motion) were left out",)
    path.write_text(rigid)
    with pytest.raises(InputError, match="1 mode at 0 Hz alone; expected modes above 0 Hz"):
        read_shapes(path)


def test_reported_rigid_modes() -> None:
    found = read_shapes(shared("reported", "fe_free_zero_hz.unv"))
    np.testing.assert_allclose(found.frequency_hz, [11.2, 23.5, 41.9])
    assert found.notes == ("3 modes at 0 Hz (rigid motion) were left out",)


def test_a_missing_file_is_an_input_error(path: Path) -> None:
    with pytest.raises(InputError, match="cannot be read"):
        read_shapes(path)


def test_a_unit_against_the_file_is_refused(path: Path) -> None:
    write_shapes(path, TABLE, GEOMETRY)
    assert read_geometry(path, "m").nodes == GEOMETRY.nodes
    with pytest.raises(InputError, match="although the file says 1 m"):
        read_geometry(path, "mm")


def test_shapes_on_the_geometry_turn_with_the_nodes(path: Path) -> None:
    shapes = np.array([[1, 2, 3, 0, 0, 1, 0, 0, 0]], dtype=complex)
    moving = replace(
        TABLE, frequency_hz=TABLE.frequency_hz[:1], damping_ratio=TABLE.damping_ratio[:1], shapes=shapes
    )
    vectors = displacements(GEOMETRY, moving)
    np.testing.assert_allclose(vectors[0], [[1, -2, 3], [0, 0, 1], [0, 0, 0]])
    x_of_turned = displacements(GEOMETRY, replace(moving, shapes=np.eye(9)[3:4].astype(complex)))
    np.testing.assert_allclose(x_of_turned[0, 1], TURN[0])


@pytest.mark.parametrize(
    ("name", "unit", "nodes", "lines"),
    [
        ("TestLab 161 164 18 15 82.uff", None, 36, 11),
        ("Artemis export - Geometry RPBC_setup_05_14102016_105117.uff", "m", 74, 108),
        ("mesh_Oros-modal_uff15_uff2412.uff", "mm", 96, 0),
    ],
)
def test_geometry_of_measured_structures(name: str, unit: str | None, nodes: int, lines: int) -> None:
    found = read_geometry(shared("data", "pyuff_measured_uff", name), unit)
    assert len(found.nodes) == nodes
    assert len(found.lines) == lines
    turned = found.axes @ found.axes.transpose(0, 2, 1)
    np.testing.assert_allclose(turned, np.broadcast_to(np.eye(3), turned.shape), atol=1e-5)
    other = next(
        s for s in pyuff.UFF(str(shared("data", "pyuff_measured_uff", name))).read_sets() if s["type"] == 15
    )
    order = np.argsort(other["node_nums"])
    scale = {"mm": 1e-3}.get(unit or "", 1.0)
    np.testing.assert_allclose(found.position_m[:, 0], scale * np.asarray(other["x"])[order], atol=1e-6)


def test_geometry_before_binary_functions() -> None:
    found = read_geometry(shared("data", "uliege_aircraft", "aircraft_converted.uff"), "m")
    rows = np.loadtxt(shared("data", "uliege_aircraft", "impact_dofs.csv"), delimiter=",", skiprows=1)
    np.testing.assert_allclose(found.position_m[:74], rows[:, 1:4] / 1000, atol=1e-6)


@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.integers(0, 10_000), st.integers(1, 4), st.integers(1, 5))
def test_any_table_survives_the_round_trip(path: Path, seed: int, modes: int, nodes: int) -> None:
    random = np.random.default_rng(seed)
    channels = tuple(Channel(int(n) + 1, int(d)) for n in random.permutation(nodes) for d in (1, 2, -3))
    table = ModalTable(
        np.sort(10 ** random.uniform(-1, 4, modes)),
        random.uniform(1e-5, 0.5, modes),
        channels,
        10 ** random.uniform(-8, 8)
        * (random.normal(size=(modes, 3 * nodes)) + 1j * random.normal(size=(modes, 3 * nodes))),
    )
    write_shapes(path, table)
    found = read_shapes(path)
    np.testing.assert_allclose(found.frequency_hz, table.frequency_hz, rtol=1e-5)
    np.testing.assert_allclose(found.damping_ratio, table.damping_ratio, rtol=2e-5)
    where = {(c.node, abs(c.direction)): i for i, c in enumerate(channels)}
    same = [where[c.node, c.direction] for c in found.channels]
    np.testing.assert_allclose(found.shapes, (table.shapes * [c.sign for c in channels])[:, same], rtol=1e-4)


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.data())
def test_a_changed_character_is_an_error_or_does_no_more_than_that_number(
    path: Path, data: st.DataObject
) -> None:
    """A lost or doubled character never shifts one number into another."""
    write_shapes(path, TABLE)
    text = text_of(path)
    at = data.draw(st.integers(0, len(text) - 1))
    path.write_text(
        text[:at] + text[at + 1 :] if data.draw(st.booleans()) else text[:at] + text[at] + text[at:],
        newline="\n",
    )
    try:
        found = read_shapes(path)
    except InputError:
        return
    if len(found) == len(TABLE) and found.shapes.shape == TABLE.shapes.shape:
        true = TABLE.shapes * [c.sign for c in CHANNELS]
        assert np.sum(~np.isclose(found.shapes, true, rtol=1e-4)) <= 1

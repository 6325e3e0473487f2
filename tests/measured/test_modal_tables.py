"""Modal tables in YAML and CSV: what is read, round trips, and errors with their lines."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from identify.core.errors import InputError
from identify.measured.channel import Channel
from identify.measured.modal_tables import ModalTable, parse_modes, read_modal_table, write_modal_table

YAML = """# the TX200 of Table 1
modes:
  - {frequency_hz: 16.66, damping_percent: 3.1, shape: {"1:+X": 1, "2:-Z": 0.5-0.25j}}
  - frequency_hz: 12.05
    damping_ratio: 0.05
    frequency_std_hz: 0.01
    shape: {"2:-Z": "0.3 + 0.1j", "1:+X": -1e-3}
"""
CSV = "mode,frequency_hz,damping_percent,frequency_std_hz,damping_std_percent\n1,12.05,5,0.01,0.5\n2,16.66,3.1,,\n"  # noqa: E501
SHAPES = "mode,channel,real,imag\n1,1:+X,1,0\n1,2:-Z,0.5,-0.25\n2,2:-Z,0.3,0.1\n2,1:+X,-1,0\n"


def read(tmp_path: Path, text: str, suffix: str = ".yaml") -> ModalTable:
    path = tmp_path / f"modes{suffix}"
    path.write_text(text)
    return read_modal_table(path)


def test_yaml_sorted_by_frequency_with_shapes_in_one_order(tmp_path: Path) -> None:
    table = read(tmp_path, YAML)
    np.testing.assert_allclose(table.frequency_hz, [12.05, 16.66])
    np.testing.assert_allclose(table.damping_ratio, [0.05, 0.031])
    assert table.channels == (Channel(1, 1), Channel(2, -3)) and table.shapes is not None
    np.testing.assert_allclose(table.shapes, [[-1e-3, 0.3 + 0.1j], [1, 0.5 - 0.25j]])
    assert (
        table.frequency_std_hz is not None
        and table.frequency_std_hz[0] == 0.01
        and np.isnan(table.frequency_std_hz[1])
    )
    assert table.damping_std is None and table.source.endswith("modes.yaml") and len(table.sha256) == 64


def test_csv_with_shapes_in_a_second_file(tmp_path: Path) -> None:
    (tmp_path / "m.csv").write_text(CSV)
    (tmp_path / "s.csv").write_text(SHAPES)
    table = read_modal_table(tmp_path / "m.csv", tmp_path / "s.csv")
    np.testing.assert_allclose(table.damping_ratio, [0.05, 0.031])
    assert (
        table.damping_std is not None
        and table.damping_std[0] == pytest.approx(0.005)
        and np.isnan(table.damping_std[1])
    )
    assert table.shapes is not None
    np.testing.assert_allclose(table.shapes, [[1, 0.5 - 0.25j], [-1, 0.3 + 0.1j]])
    assert read_modal_table(tmp_path / "m.csv").shapes is None


numbers = st.floats(-1e6, 1e6)


@st.composite
def tables(draw: st.DrawFn) -> ModalTable:
    modes, channels = draw(st.integers(1, 4)), draw(st.integers(1, 3))

    def column(low: float, high: float) -> np.ndarray:
        return np.array(draw(st.lists(st.floats(low, high), min_size=modes, max_size=modes)))

    shapes = None
    if draw(st.booleans()):
        parts = [
            np.array(draw(st.lists(numbers, min_size=modes * channels, max_size=modes * channels)))
            for _ in range(2)
        ]
        shapes = (parts[0] + 1j * parts[1]).reshape(modes, channels)
    damping = column(-1, 1)
    damping[draw(st.integers(0, modes - 1))] = np.nan
    return ModalTable(
        frequency_hz=np.sort(column(1e-3, 1e4)),
        damping_ratio=damping,
        channels=(
            tuple(Channel(n + 1, draw(st.integers(-6, 6))) for n in range(channels))
            if shapes is not None
            else ()
        ),
        shapes=shapes,
        frequency_std_hz=column(0, 1) if draw(st.booleans()) else None,
        damping_std=column(0, 1) if draw(st.booleans()) else None,
    )


@pytest.mark.parametrize("suffix", [".yaml", ".csv"])
@given(table=tables())
@settings(max_examples=60, deadline=None)
def test_what_is_written_is_read_bit_by_bit(
    tmp_path_factory: pytest.TempPathFactory, suffix: str, table: ModalTable
) -> None:
    folder = tmp_path_factory.mktemp("round")
    shapes = folder / "shapes.csv" if suffix == ".csv" and table.shapes is not None else None
    write_modal_table(folder / f"m{suffix}", table, shapes)
    again = read_modal_table(folder / f"m{suffix}", shapes)
    assert again.channels == table.channels
    for name in ("frequency_hz", "damping_ratio", "shapes", "frequency_std_hz", "damping_std"):
        if getattr(table, name) is None:
            assert getattr(again, name) is None
        else:
            np.testing.assert_array_equal(getattr(again, name), getattr(table, name))


@pytest.mark.parametrize(
    ("old", "new", "found"),
    [
        ("damping_ratio: 0.05", "damping: 0.05", "line 4: unknown key 'damping'"),
        (
            "damping_ratio: 0.05",
            "damping_ratio: 5",
            "line 4: damping_ratio: 5; expected a damping ratio between",
        ),
        (
            "damping_ratio: 0.05",
            "damping_ratio: 0.05\n    damping_percent: 5",
            "line 4: both damping_ratio and damping_percent",
        ),
        ("damping_ratio: 0.05", "damping_ratio: much", "line 4, damping_ratio: 'much'"),
        ("frequency_hz: 12.05", "frequency_hz: -12", "line 4: frequency_hz: -12"),
        ("frequency_hz: 12.05", "frequency_hz: .nan", "line 4, frequency_hz: nan"),
        ("frequency_hz: 12.05", "frequency_std_hz: 1", "line 6: broken YAML .found duplicate key"),
        ("frequency_hz: 16.66, ", "", "line 3: no frequency_hz"),
        ('"1:+X": 1,', '"7:+X": 1,', "line 4: a shape with other channels"),
        ('"1:+X": 1,', '"X1": 1,', "line 3: channel 'X1'"),
        ('"0.3 + 0.1j"', '"0.3 + i"', "line 4, 2:-Z: '0.3 [+] i'"),
        (', shape: {"1:+X": 1, "2:-Z": 0.5-0.25j}', "", "line 3: a mode without shape"),
        ("modes:", "mode:", "no list under the key modes"),
        ("modes:\n", "modes: 3\nx:\n", "no list under the key modes"),
        ("  - {", "  - {{", "a key that is a list or a mapping"),
        ("  - {frequency_hz: 16.66", "  - 5\n  - {frequency_hz: 16.66", "line 3: mode 5"),
    ],
)
def test_errors_of_yaml_name_the_line(tmp_path: Path, old: str, new: str, found: str) -> None:
    assert old in YAML
    with pytest.raises(InputError, match=found):
        read(tmp_path, YAML.replace(old, new, 1))


@pytest.mark.parametrize(
    ("old", "new", "found"),
    [
        ("2,16.66", "1,16.66", "line 3: mode '1'"),
        ("2,16.66", "2,", "line 3: no frequency_hz"),
        ("2,16.66", "2,fast", "line 3, frequency_hz: 'fast'"),
        ("frequency_hz", "hz", "the columns mode, hz"),
        ("frequency_std_hz", "std", "unknown key 'std'"),
    ],
)
def test_errors_of_csv_name_the_line(tmp_path: Path, old: str, new: str, found: str) -> None:
    with pytest.raises(InputError, match=found):
        read(tmp_path, CSV.replace(old, new, 1), ".csv")


@pytest.mark.parametrize(
    ("old", "new", "found"),
    [
        ("2,1:+X", "3,1:+X", "line 5: mode '3', which the table of modes does not have"),
        ("2,1:+X", "2,2:-Z", "line 5: channel 2:-Z of mode 2 a second time"),
        ("2,1:+X,-1,0\n", "", "other channels"),
        ("real", "re", "the columns mode, channel, re"),
        ("0.3", "x", "line 4: 'x' in column 'real'"),
    ],
)
def test_errors_of_shapes_name_the_line(tmp_path: Path, old: str, new: str, found: str) -> None:
    (tmp_path / "m.csv").write_text(CSV)
    (tmp_path / "s.csv").write_text(SHAPES.replace(old, new, 1))
    with pytest.raises(InputError, match=found):
        read_modal_table(tmp_path / "m.csv", tmp_path / "s.csv")


def test_missing_files_other_suffixes_and_empty_tables_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be read"):
        read_modal_table(tmp_path / "missing.yaml")
    with pytest.raises(InputError, match=r"suffix '\.txt'"):
        read_modal_table(tmp_path / "modes.txt")
    with pytest.raises(InputError, match="no mode"):
        parse_modes([], "study.yaml")
    with pytest.raises(InputError, match="broken YAML"):
        read(tmp_path, "modes:\n  - {frequency_hz: 1, frequency_hz: 2}\n")

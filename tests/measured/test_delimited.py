"""CSV files: both layouts, notes, round trips, and errors with their lines."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from identify.core.errors import InputError
from identify.measured.frf_set import FrfSet
from identify.measured.loaders import FrfFileOptions, load_frf_set, load_time_history
from tests.frf_files import write_csv
from tests.measured.frf_sets import assert_same, sets, some_set

LONG = """# unit: g/N
# averages: 4
# a comment
frequency_hz,output,input,real,imag,coherence
2.0,12:+Z,1:+X,3,-1,0.8
1.0,12:+Z,1:+X,1,2,0.9
1.0,12:-Y,1:+X,0.5,0,
2.0,12:-Y,1:+X,0.25,1e-3,
"""
WIDE = """frequency_hz,12:+Z/1:+X real,12:+Z/1:+X imag,12:+Z/1:+X coherence,12:-Y/1:+X magnitude,12:-Y/1:+X phase_deg
1.0,1,2,0.9,0.5,0
2.0,3,-1,0.8,2,90
"""  # noqa: E501


def load(tmp_path: Path, text: str, **options: object) -> FrfSet:
    path = tmp_path / "x.csv"
    path.write_text(text, encoding="utf-8")
    return load_frf_set(path, FrfFileOptions.model_validate(options))


def test_the_long_layout_in_any_order_of_lines(tmp_path: Path) -> None:
    read = load(tmp_path, LONG, window_decay_per_s=0.5)
    assert (
        [str(c) for c in read.outputs] == ["12:+Z", "12:-Y"]
        and read.averages == 4
        and read.window_decay_per_s == 0.5
    )
    np.testing.assert_allclose(read.frf[:, 0, 0], 9.80665 * np.array([1 + 2j, 3 - 1j]))
    np.testing.assert_allclose(read.frf[:, 1, 0], 9.80665 * np.array([0.5, 0.25 + 1e-3j]))
    assert (
        read.coherence is not None
        and read.coherence[:, 0, 0].tolist() == [0.9, 0.8]
        and np.isnan(read.coherence[:, 1, 0]).all()
    )


def test_the_wide_layout_with_real_and_imag_or_magnitude_and_phase(tmp_path: Path) -> None:
    read = load(tmp_path, WIDE, unit="m/N")
    np.testing.assert_allclose(read.frf[:, 0, 0], [1 + 2j, 3 - 1j])
    np.testing.assert_allclose(read.frf[:, 1, 0], [0.5, 2j], atol=1e-15)
    with pytest.raises(InputError, match="gives no unit"):
        load(tmp_path, WIDE)


@given(sets())
@settings(max_examples=60, deadline=None)
def test_what_is_written_is_read_bit_by_bit(
    tmp_path_factory: pytest.TempPathFactory, frf_set: FrfSet
) -> None:
    path = tmp_path_factory.mktemp("round") / "x.csv"
    write_csv(path, frf_set)
    read = load_frf_set(path)
    assert_same(read, frf_set)
    assert (read.averages, read.window_decay_per_s) == (frf_set.averages, frf_set.window_decay_per_s)


@pytest.mark.parametrize(
    ("old", "new", "found"),
    [
        ("2.0,12:+Z,1:+X,3,-1,0.8", "2.0,12:+Z,1:+X,three,-1,0.8", r"line 5: 'three' in column 'real'"),
        ("2.0,12:+Z,1:+X,3,-1,0.8", "2.0,12:+Z,1:+X,nan,-1,0.8", r"line 5: 'nan' in column 'real'"),
        ("2.0,12:+Z,1:+X,3,-1,0.8", "2.0,12:+Z,1:+X,3", r"line 5: 4 cells, 6 in the header"),
        (
            "2.0,12:+Z,1:+X,3,-1,0.8",
            "2,0,12:+Z,1:+X,3,-1,0.8",
            r"line 5: 7 cells, 6 in the header.* decimal point",
        ),
        (
            "2.0,12:+Z,1:+X,3,-1,0.8\n",
            "",
            r"line 5: 1 line from 1 to 1 Hz, beside 2 lines from 1 to 2 Hz in .*line 6",
        ),
        (
            "1.0,12:-Y",
            "1.5,12:-Y",
            r"line 7: 2 lines from 1.5 to 2 Hz, beside 2 lines from 1 to 2 Hz in .*line 5",
        ),
        (
            "1.0,12:-Y,1:+X,0.5,0,",
            "2.0,12:-Y,1:+X,0.5,0,",
            r"line 8: a frequency of 12:-Y/1:\+X that comes twice",
        ),
        ("12:+Z,1:+X,1,2,0.9", "12:+Q,1:+X,1,2,0.9", r"line 6: channel '12:\+Q'"),
        ("12:-Y,1:+X,0.5,0,", "12:-Y,1:+X,0.5,0,0.5", r"line 8: '' in column 'coherence'"),
        ("# averages: 4", "# averages: four", "# averages: four"),
        ("# unit: g/N", "# unit: V/N", "'V/N'"),
        ("frequency_hz,output", "f,output", "the columns f, output"),
        ("real,imag,", "real,real,", "line 4: a column name that comes twice"),
    ],
)
def test_errors_of_the_long_layout_name_the_line(tmp_path: Path, old: str, new: str, found: str) -> None:
    assert old in LONG
    with pytest.raises(InputError, match=found):
        load(tmp_path, LONG.replace(old, new))


@pytest.mark.parametrize(
    ("old", "new", "found"),
    [
        ("12:+Z/1:+X imag", "12:+Z/1:+X magnitude", "the parts magnitude and real"),
        ("12:+Z/1:+X imag", "12:+Z imag", "no pair and part"),
        ("12:-Y/1:+X magnitude", "12:+Z/1:+X  real", "real of 12:.Z/1:.X a second time"),
        ("1.0,1,2", "2.0,1,2", "not rising"),
    ],
)
def test_errors_of_the_wide_layout(tmp_path: Path, old: str, new: str, found: str) -> None:
    with pytest.raises(InputError, match=found):
        load(tmp_path, WIDE.replace(old, new), unit="m/N")


@pytest.mark.parametrize(
    ("text", "found"),
    [("", "no line"), ("\n\n", "no line"), ("frequency_hz,output,input,real,imag\n", "a header line alone")],
)
def test_an_empty_file_is_refused(tmp_path: Path, text: str, found: str) -> None:
    with pytest.raises(InputError, match=f"{found}; expected a header line and at least one line of numbers"):
        load(tmp_path, text)


@example("-\n0")
@given(st.text(alphabet='frequency_hz,output12:+-Z/X real\n#"0.5', max_size=80))
@settings(max_examples=150, deadline=None)
def test_any_text_is_an_frf_set_or_an_input_error(
    tmp_path_factory: pytest.TempPathFactory, text: str
) -> None:
    folder = tmp_path_factory.getbasetemp()
    for start in (
        "",
        "frequency_hz,output,input,real,imag\n",
        "frequency_hz,1:+X/2:+X real,1:+X/2:+X imag\n",
    ):
        try:
            read = load(folder, start + text, unit="m/N")
        except InputError:
            continue
        assert np.isfinite(read.frf[:, read.measured]).all()


def test_a_time_history_with_hits(tmp_path: Path) -> None:
    path = tmp_path / "x.csv"
    path.write_text(
        "block,time_s,12:+Z [g],1:+X"
        " [N]\n1,0,1,10\n1,0.5,2,20\n1,1.0,3,30\n2,0,4,40\n2,0.5,5,50\n2,1.0,6,60\n"
    )
    read = load_time_history(path)
    assert (
        read.sample_rate_hz == 2
        and read.units == ("m/s^2", "N")
        and read.forces == [1]
        and read.responses == [0]
    )
    np.testing.assert_array_equal(read.data[:, :, 1], [[10, 20, 30], [40, 50, 60]])
    np.testing.assert_allclose(read.data[:, :, 0], 9.80665 * np.array([[1, 2, 3], [4, 5, 6]]))


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("time_s,12:+Z\n0,1\n1,2\n", r"column '12:\+Z': no channel with its unit"),
        ("time_s,12:+Z [V]\n0,1\n1,2\n", "'V'"),
        ("time_s,12:+Z [rad/s]\n0,1\n1,2\n", r"unit rad/s at channel 12:\+Z"),
        ("t,12:+Z [N]\n0,1\n1,2\n", "the columns t"),
        ("time_s,12:+Z [N]\n0,1\n1,2\n3,4\n", "not all alike"),
        ("time_s,12:+Z [N]\n0,1\n", "a single time value"),
        ("block,time_s,12:+Z [N]\n1,0,1\n1,1,2\n2,0,1\n", "block 2: 1 time values, 2 in"),
    ],
)
def test_errors_of_time_histories(tmp_path: Path, text: str, found: str) -> None:
    path = tmp_path / "x.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=found):
        load_time_history(path)


def test_a_set_without_averages_or_coherence_is_written_and_read(tmp_path: Path) -> None:
    plain = some_set(averages=None, coherence=None, window_decay_per_s=0.0)
    write_csv(tmp_path / "x.csv", plain)
    read = load_frf_set(tmp_path / "x.csv")
    assert_same(read, plain)
    assert read.averages is None and read.window_decay_per_s == 0


@pytest.mark.parametrize("cell", ["nan", "inf", ""])
def test_an_frf_that_is_no_number_at_0_hz_loses_that_line(tmp_path: Path, cell: str) -> None:
    """As of a receptance made from an acceleration; elsewhere it is an error with its line."""
    long = (
        "# unit: m/N\nfrequency_hz,output,input,real,imag\n"
        f"0,1:+Z,1:+Z,{cell},{cell}\n1,1:+Z,1:+Z,2,3\n2,1:+Z,1:+Z,4,5\n"
    )
    wide = f"# unit: m/N\nfrequency_hz,1:+Z/1:+Z real,1:+Z/1:+Z imag\n0,{cell},{cell}\n1,2,3\n2,4,5\n"
    for text in (long, wide):
        (tmp_path / "x.csv").write_text(text)
        read = load_frf_set(tmp_path / "x.csv")
        assert read.frequency_hz.tolist() == [1, 2]
        assert read.frf[:, 0, 0].tolist() == [2 + 3j, 4 + 5j]
        assert read.notes == ("the line at 0 Hz was left out: not all FRFs are numbers there",)
        (tmp_path / "x.csv").write_text(
            text.replace("1,2,3", f"1,{cell},3").replace("1:+Z,2,3", f"1:+Z,{cell},3")
        )
        with pytest.raises(InputError, match=r"line \d: '.*' in column '.*real'"):
            load_frf_set(tmp_path / "x.csv")

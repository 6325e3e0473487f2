"""FRFs as people have them: a file per pair, text without header, semicolons and decimal commas, start and
step in place of frequencies, arrays under any names.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
from scipy.io import savemat

from identify.core.errors import InputError
from identify.measured.frf_set import FrfSet
from identify.measured.loaders import FrfFileOptions, load_frf_set
from identify.measured.several import name_of
from identify.measured.uff.write import write_uff58
from tests.measured.frf_sets import assert_same, some_set

SET = replace(some_set(seed=4, lines=9, outputs=4, inputs=2), window_decay_per_s=0.0)
UNIT = "m/s^2/N"
Name = Callable[[object, object], str]


def compact(channel: object) -> str:
    return str(channel).replace(":", "")


def one_each(folder: Path, write: Callable[[Path, FrfSet], None], suffix: str) -> None:
    """A file for each FRF, such as `FRF_3+X_4-Y`."""
    for i, output in enumerate(SET.outputs):
        for j, input_ in enumerate(SET.inputs):
            name = f"FRF_{compact(output)}_{compact(input_)}{suffix}"
            write(folder / name, SET.pairs([i], [j]))


def headerless(path: Path, one: FrfSet) -> None:
    rows = np.column_stack(
        [one.frequency_hz, one.frf[:, 0, 0].real, one.frf[:, 0, 0].imag, one.coherence[:, 0, 0]]  # type: ignore[index]
    )
    np.savetxt(path, rows, fmt="%.17g")


def german(path: Path, one: FrfSet) -> None:
    """As a spreadsheet of a German saves it: semicolons, decimal commas, a number of the line in front."""
    lines = ["sep=;", ";frequency_hz;real;imag;coherence"]
    assert one.coherence is not None
    for n, (f, h, c) in enumerate(
        zip(one.frequency_hz, one.frf[:, 0, 0], one.coherence[:, 0, 0], strict=True)
    ):
        lines.append(f"{n};{f!r};{h.real!r};{h.imag!r};{c!r}".replace("np.float64(", "").replace(")", ""))
    path.write_text("\n".join(lines).replace(".", ",") + "\n", encoding="utf-8")


COLUMNS = ["frequency_hz", "real", "imag", "coherence"]


@pytest.mark.parametrize(
    ("write", "suffix", "options"),
    [
        (write_uff58, ".uff", {}),
        (headerless, ".txt", {"unit": UNIT, "columns": COLUMNS, "names": "FRF_{output}_{input}"}),
        (german, ".csv", {"unit": UNIT, "names": "*_{output}_{input}"}),
        (
            german,
            ".csv",
            {"unit": UNIT, "names": "FRF_{output_node}{output_direction}_{input_node}{input_direction}"},
        ),
    ],
    ids=["uff", "headerless", "german", "pieces"],
)
@pytest.mark.parametrize("how", ["folder", "pattern", "list"])
def test_a_file_for_each_frf(
    tmp_path: Path,
    how: str,
    write: Callable[[Path, FrfSet], None],
    suffix: str,
    options: dict[str, object],
) -> None:
    one_each(tmp_path, write, suffix)
    paths = {
        "folder": tmp_path,
        "pattern": tmp_path / f"FRF_*{suffix}",
        "list": sorted(tmp_path.iterdir()),
    }[how]
    read = load_frf_set(paths, FrfFileOptions.model_validate(options))  # type: ignore[arg-type]
    assert_same(read, SET if read.coherence is not None else replace(SET, coherence=None), rtol=1e-12)
    assert set(read.outputs) == set(SET.outputs) and len(read.sha256) == 64


def test_files_come_in_the_order_of_their_numbers(tmp_path: Path) -> None:
    for node in (2, 10, 1):
        (tmp_path / f"p{node}Z.txt").write_text("1 1 0\n2 1 1\n")
    options = FrfFileOptions(
        unit=UNIT, names="p{output}", inputs=["1:+X"], columns=["frequency_hz", "real", "imag"]
    )
    assert [channel.node for channel in load_frf_set(tmp_path, options).outputs] == [1, 2, 10]


def test_start_and_step_in_place_of_frequencies(tmp_path: Path) -> None:
    path = tmp_path / "x.csv"
    values = SET.frf[:, 0, 0].tolist()
    text = "12:+Z/1:+X real\t12:+Z/1:+X imag\t\n" + "".join(f"{h.real!r}\t{h.imag!r}\t\n" for h in values)
    path.write_text(text)
    start, step = SET.frequency_hz[0], SET.frequency_hz[1] - SET.frequency_hz[0]
    read = load_frf_set(path, FrfFileOptions(unit=UNIT, frequency_start_hz=start, frequency_step_hz=step))
    np.testing.assert_allclose(read.frequency_hz, SET.frequency_hz)
    np.testing.assert_array_equal(read.frf[:, 0, 0], SET.frf[:, 0, 0])
    path.write_text(f"# frequency_start_hz: {start}\n# frequency_step_hz: {step}\n{text}")
    np.testing.assert_allclose(load_frf_set(path, FrfFileOptions(unit=UNIT)).frequency_hz, SET.frequency_hz)
    path.write_text("frequency_hz,12:+Z/1:+X real,12:+Z/1:+X imag\n1,1,1\n2,1,1\n")
    with pytest.raises(InputError, match="beside a column frequency_hz"):
        load_frf_set(path, FrfFileOptions(unit=UNIT, frequency_step_hz=step))


def struct(folder: Path) -> tuple[Path, dict[str, str]]:
    """As programs for tests export it: an axis with start and increment, and values."""
    start, step = SET.frequency_hz[0], SET.frequency_hz[1] - SET.frequency_hz[0]
    axis = {"start_value": start, "increment": step, "number_of_values": len(SET.frequency_hz)}
    savemat(
        folder / "x.mat",
        {"FRF": {"x_values": axis, "y_values": {"values": SET.frf[:, :, 0]}, "note": "as measured"}},
    )
    return folder / "x.mat", {
        "frequency_start_hz": "FRF.x_values.start_value",
        "frequency_step_hz": "FRF.x_values.increment",
        "frf": "FRF.y_values.values",
    }


def test_a_struct_with_start_and_increment(tmp_path: Path) -> None:
    path, variables = struct(tmp_path)
    one = replace(SET.pairs([0, 1, 2, 3], [0]), coherence=None)
    channels = {"outputs": [str(c) for c in one.outputs], "inputs": [str(c) for c in one.inputs]}
    read = load_frf_set(path, FrfFileOptions(unit=UNIT, variables=variables, **channels))
    assert_same(read, one, rtol=1e-12)


def test_what_a_file_of_arrays_holds_is_said_with_how_to_name_it(tmp_path: Path) -> None:
    path, variables = struct(tmp_path)
    with pytest.raises(InputError, match=r"FRF\.y_values\.values \(9 x 4 complex\)") as caught:
        load_frf_set(path)
    said = str(caught.value)
    assert "FRF.x_values.increment = 0.625" in said and "FRF.note 'as measured'" in said
    for name, place in variables.items():
        assert f"{name}: {place}" in said
    rows = np.array(
        [(SET.frf[:, 0, 0], SET.frequency_hz), (SET.frf[:, 1, 0], SET.frequency_hz)], dtype=object
    )
    savemat(tmp_path / "y.mat", {"freq": SET.frequency_hz, "H": SET.frf, "cells": rows})
    with pytest.raises(InputError, match=r"variables: {frequency_hz: freq, frf: H}"):
        load_frf_set(tmp_path / "y.mat")
    savemat(tmp_path / "odd.mat", {"f": SET.frequency_hz, "Hzz": SET.frf})
    damaged = (tmp_path / "odd.mat").read_bytes().replace(b"Hzz", b"H\x11z")
    (tmp_path / "odd.mat").write_bytes(damaged)
    with pytest.raises(InputError) as odd:
        load_frf_set(tmp_path / "odd.mat")
    assert str(odd.value).isprintable()
    with h5py.File(tmp_path / "z.h5", "w") as file:
        file["run/f"] = SET.frequency_hz
        file["run/H"] = SET.frf
    with pytest.raises(InputError, match=r"run/H \(9 x 4 x 2 complex\).*frequency_hz: run/f, frf: run/H"):
        load_frf_set(tmp_path / "z.h5")


def test_rows_of_an_array(tmp_path: Path) -> None:
    savemat(tmp_path / "x.mat", {"data": {"H": SET.frf[:, :2, 0].T, "f": np.array([SET.frequency_hz] * 2)}})
    variables = {"frequency_hz": "data.f[0,:]", "3:+X/1:+X": "data.H[0,:]", "4:-Y/1:+X": "data.H[1,:]"}
    read = load_frf_set(tmp_path / "x.mat", FrfFileOptions(unit=UNIT, variables=variables))
    np.testing.assert_array_equal(read.frf[:, :, 0], SET.frf[:, :2, 0])


@pytest.mark.parametrize(
    ("files", "options", "said"),
    [
        (
            {"a.txt": "1 2 3\n2 3 4\n"},
            {},
            "numbers in the first line, and no names of the 3 columns.*columns: ",
        ),
        ({"a.txt": "1 2 3\n"}, {"columns": ["frequency_hz", "real"]}, "3 cells, 2 names in the key columns"),
        (
            {"a.txt": "1 2 3\n2 3 4\n"},
            {"columns": ["frequency_hz", "real", "imag"]},
            "column 'real': no pair.*or by `names`",
        ),
        ({"a.txt": "1 2 3\n"}, {"names": "{output}"}, "'a' is not of the form '{output}'"),
        ({"a.txt": "1 2 3\n"}, {"names": "{point}"}, r"{point}; expected one of {output}"),
        ({"a.xlsx": "PK"}, {}, "a workbook of a spreadsheet.*save its sheet as CSV"),
        (
            {"a.csv": '"1,5","2,5"\n'},
            {"columns": ["frequency_hz", "12:+Z/1:+X real"]},
            "separate cells by semicolons",
        ),
        ({"a.uff": ""}, {"columns": ["frequency_hz", "-"]}, "names of columns of a file that has none"),
        ({"a.uff": ""}, {"frequency_step_hz": 1.0}, "frequencies of a file that says them itself"),
    ],
)
def test_what_is_missing_is_said(
    tmp_path: Path, files: dict[str, str], options: dict[str, object], said: str
) -> None:
    for name, text in files.items():
        (tmp_path / name).write_text(text)
    [name] = files
    with pytest.raises(InputError, match=said):
        load_frf_set(tmp_path / name, FrfFileOptions.model_validate(options))


@pytest.mark.parametrize(("name", "said"), [("*.csv", "no file is called so"), ("", "a folder without any")])
def test_a_place_without_files_is_refused(tmp_path: Path, name: str, said: str) -> None:
    with pytest.raises(InputError, match=said):
        load_frf_set(tmp_path / name)


def test_files_that_do_not_belong_together_are_refused(tmp_path: Path) -> None:
    for name, notes in (("a", "# unit: g/N\n"), ("b", "# unit: m/s^2/N\n")):
        pair = f"1{name.replace('a', ':+X').replace('b', ':+Y')}/1:+X"
        (tmp_path / f"{name}.csv").write_text(
            f"{notes}frequency_hz,{pair} real,{pair} imag\n1,1,1\n2,1,1\n3,1,2\n"
        )
    with pytest.raises(InputError, match="2 units in 2 files"):
        load_frf_set(tmp_path)


@pytest.mark.parametrize(
    ("paths", "name"),
    [
        (["p1/posture1.uff"], "posture1"),
        (["p1"], "p1"),
        (["p1/*.csv"], "p1"),
        (["*.csv"], "measurement"),
        (["p1/a.uff", "p1/b.uff"], "p1"),
        (["a.uff", "b.uff"], "a"),
    ],
)
def test_a_measurement_is_called_by_its_file_or_folder(paths: list[str], name: str) -> None:
    assert name_of([Path(path) for path in paths]) == name

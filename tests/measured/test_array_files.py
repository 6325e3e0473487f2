"""HDF5 and MATLAB files: round trips, other names, other shapes, measured originals."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from hypothesis import given, settings
from scipy.io import savemat

from identify.core.errors import InputError
from identify.measured.frf_set import FrfSet
from identify.measured.loaders import FrfFileOptions, load_frf_set
from tests.frf_files import write_hdf5
from tests.measured.frf_sets import assert_same, sets, some_set
from tests.measured.mat_files import content, write_v73
from tests.shared import shared


@given(sets())
@settings(max_examples=40, deadline=None)
def test_hdf5_keeps_every_bit(tmp_path_factory: pytest.TempPathFactory, frf_set: FrfSet) -> None:
    path = tmp_path_factory.mktemp("round") / "x.h5"
    write_hdf5(path, frf_set)
    read = load_frf_set(path)
    assert_same(read, frf_set)
    assert (read.averages, read.window_decay_per_s) == (frf_set.averages, frf_set.window_decay_per_s)


@pytest.mark.parametrize("version", ["v5", "v7.3"])
@pytest.mark.parametrize(("lines", "outputs", "inputs"), [(7, 3, 2), (7, 3, 1), (7, 1, 1), (7, 1, 2)])
def test_matlab_files_under_the_documented_names(
    tmp_path: Path, version: str, lines: int, outputs: int, inputs: int
) -> None:
    frf_set, path = some_set(1, lines, outputs, inputs), tmp_path / "x.mat"
    if version == "v5":
        savemat(path, content(frf_set))
    else:
        write_v73(path, content(frf_set))
    read = load_frf_set(path)
    assert_same(read, frf_set)
    assert read.averages == 4


def test_other_names_real_and_imaginary_parts_structures_and_channels_that_the_user_names(
    tmp_path: Path,
) -> None:
    frf_set, path = some_set(coherence=None), tmp_path / "x.mat"
    savemat(path, {"test": {"f": frf_set.frequency_hz, "re": frf_set.frf.real, "im": frf_set.frf.imag}})
    variables = {"frequency_hz": "test.f", "frf_real": "test.re", "frf_imag": "test.im"}
    channels = {"outputs": [str(c) for c in frf_set.outputs], "inputs": [str(c) for c in frf_set.inputs]}
    options = FrfFileOptions(unit="m/s^2/N", variables=variables, **channels)
    assert_same(load_frf_set(path, options), frf_set)
    with pytest.raises(InputError, match=r"no outputs; .* name them with the key outputs"):
        load_frf_set(path, FrfFileOptions(unit="m/s^2/N", variables=variables))


def test_single_pairs_in_hdf5_groups(tmp_path: Path) -> None:
    frf_set = some_set(outputs=2, inputs=1)
    assert frf_set.coherence is not None
    with h5py.File(tmp_path / "x.hdf5", "w") as file:
        file["run/f"] = frf_set.frequency_hz
        for i in range(2):
            file[f"run/H{i}"] = np.stack([frf_set.frequency_hz, frf_set.frf[:, i, 0]], axis=1)
            file[f"run/C{i}"] = frf_set.coherence[:, i, 0]
    variables = {"frequency_hz": "run/f"}
    for i, output in enumerate(frf_set.outputs):
        pair = f"{output}/{frf_set.inputs[0]}"
        variables |= {pair: f"run/H{i}[:,1]", f"{pair} coherence": f"run/C{i}"}
    assert_same(
        load_frf_set(tmp_path / "x.hdf5", FrfFileOptions(unit="m/s^2/N", variables=variables)), frf_set
    )


@pytest.mark.parametrize(
    ("changes", "options", "found"),
    [
        ({"frf": None}, {}, "no frf"),
        ({"frf": "text"}, {}, "values of type"),
        ({"frequency_hz": None}, {}, "no real frequency_hz"),
        (
            {"frequency_hz": np.arange(6.0)},
            {},
            r"shape \(7, 3, 2\); expected \(lines, outputs, inputs\) = \(6, 3, 2\)",
        ),
        ({"frf": np.zeros((3, 2, 7), complex)}, {}, "bring its axes into this order"),
        ({"outputs": ["1:+X", "2:+X", "1:+X"]}, {}, "outputs: a channel that comes twice"),
        ({"outputs": ["1:+X", "2:+X", "x"]}, {}, "channel 'x'"),
        ({"unit": None}, {}, "gives no unit"),
        ({"quantity": "mobility"}, {}, "quantity mobility with unit"),
        ({"quantity": "impedance"}, {}, "impedance"),
        ({"averages": 4.5}, {}, "averages: 4.5"),
        ({"averages": [4.0, 5.0]}, {}, "one real number"),
        ({}, {"unit": "g/N"}, "the key unit says"),
        ({}, {"outputs": ["9:+X", "2:+X", "1:+X"]}, "a channel that the file does not name"),
        ({}, {"variables": {"frf": "H"}}, "frf should be at 'H', where nothing is"),
        ({}, {"variables": {"FRF": "frf"}}, "unknown name 'FRF'"),
        ({}, {"variables": {"1:+X/2:+X": "frf"}}, r"values of shape \(7, 3, 2\); expected 7"),
        ({}, {"variables": {"frequency_hz": "frf[:,0]"}}, "two dimensions"),
    ],
)
@pytest.mark.parametrize("suffix", [".mat", ".h5"])
def test_what_does_not_fit_is_refused(
    tmp_path: Path, suffix: str, changes: dict[str, Any], options: dict[str, Any], found: str
) -> None:
    path = tmp_path / f"x{suffix}"
    names = {name: value for name, value in (content(some_set()) | changes).items() if value is not None}
    if suffix == ".mat":
        savemat(
            path,
            {
                name: np.array(value, dtype=object)
                if isinstance(value, list) and isinstance(value[0], str)
                else value
                for name, value in names.items()
            },
        )
    else:
        with h5py.File(path, "w") as file:
            for name, value in names.items():
                file[name] = (
                    value.astype(str).tolist()
                    if isinstance(value, np.ndarray) and value.dtype == object
                    else value
                )
    with pytest.raises(InputError, match=found):
        load_frf_set(path, FrfFileOptions.model_validate(options))


@pytest.mark.parametrize("suffix", [".mat", ".h5"])
def test_a_damaged_file_gives_the_same_numbers_or_an_error(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"x{suffix}"
    whole = some_set()
    if suffix == ".mat":
        savemat(path, content(whole))
    else:
        write_hdf5(path, whole)
    raw = path.read_bytes()
    for length in range(0, len(raw) - 1, 131):
        path.write_bytes(raw[:length])
        with pytest.raises(InputError):
            load_frf_set(path)


def test_a_measured_matlab_file_equals_its_universal_file() -> None:
    options: dict[str, str] = {"frequency_hz": "H1_2[:,0]"}
    for output, number in (("101:+Z", 2), ("102:+Z", 3), ("103:-Y", 4)):
        options |= {f"{output}/41:-Z": f"H1_{number}[:,1]", f"{output}/41:-Z coherence": f"C1_{number}[:,1]"}
    read = load_frf_set(
        shared("data", "uliege_aircraft", "DPsv00041.mat"), FrfFileOptions(unit="g/N", variables=options)
    )
    other = load_frf_set(
        shared("data", "uliege_aircraft", "aircraft_converted.uff"), FrfFileOptions(unit="m/s^2/N")
    )
    at = [str(channel) for channel in other.inputs].index("41:-Z")
    np.testing.assert_allclose(read.frf[:, :, 0], other.frf[:, :, at], rtol=1e-12)
    assert read.coherence is not None and 0 <= read.coherence.min() < read.coherence.max() <= 1

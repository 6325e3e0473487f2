"""Matrices and state space come back from SciPy, NumPy, JSON and, where they are there, python-control and
Octave, and have the FRFs of the model.
"""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path
from typing import Any

import control
import numpy as np
import pytest
from scipy.io import loadmat
from scipy.signal import StateSpace

from identify.core.errors import InputError
from identify.export.run import Wanted, run_export
from tests.export.conftest import EFFECTS, Result
from tests.export.model import BAND, LINES, by_solve, error, model_of


def response(a: Any, b: Any, c: Any, d: Any) -> np.ndarray:
    """C (s - A)^-1 B + D at LINES."""
    s = 2j * np.pi * LINES
    return np.array([c @ np.linalg.solve(x * np.eye(len(a)) - a, b) + d for x in s])


def of_rms(found: np.ndarray, right: np.ndarray) -> float:
    """The largest difference over the RMS of each FRF that is no rounding."""
    level = np.sqrt(np.mean(np.abs(right) ** 2, axis=0))
    kept = level > 1e-6 * level.max()
    return float((np.abs(found - right).max(axis=0)[kept] / level[kept]).max())


@pytest.mark.parametrize("name", [name for name in EFFECTS if name != "lossy"])
def test_npz_has_the_frfs_of_the_model(result: Result, tmp_path: Path, name: str) -> None:
    run_export(result(name), Wanted("npz"), tmp_path / "arm.npz")
    model = model_of(result(name))
    right = model.receptance(LINES)
    with np.load(tmp_path / "arm.npz") as found:
        assert not any(array.dtype == object for array in found.values())
        by_matrices = by_solve(found["mass"], found["damping"], found["stiffness"], found["output_map"])
        by_states = response(*(found[key] for key in "ABCD"))
        names, units = found["coordinates"].tolist(), found["coordinate_units"].tolist()
        np.testing.assert_allclose(found["posture_deg"], [13.4, 10.2, -1.9, 8.0, 50.0, 8.4])
        assert found["outputs"].tolist() == [str(channel) for channel in model.channels]
    assert names == list(model.coordinates) and units == list(model.units)
    assert error(by_matrices, right) < 1e-9 and error(by_states, right) < 1e-6


def test_scipy_reads_the_mat(result: Result, tmp_path: Path) -> None:
    run_export(result("plain"), Wanted("mat", error=0.01), tmp_path / "arm.mat")
    found = loadmat(tmp_path / "arm.mat", squeeze_me=True)
    model = model_of(result("plain"))
    system = StateSpace(*(found[key] for key in "ABCD"))
    poles = np.linalg.eigvals(system.A)
    poles = np.sort_complex(poles[poles.imag > 0])
    np.testing.assert_allclose(poles, np.sort_complex(model.modes.eigenvalues), rtol=1e-6)
    assert error(response(system.A, system.B, system.C, system.D), model.receptance(LINES)) < 1e-6
    assert found["outputs"].tolist() == [str(channel) for channel in model.channels]
    reduced = response(*(found[f"{key}_reduced"] for key in "ABCD"))
    assert of_rms(reduced, model.receptance(LINES)) < 1.2 * max(float(found["reduced_error"]), 1e-6)


def test_the_error_of_fewer_states_is_stated_and_kept(result: Result, tmp_path: Path) -> None:
    """Asked for by the error, the fewest modes; by their number, whatever error that leaves."""
    model = model_of(result("rich"))
    asked = run_export(result("rich"), Wanted("statespace", error=0.05, band_hz=BAND), tmp_path / "few.json")
    found = json.loads((tmp_path / "few.json").read_text())
    reduced = response(*(np.array(found[key]) for key in "ABCD"))
    assert of_rms(reduced, model.receptance(LINES)) < 0.05
    assert len(found["A"]) < 2 * len(model.coordinates)
    assert any(
        "reduced to" in note and "the largest error between 3 and 80 Hz" in note for note in asked.notes
    )
    with pytest.raises(InputError, match="1 to"):
        run_export(result("rich"), Wanted("npz", modes=99), tmp_path / "none.npz")


def test_fewer_states_are_exact_at_rest(result: Result, tmp_path: Path) -> None:
    """What the modes that are left out give there is in D."""
    run_export(result("plain"), Wanted("statespace", modes=2), tmp_path / "few.json")
    found = json.loads((tmp_path / "few.json").read_text())
    a, b, c, d = (np.array(found[key]) for key in "ABCD")
    model = model_of(result("plain"))
    right = model.out @ np.linalg.solve(model.stiffness, model.out.T)
    assert len(a) == 4
    np.testing.assert_allclose(d - c @ np.linalg.solve(a, b), right, rtol=0, atol=1e-9 * np.abs(right).max())


def test_what_real_matrices_cannot_say_is_said(result: Result, tmp_path: Path) -> None:
    notes = run_export(result("lossy"), Wanted("npz"), tmp_path / "arm.npz").notes
    assert any("hysteretic damping is made viscous, the same at" in note for note in notes)
    assert any("left out, because it belongs to the measurement: time delay" in note for note in notes)
    with np.load(tmp_path / "arm.npz") as found:
        assert found["stiffness"].dtype == float and found["notes"].tolist() == list(notes)


@pytest.mark.parametrize(("to", "kept"), [("npz", "arm.npz"), ("simscape", "arm.mat")])
def test_a_file_that_exists_is_kept(result: Result, tmp_path: Path, to: str, kept: str) -> None:
    """Also where it is not the first that a format writes."""
    (tmp_path / kept).write_text("mine")
    with pytest.raises(InputError, match="the file exists; expected a new file") as refused:
        run_export(result("plain"), Wanted(to), tmp_path / ("arm.m" if to == "simscape" else "arm.npz"))
    assert kept in refused.value.where
    assert [path.name for path in tmp_path.iterdir()] == [kept] and (tmp_path / kept).read_text() == "mine"


def test_a_file_for_each_posture(result: Result, tmp_path: Path) -> None:
    wanted = Wanted("npz", ["all", "0,30,-60,0,45,0"])
    written = run_export(result("plain"), wanted, tmp_path / "arm.npz").written
    assert [path.name for path in written] == [
        "arm_posture1.npz",
        "arm_posture2.npz",
        "arm_0_30_-60_0_45_0.npz",
    ]
    with np.load(written[0]) as one, np.load(written[2]) as other:
        assert one["mass"].shape == other["mass"].shape and not np.allclose(one["mass"], other["mass"])


@pytest.mark.parametrize(
    ("wanted", "said"),
    [
        (Wanted("excel"), "unknown export format 'excel'; expected one of fmu, mat, mjcf"),
        (Wanted("npz", modes=1, band_hz=(50.0, 5.0)), "--band: 50 to 5 Hz"),
        (Wanted("fmu"), "compiled for each system"),
        (Wanted("uff", modes=3), "expected one of mat, npz, simscape, statespace"),
        (Wanted("mat", ["1,2"]), "6 angles in degrees"),
    ],
)
def test_what_cannot_be_exported_is_refused(
    result: Result, tmp_path: Path, wanted: Wanted, said: str
) -> None:
    with pytest.raises(InputError, match=said):
        run_export(result("plain"), wanted, tmp_path / "x")


@pytest.mark.parametrize("to", ["mat", "npz"])
def test_python_control_takes_it(result: Result, tmp_path: Path, to: str) -> None:
    path = tmp_path / f"arm.{to}"
    run_export(result("plain"), Wanted(to), path)
    found = loadmat(path) if to == "mat" else dict(np.load(path))
    system = control.ss(*(found[key] for key in "ABCD"))
    values = np.moveaxis(system(2j * np.pi * LINES), -1, 0)
    assert error(values, model_of(result("plain")).receptance(LINES)) < 1e-6


@pytest.mark.parametrize("to", ["mat", "simscape"])
def test_octave_reads_it(result: Result, tmp_path: Path, to: str) -> None:
    if shutil.which("octave") is None:
        pytest.skip("GNU Octave is not installed")
    written = run_export(result("plain"), Wanted(to), tmp_path / "arm").written
    load = f"model = load('{written[-1]}');" if to == "mat" else f"run('{written[0]}');"
    line = float(LINES[7])
    code = (
        f"{load} s = 2j * pi * {line!r}; h = model.C * ((s * eye(size(model.A)) - model.A) \\ model.B);"
        "printf('%.15g %.15g %s', real(h(6, 4)), imag(h(6, 4)), model.outputs{6});"
    )
    done = subprocess.run(["octave", "--quiet", "--eval", code], capture_output=True, text=True, check=True)
    real, imaginary, name = done.stdout.split()
    model = model_of(result("plain"))
    right = model.receptance(LINES)[7, 5, 3]
    assert complex(float(real), float(imaginary)) == pytest.approx(right, rel=1e-6)
    assert name == str(model.channels[5])

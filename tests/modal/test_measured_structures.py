"""Modes of measured structures beside what others found on the same data; every setting but the band is the
default.
"""

from __future__ import annotations

import io
import tarfile
from dataclasses import replace

import numpy as np
import pytest
from scipy.io import loadmat

from identify.measured.channel import Channel
from identify.measured.frf_records import FrfFileOptions
from identify.measured.frf_set import FrfSet
from identify.measured.loaders import load_frf_set
from identify.measured.modal_tables import ModalTable
from identify.modal.analysis import ModalAnalysis, analyse, synthesis_error
from identify.modal.layout import arrange
from identify.modal.lsfd import lsfd, synthesise
from identify.modal.mac import mpc
from identify.modal.pairing import pair
from identify.modal.settings import ModalSettings
from tests.shared import shared

AIRCRAFT_HZ = [
    18.841,
    40.180,
    87.740,
    89.630,
    97.533,
    105.187,
    117.910,
    125.196,
    125.692,
    129.753,
    135.120,
    143.370,
    166.270,
]
AIRCRAFT_PERCENT = [0.360, 0.273, 0.509, 0.363, 0.132, 0.128, 0.481, 0.380, 0.398, 0.743, 0.873, 0.640, 0.104]
"""The course authors' poly-reference picks (SOURCE.md of the data); damping good to about 30 %."""

BEAM_HZ, BEAM_PERCENT = [111.99, 306.86, 596.37, 974.14], [0.0144, 0.0121, 0.0099, 0.0102]
STANDARD_GRAVITY = 9.80665


def reference(frequency_hz: list[float], percent: list[float]) -> ModalTable:
    return ModalTable(np.array(frequency_hz), np.array(percent) / 100)


def aircraft(frf: np.ndarray, frequency_hz: np.ndarray, inputs: tuple[Channel, ...]) -> FrfSet:
    """FRFs (lines, outputs, inputs) in g/N of the three accelerometers, which are points of their own."""
    accelerometers = (Channel(101, 3), Channel(102, 3), Channel(103, -2))
    return FrfSet(
        frequency_hz,
        frf.astype(complex) * STANDARD_GRAVITY,
        accelerometers,
        inputs,
        "accelerance",
        source="aircraft",
    )


def impacts() -> tuple[Channel, ...]:
    rows = np.loadtxt(shared("data", "uliege_aircraft", "impact_dofs.csv"), delimiter=",", skiprows=1)
    return tuple(Channel(int(row[0]), int(np.sum(row[4:] * [1, 2, 3]))) for row in rows)


@pytest.fixture(scope="module")
def arrays() -> FrfSet:
    kept = np.load(shared("data", "uliege_aircraft", "frf_g_per_N.npz"))
    return aircraft(kept["H"].transpose(2, 1, 0), kept["f_hz"], impacts())


@pytest.fixture(scope="module")
def from_arrays(arrays: FrfSet) -> ModalAnalysis:
    """Of the first and the last accelerometer, which see every mode; all three take five times as long."""
    two = replace(arrays, frf=arrays.frf[:, ::2], outputs=arrays.outputs[::2])
    return analyse(two, ModalSettings(band_hz=(10, 170)))


def test_aircraft_all_reference_modes_and_at_most_five_more(from_arrays: ModalAnalysis) -> None:
    found = pair(reference(AIRCRAFT_HZ, AIRCRAFT_PERCENT), from_arrays.table)
    assert len(found) == 13
    assert np.max(np.abs(found.frequency_error)) < 0.003
    assert np.sum(np.abs(found.damping_error) < 0.3) >= 10
    assert len(found.unpaired_b) <= 5
    assert from_arrays.total_error < 0.2
    assert np.nanmedian(synthesis_error(from_arrays.layout.frf, from_arrays.synthesised)[0]) < 0.2


def local_error(found: ModalAnalysis, frf: np.ndarray, pole: complex) -> float:
    """Error of rebuilt FRFs over the measured ones within two half-bandwidths (at least 2 lines) of a
    pole.
    """
    near = np.abs(found.layout.frequency_hz - abs(pole) / 2 / np.pi) < max(-pole.real / np.pi, 0.25)
    return float(np.linalg.norm((found.layout.frf - frf)[near]) / np.linalg.norm(found.layout.frf[near]))


def test_aircraft_rebuilding_without_a_reference_mode_misses_it(from_arrays: ModalAnalysis) -> None:
    layout, model = from_arrays.layout, from_arrays.model
    for r in pair(reference(AIRCRAFT_HZ, AIRCRAFT_PERCENT), from_arrays.table).b:
        poles, participation = np.delete(model.poles, r), np.delete(model.participation, r, axis=0)
        without = synthesise(lsfd(layout, poles, participation, ("lower", "upper")), layout.s, layout.power)
        error = local_error(from_arrays, from_arrays.synthesised, model.poles[r])
        assert error < 0.6
        assert local_error(from_arrays, without, model.poles[r]) > 1.25 * error, (
            abs(model.poles[r]) / 2 / np.pi
        )
        assert mpc(from_arrays.table.shapes)[r] > 0.9


def test_aircraft_from_the_universal_file_is_the_same(arrays: FrfSet) -> None:
    """The FRFs that are analysed, so that all that follows is."""
    settings = ModalSettings(band_hz=(10, 170))
    data = load_frf_set(
        shared("data", "uliege_aircraft", "aircraft_converted.uff"), FrfFileOptions(unit="m/s^2/N")
    )
    layout, expected = arrange(data, settings), arrange(arrays, settings)
    assert layout.responses == expected.responses
    np.testing.assert_allclose(layout.frequency_hz, expected.frequency_hz, rtol=1e-6)
    np.testing.assert_allclose(layout.frf, expected.frf, atol=1e-4 * np.abs(expected.frf).max())
    assert np.abs(layout.frf - expected.frf[::-1]).max() > 0.1 * np.abs(expected.frf).max()


def test_aircraft_from_two_original_files_alone() -> None:
    files = [loadmat(shared("data", "uliege_aircraft", f"DPsv000{number}.mat")) for number in (41, 74)]
    frf = np.array([[file[f"H1_{sensor}"][:, 1] for file in files] for sensor in (2, 3, 4)]).transpose(
        2, 0, 1
    )
    frequency = files[0]["H1_2"][:, 0].real
    table = analyse(
        aircraft(frf, frequency, (Channel(41, -3), Channel(74, 2))), ModalSettings(band_hz=(10, 170))
    ).table
    found = pair(reference(AIRCRAFT_HZ, AIRCRAFT_PERCENT), table)
    assert np.sum(np.abs(found.frequency_error) < 0.003) >= 12
    assert len(found.unpaired_b) <= 5


def beam() -> FrfSet:
    """Nine hammer points and one accelerometer from the ASCII files in the archive."""
    spectra = []
    with tarfile.open(shared("data", "modelab_beam", "SignalCalc_Hxysv_1-9.tar.gz")) as archive:
        for number in range(1, 10):
            file = archive.extractfile(f"./H{number}.txt")
            assert file is not None
            spectra.append(np.loadtxt(io.StringIO(file.read().decode("latin-1")), skiprows=9))
    frf = np.stack([spectrum[:, 1] + 1j * spectrum[:, 2] for spectrum in spectra], axis=1)[:, None, :]
    return FrfSet(
        spectra[0][:, 0],
        frf,
        (Channel(4, -1),),
        tuple(Channel(n, 1) for n in range(1, 10)),
        "accelerance",
        source="beam",
    )


def test_beam_with_a_ten_thousandth_of_damping() -> None:
    found = analyse(beam(), ModalSettings(band_hz=(65, 1000)))
    paired = pair(reference(BEAM_HZ, BEAM_PERCENT), found.table)
    assert len(paired) == 4
    assert np.max(np.abs(paired.frequency_error)) < 1e-4
    assert np.max(np.abs(paired.damping_error)) < 0.1
    assert len(paired.unpaired_b) == 0
    assert len(found.layout.frequency_hz) > 47_000


def test_three_accelerances_peak_where_they_peak() -> None:
    paths = [shared("data", "pyuff_measured_uff", f"meas_point_{point}.txt") for point in (1, 2, 3)]
    frf = np.array([[complex(line) for line in path.read_text().split()] for path in paths]).T
    sensors = tuple(Channel(point, 3) for point in (1, 2, 3))
    found = analyse(
        FrfSet(np.arange(1001.0), frf[:, :, None], sensors, (Channel(4, 3),), "accelerance"),
        ModalSettings(band_hz=(10, 1000)),
    )
    for peak in (52, 142, 279, 460, 687, 959):
        assert np.min(np.abs(found.table.frequency_hz - peak)) < 1, peak
    assert len(found.table) <= 7
    assert found.total_error < 0.05

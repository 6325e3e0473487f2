"""`identify modes --output-only`: responses of a milling structure of known modes in, its modes out, no
harmonic among them; files of every format; what is refused.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from scipy.io import savemat
from typer.testing import CliRunner

from identify.cli import app
from identify.measured.channel import Channel
from identify.measured.time_history import TimeHistory
from identify.modal.mac import mac
from identify.modal.operational.analysis import OperationalModes, analyse
from identify.modal.operational.settings import OperationalSettings
from identify.modal.settings import ModalSettings
from identify.modes.compare_shapes import read_modes
from identify.results import file as result_file
from identify.results.modes import ModesResult
from tests.generator.linear import Linear
from tests.generator.working import Work, cutting, recorded, truth

HZ, DAMPING = np.array([9.0, 17.0, 26.0, 38.0]), np.array([0.03, 0.02, 0.025, 0.02])
SHAPES = np.array(
    [[1.0, 2.0, 3.0, 4.0], [1.0, 1.5, 0.2, -1.6], [2.0, -0.5, -0.8, 0.9], [1.0, -2.0, 1.5, -1.0]]
)
WORK = Work(rate_hz=128.0, seconds=240.0, rpm=780.0, teeth=2, wander=3e-4, pulses=1.5)
"""13 Hz of the spindle: its third and second multiples are near the third and fourth mode."""
BAND = (4.0, 50.0)
LOW = ModalSettings(band_hz=BAND, max_order=40)
"""Of lower orders than by default, in less than half the time."""
NAMES = ("1:+Z", "2:+Z", "3:+Z", "4:+Z")


def structure() -> Linear:
    """Four sensors on a structure of four modes, pushed at three of them."""
    omega = 2 * np.pi * HZ
    lower = np.hstack([-np.diag(omega**2), -np.diag(2 * DAMPING * omega)])
    a = np.vstack([np.eye(4, 8, 4), lower])
    push = SHAPES[:, :3]
    b = np.vstack([np.zeros((4, 3)), push])
    return Linear(a, b, SHAPES.T @ lower, SHAPES.T @ push)


def records(work: Work = WORK, seed: int = 5) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return recorded([(structure(), cutting(work, rng))], work, rng)


def history(values: np.ndarray, units: tuple[str, ...] = ("m/s^2",) * 4) -> TimeHistory:
    return TimeHistory(WORK.rate_hz, values[None], tuple(map(Channel.parse, NAMES)), units, source="milling")


@pytest.fixture(scope="module")
def values() -> np.ndarray:
    return records()


@pytest.fixture(scope="module")
def found(values: np.ndarray) -> OperationalModes:
    return analyse(history(values), OperationalSettings(speeds_rpm=(WORK.rpm,)), ModalSettings(band_hz=BAND))


def csv(path: Path, values: np.ndarray, unit: str = "m/s^2") -> Path:
    head = "time_s," + ",".join(f"{name} [{unit}]" for name in NAMES[: values.shape[1]])
    table = np.column_stack([np.arange(len(values)) / WORK.rate_hz, values])
    np.savetxt(path, table, delimiter=",", header=head, comments="", fmt="%.9g")
    return path


def invoke(*arguments: object) -> Any:
    return CliRunner().invoke(app, ["modes", *map(str, arguments), "--output-only", "--no-report"])


def refusal(*arguments: object) -> str:
    done = CliRunner().invoke(app, ["modes", *map(str, arguments)])
    assert done.exit_code != 0
    return str(done.exception)


def test_modes_of_a_milling_structure_and_no_harmonic(found: OperationalModes) -> None:
    poles, shapes = truth(structure())
    assert len(found.frequency_hz) == len(HZ)
    assert np.abs(found.frequency_hz / (np.abs(poles) / (2 * np.pi)) - 1).max() < 0.01
    assert np.abs(found.damping_ratio / DAMPING - 1).max() < 0.2
    assert np.diag(mac(found.shapes, shapes)).min() > 0.98


def test_multiples_of_the_speed_are_found_and_named(found: OperationalModes) -> None:
    assert {tone.multiple for tone in found.tones} == {1, 2, 3}


def test_tones_are_found_without_a_speed(values: np.ndarray) -> None:
    alone = analyse(history(values), OperationalSettings(), LOW)
    assert len(alone.frequency_hz) == len(HZ)
    near = [round(tone.frequency_hz / 13) for tone in alone.tones]
    assert near == [1, 2, 3]


def test_noise_alone_has_no_tone() -> None:
    quiet = analyse(history(records(replace(WORK, pulses=0.0))), OperationalSettings(), LOW)
    assert quiet.tones == ()


@pytest.mark.parametrize("count", [4, pytest.param(16, marks=pytest.mark.exam)])
def test_intervals_are_as_wide_as_the_scatter_over_records(found: OperationalModes, count: int) -> None:
    """Errors over many records are those promised; twice as long a record would promise less."""
    wanted = OperationalSettings(), LOW
    short = replace(WORK, seconds=120.0, pulses=0.0)
    runs = [analyse(history(records(short, seed)), *wanted) for seed in range(count)]
    z = np.concatenate([(run.frequency_hz - HZ) / run.scatter.frequency_hz for run in runs])
    assert 0.5 < np.sqrt(np.mean(z**2)) < 1.6
    assert np.mean(np.abs(z) < 1.96) > 0.85


def test_displacement_shapes_whatever_was_measured(found: OperationalModes, values: np.ndarray) -> None:
    """One sensor measures velocity: its record is the integral, its part of the shapes the same."""
    spectrum = np.fft.rfft(values[:, 3])
    s = 2j * np.pi * np.fft.rfftfreq(len(values), 1 / WORK.rate_hz)
    spectrum[1:] /= s[1:]
    mixed = np.column_stack([values[:, :3], np.fft.irfft(spectrum, len(values))])
    units = ("m/s^2",) * 3 + ("m/s",)
    again = analyse(history(mixed, units), OperationalSettings(speeds_rpm=(WORK.rpm,)), LOW)
    assert np.abs(again.shapes - found.shapes).max() < 0.1
    wrong = analyse(history(mixed), OperationalSettings(speeds_rpm=(WORK.rpm,)), LOW)
    assert np.abs(wrong.shapes - found.shapes).max() > 0.3


def test_by_hand(values: np.ndarray) -> None:
    settings = ModalSettings(band_hz=BAND, max_order=40, drop_hz=(17.0,))
    dropped = analyse(history(values), OperationalSettings(), settings)
    assert np.abs(dropped.frequency_hz - 17).min() > 5
    assert "dropped by hand" in [one.reason for one in dropped.rejected]


def test_the_command_writes_what_modes_writes(tmp_path: Path, values: np.ndarray) -> None:
    data, out = csv(tmp_path / "mill.csv", values), tmp_path / "mill.h5"
    done = invoke(data, "--band", *BAND, "--max-order", 40, "--speed", WORK.rpm, "--teeth", 2, "--out", out)
    assert done.exit_code == 0, done.output
    said = " ".join(done.output.split())
    assert "1 x the tooth passing at 26 Hz" in said
    assert "there is no modal mass" in said
    assert [path.suffix for path in sorted(tmp_path.iterdir())] == [".csv", ".h5", ".uff", ".yaml"]
    (kept,) = result_file.read(out, ModesResult).measurements.values()
    assert kept.output_only is not None
    assert kept.output_only.shape_std.shape == (4, 4)
    assert kept.frf.quantity == "half spectrum"
    assert read_modes(out).frequency_hz == pytest.approx(HZ, rel=0.01)
    compared = CliRunner().invoke(app, ["mac", str(out), str(tmp_path / "mill.yaml")])
    assert compared.exit_code == 0
    assert "4 channels in common" in compared.output


@pytest.mark.parametrize("kind", ["h5", "mat"])
def test_arrays_give_the_same(tmp_path: Path, values: np.ndarray, found: OperationalModes, kind: str) -> None:
    data, time_s = tmp_path / f"mill.{kind}", np.arange(len(values)) / WORK.rate_hz
    if kind == "h5":
        with h5py.File(data, "w") as file:
            file["acc"], file["time_s"] = values, time_s
    else:
        savemat(data, {"acc": values, "time_s": time_s})
    given = ["--variable", "responses=acc", "--outputs", ",".join(NAMES), "--unit", "m/s^2"]
    done = invoke(data, *given, "--band", *BAND, "--speed", WORK.rpm, "--out", tmp_path / "out.h5")
    assert done.exit_code == 0, done.output
    assert read_modes(tmp_path / "out.h5").frequency_hz == pytest.approx(found.frequency_hz, rel=1e-6)
    assert "no unit" in str(invoke(data, *given[:4], "--out", tmp_path / "other.h5").exception)


def test_refusals(tmp_path: Path) -> None:
    values = records(replace(WORK, seconds=60.0))

    def said(name: str, content: np.ndarray, *options: object, unit: str = "m/s^2") -> str:
        return refusal(csv(tmp_path / name, content, unit), "--output-only", *options)

    assert "1 response record" in said("one.csv", values[:, :1])
    assert "a record of 7.8" in said("short.csv", values[:1000], "--band", 4, 50)
    assert "a record of 60" in said("weak.csv", values, "--band", 4, 50, "--damping", 0.001)
    assert "stays the same" in said("still.csv", values * [1, 1, 0, 1])
    assert "parsec" in said("unit.csv", values, unit="parsec")
    assert "a band up to 64 Hz" in said("band.csv", values, "--band", 4, 64)
    assert "for columns that say theirs" in said("twice.csv", values, "--unit", "g")
    assert "--averages" in said("averages.csv", values, "--averages", 4)
    assert "--frfs" in said("frfs.csv", values, "--frfs")
    assert "teeth with 0 speeds" in said("teeth.csv", values, "--teeth", 2)
    whole = csv(tmp_path / "whole.csv", values)
    text = whole.read_text()
    whole.write_text(text.replace("time_s", "second"))
    assert "time_s and signals" in refusal(whole, "--output-only")
    assert "--speed" in refusal(whole, "--speed", 900)
    assert not list(tmp_path.glob("*.h5"))

"""Records from every kind of file are the same record; what does not fit is refused in a sentence;
conditioning keeps its promises.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
import pyuff
from numpy.typing import NDArray
from scipy.io import savemat

from identify.core.errors import InputError
from identify.measured.conditioning import condition
from identify.measured.records import MotionRecord, Quantity, SignalSettings, TimeAxis, read_record

RATE, JOINTS = 200.0, 2
TIME = np.arange(400) / RATE
DEGREES = np.stack([20 * np.sin(2 * TIME), 10 * np.cos(3 * TIME)], axis=1)
TORQUE = np.stack([np.sin(5 * TIME), np.cos(7 * TIME)], axis=1)
ZERO = np.radians([5.0, -40.0])
Signals = dict[Quantity, SignalSettings]


def _read(path: Path, signals: Signals, time: TimeAxis | float = RATE) -> MotionRecord:
    return read_record(path, "r", signals, time, JOINTS, ZERO)


def _csv(folder: Path) -> tuple[Path, Signals, TimeAxis | float]:
    path = folder / "r.csv"
    table = np.column_stack([1e3 * TIME, DEGREES, TORQUE])
    np.savetxt(path, table, delimiter=",", header="t,q1,q2,m1,m2", comments="", fmt="%.15g")
    return path, _signals("q{joint}", "m{joint}"), TimeAxis(at="t", unit="ms")


def _mat(folder: Path) -> tuple[Path, Signals, TimeAxis | float]:
    savemat(folder / "r.mat", {"rec": {"t": TIME, "q": DEGREES.T, "m": TORQUE.T}})
    return folder / "r.mat", _signals("rec.q", "rec.m"), TimeAxis(at="rec.t")


def _hdf5(folder: Path) -> tuple[Path, Signals, TimeAxis | float]:
    with h5py.File(folder / "r.h5", "w") as file:
        file["run/q"], file["run/m"] = DEGREES, TORQUE
    return folder / "r.h5", _signals("run/q", "run/m"), RATE


def _uff(folder: Path) -> tuple[Path, Signals, TimeAxis | float]:
    path = folder / "r.uff"
    sets = []
    for values, unit, code in ((DEGREES, "deg", 8), (TORQUE, "N m", 9)):
        for joint in range(JOINTS):
            sets.append(
                {
                    "type": 58,
                    "func_type": 1,
                    "rsp_node": joint + 1,
                    "rsp_dir": 6,
                    "ref_node": 0,
                    "ref_dir": 0,
                    "data": values[:, joint],
                    "x": TIME,
                    "abscissa_spec_data_type": 17,
                    "abscissa_axis_units_lab": "s",
                    "ordinate_spec_data_type": code,
                    "orddenom_spec_data_type": 0,
                    "ordinate_axis_units_lab": unit,
                    "binary": 0,
                    "version_num": 0,
                }
            )
    pyuff.UFF(str(path)).write_sets(sets, "overwrite")
    return path, _signals("{joint}:+RZ", "{joint}:+RZ"), TimeAxis(at="time")


def _signals(position: str, torque: str) -> Signals:
    return {
        "motor_position": SignalSettings(at=position, unit="deg"),
        "motor_torque": SignalSettings(at=torque, unit="N m"),
    }


@pytest.mark.parametrize("written", [_csv, _mat, _hdf5, _uff])
def test_every_format_gives_the_same_record(written: object, tmp_path: Path) -> None:
    found = _read(*written(tmp_path))  # type: ignore[operator]
    assert found.sample_rate_hz == pytest.approx(RATE, rel=1e-5)
    np.testing.assert_allclose(found.signals["motor_position"], np.radians(DEGREES) + ZERO, rtol=0, atol=1e-5)
    np.testing.assert_allclose(found.signals["motor_torque"], TORQUE, atol=1e-4)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"at": "nothing"}, "nothing of that name"),
        ({"unit": "m"}, "a unit of the kind of rad"),
        ({"unit": "A"}, "rad"),
        ({"at": "t"}, "one side of 2"),
    ],
)
def test_what_does_not_fit_is_refused(change: dict[str, str], said: str, tmp_path: Path) -> None:
    path, _, time = _csv(tmp_path)
    settings = {"at": "q{joint}", "unit": "deg", **change}
    with pytest.raises(InputError, match=said):
        _read(path, {"motor_position": SignalSettings(**settings)}, time)


def test_missing_files_and_joints(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="put the data there"):
        _read(tmp_path / "absent.csv", _signals("q{joint}", "m{joint}"))
    path, signals, time = _csv(tmp_path)
    half = {**signals, "link_position": SignalSettings(at="q{joint}", unit="deg", joints=[2])}
    link = _read(path, half, time).signals["link_position"]
    assert np.isnan(link[:, 0]).all()
    assert np.isfinite(link[:, 1]).all()


def _record(noise: float = 0.0, current: bool = False) -> MotionRecord:
    rng = np.random.default_rng(0)
    position = np.radians(DEGREES) + rng.normal(scale=noise, size=DEGREES.shape)
    return MotionRecord(
        "r",
        RATE,
        TIME,
        {"motor_position": position, "motor_current" if current else "motor_torque": TORQUE},
        "r.csv",
        "",
    )


def _exact() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    speed = np.radians(np.stack([40 * np.cos(2 * TIME), -30 * np.sin(3 * TIME)], axis=1))
    return speed, np.radians(np.stack([-80 * np.sin(2 * TIME), -90 * np.cos(3 * TIME)], axis=1))


def test_derivatives_are_those_of_the_motion() -> None:
    found, (speed, acceleration) = condition(_record(), 20.0), _exact()
    np.testing.assert_allclose(found.velocity[found.inside], speed[found.inside], atol=2e-3)
    inner = slice(60, -60)
    np.testing.assert_allclose(found.acceleration[inner], acceleration[inner], atol=2e-2)
    assert any("20 Hz" in sentence for sentence in found.said)


def test_resampling_says_so_and_keeps_the_signal() -> None:
    found = condition(_record(), 10.0, resample_hz=80.0)
    assert found.sample_rate_hz == 80.0
    expected = np.radians(20 * np.sin(2 * found.time_s))
    np.testing.assert_allclose(found.position[10:-10, 0], expected[10:-10], atol=1e-5)
    assert "resampled from 200 to 80 Hz" in found.said[0]
    assert "low-pass" in found.said[0]


def test_currents_need_their_constant() -> None:
    assert np.allclose(
        condition(_record(current=True), 20.0, torque_constant=np.array([2.0, 3.0])).torque,
        TORQUE * [2.0, 3.0],
    )
    with pytest.raises(InputError, match="torque_constant_nm_per_a"):
        condition(_record(current=True), 20.0)
    with pytest.raises(InputError, match="below 100 Hz"):
        condition(_record(), 100.0)


@pytest.mark.parametrize("samples", [3, 15, 20])
def test_a_record_that_is_too_short_for_its_filter_is_refused(samples: int) -> None:
    whole = _record()
    signals = {name: values[:samples] for name, values in whole.signals.items()}
    short = replace(whole, time_s=whole.time_s[:samples], signals=signals)
    with pytest.raises(InputError, match=rf"{samples} samples at .* more than .* record longer"):
        condition(short, 20.0)
    with pytest.raises(InputError, match=r"samples at .* record longer"):
        condition(short, 20.0, resample_hz=80.0)


def test_a_recorded_number_of_no_size_is_refused(tmp_path: Path) -> None:
    """Its square is no number, and everything alike then."""
    path, signals, time = _csv(tmp_path)
    lines = path.read_text().splitlines()
    lines[50] = lines[50].rpartition(",")[0] + ",1e300"
    path.write_text("\n".join(lines))
    with pytest.raises(InputError, match=r"m2: values that are not finite, or beyond 1e\+30, at sample 49"):
        _read(path, signals, time)


def test_the_columns_of_a_table_are_named_where_one_is_missing(tmp_path: Path) -> None:
    path, _, time = _csv(tmp_path)
    with pytest.raises(InputError, match=r"p1: nothing .* a column, such as t, q1, q2, m1; correct"):
        _read(path, _signals("p{joint}", "m{joint}"), time)

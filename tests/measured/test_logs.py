"""FRFs from logs of controllers: local polynomials, periods, held torques, and the files they come in."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
import scipy

from identify.core.errors import InputError
from identify.measured import record_files
from identify.measured.channel import Channel
from identify.measured.frf_records import FrfFileOptions
from identify.measured.frf_set import FrfSet
from identify.measured.log_file import read_log
from identify.measured.periodic import frf_from_periods, frf_local_polynomial
from identify.measured.source import Estimation, read_source, unheld
from identify.measured.time_history import TimeHistory

RATE, SAMPLES = 500.0, 10_000
MOTOR, REFERENCE = Channel.parse("joint2:motor"), Channel.parse("joint2:reference")
PLANT = scipy.signal.ZerosPolesGain([], [-3 + 90j, -3 - 90j], 8e3)
"""A resonance at 14 Hz, 3.3 % of critical damping."""


def _sampled() -> tuple[np.ndarray, np.ndarray]:
    """What holding between samples makes of the plant: numerator and denominator in z."""
    numerator, denominator, _ = scipy.signal.cont2discrete(
        (np.poly([]) * PLANT.gain, np.poly(PLANT.poles)), 1 / RATE
    )
    return np.ravel(numerator), denominator


def _at(frequency_hz: np.ndarray) -> np.ndarray:
    """FRF of the sampled plant."""
    return scipy.signal.freqz(*_sampled(), worN=2 * np.pi * frequency_hz / RATE)[1]


def _history(columns: Sequence[np.ndarray], channels: Sequence[Channel], units: Sequence[str]) -> TimeHistory:
    return TimeHistory(
        RATE, np.stack(columns, axis=-1).reshape(-1, SAMPLES, len(columns)), tuple(channels), tuple(units)
    )


def _scores(found: FrfSet, band: tuple[float, float] = (1.0, 100.0)) -> np.ndarray:
    """Errors over noise, whose mean square is 1."""
    own = found.band(*band)
    assert own.noise is not None
    return (own.frf[:, 0, 0] - _at(own.frequency_hz)) / own.noise[:, 0, 0] / np.sqrt(2)


@pytest.mark.parametrize("blocks", [1, 3])
def test_local_polynomials_know_the_frf_and_its_noise(blocks: int) -> None:
    """Records that begin in the middle of a motion, with noise of the response: errors are as large as
    stated, and alike in no two lines.
    """
    rng = np.random.default_rng(blocks)
    torque = rng.normal(size=(blocks, SAMPLES + 300))
    angle = scipy.signal.lfilter(*_sampled(), torque, axis=1)
    noisy = angle + 0.02 * angle.std() * rng.normal(size=angle.shape)
    told = [torque[:, 300:], noisy[:, 300:]]
    found = frf_local_polynomial(_history(told, [MOTOR, MOTOR], ["N m", "rad"]))
    assert found.quantity == "receptance" and found.outputs == found.inputs == (MOTOR,)
    scores = _scores(found)
    assert np.sqrt(np.mean(np.abs(scores) ** 2)) == pytest.approx(1, abs=0.15)
    assert abs(np.mean(scores[1:] * scores[:-1].conj())) < 0.25
    plain = np.fft.rfft(told[1])[:, 50:400] / np.fft.rfft(told[0])[:, 50:400]
    line = np.arange(50, 400) * RATE / SAMPLES
    worse = np.median(np.abs(plain[0] / _at(line) - 1))
    near = found.band(line[0], line[-1])
    assert np.median(np.abs(near.frf[:, 0, 0] / _at(near.frequency_hz) - 1)) < 0.7 * worse


def _looped(seed: int) -> list[np.ndarray]:
    """Torque, angle and reference of a loop that feeds the noise of the angle back."""
    rng = np.random.default_rng(seed)
    reference, noise = rng.normal(size=SAMPLES), rng.normal(size=SAMPLES)
    numerator, denominator = _sampled()
    torque, angle, seen = np.zeros(SAMPLES), np.zeros(SAMPLES), np.zeros(SAMPLES)
    order = len(denominator) - 1
    for k in range(SAMPLES):
        past = range(1, min(order, k) + 1)
        angle[k] = sum(numerator[n] * torque[k - n] - denominator[n] * angle[k - n] for n in past)
        seen[k] = angle[k] + 2.0 * noise[k]
        torque[k] = reference[k] - 0.4 * seen[k]
    return [torque, seen, reference]


def test_the_reference_takes_the_bias_of_a_loop_away() -> None:
    data = _looped(1)
    channels, units = [MOTOR, MOTOR, REFERENCE], ["N m", "rad", "N m"]
    right = frf_local_polynomial(_history(data, channels, units))
    assert right.inputs == (MOTOR,)
    off = _scores(right, (2.0, 60.0))
    assert np.sqrt(np.mean(np.abs(off) ** 2)) == pytest.approx(1, abs=0.2)
    below = _scores(right, (1.0, 10.0))
    assert np.sqrt(np.mean(np.abs(below) ** 2)) == pytest.approx(1, abs=0.4), "where the loop is strong"
    plain = frf_local_polynomial(_history(data[:2], channels[:2], units[:2]))
    assert np.sqrt(np.mean(np.abs(_scores(plain, (2.0, 60.0))) ** 2)) > 1.7


def test_two_torques_at_once_are_told_apart() -> None:
    rng = np.random.default_rng(5)
    other = Channel.parse("joint3:motor")
    torques = rng.normal(size=(2, SAMPLES))
    angle = scipy.signal.lfilter(*_sampled(), torques[0]) + 3.0 * torques[1]
    angle += 0.01 * angle.std() * rng.normal(size=SAMPLES)
    history = _history([torques[0], torques[1], angle], [MOTOR, other, MOTOR], ["N m", "N m", "rad"])
    found = frf_local_polynomial(history)
    assert found.inputs == (MOTOR, other)
    assert np.sqrt(np.mean(np.abs(_scores(found)) ** 2)) == pytest.approx(1, abs=0.2)
    assert np.median(found.frf[:, 0, 1].real) == pytest.approx(3.0, rel=0.02)


def test_periods_know_the_frf_and_its_noise_in_a_loop_too() -> None:
    """A multisine of every tenth line repeats 20 times; noise of torque and angle averages out of both."""
    rng, size = np.random.default_rng(3), SAMPLES // 20
    spectrum = np.zeros(size // 2 + 1, dtype=complex)
    spectrum[2:120:2] = np.exp(2j * np.pi * rng.uniform(size=59))
    torque = np.tile(np.fft.irfft(spectrum, size), 20) * size / 10
    angle = scipy.signal.lfilter(*_sampled(), torque)
    back = 0.1 * torque.std() * rng.normal(size=SAMPLES)
    data = [
        torque + back,
        angle + scipy.signal.lfilter(*_sampled(), back) + 0.02 * angle.std() * rng.normal(size=SAMPLES),
    ]
    history = _history(data, [MOTOR, MOTOR], ["N m", "rad"])
    found = frf_from_periods(history, size / RATE)
    assert found.frequency_hz == pytest.approx(np.arange(2, 120, 2) * RATE / size), "excited lines alone"
    off = np.sqrt(np.mean(np.abs(_scores(found, (2.0, 90.0))) ** 2))
    assert off == pytest.approx(1, abs=0.35)
    with pytest.raises(InputError, match="a whole number"):
        frf_from_periods(history, 1.0003)
    with pytest.raises(InputError, match="3 or more"):
        frf_from_periods(history, 10.0)
    noise = [rng.normal(size=SAMPLES), angle]
    with pytest.raises(InputError, match="a periodic force"):
        frf_from_periods(_history(noise, [MOTOR, MOTOR], ["N m", "rad"]), size / RATE)


@pytest.mark.parametrize(("quantity", "power"), [("receptance", 0), ("mobility", 1)])
def test_what_the_hold_makes_of_a_drive_is_taken_out(quantity: str, power: int) -> None:
    """Two inertias and a spring, exactly sampled: far less is left than of the FRFs as they are."""
    a = np.array([[0, 0, 1, 0], [0, 0, 0, 1], [-6e3, 6e3, -9, 5], [4e3, -4e3, 4, -4.0]])
    b, c = np.array([[0], [0], [0.8], [0]]), np.eye(4)[[2 * power]]
    ad, bd, cd, dd, _ = scipy.signal.cont2discrete((a, b, c, np.zeros((1, 1))), 1 / RATE)
    hz = np.linspace(3.0, 120.0, 200)
    s, z = 2j * np.pi * hz, np.exp(2j * np.pi * hz / RATE)

    def response(at: np.ndarray, m: np.ndarray, n: np.ndarray, p: np.ndarray) -> np.ndarray:
        return np.array([(p @ np.linalg.solve(one * np.eye(4) - m, n))[0, 0] for one in at])

    true, sampled = response(s, a, b, c), response(z, ad, bd, cd) + dd[0, 0]
    given = FrfSet(hz, sampled[:, None, None], (MOTOR,), (MOTOR,), quantity)  # type: ignore[arg-type]
    left = np.abs(unheld(given, RATE).frf[:, 0, 0] / true - 1)
    assert np.median(left) < 2e-3
    assert left.max() < 0.03
    assert np.median(np.abs(sampled / true - 1)) > 0.3
    apart = FrfSet(hz, sampled[:, None, None], (Channel(1, 6),), (MOTOR,), quantity)  # type: ignore[arg-type]
    assert not np.allclose(unheld(apart, RATE).frf, unheld(given, RATE).frf, rtol=1e-3)


NAMES = {"time_s": "t", "joint2:motor [N m]": "tau[:,1]", "joint2:motor [deg]": "q[:,1]"}


def _log(rows: int = 400) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(2)
    return np.arange(rows) / RATE, rng.normal(size=(rows, 3)), rng.normal(size=(rows, 3))


def test_a_log_is_read_by_the_names_of_its_signals(tmp_path: Path) -> None:
    t, tau, q = _log()
    scipy.io.savemat(tmp_path / "log.mat", {"t": t, "tau": tau, "q": q})
    found = read_log(tmp_path / "log.mat", NAMES, None)
    assert found.sample_rate_hz == pytest.approx(RATE)
    assert found.channels == (MOTOR, MOTOR) and found.units == ("N m", "rad")
    assert found.data[0, :, 0] == pytest.approx(tau[:, 1])
    assert found.data[0, :, 1] == pytest.approx(np.radians(q[:, 1]))
    without = {key: name for key, name in NAMES.items() if key != "time_s"}
    assert read_log(tmp_path / "log.mat", without, RATE).data == pytest.approx(found.data)
    with pytest.raises(InputError, match="no times"):
        read_log(tmp_path / "log.mat", without, None)
    with pytest.raises(InputError, match=r"one column; name it, such as tau\[:,0\]"):
        read_log(tmp_path / "log.mat", {**NAMES, "joint2:motor [N m]": "tau"}, None)
    with pytest.raises(InputError, match="channel \\[unit\\]"):
        read_log(tmp_path / "log.mat", {**NAMES, "torque": "tau[:,0]"}, None)


def test_uneven_times_are_interpolated_where_that_is_asked_for(tmp_path: Path) -> None:
    t, _, _ = _log(2000)
    jitter = t + 4e-4 * np.random.default_rng(1).uniform(-1, 1, size=len(t))
    slow = np.sin(2 * np.pi * 5 * jitter)
    table = np.column_stack([jitter, slow, slow])
    np.savetxt(tmp_path / "log.csv", table, delimiter=",", header="t,tau,q", comments="", fmt="%.12g")
    names = {"time_s": "t", "joint2:motor [N m]": "tau", "joint2:motor [rad]": "q"}
    with pytest.raises(InputError, match="sample_rate_hz"):
        read_log(tmp_path / "log.csv", names, None)
    found = read_log(tmp_path / "log.csv", names, RATE)
    even = jitter[0] + np.arange(found.data.shape[1]) / RATE
    assert found.data[0, :, 0] == pytest.approx(np.sin(2 * np.pi * 5 * even), abs=1e-4)
    with pytest.raises(InputError, match="as many or more"):
        read_log(tmp_path / "log.csv", names, 0.5 * RATE)


def test_repeats_of_a_log_are_one_estimate(tmp_path: Path) -> None:
    rng = np.random.default_rng(9)
    paths = [tmp_path / f"{n}.csv" for n in range(2)]
    for n, path in enumerate(paths):
        torque = rng.normal(size=SAMPLES - 500 * n)
        angle = scipy.signal.lfilter(*_sampled(), torque)
        angle = angle + 0.02 * angle.std() * rng.normal(size=len(torque))
        table = np.column_stack([np.arange(len(torque)) / RATE, torque, angle])
        head = "time_s,joint2:motor [N m],joint2:motor [rad]"
        np.savetxt(path, table, delimiter=",", header=head, comments="", fmt="%.12g")
    both = read_source(paths, FrfFileOptions(), Estimation(excitation="broadband"))
    one = read_source(paths[:1], FrfFileOptions(), Estimation(excitation="broadband"))
    assert both.noise is not None and one.noise is not None
    assert np.sqrt(np.mean(np.abs(_scores(both)) ** 2)) == pytest.approx(1, abs=0.2)
    assert np.ptp(np.diff(both.frequency_hz)) < 1e-9
    assert len(both.frequency_hz) > len(one.frequency_hz), "two records leave noise in shorter windows"


def _bag(path: Path, kind: str) -> tuple[np.ndarray, np.ndarray]:
    """A recording of joint states, whose order changes, and of a reference at other times; and what was in
    it.
    """
    rosbag2 = pytest.importorskip("rosbags.rosbag2")
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    state, header = store.types["sensor_msgs/msg/JointState"], store.types["std_msgs/msg/Header"]
    stamp, number = store.types["builtin_interfaces/msg/Time"], store.types["std_msgs/msg/Float64"]
    t, tau, q = _log(300)
    plugin = {"mcap": rosbag2.StoragePlugin.MCAP, "db3": rosbag2.StoragePlugin.SQLITE3}[kind]
    with rosbag2.Writer(path, version=9, storage_plugin=plugin) as writer:
        own = writer.add_connection("/joint_states", state.__msgtype__, typestore=store)
        other = writer.add_connection("/excitation", number.__msgtype__, typestore=store)
        for row, time in enumerate(t):
            at = 10**18 + round(1e9 * time)
            names, order = (["elbow", "shoulder"], [0, 1]) if row % 2 else (["shoulder", "elbow"], [1, 0])
            head = header(stamp(at // 10**9, at % 10**9), "")
            message = state(head, names, q[row, order], np.zeros(2), tau[row, order])
            writer.write(own, at + 10**6, store.serialize_cdr(message, state.__msgtype__))
            told = number(float(np.sin(20 * time)))
            writer.write(other, at + 5 * 10**5, store.serialize_cdr(told, number.__msgtype__))
    return tau, q


BAG = {
    "time_s": "/joint_states:time",
    "joint2:motor [N m]": "/joint_states:effort:shoulder",
    "joint2:motor [rad]": "/joint_states:position:shoulder",
    "joint2:reference [N m]": "/excitation:data",
}


@pytest.mark.parametrize("kind", ["mcap", "db3"])
def test_bags_of_ros_2_are_read_by_topic_field_and_joint(tmp_path: Path, kind: str) -> None:
    """As a folder and as a single file, with joints whose order changes and a topic of other times."""
    tau, q = _bag(tmp_path / "run", kind)
    [single] = (tmp_path / "run").glob(f"*.{kind}")
    for path in (tmp_path / "run", single):
        found = read_log(path, BAG, None)
        assert found.sample_rate_hz == pytest.approx(RATE, rel=1e-6)
        assert found.data[0, :, 0] == pytest.approx(tau[:, 1])
        assert found.data[0, :, 1] == pytest.approx(q[:, 1])
        late = np.sin(20 * (np.arange(300) / RATE - 5e-4))
        assert found.data[0, 1:, 2] == pytest.approx(late[1:], abs=1e-3)


def test_what_a_bag_does_not_have_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    _bag(tmp_path / "run", "mcap")
    for name, said in (
        ("/joint_state:effort:elbow", r"no such topic; the bag has /excitation .*, /joint_states"),
        ("/joint_states:torque:elbow", "no field 'torque'; a message has .*effort"),
        ("/joint_states:effort", "joints whose order changes: name one, /joint_states:effort:shoulder"),
        ("/joint_states:effort:wrist", "no value of joint 'wrist'; the message has shoulder, elbow"),
    ):
        with pytest.raises(InputError, match=said):
            read_log(tmp_path / "run", {**BAG, "joint2:motor [N m]": name}, None)
    (tmp_path / "cut.mcap").write_bytes(b"\x89MCAP0\r\n" + bytes(200))
    with pytest.raises(InputError, match=r"cut\.mcap"):
        read_log(tmp_path / "cut.mcap", BAG, None)
    monkeypatch.setattr(record_files, "find_spec", lambda name: None)
    with pytest.raises(InputError, match=r"robot-identify\[ros\]"):
        read_log(tmp_path / "run", BAG, None)

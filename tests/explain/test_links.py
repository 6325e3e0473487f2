"""Gears that bend: the load side is that of the links, and no answer hangs on the low-pass.

Against drives of two inertias that share no code with what explains them, and two measured benches.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy

from identify.core.correlated import log_likelihood_gain, white_level
from identify.explain import stages
from identify.explain.effects.friction import TorqueConstant
from identify.explain.effects.harmonics import AngularTransmissionError, TorqueRipple
from identify.explain.effects.motor_coupling import RotorInertia
from identify.explain.evaluate import resonance_warnings
from identify.explain.regression import solve
from identify.explain.run import run_explain
from identify.joints.intervals import IMPOSSIBLE, symmetric
from identify.measured.conditioning import slow_part
from identify.results.explain import ExplainResult
from tests.benchmarks.drives import SPRINGS, stiffness
from tests.explain.moved import moved, problem
from tests.generator import two_mass
from tests.generator.two_mass import Drive, Sensing
from tests.shared import shared

KINDS = "[joint-compliance, damped-compliance, sensor-latency, lost-motion, angular-transmission-error]"
SOFT = Drive(rotor=0.8, link=1.0, stiffness=2000.0, damper=1.5, coulomb=0.05, viscous=0.3, ratio=100.0)
SENSED = Sensing(rate_hz=250.0, seconds=10.0, counts=2.0**18, latency_s=0.003)
"""Link alone 7.1 Hz, resonance 10.7 Hz."""
ALL = np.ones(4000, dtype=bool)


def _explained(folder: Path, lowpass_hz: float, **more: object) -> ExplainResult:
    folder.mkdir(exist_ok=True)
    config = two_mass.study(folder, SOFT, SENSED, lowpass_hz, 3, {"effects": KINDS, **more})
    return run_explain(config, folder / "out.h5")[0]


@pytest.mark.parametrize("lowpass_hz", [5.0, 10.7, 40.0])
def test_stiffness_does_not_depend_on_the_low_pass(tmp_path: Path, lowpass_hz: float) -> None:
    """Below the link's own frequency, at the resonance, above it; a link-side encoder that is read late."""
    result = _explained(tmp_path / "run", lowpass_hz)
    found = stiffness(result)
    assert found is not None
    assert found[0] == pytest.approx(SOFT.stiffness, rel=0.02)
    names = set(result.targets["deflection"].effects.name)
    assert names <= {*SPRINGS, "joint1.sensor-latency"}
    warned = [note for note in result.notes if "lowpass_hz" in note and note.startswith("deflection")]
    assert bool(warned) is (lowpass_hz < 10)
    if warned:
        assert "near 10." in warned[0]


def test_accelerations_of_the_motor_make_no_spring(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Negative control: past the resonance they go against those of the link."""
    real = stages.scene_of
    monkeypatch.setattr(
        stages, "scene_of", lambda motion, known, *_: real(motion, replace(known, by_links=False))
    )
    assert stiffness(_explained(tmp_path / "run", 40.0)) is None


def test_what_rings_in_the_rest_is_warned_of() -> None:
    """A torque that rings at 9 Hz, twelve seconds long; noise of the same size does not."""
    scene, rng = moved(), np.random.default_rng(1)
    ringing = np.sin(2 * np.pi * 9 * scene.time_s)
    for history, warned in ((ringing, True), (rng.normal(size=len(ringing)), False)):
        made = problem(scene, history)
        said = resonance_warnings("torque", made, solve(made, (), (), np.ones(1)), 20.0)
        assert bool(said) is warned
        assert all("lies near 9 Hz" in one for one in said)


def test_cosines_up_to_a_frequency_are_a_projection_and_derivatives_are_as_large_as_they_are() -> None:
    rng, rate = np.random.default_rng(1), 250.0
    signal, time = rng.normal(size=1000), np.arange(1000) / rate
    slow = slow_part(signal, 40.0, rate)
    assert slow @ signal == pytest.approx(slow @ slow)
    wave = np.sin(2 * np.pi * 30 * time)
    speed = slow_part(np.gradient(wave, 1 / rate), 60.0, rate, 1)
    exact = 2 * np.pi * 30 * np.cos(2 * np.pi * 30 * time)
    inside = slice(100, -100)
    assert np.abs(speed - exact)[inside].max() < 0.02 * 2 * np.pi * 30
    assert np.abs(np.gradient(wave, 1 / rate) - exact)[inside].max() > 0.08 * 2 * np.pi * 30


def test_noise_is_told_behind_a_filter_and_between_counts_or_not_at_all() -> None:
    rng, time = np.random.default_rng(0), np.arange(4000) / 500
    signal = np.sin(2 * np.pi * 8 * time)
    sections = scipy.signal.butter(2, 20, fs=500, output="sos")
    filtered = scipy.signal.sosfilt(sections, rng.normal(scale=0.02, size=4000))
    assert white_level(signal + filtered, ALL) == pytest.approx(filtered.std(), rel=0.4)
    assert white_level(np.round(signal / 0.01) * 0.01, ALL) == pytest.approx(0.01 / np.sqrt(12), rel=0.4)
    assert np.isnan(white_level(signal, ALL))


def test_what_leaks_into_upper_octaves_is_no_evidence() -> None:
    """A slow residual has no more samples for being recorded fast."""
    time = np.arange(4000) / 500
    slow = 0.3 * np.sin(2 * np.pi * 0.8 * time + 0.5) + 0.2 * np.sin(2 * np.pi * 1.7 * time)
    gain = log_likelihood_gain(slow, 0.8 * slow, ALL)[0]
    assert 0 < gain < 64 * np.log(1 / 0.8)


def test_what_cannot_be_is_not_named_nor_determined() -> None:
    assert not TorqueConstant(1).possible(np.array([-1.79]))
    assert TorqueConstant(1).possible(np.array([-0.1]))
    assert not RotorInertia(1).possible(np.array([-0.01]))
    assert RotorInertia(1, stated=0.02).possible(np.array([-0.01]))
    states = [symmetric("motor5.ia", "kg m^2", -1.0, 0.1, positive=sure).status for sure in (True, False)]
    assert states == [IMPOSSIBLE, "determined"]


def test_waves_that_are_not_travelled_are_not_looked_for() -> None:
    scene = moved()
    still = replace(scene, position=1e-4 * scene.position, cache={})
    for kind in (TorqueRipple, AngularTransmissionError):
        assert list(kind.instances(scene))
        assert not list(kind.instances(still))


def _bench(folder: Path, columns: dict[str, Any], lines: list[str], cut: int, lowpass_hz: float) -> Path:
    """A study of a bench's record in two halves."""
    for name, half in (("a", slice(0, cut)), ("b", slice(cut, 2 * cut))):
        table = np.column_stack([column[half] for column in columns.values()])
        table[:, 0] -= table[0, 0]
        np.savetxt(folder / f"{name}.csv", table, delimiter=",", header=",".join(columns), comments="")
    first = ["schema: identify-explain/1", "name: bench", "time: {at: time_s}", f"lowpass_hz: {lowpass_hz}"]
    first.append("records: [{name: A, file: a.csv}, {name: B, file: b.csv, use: validate}]")
    path = folder / "study.yaml"
    path.write_text("\n".join([*first, f"effects: {KINDS}", *lines]) + "\n")
    return path


@pytest.mark.parametrize("lowpass_hz", [30.0, pytest.param(200.0, marks=pytest.mark.exam)])
def test_the_motor_bench_is_as_stiff_as_its_frfs_say(tmp_path: Path, lowpass_hz: float) -> None:
    """558 N m/rad by two inertias fitted to FRFs of the same bench, resonance 76 Hz (SOURCE.md)."""
    data = scipy.io.loadmat(shared("data", "fditools_motor_bench", "MultisineTypeA.mat"), squeeze_me=True)
    start = slice(5000, None)
    signals = {"q": data["theta_mx"][start], "i": data["iq_adx"][start], "l": -data["theta_my"][start]}
    columns = {"time_s": np.arange(len(signals["q"])) / 2500, **signals}
    (tmp_path / "robot.yaml").write_text(
        "name: bench\nconvention: standard\njoints: [{name: j, d_m: 0, a_m: 0, alpha_deg: 0}]\n"
        "links: [{name: l, mass_kg: 1, centre_m: [0, 0, 0],"
        " inertia_kg_m2: [0.00488, 0.00488, 0.00488, 0, 0, 0]}]\n"
    )
    lines = [
        "robot: {dh: robot.yaml}",
        "drives: {gear_ratio: [1], torque_constant_nm_per_a: [1.0]}",
        "signals:",
        "  motor_position: {at: q, unit: rad}",
        "  motor_current: {at: i, unit: A}",
        "  link_position: {at: l, unit: rad}",
    ]
    found = stiffness(run_explain(_bench(tmp_path, columns, lines, 10000, lowpass_hz), tmp_path / "o.h5")[0])
    assert found is not None
    assert found[0] == pytest.approx(558, rel=0.02)


@pytest.mark.parametrize("lowpass_hz", [3.0, pytest.param(20.0, marks=pytest.mark.exam)])
def test_the_flexible_link_has_one_stiffness_and_nothing_false(tmp_path: Path, lowpass_hz: float) -> None:
    """About 23 N m/rad by the reference in SOURCE.md; its deflections pass a slow filter."""
    folder = shared("data", "quanser_2dsfl")
    data = scipy.io.loadmat(folder / "lqr_full_10deg.mat", squeeze_me=True)
    hubs, bends, currents = (
        np.column_stack([data[f"data_{name}"][:, 2] for name in names])
        for names in (("th11", "th21"), ("th12", "th22"), ("Im1", "Im2"))
    )
    columns = {"time_s": data["data_th11"][:, 0]}
    for what, values in (("q", hubs), ("i", currents), ("l", hubs + bends)):
        columns |= {f"{what}{joint}": values[:, joint - 1] for joint in (1, 2)}
    lines = [
        f"robot: {{dh: {folder / 'robot.yaml'}}}",
        "drives: {gear_ratio: [100, 50], torque_constant_nm_per_a: [0.119, 0.0232]}",
        "signals:",
        "  motor_position: {at: 'q{joint}', unit: deg}",
        "  motor_current: {at: 'i{joint}', unit: A}",
        "  link_position: {at: 'l{joint}', unit: deg}",
    ]
    result = run_explain(_bench(tmp_path, columns, lines, 5000, lowpass_hz), tmp_path / "o.h5")[0]
    found = result.targets["deflection"]
    assert set(found.effects.name) == {f"joint{joint}.damped-compliance" for joint in (1, 2)}
    k = stiffness(result)
    assert k is not None
    value, low, high = k
    assert value == pytest.approx(23, rel=0.15)
    assert low < 23, "what the reference says"
    assert high > 30, "30 is what the same records say once the filter is undone"
    assert np.isnan(found.gap).all(), "noise behind the filter is not told from the signal"

"""The zeros of encoders: every record has its own, and no answer depends on them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from identify.explain.effects.joint_stiffness import SensorLatency
from identify.explain.regression import Datum, aligned, solve
from identify.explain.run import run_explain
from identify.explain.workbench import rms
from identify.results.explain import ExplainResult
from tests.explain.moved import moved, problem
from tests.motion.hidden_drive import Hidden, Motion, only, study

KINDS = "[sensor-latency, joint-compliance, encoder-eccentricity, position-lag]"


def _shifted(path: Path, size: float, seed: int, what: tuple[str, ...]) -> None:
    """A record whose columns of those kinds count from other zeros, up to `size` degrees."""
    names = path.read_text().split("\n", 1)[0].split(",")
    data = np.loadtxt(path, delimiter=",", skiprows=1)
    rng = np.random.default_rng(seed)
    for number, name in enumerate(names):
        if name.rstrip("0123456789") in what:
            data[:, number] += rng.uniform(-size, size)
    np.savetxt(path, data, delimiter=",", header=",".join(names), comments="", fmt="%.12g")


def _explained(folder: Path, shifts: tuple[str, ...], **more: object) -> ExplainResult:
    """Late link encoders, a soft joint, a servo loop; encoders of both records counting from other zeros."""
    noise = np.random.default_rng(4)

    def bend(m: Motion) -> np.ndarray:
        return only(2, 2, m.rigid[:, 1] / 8e5)

    def error(m: Motion) -> np.ndarray:
        return 0.02 * m.v + noise.normal(scale=1e-5, size=m.q.shape)

    folder.mkdir()
    hidden = Hidden(deflection=bend, latency_s=(0.003,) * 5, error=error, torque_noise=0.01)
    config = study(folder, 2, hidden, effects=KINDS, resample_hz=50, **more)
    for seed, name in enumerate(("a.csv", "b.csv")):
        _shifted(folder / name, 0.2, seed, shifts)
    return run_explain(config, folder / "out.h5")[0]


def _same(one: ExplainResult, other: ExplainResult) -> None:
    for target, found in one.targets.items():
        again = other.targets[target]
        assert again.effects.name == found.effects.name
        assert again.values.value == pytest.approx(found.values.value, rel=1e-5)
        assert again.values.low_95 == pytest.approx(found.values.low_95, rel=1e-4)
        assert again.rms_judge == pytest.approx(found.rms_judge, rel=1e-5)
        assert again.rms_judge_start == pytest.approx(found.rms_judge_start, rel=1e-5)


def test_link_encoders_and_commands_of_both_records_may_count_from_any_zero(tmp_path: Path) -> None:
    plain, moved_ = (
        _explained(tmp_path / name, what) for name, what in (("p", ()), ("s", ("link", "command")))
    )
    names = plain.targets["deflection"].effects.name
    assert {"joint2.joint-compliance", "joint1.sensor-latency", "joint2.sensor-latency"} == set(names)
    _same(plain, moved_)


def test_relative_records_may_count_from_any_zero_on_every_encoder(tmp_path: Path) -> None:
    what = ("position", "link", "command")
    plain, moved_ = (
        _explained(tmp_path / name, w, positions="relative") for name, w in (("p", ()), ("s", what))
    )
    assert plain.targets["deflection"].effects.name
    _same(plain, moved_)


@pytest.mark.parametrize(("datum", "left"), [("none", 0.1), ("constant", 0.0), ("line", 0.0)])
def test_a_datum_is_that_of_the_record_that_is_judged(datum: Datum, left: float) -> None:
    """Fitted on a record that counts from zero, judged on one that does not; without a datum it is lost."""
    scene = moved()
    made = problem(scene, 0.003 * scene.velocity[:, 0], datum)
    away = problem(scene, 0.003 * scene.velocity[:, 0] + 0.1, datum)
    fit = solve(made, (SensorLatency(1),), (np.zeros(0),), np.ones(1))
    assert rms(away, aligned(away, fit))[0] == pytest.approx(left, abs=1e-9)


def test_every_record_of_several_has_its_own_datum() -> None:
    """Two records in a row whose encoders count from different zeros, and a line in the second."""
    scene = moved()
    half = len(scene.time_s) // 2
    history = 0.003 * scene.velocity[:, 0]
    drift = np.where(np.arange(len(history)) < half, 0.2, 0.1 + 1e-4 * np.arange(len(history)))
    for starts, found in (((0, half), True), ((0,), False)):
        made = problem(replace(scene, starts=starts), history + drift, "line")
        fit = solve(made, (SensorLatency(1),), (np.zeros(0),), np.ones(1))
        assert bool(abs(fit.of(SensorLatency(1))[0] - 0.003) < 1e-9) is found

"""The Nagoya study at its true numbers against its independent generator: sticking, FRFs in the closed loop,
control by two degrees.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from pydantic import ValidationError

from identify.core.arrays import Complex
from identify.core.errors import InputErrors
from identify.motion.excitation import Excitation, closed_loop_frf
from identify.motion.problem import MotionProblem, load_motion
from identify.motion.study import read_motion_study
from identify.motion.trajectory import simulated
from tests.motion.test_published_arms import gaps, truth_of

Array = NDArray[np.float64]
ROOT = Path(__file__).parents[2]


def study(name: str, tmp_path: Path, *changes: tuple[str, str]) -> tuple[MotionProblem, Array]:
    """A config of the study with parts of its text changed, and the true values of its parameters."""
    text = (ROOT / "configs" / f"{name}.yaml").read_text().replace("../data", str(ROOT / "data"))
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    (tmp_path / "config.yaml").write_text(text)
    problem = load_motion(read_motion_study(tmp_path / "config.yaml"))
    return problem, truth_of(problem, "nagoya_two_link")


def gap(problem: MotionProblem, values: Array, *records: str, seconds: float = 1.5) -> float:
    """On the first seconds of records."""
    return float(gaps(problem, [values], records, seconds)[0])


def test_a_drive_that_stops_sticks_and_does_not_creep(tmp_path: Path) -> None:
    """Behind a stop the friction of Eq. 11 holds with less than F_c + F_s; smoothed to 0.2 mrad/s it creeps
    by many times the noise.
    """
    assert gap(*study("nagoya_two_link", tmp_path), "fast1", "fast2", seconds=3.0) < 1.2
    creeping = ("creep_velocity: 1.0e-7", "creep_velocity: 2.0e-4")
    assert gap(*study("nagoya_two_link", tmp_path, creeping), "fast1", "fast2", seconds=3.0) > 5.0


def frfs(
    problem: MotionProblem, values: Sequence[Array], names: tuple[str, str]
) -> tuple[Array, Complex, list[Complex]]:
    """Frequencies and motor angle per motor torque of both joints (lines, 2, 2), from two records, as
    measured and as the model has them at each of the values.
    """
    records = [record for record in problem.records if record.settings.name in names]
    motion = problem.run(np.array(values), records)
    measured = [record.measured for record in records if record.measured is not None]
    runs = [simulated(problem, motion, record, number, len(records)) for number, record in enumerate(records)]

    def of(signals: Sequence[Mapping[str, Array]]) -> tuple[Array, Complex]:
        torques, angles = ([s[key] for s in signals] for key in ("motor_torque", "motor_position"))
        return closed_loop_frf(torques, angles, float(measured[0].time_s[1]), 1.0)[:2]

    f, h = of([one.signals for one in measured])
    models = [{key: rows[n] for key, rows in run.items()} for n in range(len(values)) for run in runs]
    return f, h, [of(models[n : n + len(runs)])[1] for n in range(0, len(models), len(runs))]


def test_frfs_in_the_closed_loop_agree_and_show_a_wrong_stiffness(tmp_path: Path) -> None:
    problem, values = study("nagoya_two_link_frf", tmp_path)
    stiff = np.array(["rz.stiffness" in p.name for p in problem.parameters])
    both = [values, np.where(stiff, 1.5 * values, values)]
    f, measured, models = frfs(problem, both, ("reaching1", "reaching2"))
    band, diagonal = (f >= 3) & (f <= 50), (slice(None), (0, 1), (0, 1))

    def apart(model: Complex) -> float:
        ratio = model[band][diagonal] / measured[band][diagonal]
        return float(np.median(np.abs(20 * np.log10(np.abs(ratio)))))

    assert apart(models[0]) < 0.2
    assert apart(models[1]) > 0.5


def test_an_frf_in_a_closed_loop_is_that_of_the_plant() -> None:
    """Two coupled masses with feedback from both to both: exact at all lines of a periodic excitation, once
    the transient is over.
    """
    rng, size = np.random.default_rng(0), 200
    a, b = np.array([[0.6, 0.1], [0.05, 0.5]]), np.array([[1.0, 0.2], [0.1, 0.8]])
    torques, responses = [], []
    for joint in (0, 1):
        added, x = np.zeros((5 * size, 2)), np.zeros(2)
        added[:, joint] = np.tile(rng.normal(size=size), 5)
        torques.append(np.zeros_like(added))
        responses.append(np.zeros_like(added))
        for tick, extra in enumerate(added):
            torques[joint][tick], responses[joint][tick] = extra - 0.3 * x.sum(), x
            x = a @ x + b @ torques[joint][tick]
    f, h, coherence = closed_loop_frf(torques, responses, 0.01, 2.0)
    exact = np.array([np.linalg.solve(np.exp(2j * np.pi * line * 0.01) * np.eye(2) - a, b) for line in f])
    np.testing.assert_allclose(h, exact, rtol=1e-6)
    assert coherence.min() > 0.999


def test_two_degrees_of_freedom_and_notch_are_those_of_the_generator(tmp_path: Path) -> None:
    start = (
        "initial: [2.0e+6, 2.0e+6]",
        "initial: [3.0e+6, 1.2e+6]",
    )  # what the controller's notch is designed for
    problem, values = study("nagoya_two_link_control", tmp_path, start)
    assert gap(problem, values, "notched2") < 1.5
    assert (
        gap(
            *study("nagoya_two_link_control", tmp_path, start, ("notch_width: 0.3", "notch_width: 0.0")),
            "notched2",
        )
        > 5.0
    )


@pytest.mark.parametrize(
    ("record", "changes"),
    [
        ("inertia1", ["feedforward: two-inertia"]),
        ("shaped2", ["feedforward: rigid", "notch_width: 0.3\n  notch_depth: 0.3"]),
    ],
)
def test_conventional_feedforward_and_notch_alone_are_those_of_the_generator(
    tmp_path: Path, record: str, changes: list[str]
) -> None:
    """And not those of the elastic two-link model."""
    start = ("initial: [2.0e+6, 2.0e+6]", "initial: [3.0e+6, 1.2e+6]")
    gains = (
        "velocity_gain: [24000, 8000]",
        f"velocity_gain: [{12000 * int(record[-1])}, {4000 * int(record[-1])}]",
    )
    named = ("notched2", record)
    notch = ("notch_width: 0.3\n  notch_depth: 0.3", "\n  ".join(changes))
    assert gap(*study("nagoya_two_link_control", tmp_path, start, gains, named, notch), record) < 1.5
    other = ("notch_width: 0.3\n  notch_depth: 0.3", "\n  ".join(changes[1:]) or "notch_width: 0")
    assert gap(*study("nagoya_two_link_control", tmp_path, start, gains, named, other), record) > 5.0


def test_a_wrong_excitation_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ValidationError, match="the lower first"):
        Excitation(joint=1, torque_n_m=10.0, band_hz=(60.0, 1.0), period_s=1.0)
    with pytest.raises(InputErrors, match="joint"):
        study("nagoya_two_link_frf", tmp_path, ("{joint: 1, torque_n_m", "{joint: 1, torque"))

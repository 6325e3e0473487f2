"""The Nagoya study at its true numbers against its independent generator: sticking, FRFs in the closed loop,
control by two degrees.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from pydantic import ValidationError

from identify.core.errors import InputErrors
from identify.motion.changed import with_numbers
from identify.motion.evaluate import evaluate_simulation
from identify.motion.excitation import Excitation, closed_loop_frf
from identify.motion.problem import MotionProblem, load_motion
from identify.motion.study import read_motion_study
from identify.reports.motion.closed_loop import extremes, extremes_table
from identify.results.motion import ClosedLoopFrfs
from tests.motion import arms
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
    """Behind a stop the friction of Eq. 11 holds with less than F_c + F_s; smoothed to 1 mrad/s it creeps
    by many times the noise.
    """
    assert gap(*study("nagoya_two_link", tmp_path), "fast1", seconds=1.6) < 1.2
    creeping = ("creep_velocity: 1.0e-7", "creep_velocity: 1.0e-3")
    assert gap(*study("nagoya_two_link", tmp_path, creeping), "fast1", seconds=1.6) > 5.0


def test_frfs_of_a_result_agree_and_show_a_wrong_stiffness(tmp_path: Path) -> None:
    """Dips and peaks as the generator's records have them, a median of 0.2 dB apart at the true numbers."""
    problem, values = study("nagoya_two_link_frf", tmp_path)
    records = tuple(record for record in problem.records if record.settings.name.startswith("reaching"))
    names = [parameter.name for parameter in problem.parameters]

    def found(factor: float) -> ClosedLoopFrfs:
        scaled = [v * factor if "rz.stiffness" in n else v for n, v in zip(names, values, strict=True)]
        own = with_numbers(replace(problem, records=records), {}, dict(zip(names, scaled, strict=True)))
        [(name, frfs)] = evaluate_simulation(own).frfs.items()
        assert name == "reaching1 and reaching2"
        return frfs

    right, wrong = found(1.0), found(1.5)
    assert list(right.joint) == [1, 2]
    for one, near in ((right, True), (wrong, False)):
        [first, second] = extremes_table({"reaching": one}).rows
        dips, apart = (float(first[3]), float(first[4])), float(first[7])
        assert (abs(dips[0] - dips[1]) < 0.2) is near, (first, second)
        assert (apart < 0.2) is near
    assert right.acceleration_measured is not None
    assert right.acceleration is not None
    ratio = np.abs(right.acceleration / right.acceleration_measured)[:, [0, 1], [0, 1]]
    assert np.median(np.abs(20 * np.log10(ratio))) < 0.3


def test_one_body_is_an_inertia_whatever_holds_it(tmp_path: Path) -> None:
    """Velocity 1/(j omega J) and acceleration 1/J per torque, of an arm and a rotor behind a rigid gear; a
    record that is too short has none, with a note.
    """
    excited = {"joint": 1, "torque_n_m": 40.0, "band_hz": [2.0, 30.0], "period_s": 1.0}
    records = [
        {"name": name, "start_deg": [at], "duration_s": length, "excitation": excited}
        for name, at, length in (("a", 0.0, 4.0), ("b", 10.0, 1.5))
    ]
    servo = {**arms.CASCADE, "period_s": 5e-4}
    result = evaluate_simulation(arms.study(tmp_path, arms.one_link(0.0), servo=servo, records=records))
    [(name, one)] = result.frfs.items()
    assert name == "a"
    assert one.velocity_measured is None
    assert [note for note in result.notes if "no closed-loop FRFs of b" in note]
    inertia, f = arms.ABOUT_JOINT + 50.0**2 * 1e-3, one.frequency_hz
    assert (f[0], f[-1]) == (2.0, 30.0)
    assert one.acceleration is not None
    np.testing.assert_allclose(one.velocity[:, 0, 0] * 2j * np.pi * f * inertia, 1, atol=0.06)
    np.testing.assert_allclose(one.acceleration[:, 0, 0] * inertia, 1, atol=0.06)


def test_dip_and_peak_are_those_of_a_closed_form() -> None:
    """Between lines 1 Hz apart, as on lines a thousand times as close."""

    def gain(f: Array) -> Array:
        return np.asarray(np.abs((9.4**2 - f**2 + 2j * f) / (23.3**2 - f**2 + 3j * f)) / f)

    f, fine = np.arange(1.0, 60.0), np.arange(1.0, 60.0, 1e-3)
    exact = fine[np.argmin(fine * gain(fine))], fine[np.argmax(fine * gain(fine))]
    assert extremes(f, gain(f)) == pytest.approx(exact, abs=0.2)
    assert np.isnan(extremes(f, f)).all()


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

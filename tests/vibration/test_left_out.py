"""Channels that measured nothing are left out of a fit by name; those that stand still, and say so, stay."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from identify.fitting.fit import fit
from identify.measured.frf_set import FrfSet
from identify.measured.noise import with_relative_noise
from identify.vibration.check import STUDY, run_checks
from identify.vibration.plan import fit_plan
from identify.vibration.problem import Problem, load_problem
from identify.vibration.study import read_study
from identify.vibration.uncertainty import gap
from tests.shared import shared
from tests.test_metamorphic import Told, only, plain, study


def loaded(told: Told, folder: Path) -> Problem:
    return load_problem(read_study(study(told, folder)))


def with_channel(number: int, values: np.ndarray) -> Told:
    """The plain test with other values at one output, of a coherence as noise has."""

    def change(data: FrfSet) -> FrfSet:
        frf, coherence = data.frf.copy(), np.asarray(data.coherence).copy()
        frf[:, number], coherence[:, number] = values, np.random.default_rng(2).uniform(0.05, 0.5)
        return replace(data, frf=frf, coherence=coherence)

    return only(plain(), change)


def noise(size: float) -> np.ndarray:
    rng, shape = np.random.default_rng(1), plain().files["a.csv"][0].frf[:, 0].shape
    return np.asarray(size * (rng.normal(size=shape) + 1j * rng.normal(size=shape)))


def test_a_sensor_that_is_not_connected_is_left_out_where_the_model_moves(tmp_path: Path) -> None:
    [frf] = loaded(with_channel(4, noise(1e-4)), tmp_path).targets().frf
    whole = plain().files["a.csv"][0].outputs
    assert frf.data.outputs == whole[:4] + whole[5:]
    assert frf.data.notes == (f"output {whole[4]} is nothing but noise although the model moves there, like"
        " a sensor that is not connected, and left out",)  # fmt: skip


def test_a_point_that_stands_still_stays(tmp_path: Path) -> None:
    """The base of the shipped test: noise alone, and so the model says."""
    source = Path(__file__).parents[2] / "configs" / "arm_hammer_test.yaml"
    for frf in load_problem(read_study(source)).targets().frf:
        assert (len(frf.data.outputs), frf.data.notes) == (30, ())


@pytest.mark.parametrize(("case", "said"), [("dead_channel", "nothing but noise"), ("zero_channel", "zero")])
def test_the_reported_channel_is_named_and_the_rest_fits(case: str, said: str, tmp_path: Path) -> None:
    config = Path(shutil.copytree(shared("reported", "trust", case), tmp_path / case)) / "c.yaml"
    problem = load_problem(read_study(config))
    [note] = problem.targets().frf[0].data.notes
    assert note.startswith("output 1:+X is ") and said in note
    found = fit(fit_plan(problem))
    assert gap(problem.targets(), found.values) == pytest.approx(0.97, abs=0.01)
    assert found.values[::2] == pytest.approx([4e5, 2.3e5, 6e4], rel=0.005)
    assert f"p: {note}." in [one.channels or one.sentence for one in run_checks(config).findings[STUDY]]


def test_the_reported_robot_with_zero_channels_fits() -> None:
    problem = load_problem(read_study(shared("reported", "robots", "zero_channel", "study.yaml")))
    found = fit(replace(fit_plan(problem), starts=1, last_resort=()))
    assert gap(problem.targets(), found.values) < 1
    assert problem.targets().frf[0].data.notes[0].startswith("output 1:+X, 1:+Y, 1:+Z is zero or constant")


def test_stated_noise_has_floors() -> None:
    """Of a channel that hardly moves: what it picks up across its axis; of a noisy one: its scatter."""
    data = plain().files["a.csv"][0]
    frf = data.frf.copy()
    frf[:, 3] *= 1e-9
    frf[:, 5] += noise(0.3) * np.abs(frf[:, 5]).mean()
    told = with_relative_noise(replace(data, frf=frf), 0.05)
    level = np.sqrt(np.mean(np.abs(frf) ** 2, axis=0))
    assert told.noise is not None
    assert told.noise[0, 3] == pytest.approx(0.05 * 0.01 * level.max() / np.sqrt(2))
    assert np.all(told.noise[0, 5] > 0.2 * np.abs(data.frf[:, 5]).mean())
    loud = level > 0.2 * level.max()
    loud[5] = False
    assert loud.sum() > 5
    assert told.noise[0][loud] == pytest.approx(0.05 * level[loud] / np.sqrt(2))
    assert "FRFs scatter more between lines than the stated noise of 0.05" in told.notes[0]


def test_all_channels_dead_is_refused(tmp_path: Path) -> None:
    dead = only(plain(), lambda data: replace(data, frf=0 * data.frf))
    with pytest.raises(Exception, match=r"which are all, is zero or constant at every line"):
        loaded(dead, tmp_path)

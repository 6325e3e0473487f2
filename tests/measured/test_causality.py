"""The complex conjugate of a set of FRFs is found by its impulse responses, which come before the impulse."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from identify.measured.causality import is_conjugated
from identify.measured.loaders import load_frf_set
from identify.measured.uff.write import write_uff58
from identify.modes.from_study import job_of_study
from tests.shared import shared
from tests.test_modes_command import frf_set


def test_a_conjugated_set_is_turned_with_a_note(tmp_path: Path) -> None:
    data = frf_set()
    for conjugated in (False, True):
        for sign in (1, -1):  # a turned sensor is something else
            write_uff58(
                tmp_path / "a.uff",
                type(data)(
                    data.frequency_hz,
                    sign * (data.frf.conj() if conjugated else data.frf),
                    data.outputs,
                    data.inputs,
                    data.quantity,
                ),
                binary=True,
            )
            read = load_frf_set(tmp_path / "a.uff")
            np.testing.assert_array_equal(read.frf, sign * data.frf)
            assert ["phases turn the wrong way" in note for note in read.notes] == [True] * conjugated


@pytest.mark.parametrize("lines", [3, 40, 400])
@pytest.mark.parametrize("pairs", [1, 12])
def test_noise_is_not_taken_for_it(lines: int, pairs: int) -> None:
    """Also where few lines have all of the energy, as of a displacement from an acceleration."""
    rng = np.random.default_rng(1)
    frequency = 2.0 + 0.5 * np.arange(lines)
    for power in (0, -2):
        for _ in range(50):
            noise = rng.normal(size=(lines, pairs)) + 1j * rng.normal(size=(lines, pairs))
            assert not is_conjugated(frequency, noise * frequency[:, None] ** power)


def test_lines_need_not_be_even() -> None:
    frequency = np.geomspace(5, 55, 150)
    s = 2j * np.pi * frequency
    poles = [(-0.02 + 1j) * 2 * np.pi * hz for hz in (12.0, 27.0)]
    low, high = (s / ((s - pole) * (s - pole.conjugate())) for pole in poles)
    frf = np.stack([low + high, low - high, low, high], axis=1)
    assert is_conjugated(frequency, frf.conj()) and not is_conjugated(frequency, frf)


def test_nothing_is_said_of_nothing() -> None:
    assert not is_conjugated(np.array([1.0]), np.ones((1, 1), dtype=complex))
    assert not is_conjugated(np.array([1.0, 2.0]), np.zeros((2, 1), dtype=complex))


def test_the_reported_set_is_read_with_a_note() -> None:
    read = load_frf_set(shared("reported", "frf_conjugated.uff"))
    assert "phases turn the wrong way" in read.notes[0]
    assert not load_frf_set(shared("reported", "frf_good.uff")).notes


def test_modes_of_a_study_say_what_was_done_to_its_files(tmp_path: Path) -> None:
    source = Path(__file__).parents[2] / "configs/hidden_effects.yaml"
    data = load_frf_set(source.parents[1] / "data/hidden_effects/posture1.uff")
    write_uff58(tmp_path / "turned.uff", replace(data, frf=data.frf.conj()), binary=True)
    text = source.read_text("utf-8").replace("../data/hidden_effects/posture1.uff", "turned.uff")
    (tmp_path / "study.yaml").write_text(text.replace("../data", str(source.parents[1] / "data")))
    job = job_of_study(tmp_path / "study.yaml", {}, refused=False)
    assert any("phases turn the wrong way" in note for note in job.notes)
    np.testing.assert_array_equal(job.measured[0].data.frf.shape[1:], data.frf.shape[1:])

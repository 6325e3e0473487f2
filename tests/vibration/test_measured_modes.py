"""Modes of measured FRFs are identified once for all fits of a process."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from identify.core.errors import InputError
from identify.measured.frf_set import FrfSet
from identify.modal.analysis import ModalAnalysis, analyse
from identify.modal.settings import ModalSettings
from identify.vibration import measured_modes as told
from identify.vibration.costs.target import FrfTarget
from identify.vibration.problem import Problem, load_problem
from identify.vibration.study import read_study

CONFIG = Path(__file__).parents[2] / "configs" / "arm_hammer_test.yaml"


def _of(problem: Problem, data: FrfSet, settings: ModalSettings) -> Problem:
    """The problem with other data in its first measurement, and other settings of modal analysis."""
    first, *others = problem.measurements
    assert isinstance(first.target, FrfTarget)
    study = problem.file.study.model_copy(update={"modal": settings})
    return replace(
        problem,
        file=problem.file.model_copy(update={"study": study}),
        measurements=(replace(first, target=replace(first.target, data=data)), *others),
    )


def test_modes_are_identified_once_of_the_same_data_and_anew_of_others(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    problem, asked = load_problem(read_study(CONFIG)), list[float]()
    data, settings = problem.targets().frf[0].data, problem.file.study.modal
    name = problem.measurements[0].name

    def counted(frf_set: FrfSet, options: ModalSettings) -> ModalAnalysis:
        asked.append(float(np.abs(frf_set.frf).sum()))
        if len(asked) == 4:
            raise InputError("here", "nothing", "something")
        return analyse(frf_set, options)

    monkeypatch.setattr(told, "analyse", counted)
    monkeypatch.setattr(told, "_KNOWN", {})
    few = data.lines(data.frequency_hz < 25)
    first, again, renamed, louder, narrower, refused, still_refused = (
        told.modes_of(_of(problem, one, how), name)
        for one, how in (
            (few, settings),
            (replace(few, frf=few.frf.copy()), settings),
            (replace(few, source="elsewhere.uff"), settings),
            (replace(few, frf=2 * few.frf), settings),
            (few, settings.model_copy(update={"band_hz": (3.0, 20.0)})),
            (replace(few, frf=3 * few.frf), settings),
            (replace(few, frf=3 * few.frf), settings),
        )
    )
    assert len(asked) == 4
    assert first is not None and again is not None and renamed is not None
    assert louder is not None and narrower is not None
    assert again.table.frequency_hz.tolist() == first.table.frequency_hz.tolist()
    assert (first.table.source, renamed.table.source) == (few.source, "elsewhere.uff")
    assert narrower.table.frequency_hz.max() <= 20
    assert refused is None and still_refused is None

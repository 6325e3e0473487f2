"""Starts side by side: the same fit, journal and end as one after the other."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from identify.core.part_file import PartFile
from identify.core.threads import one_thread
from identify.fitting.fit import Fit, Progress, fit
from identify.fitting.memory import Journal
from identify.fitting.plan import FitPlan
from identify.fitting.processes import Processes
from identify.vibration.plan import fit_plan
from identify.vibration.problem import load_problem
from identify.vibration.study import read_study

ARM = Path(__file__).parents[2] / "configs" / "arm_hammer_test.yaml"


@pytest.fixture(scope="module")
def plan() -> FitPlan:
    """Three starts that no agreement ends, of which later ones go where the first led."""
    file = read_study(ARM)
    few = file.model_copy(update={"study": file.study.model_copy(update={"band_hz": (3.0, 45.0)})})
    with one_thread():
        whole = fit_plan(load_problem(few))
    return replace(whole, starts=3, believed_cost=0.0, alike=1e-2)


@pytest.fixture(scope="module")
def workers() -> Iterator[Processes]:
    """Two, for all tests of this file."""
    with Processes(2) as processes:
        yield processes


@pytest.fixture(scope="module")
def alone(plan: FitPlan, tmp_path_factory: pytest.TempPathFactory) -> tuple[Fit, list[bytes]]:
    """The fit by one process, and what it would be resumed from."""
    return _fitted(plan, tmp_path_factory.mktemp("alone"), None)


def _fitted(
    plan: FitPlan, folder: Path, workers: Processes | None, begun: list[bytes] | None = None
) -> tuple[Fit, list[bytes]]:
    part = PartFile(folder / "fit.part", "key")
    for record in begun or ():
        part.append(record)
    with one_thread():
        found = fit(plan, Progress(journal=Journal(part)), workers)
    return found, part.records


def _same(one: tuple[Fit, list[bytes]], other: tuple[Fit, list[bytes]]) -> None:
    assert one[1] == other[1]
    assert np.array_equal(one[0].values, other[0].values)
    assert np.array_equal(one[0].history[:, :4], other[0].history[:, :4])
    for a, b in zip(one[0].starts, other[0].starts, strict=True):
        assert np.array_equal(a.final, b.final)
        assert (a.cost, a.evaluations, a.sentence) == (b.cost, b.evaluations, b.sentence)


def test_any_number_of_workers_gives_the_same_bit_for_bit(
    plan: FitPlan, alone: tuple[Fit, list[bytes]], workers: Processes, tmp_path: Path
) -> None:
    """Also where a start is spared a stage because an earlier one, in another process, began it there."""
    stages = {(int(start), int(stage)) for start, stage in alone[0].history[:, :2]}
    assert len(stages) < 3 * len(plan.stages), "no stage is spared"
    _same(_fitted(plan, tmp_path, workers), alone)


@pytest.mark.parametrize("share", [0.2, 0.6])
def test_an_interrupted_fit_is_gone_on_with_by_another_number(
    plan: FitPlan, alone: tuple[Fit, list[bytes]], workers: Processes, share: float, tmp_path: Path
) -> None:
    begun = alone[1][: int(share * len(alone[1]))]
    _same(_fitted(plan, tmp_path, workers, begun), alone)


def test_starts_that_agree_end_the_fit(plan: FitPlan, workers: Processes, tmp_path: Path) -> None:
    settled = replace(plan, starts=40, believed_cost=np.inf)
    by_workers = _fitted(settled, tmp_path, workers)
    assert len(by_workers[0].starts) < 10
    _same(by_workers, _fitted(settled, tmp_path, None))

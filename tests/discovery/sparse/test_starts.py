"""Where a dense fit starts, so that what it compensates for is not found elsewhere."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from identify.discovery.sparse.dense import of_all, with_more
from identify.discovery.sparse.fit import dense_fit
from identify.discovery.sparse.search import _others
from identify.fitting.selection.workbench import Story
from identify.vibration.all_springs import all_springs
from tests.discovery.sparse.test_at_once import problem_of


def test_a_delay_leads_no_drive_astray(tmp_path: Path) -> None:
    problem = problem_of(tmp_path, "delay", 7)
    structure = (*all_springs(problem, shrink=True), *of_all(problem))
    found = dense_fit(problem, structure, usual=False)
    assert found.gap < 1.1
    assert np.sum(found.unknowns.springs & (found.x > 0)) < 6  # nothing gives way in place of the delay
    # With errors of every sensor as well, the delay is there once.
    more = next(iter(_others(problem, problem, structure, Story(), found)))
    assert [effect.kind for effect in more.effects].count("time-delay") == 1
    assert more.gap < 1.1
    delay = next(effect for effect in of_all(problem) if effect.kind == "time-delay")
    assert delay not in list(of_all(with_more(problem, [delay])))

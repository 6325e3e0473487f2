"""A recorded command drives the simulation where the study commands nothing itself."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from identify.core.errors import InputError
from tests.motion import arms

MOVE = arms.move(1, 30, 90)


def record(folder: Path, command_deg: np.ndarray, **more: Any) -> list[dict[str, Any]]:
    """One motion with a file of times, commands and, to have something measured, the same as positions."""
    time = np.linspace(0, 0.9, len(command_deg))
    rows = np.column_stack([time, command_deg, command_deg])
    np.savetxt(folder / "rec.csv", rows, delimiter=",", header="time_s,c1,q1", comments="")
    signals = {
        "command_position": {"at": "c{joint}", "unit": "deg"},
        "motor_position": {"at": "q{joint}", "unit": "deg"},
    }
    measured = {"file": "rec.csv", "signals": signals}
    return [{"name": "own", "start_deg": [0.0], "duration_s": 1.0, "measured": measured, **more}]


def test_it_is_followed_as_moves_are(tmp_path: Path) -> None:
    moved = arms.study(
        tmp_path,
        arms.one_link(0.0),
        records=[{"name": "m", "start_deg": [0.0], "duration_s": 1.0, "moves": [MOVE]}],
    )
    wanted = moved.records[0].command.position[:, 0]
    times = np.linspace(0, 0.9, 181)
    told = np.degrees(np.interp(times, np.linspace(0, 1, len(wanted)), wanted))
    driven = arms.study(tmp_path, arms.one_link(0.0), records=record(tmp_path, told))
    command = driven.records[0].command.position[:, 0]
    assert np.ptp(command) > 0.4
    np.testing.assert_allclose(command[:900], wanted[:900], atol=1e-4)
    np.testing.assert_allclose(command[901:], command[900], atol=1e-9)
    motions = [p.run(p.initial[None], p.records).coordinates[0, :900, 0] for p in (moved, driven)]
    np.testing.assert_allclose(motions[0], motions[1], atol=1e-3)


def test_moves_go_before_it(tmp_path: Path) -> None:
    both = arms.study(tmp_path, arms.one_link(0.0), records=record(tmp_path, np.zeros(181), moves=[MOVE]))
    assert np.ptp(both.records[0].command.position) > 0.4


def test_it_must_begin_where_the_study_does(tmp_path: Path) -> None:
    records = record(tmp_path, np.full(181, 12.0))
    with pytest.raises(InputError, match=r"begins at 12° of joint 1; expected start_deg, which is 0°"):
        arms.study(tmp_path, arms.one_link(0.0), records=records)

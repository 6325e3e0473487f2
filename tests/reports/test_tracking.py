"""Tracking errors that are known: a link so far off its command, on one phase more than on another."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from identify.reports.motion.tables import tracking_table
from tests.reports.motion_sample import motion_result


def test_rms_of_what_is_off_the_command() -> None:
    result = motion_result()
    record = result.records["a"]
    time, command = record.time_s, record.signals["command_position"].values
    late = time >= 1.0
    one = next(iter(record.comparisons.values()))
    seen = command + np.where(late, 0.02, 0.01)[:, None]
    compared = {"motor_position": replace(one, time_s=time, measured=seen, simulated=command + 0.03)}
    phases = np.array([(0.0, time[-1]), (1.0, time[-1])])
    own = replace(record, comparisons=compared, phases=("whole", "late"), phase_s=phases)
    table = tracking_table(replace(result, records={"a": own}))
    assert table is not None
    assert [column.heading for column in table.columns][2:] == [
        "Whole, measured",
        "Whole, model",
        "Late, measured",
        "Late, model",
    ]
    for row in table.rows:
        assert float(row[4]) == pytest.approx(np.degrees(0.02), rel=1e-3)
        assert float(row[5]) == float(row[3]) == pytest.approx(np.degrees(0.03), rel=1e-3)
        assert np.degrees(0.01) < float(row[2]) < np.degrees(0.02)
    still = replace(own.signals["command_position"], values=0 * command)
    standing = replace(own, signals={**own.signals, "command_position": still})
    assert tracking_table(replace(result, records={"a": standing})) is None

"""What is printed on a terminal that is narrow, or into a file."""

from __future__ import annotations

import io
from collections.abc import Callable
from typing import Any

import pytest
from rich.console import Console

from identify.reports.kinds import report_of
from identify.reports.kit.report import TERMINAL, Tabular
from identify.reports.kit.terminal import print_table
from tests.reports.discovery_sample import discovery_result
from tests.reports.excite_sample import excite_result
from tests.reports.plan_sample import plan_result


@pytest.mark.parametrize("made", [discovery_result, excite_result, plan_result])
@pytest.mark.parametrize("width", [40, 80, 200])
def test_no_number_of_a_table_is_cut_off(made: Callable[[], Any], width: int) -> None:
    report, tables = report_of(made()), 0
    for part in report.shown(TERMINAL):
        if not isinstance(part, Tabular):
            continue
        tables += 1
        file = io.StringIO()
        print_table(Console(file=file, width=width), part.table.part(slice(part.rows), part.terminal))
        printed = [line.split() for line in file.getvalue().splitlines()]
        for row in part.table.rows[: part.rows]:
            for cell, column in zip(row, part.table.columns, strict=True):
                if column.numeric and (not part.terminal or column.heading in part.terminal):
                    words = str(cell).split()
                    assert any(" ".join(words) in " ".join(line) for line in printed), (column.head, cell)
    assert tables

"""Modes that are not to be relied on are marked in the table, on the page and in the verdict."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from identify.measured.modal_tables import ModalTable
from identify.measured.uff.write import write_uff58
from identify.modal.settings import ModalSettings
from identify.modes.doubt import doubt_sentence, doubts
from identify.modes.run import run_modes
from identify.reports.modes.tables import mode_table
from identify.results import file as result_file
from identify.results.modes import ModesResult
from tests.modal.test_alone import roved
from tests.reports.modes_sample import modes_result


@pytest.mark.parametrize(
    ("frequency_std", "damping_std", "mpc", "mpd", "why"),
    [
        (0.1, 0.001, 1.0, 0.0, ""),
        (8.0, 0.001, 1.0, 0.0, "frequency"),
        (0.1, 0.008, 1.0, 0.0, "damping"),
        (0.1, 0.001, 0.25, 0.0, "shape"),
        (0.1, 0.001, 0.9, 40.0, "shape"),
        (56.0, 0.02, 0.25, 0.0, "frequency, damping, shape"),
        (np.nan, np.nan, 1.0, 0.0, ""),
    ],
)
def test_what_is_doubtful(frequency_std: float, damping_std: float, mpc: float, mpd: float, why: str) -> None:
    """A mode at 1318 Hz with 1 % of damping: its resonance is 13 Hz wide to each side."""
    table = ModalTable(
        np.array([1318.0]),
        np.array([0.01]),
        frequency_std_hz=np.array([frequency_std]),
        damping_std=np.array([damping_std]),
    )
    found = doubts(table, np.array([mpc]), np.array([mpd]), ModalSettings())
    assert found == (why,)
    assert doubt_sentence(table.frequency_hz, found) == (f"Doubtful: 1318 Hz ({why})." if why else "")


def test_the_table_marks_them_and_only_where_there_are_some() -> None:
    (m, *_) = modes_result().measurements.values()
    count = len(m.modes.frequency_hz)
    some = replace(m, modes=replace(m.modes, doubt=("damping", *[""] * (count - 1))))
    table = mode_table(some)
    assert table.columns[-1].heading == "Doubtful" and table.rows[0][-1] == "damping"
    assert "contains 0" in table.note
    for doubt in ((), ("",) * count):
        assert mode_table(replace(m, modes=replace(m.modes, doubt=doubt))).columns[-1].heading == "MPD"


def test_frfs_that_do_not_share_their_poles_are_said_and_kept(tmp_path: Path) -> None:
    write_uff58(tmp_path / "roved.uff", roved(1, 1.012, 0.985, 1.02), binary=True)
    run_modes(tmp_path / "roved.uff", tmp_path / "m.h5")
    said = result_file.read(tmp_path / "m.h5", ModesResult).notes[-1]
    assert "the FRFs do not share their poles" in said
    assert "11.82 to 12.24 Hz (3.5 %" in said

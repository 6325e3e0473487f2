"""`identify modes` on several files: setups, a sensor moved within one file, time records with forces."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from identify.cli import app
from identify.core.errors import InputError
from identify.measured.uff.write import write_uff58
from identify.modal.mac import mac
from identify.modal.setups.result import pooled
from identify.reports.modes.tables import setup_table
from identify.results import file as result_file
from identify.results.modes import AnalysedMeasurement, ModesResult
from tests.measured.simulate import SAMPLE_RATE_HZ, hammer_test, random_test, two_masses
from tests.modal.test_setups import HZ, KG, SHAPES, setups


def invoke(*arguments: object) -> Any:
    return CliRunner().invoke(app, ["modes", *map(str, arguments)])


def result(path: Path) -> tuple[ModesResult, AnalysedMeasurement]:
    found = result_file.read(path, ModesResult)
    (m,) = found.measurements.values()
    return found, m


@pytest.fixture
def files(tmp_path: Path) -> list[Path]:
    paths = [tmp_path / f"point{k + 1}.uff" for k in range(6)]
    for path, one in zip(paths, setups(KG), strict=True):
        write_uff58(path, one, binary=True)
    return paths


WORDS = ("--window-decay", "0")


def write_blocks(path: Path, blocks: np.ndarray) -> None:
    """Blocks (n, samples, signals) of a force at 1 and accelerations of two masses, as CSV."""
    heads = "block,time_s,1:+X [N],1:+X [m/s^2],2:+X [m/s^2]"
    time = np.arange(blocks.shape[1]) / SAMPLE_RATE_HZ
    rows = [np.column_stack([np.full(len(time), k + 1), time, block]) for k, block in enumerate(blocks)]
    np.savetxt(path, np.concatenate(rows), delimiter=",", header=heads, comments="", fmt="%.9g")


def test_a_file_for_each_place_of_a_sensor(files: list[Path], tmp_path: Path) -> None:
    said = invoke(*files, *WORDS, "--out", tmp_path / "m.h5", "--no-report")
    assert said.exit_code == 0, said.output
    found, m = result(tmp_path / "m.h5")
    assert m.modes.frequency_hz == pytest.approx(HZ, rel=5e-4)
    assert np.diag(mac(m.modes.shapes, SHAPES)) == pytest.approx(1, abs=5e-3)
    assert m.setups is not None and not m.setups.together
    assert m.setups.sensor_kg == pytest.approx(KG, rel=0.05)
    assert m.setups.own_hz.shape == (4, 6)
    (note,) = (note for note in found.notes if "setups" in note)
    assert "6 setups whose poles differ" in note and "of a moved sensor explains it" in note
    table = setup_table(m)
    assert table is not None and "Mass of a roving sensor" in table.note
    assert [row[1] for row in table.rows] == ["6 of 6"] * 4
    assert setup_table(replace(m, setups=None)) is None
    assert m.file and len(found.provenance.input_files) == 6
    folder = invoke(tmp_path / "point*.uff", *WORDS, "--out", tmp_path / "n.h5", "--no-report")
    assert folder.exit_code == 0
    assert result(tmp_path / "n.h5")[1].modes.frequency_hz == pytest.approx(m.modes.frequency_hz)


def test_one_file_in_which_a_sensor_was_moved(tmp_path: Path) -> None:
    write_uff58(tmp_path / "all.uff", pooled(setups(KG)), binary=True)
    said = invoke(tmp_path / "all.uff", "--roved", *WORDS, "--out", tmp_path / "m.h5", "--no-report")
    assert said.exit_code == 0
    _, m = result(tmp_path / "m.h5")
    assert len(m.modes.frequency_hz) == 4
    assert m.setups is not None and m.setups.setup[0] == "all, node 1"
    plain = invoke(tmp_path / "all.uff", *WORDS, "--out", tmp_path / "n.h5", "--no-report")
    assert plain.exit_code in (0, 4)
    assert result(tmp_path / "n.h5")[1].setups is None, "negative control: not asked for"


def test_hits_and_random_records_become_frfs_and_modes(tmp_path: Path) -> None:
    true, rng = two_masses(), np.random.default_rng(4)
    write_blocks(tmp_path / "hits.csv", hammer_test(true, 0, 5, rng))
    words = ("--estimate", "impacts", "--force-window", "0.05", "--window-decay", "3", "--band", "5", "60")
    said = invoke(tmp_path / "hits.csv", *words, "--out", tmp_path / "m.h5", "--no-report")
    assert said.exit_code == 0, (said.output, said.exception)
    found, m = result(tmp_path / "m.h5")
    assert m.modes.frequency_hz == pytest.approx(true.frequency_hz, rel=3e-3)
    assert m.modes.damping_ratio == pytest.approx(true.damping_ratio, rel=0.1)
    assert dict(zip(found.provenance.settings.key, found.provenance.settings.value, strict=True))["estimate"]
    force, moved = random_test(true, [0], 60_000, rng)
    write_blocks(tmp_path / "noise.csv", np.hstack([force, moved])[None])
    words = ("--estimate", "random", "--segment", "8", "--band", "5", "60", "--max-order", "24")
    said = invoke(tmp_path / "noise.csv", *words, "--out", tmp_path / "n.h5", "--no-report")
    assert said.exit_code == 0, (said.output, said.exception)
    found, m = result(tmp_path / "n.h5")
    assert m.modes.frequency_hz == pytest.approx(true.frequency_hz, rel=5e-3)
    assert not any("window" in note for note in found.notes), "records of noise have no exponential window"


def test_channels_are_chosen_from_all_files(files: list[Path], tmp_path: Path) -> None:
    words = (*WORDS, "--outputs", "1:+Z,2:+Z,4:+Z,6:+Z", "--out", tmp_path / "m.h5", "--no-report")
    assert invoke(*files, *words).exit_code == 0
    _, m = result(tmp_path / "m.h5")
    assert m.modes.channels == ("1:+Z", "2:+Z", "4:+Z", "6:+Z")
    assert m.setups is not None and len(m.setups.setup) == 4
    found = invoke(*files, *WORDS, "--outputs", "9:+Z", "--out", tmp_path / "n.h5")
    assert "channel 9:+Z is not in the file" in str(found.exception)


def test_options_that_do_not_go_together(files: list[Path], tmp_path: Path) -> None:
    for words, said in (
        (("--segment", "2"), "given without --estimate"),
        (("--estimate", "hammer"), "impacts"),
        (("--estimate", "random", "--force-window", "0.1"), "no meaning"),
        (("--output-only", "--roved"), "given beside --output-only"),
    ):
        found = invoke(files[0], *words, "--out", tmp_path / "x.h5")
        assert isinstance(found.exception, InputError) and said in str(found.exception), words

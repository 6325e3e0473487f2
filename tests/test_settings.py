"""Every value of a run knows where it came from: a line of the config, the command line, or a default."""

from __future__ import annotations

from pathlib import Path

import pytest
from pydantic import BaseModel
from typer.testing import CliRunner

from identify.cli import app
from identify.measured.frf_records import FrfFileOptions
from identify.modal.settings import ModalSettings
from identify.results.file import read
from identify.results.fit import FitResult
from identify.results.setting_table import COMMAND_LINE, DEFAULT, option_settings
from identify.results.tables import SettingTable
from identify.vibration.provenance import study_settings
from identify.vibration.study import StudyFile, read_study

CONFIG = Path(__file__).parents[1] / "configs" / "umons_tx200.yaml"


def _rows(table: SettingTable) -> dict[str, tuple[str, str]]:
    return dict(zip(table.key, zip(table.value, table.source, strict=True), strict=True))


@pytest.fixture(scope="module")
def file() -> StudyFile:
    return read_study(CONFIG)


def test_given_values_point_at_their_line(file: StudyFile) -> None:
    lines = CONFIG.read_text("utf-8").splitlines()
    given = {key: row for key, row in _rows(study_settings(file)).items() if row[1] != DEFAULT}
    assert len(given) > 8
    for key, (_, source) in given.items():
        name, _, number = source.rpartition(" line ")
        assert name == CONFIG.name
        last = key.split(".")[-1]
        assert last in lines[int(number) - 1], f"{key} is not in line {number}"


def test_defaults_are_said_to_be_defaults(file: StudyFile) -> None:
    rows = _rows(study_settings(file))
    assert "start_factor" not in CONFIG.read_text("utf-8")
    assert rows["start_factor"] == ("3.0", DEFAULT)
    assert rows["optimizer.0.kind"][1] != DEFAULT


def test_every_field_of_the_study_is_there(file: StudyFile) -> None:
    """By another route: the leaves of what pydantic says the study holds."""
    keys = set(study_settings(file).key)
    for name, field in type(file.study).model_fields.items():
        key = field.alias or name
        assert any(one == key or one.startswith(f"{key}.") for one in keys), key


def test_the_default_optimizer_is_spelled_out(tmp_path: Path) -> None:
    text = CONFIG.with_name("arm_hammer_test.yaml").read_text("utf-8")
    (tmp_path / "study.yaml").write_text(text, encoding="utf-8")
    value, source = _rows(study_settings(read_study(tmp_path / "study.yaml")))["optimizer"]
    assert source == DEFAULT
    assert value.count("gauss-newton") == 2 and '"residual": "log"' in value


def test_the_command_line_goes_before_the_config(tmp_path: Path) -> None:
    text = (
        CONFIG.read_text("utf-8")
        .replace("../data", str(CONFIG.parents[1] / "data"))
        .replace("evaluations: 20000", "evaluations: 60")
    )
    (tmp_path / "study.yaml").write_text(text, encoding="utf-8")
    out = tmp_path / "run.h5"
    CliRunner().invoke(
        app,
        [
            "fit",
            str(tmp_path / "study.yaml"),
            "--out",
            str(out),
            "--starts",
            "1",
            "--seed",
            "7",
            "-q",
            "--no-report",
        ],
    )
    result: FitResult = read(out, FitResult)
    assert result.provenance.settings is not None
    rows = _rows(result.provenance.settings)
    assert rows["starts"] == ("1", COMMAND_LINE)
    assert rows["seed"] == ("7", COMMAND_LINE)
    assert rows["name"][1].startswith("study.yaml line ")


def test_options_without_a_config_are_given_or_default() -> None:
    models: dict[str, BaseModel] = {
        "": FrfFileOptions(averages=4),
        "modal": ModalSettings(band_hz=(4.0, 70.0)),
    }
    rows = _rows(option_settings(models, {"averages": 4, "modal.band_hz": (4.0, 70.0)}))
    assert rows["averages"] == ("4", COMMAND_LINE)
    assert rows["modal.band_hz"] == ("[4.0, 70.0]", COMMAND_LINE)
    assert rows["modal.estimator"][1] == DEFAULT

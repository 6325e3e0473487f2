"""identify from Python: functions, results as tables and figures, notebooks."""

from __future__ import annotations

import dataclasses
import math
import re
import subprocess
import sys
from pathlib import Path

import nbformat
import pandas as pd
import pytest
from nbclient import NotebookClient

import identify
from identify.core.errors import InputError
from identify.reports.kit.cells import Column, Table, words
from identify.reports.next_step import next_steps
from identify.reports.outcome import Columns, Result
from identify.results import file as result_file
from identify.results.discovery import fit_of
from tests.reports.discovery_sample import discovery_result
from tests.reports.kinds import CASES
from tests.reports.sample import frf_result, modal_result

ROOT = Path(__file__).parents[1]
TX200 = ROOT / "configs" / "umons_tx200.yaml"


@pytest.fixture(scope="module")
def fitted(tmp_path_factory: pytest.TempPathFactory) -> Result:
    """The TX200 study, one start of few evaluations."""
    folder = tmp_path_factory.mktemp("api")
    text = (
        TX200.read_text()
        .replace("../data", str(ROOT / "data"))
        .replace("evaluations: 20000", "evaluations: 200")
    )
    (folder / "few.yaml").write_text(text)
    return identify.fit(folder / "few.yaml", out=folder / "tx200.h5", starts=1, seed=3)


def test_a_fit_gives_tables_and_figures(fitted: Result) -> None:
    assert fitted.path.exists()
    assert not fitted.path.with_suffix(".html").exists(), "reports are written where they are asked for"
    frame = pd.DataFrame(fitted.parameters)
    assert frame["Parameter"].tolist() == list(fitted.data.parameters.name)
    fits = [column for column in frame.columns if column.startswith("Fitted")]
    assert frame[fits[0]].tolist() == fitted.data.parameters.value.tolist(), "as in the result, not rounded"
    assert fitted.plot("Parameters").axes
    with pytest.raises(InputError, match="Parameters"):
        fitted.plot("nonsense")


def test_the_python_of_the_readme_works_with_what_its_install_brings(
    fitted: Result, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As it stands there; the study is read from a folder of its own, and the fit is not made again."""
    for extra in ("pandas", "xarray", "h5netcdf"):
        monkeypatch.setitem(sys.modules, extra, None)
    monkeypatch.setattr("identify.fit", lambda config: identify.read_result(fitted.path), raising=False)
    (code,) = re.findall(r"```python\n(.*?)```", (ROOT / "README.md").read_text(), flags=re.DOTALL)
    exec(code, {})


def test_a_notebook_shows_verdict_and_tables(fitted: Result) -> None:
    shown = fitted._repr_html_()
    assert fitted.verdict[0].split("<")[0] in shown
    assert "<table>" in shown
    assert "joint1.rz.stiffness" in fitted.parameters._repr_html_()


def test_a_result_is_read_again(fitted: Result) -> None:
    again = identify.read_result(fitted.path)
    assert (again.name, again.verdict, list(again.tables)) == (
        fitted.name,
        fitted.verdict,
        list(fitted.tables),
    )
    with pytest.raises(InputError):
        identify.read_result(TX200)


def test_options_that_do_not_apply_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="--profile"):
        identify.fit(ROOT / "configs" / "joint_runs.yaml", out=tmp_path / "x.h5", profile=["a"])


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_every_kind_of_result_has_tables_and_figures(case: object) -> None:
    result = Result(case.make()[0], (Path("x.h5"),))  # type: ignore[attr-defined]
    frames = [pd.DataFrame(columns) for columns in result.tables.values()]
    assert sum(len(frame) for frame in frames) > 0
    assert result.figures
    assert result._repr_html_().startswith("<h4>")


def test_a_column_of_numbers_is_one() -> None:
    columns = (words("Mode", ["a", "b"]), Column("Frequency", "Hz", [12.3456, math.nan]))
    table = Columns(Table("Modes", columns))
    assert table["Frequency (Hz)"][0] == 12.3456
    assert math.isnan(table["Frequency (Hz)"][1])
    assert table["Mode"] == ["a", "b"]


def test_packages_of_the_same_name_can_be_called() -> None:
    code = (
        "import identify.modes.run, identify.explain.run, identify.batch.run, identify\n"
        "print([callable(f) for f in (identify.modes, identify.explain, identify.batch, identify.robot)])"
    )
    ran = subprocess.run([sys.executable, "-c", code + "\n"], check=False, capture_output=True, text=True)
    assert ran.stdout.strip() == "[True, True, True, False]", ran.stderr


def test_a_name_that_does_not_exist_is_an_attribute_error() -> None:
    assert identify.InputError is InputError
    with pytest.raises(AttributeError, match="nonsense"):
        identify.nonsense  # noqa: B018


def test_a_fit_with_a_large_gap_is_followed_by_a_discovery(tmp_path: Path) -> None:
    """By the gap, whatever the verdict says; only of FRFs, which a discovery reads."""
    missing = frf_result(60, 4, gap=8.0, verdict=("As you like it.",))
    steps = next_steps(Result(missing, (tmp_path / "a.h5",)), Path("a.yaml"))
    assert [step.split("   ")[0] for step in steps] == ["identify discover a.yaml"]
    modal = modal_result(gap=8.0, verdict=("`identify discover a.yaml` looks for it.",))
    assert next_steps(Result(modal, (tmp_path / "a.h5",)), Path("a.yaml")) == []
    good = frf_result(60, 4, gap=1.0, converged=True, verdict=("Fine.",))
    assert "identify map" in next_steps(Result(good, (tmp_path / "a.h5",)), Path("a.yaml"))[0]


def test_a_discovery_is_followed_by_its_study_and_compared_with_the_fit(tmp_path: Path) -> None:
    data = discovery_result()
    files = (tmp_path / "x_discovery.h5", tmp_path / "x_discovery.yaml")
    steps = next_steps(Result(data, files), tmp_path / "x.yaml")
    mapped = f"identify map {files[0]} --grid 2:-60:60:9"
    assert [step.split("   ")[0] for step in steps] == [f"identify fit {files[1]}", mapped]
    fitted = tmp_path / f"{data.name}.h5"
    result_file.write(frf_result(60, 4), fitted)
    result_file.write(data, files[0])
    steps = next_steps(Result(data, files), tmp_path / "x.yaml")
    assert steps[1].startswith(f"identify compare {fitted} {files[0]}")
    assert steps[2].startswith(mapped)


def test_readme_and_tutorial_map_and_export_what_was_discovered() -> None:
    for page in (ROOT / "README.md", ROOT / "docs" / "tutorial.md"):
        after = page.read_text().partition("identify discover config.yaml")[2]
        used = re.findall(r"^identify (?:map|export) (\S+)", after, flags=re.MULTILINE)
        assert used == ["reports/arm_discovery.h5"] * 2


def test_a_fit_beside_a_discovery_of_its_study_says_that_there_is_a_better_model(tmp_path: Path) -> None:
    data, path = discovery_result(), tmp_path / "x.h5"
    result_file.write(data.before, path)
    assert fit_of(path).notes == data.before.notes
    beside = tmp_path / "x_discovery.h5"
    result_file.write(data, beside)
    (note,) = set(fit_of(path).notes) - set(data.before.notes)
    assert data.added.sentence[0] in note
    assert str(beside) in note
    assert fit_of(beside).parameters.name == data.after.parameters.name
    other = dataclasses.replace(data.provenance, config_sha256="0" * 64)
    result_file.write(dataclasses.replace(data, provenance=other), beside)
    assert fit_of(path).notes == data.before.notes, "of another study"
    beside.write_bytes(b"no result")
    assert fit_of(path).notes == data.before.notes


SHORTER = {
    "arm_hammer_test.yaml": {"starts: 10 ": "starts: 1 ", "band_hz: [3, 80]": "band_hz: [3, 40]"},
    "hidden_effects.yaml": {
        "band_hz: [3, 80]": "band_hz: [3, 25]",
        "    averages: 4\n": "    averages: 4\n    noise: {relative: 0.05}\n",
    },
}
"""What is asked for less of; beside more noise the gap is none of which a set-up is searched whole."""


@pytest.mark.parametrize("name", ["fit", "modes", pytest.param("journey", marks=pytest.mark.exam)])
def test_notebooks_run(name: str, tmp_path: Path) -> None:
    folder = tmp_path / "docs" / "notebooks"
    folder.mkdir(parents=True)
    (tmp_path / "data").symlink_to(ROOT / "data")
    (tmp_path / "configs").mkdir()
    for config, changes in SHORTER.items():
        text = (ROOT / "configs" / config).read_text()
        for long, short in changes.items():
            assert long in text
            text = text.replace(long, short)
        (tmp_path / "configs" / config).write_text(text)
    notebook = nbformat.read(ROOT / "docs" / "notebooks" / f"{name}.ipynb", as_version=4)
    NotebookClient(notebook, timeout=300, resources={"metadata": {"path": str(folder)}}).execute()
    cells = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert all(cell.execution_count for cell in cells)
    assert any("text/html" in output.get("data", {}) for cell in cells for output in cell.outputs)
    assert not any(
        cell.outputs
        for cell in nbformat.read(ROOT / "docs" / "notebooks" / f"{name}.ipynb", 4).cells
        if cell.cell_type == "code"
    )

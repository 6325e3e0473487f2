"""Damaged and hostile files kept beside the repository: each is one sentence that names it, exit code 2."""

from __future__ import annotations

from pathlib import Path

import pytest

from identify.__main__ import main
from identify.vibration.problem import load_problem
from identify.vibration.study import read_study
from tests.shared import ROOT as SHARED
from tests.shared import shared

CONFIG = Path(__file__).parents[2] / "configs" / "umons_tx200.yaml"
_FOLDER = SHARED / "hostile"
FILES = sorted(path.name for path in _FOLDER.glob("*.*") if path.suffix != ".md") or ["README.md"]


def _study(file: Path, folder: Path) -> Path:
    """The study of the shipped robot with the file in place of its own."""
    text = CONFIG.read_text(encoding="utf-8")
    data = (CONFIG.parent / "../data/umons_tx200").resolve().as_posix()
    text = text.replace("../data/umons_tx200", data)
    old = {"dh": "robot.yaml", "modal": "modes_measured.yaml", "reference": "reference.yaml"}
    name = f"{data}/{old[file.name.split('_')[0]]}"
    assert name in text
    (folder / "study.yaml").write_text(text.replace(name, file.as_posix()), encoding="utf-8")
    return folder / "study.yaml"


def _commands(file: Path, folder: Path) -> list[list[str]]:
    kind = file.name.split("_")[0]
    if kind in ("frf", "mat"):
        return [["modes", str(file), "--no-report"]] + [["report", str(file)]] * (
            file.name == "frf_channels.h5"
        )
    if kind in ("result", "config"):
        return [["report" if kind == "result" else "check", str(file)]]
    return [["fit", str(_study(file, folder)), "--no-report"]]


@pytest.mark.parametrize("name", FILES)
def test_a_hostile_file_is_one_sentence(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    file = shared("hostile", name)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("signal.signal", lambda *_: None)
    for command in _commands(file, tmp_path):
        monkeypatch.setattr("sys.argv", ["identify", *command])
        with pytest.raises(SystemExit) as ended:
            main()
        assert ended.value.code == 2
        lines = capfd.readouterr().err.splitlines()
        assert len(lines) == 1 and lines[0].startswith("error: ") and name in lines[0], lines


def test_the_same_study_with_its_own_files_runs(tmp_path: Path) -> None:
    """The negative control: what is refused above is the file."""
    own = CONFIG.parent / "../data/umons_tx200/reference.yaml"
    (tmp_path / "reference_own.yaml").write_bytes(own.read_bytes())
    assert load_problem(read_study(_study(tmp_path / "reference_own.yaml", tmp_path))).parameters

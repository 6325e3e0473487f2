"""The command line as a user meets it: exit codes, sentences, files; and how fast it answers."""

from __future__ import annotations

import io
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from identify.__main__ import main
from identify.cli import app
from identify.core.errors import InputError
from identify.fitting.optimizers.base import OPTIMIZERS
from identify.measured.loaders import FrfFileOptions, load_frf_set
from identify.results.comparison import compared
from identify.results.file import read, write
from identify.results.fit import FitResult
from identify.vibration.check import run_checks
from tests.frf_files import write_csv
from tests.programs import ran
from tests.reports.discovery_sample import discovery_result
from tests.reports.joints_sample import joints_result

ROOT = Path(__file__).parents[1]
HEAVY = ("scipy", "matplotlib", "pymoo", "plotly", "mujoco", "h5py", "pandas", "pyswarms")


@pytest.fixture(scope="module")
def fitted(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The TX200 study fitted through the command line, with reports."""
    folder = tmp_path_factory.mktemp("run")
    done = ran("fit", str(ROOT / "configs" / "umons_tx200.yaml"), "--out", "tx200.h5", cwd=folder)
    assert done.returncode == 0, done.stderr
    assert "wrote tx200.html" in done.stdout
    assert "free parameters are determined" in done.stdout
    return folder / "tx200.h5"


def test_fit_writes_result_and_reports(fitted: Path) -> None:
    result = read(fitted, FitResult)
    assert result.kind == "fit"
    assert fitted.with_suffix(".html").stat().st_size > 1e5
    assert fitted.with_suffix(".pdf").read_bytes().startswith(b"%PDF")
    assert result.provenance.config == (ROOT / "configs" / "umons_tx200.yaml").read_text()
    geometry = next(iter(result.measurements.values())).geometry
    assert geometry.skeleton_links is not None
    assert len(geometry.skeleton_links) == len(geometry.skeleton) - 1
    assert geometry.skeleton_links[1::6] == ("base", "flange"), "from the floor to the tool"


def test_compare_sets_results_side_by_side(fitted: Path) -> None:
    other = fitted.with_name("other.h5")
    text = (ROOT / "configs/umons_tx200_rebalanced.yaml").read_text().replace("../data", str(ROOT / "data"))
    # Not to the end: what is compared here need not be good.
    other.with_suffix(".yaml").write_text(text.replace("evaluations: 20000", "evaluations: 500"))
    assert (
        ran(
            "fit",
            "other.yaml",
            "--starts",
            "1",
            "--out",
            other.name,
            "--no-report",
            "-q",
            cwd=fitted.parent,
        ).stdout
        == ""
    )
    shown = ran("compare", "tx200.h5", "other.h5", cwd=fitted.parent)
    assert shown.returncode == 0
    for part in ("tx200", "other", "joint1.rz.stiffness", "12.05", "12.30", "6.50"):
        assert part in shown.stdout.replace("\n", " "), part


@pytest.mark.parametrize(
    ("encoding", "unit"), [("cp1252", "N·m/rad"), ("ascii", "N?m/rad"), ("utf-8", "N·m/rad")]
)
def test_a_pipe_of_another_code_page_ends_no_run(
    encoding: str, unit: str, fitted: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As Windows gives one to a command whose output is piped; minus signs and arrows are not in all."""
    said = io.BytesIO()
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(said, encoding=encoding, write_through=True))
    other = shutil.copy(fitted, tmp_path / "other.h5")
    monkeypatch.setattr(sys, "argv", ["identify", "compare", str(fitted), str(other)])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 0
    assert unit in said.getvalue().decode(encoding)


def test_report_again_from_the_result_alone(fitted: Path) -> None:
    before = fitted.with_suffix(".html").read_bytes()
    fitted.with_suffix(".html").unlink()
    assert ran("report", "tx200.h5", cwd=fitted.parent).returncode == 0
    assert fitted.with_suffix(".html").read_bytes() == before


def test_bad_input_is_one_sentence_and_exit_code_2(tmp_path: Path) -> None:
    (tmp_path / "config.yaml").write_text(
        "schema: identify/1\nrobot: {urdf: gone.urdf}\nmeasurements: [{file: gone.uff, posture_deg: [1]}]\n"
    )
    done = ran("fit", "config.yaml", cwd=tmp_path)
    assert done.returncode == 2
    assert done.stderr.startswith("error: ")
    assert "gone.urdf" in done.stderr
    assert "Traceback" not in done.stderr
    assert not (tmp_path / "reports").exists()


@pytest.mark.parametrize(
    "words", [["fit"], ["fit", "no-such-file.yaml"], ["report", "no.h5"], ["check", "no.yaml"], ["nonsense"]]
)
def test_wrong_words_exit_with_2(words: list[str], tmp_path: Path) -> None:
    done = ran(*words, cwd=tmp_path)
    assert done.returncode == 2
    assert "Traceback" not in done.stderr


def test_an_unfinished_fit_exits_with_4(tmp_path: Path) -> None:
    text = (ROOT / "configs" / "umons_tx200.yaml").read_text().replace("../data", str(ROOT / "data"))
    (tmp_path / "short.yaml").write_text(
        text.replace("evaluations: 20000", "evaluations: 50").replace("starts: 10", "starts: 2")
    )
    assert ran("fit", "short.yaml", "--no-report", "-q", cwd=tmp_path).returncode == 4
    assert not read(tmp_path / "reports" / "umons_tx200.h5", FitResult).converged


def test_overrides_are_used_and_kept_out_of_the_config(tmp_path: Path) -> None:
    done = ran(
        "fit",
        str(ROOT / "configs" / "umons_tx200.yaml"),
        "--seed",
        "5",
        "--starts",
        "1",
        "--no-report",
        "-q",
        cwd=tmp_path,
    )
    assert done.returncode in (0, 4)
    assert read(tmp_path / "reports" / "umons_tx200.h5", FitResult).seed == 5


def test_config_prints_every_key_with_its_meaning() -> None:
    schema = json.loads(CliRunner().invoke(app, ["config"]).stdout)
    for name, definition in [("Study", schema), *schema["$defs"].items()]:
        for key, field in definition.get("properties", {}).items():
            told = field.get("description") or key in ("kind", "robot", "measurements", "urdf", "mass_kg")
            assert told, f"{name}.{key} has no description"
    assert sorted(schema["properties"]["optimizer"]["kinds"]) == sorted(OPTIMIZERS.names())


def _imported(code: str, names: tuple[str, ...]) -> set[str]:
    """Which of these packages and modules are there after the code has run in a process of its own."""
    told = f"{code}\nimport sys; print('\\n'.join({{'.'.join(n.split('.')[:2]) for n in sys.modules}}))"
    environment = {**os.environ, "MUJOCO_GL": "disable"}
    done = subprocess.run(
        [sys.executable, "-c", told], check=True, capture_output=True, text=True, env=environment
    )
    there = set(done.stdout.split())
    return {name for name in names if name in there}


def _command(*words: str) -> str:
    return f"""import sys
from identify.__main__ import main
sys.argv = ["identify", *{list(words)!r}]
try:
    main()
except SystemExit:
    pass"""


def test_help_is_fast_because_it_imports_nothing_heavy() -> None:
    heavy = (*HEAVY, "numpy", "pydantic", "rich")
    assert _imported(_command("--help"), heavy) == set()
    assert _imported(_command("--version"), (*heavy, "typer")) == set()
    assert _imported(_command("fit", "--help"), HEAVY) == set()
    assert _imported("import identify", (*heavy, "typer")) == set()
    assert _imported("import pydantic, rich", heavy) == {"pydantic", "rich"}


def test_a_fit_imports_what_it_needs_when_it_needs_it() -> None:
    late = ("scipy.optimize", "scipy.spatial", "scipy.stats", "scipy.signal", "glfw", "matplotlib", "pymoo")
    assert _imported("import identify.vibration.run", late) == set()
    assert "scipy.optimize" in _imported("import scipy; scipy.optimize.least_squares", late)


LATE = (
    *("scipy.optimize", "scipy.signal", "scipy.stats", "scipy.interpolate"),
    *("matplotlib", "plotly", "typst", "jinja2", "glfw", "pandas"),
)
"""What takes a tenth of a second and more to import, and few commands need."""
_TX200 = str(ROOT / "configs" / "umons_tx200.yaml")
_UFF = str(ROOT / "data" / "arm_hammer_test" / "posture1.uff")


@pytest.mark.parametrize(
    ("words", "budget"),
    [
        (("check", str(ROOT / "configs" / "arm_hammer_test.yaml")), set()),
        (("fit", _TX200, "--starts", "2", "--no-report", "--out", "fit.h5"), {"scipy.optimize"}),
        (("modes", _UFF, "--no-report", "--band", "3", "40", "--out", "modes.h5"), {"scipy.optimize"}),
        (("map", "tx200.h5", "--grid", "2:-30:30:3", "--no-report", "--out", "map.h5"), set()),
        (("report", "tx200.h5"), {"matplotlib", "typst", "jinja2"}),
    ],
    ids=lambda given: given[0] if isinstance(given, tuple) else "",
)
def test_a_command_imports_no_more_than_its_budget(
    fitted: Path, monkeypatch: pytest.MonkeyPatch, words: tuple[str, ...], budget: set[str]
) -> None:
    monkeypatch.chdir(fitted.parent)
    assert _imported(_command(*words), LATE) == budget


def test_modes_of_a_plain_file_need_no_robot(tmp_path: Path) -> None:
    words = (str(ROOT / "data/arm_hammer_test/posture1.uff"), "--out", str(tmp_path / "m.h5"))
    code = _command("modes", *words, "--no-report", "--quiet", "--band", "3", "40")
    assert _imported(code, ("mujoco", "glfw", "identify.robot", "identify.modal")) == {"identify.modal"}
    assert (tmp_path / "m.h5").exists()


def test_a_shell_can_complete() -> None:
    shown = CliRunner().invoke(app, ["--help"]).stdout
    assert "--install-completion" in shown


def test_init_writes_a_config_that_asks_for_what_it_cannot_know(tmp_path: Path) -> None:
    data = ROOT / "data" / "arm_hammer_test"
    done = ran("init", str(data / "robot.urdf"), str(data / "posture1.uff"), cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "fill in `posture_deg` (line 11) and `averages` (line 12)" in done.stdout
    assert done.stdout.endswith("next: identify check config.yaml\n")
    assert "points.csv" not in done.stdout, "it exists"
    asked = ran("check", "config.yaml", cwd=tmp_path)
    assert asked.returncode == 2
    assert "posture_deg" in asked.stderr
    text = (tmp_path / "config.yaml").read_text()
    assert "FILL IN" in text
    filled = text.replace("posture_deg: null", "posture_deg: [13.4, 10.2, -1.9, 8.0, 50.0, 8.4]").replace(
        "averages: null", "averages: 4"
    )
    (tmp_path / "config.yaml").write_text(filled)
    assert ran("check", "config.yaml", cwd=tmp_path).returncode == 0
    again = ran("init", str(data / "robot.urdf"), str(data / "posture1.uff"), cwd=tmp_path)
    assert again.returncode == 2, "an existing config is not overwritten"
    words = ("--out", "other.yaml", "--points", "gone.csv")
    without = ran("init", str(data / "robot.urdf"), str(data / "posture1.uff"), *words, cwd=tmp_path)
    assert "write gone.csv, which does not exist: a line node,name,link,x_m,y_m,z_m" in without.stdout


def test_modes_asks_for_options_not_for_keys(tmp_path: Path) -> None:
    (tmp_path / "frfs.csv").write_text(
        "frequency_hz,output,input,real,imag\n1,1:+X,1:+X,1,1\n2,1:+X,1:+X,1,2\n"
    )
    refused = ran("modes", "frfs.csv", cwd=tmp_path)
    assert "add `--unit`, such as `--unit m/s^2/N`" in refused.stderr


def test_a_fit_is_compared_with_a_discovery(tmp_path: Path) -> None:
    found = discovery_result()
    write(found, tmp_path / "found.h5")
    write(found.before, tmp_path / "fitted.h5")
    runs = compared([tmp_path / "fitted.h5", tmp_path / "found.h5"]).runs
    assert [run.gap for run in runs.values()] == [found.before.gap, found.after.gap]
    write(joints_result(), tmp_path / "joints.h5")
    with pytest.raises(InputError):
        compared([tmp_path / "fitted.h5", tmp_path / "joints.h5"])


def test_init_takes_a_file_for_each_point_as_one_measurement(tmp_path: Path) -> None:
    """As a pattern, as a folder of text without header, and in the words of the shell; angles once."""
    data = ROOT / "data" / "arm_hammer_test"
    whole = load_frf_set(data / "posture1.uff", FrfFileOptions(averages=4, window_decay_per_s=1.226))
    for folder in ("p1", "bare"):
        (tmp_path / folder).mkdir()
    for i, output in enumerate(whole.outputs):
        one = whole.pairs([i], [0])
        name = str(output).replace(":", "")
        write_csv(tmp_path / "p1" / f"{name}.csv", one)
        rows = np.column_stack([one.frequency_hz, one.frf[:, 0, 0].real, one.frf[:, 0, 0].imag])
        np.savetxt(tmp_path / "bare" / f"{name}_{str(one.inputs[0]).replace(':', '')}.txt", rows)
    robot, points = str(data / "robot.urdf"), ("--points", str(data / "points.csv"))
    files = [str(path) for path in sorted((tmp_path / "p1").iterdir())]
    assert ran("init", robot, *files, *points, cwd=tmp_path).returncode == 0
    assert ran("init", robot, "p1", *points, "--out", "folder.yaml", cwd=tmp_path).returncode == 0
    words = ("--columns", "frequency_hz,real,imag", "--names", "{output}_{input}", "--out", "bare.yaml")
    refused = ran("init", robot, "bare", *points, "--out", "bare.yaml", cwd=tmp_path)
    assert refused.returncode == 2 and "--columns" in refused.stderr
    assert ran("init", robot, "bare", *words, *points, cwd=tmp_path).returncode == 0
    texts = [(tmp_path / f"{name}.yaml").read_text() for name in ("config", "folder", "bare")]
    assert '- file: "p1/*.csv"' in texts[0] and "- file: p1 " in texts[1]
    assert 'columns: ["frequency_hz", "real", "imag"]' in texts[2]
    for text, name in zip(texts, ("config", "folder", "bare"), strict=True):
        assert text.count("posture_deg: null") == 1 and "30 files of one posture" in text
        filled = text.replace("posture_deg: null", "posture_deg: [13.4, 10.2, -1.9, 8.0, 50.0, 8.4]")
        for key, value in (("averages", "4"), ("quantity", "accelerance"), ("unit", "m/s^2/N")):
            filled = filled.replace(f"{key}: null", f"{key}: {value}")
        filled = filled.replace("window_decay_per_s: 0.0", "window_decay_per_s: 1.226")
        (tmp_path / f"{name}.yaml").write_text(filled)
        checked = run_checks(tmp_path / f"{name}.yaml")
        assert not checked.refused and not checked.failed


def test_memory_that_is_not_there_is_a_sentence(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "argv", ["identify", "fit", "study.yaml"])
    monkeypatch.setattr("identify.cli._run", lambda *_: np.empty(2**55))
    with pytest.raises(SystemExit, match="2"):
        main()
    assert "error: more memory than there is (Unable to allocate" in capsys.readouterr().err


STUDY = str(ROOT / "configs" / "arm_hammer_test.yaml")


@pytest.mark.parametrize("words", [["modes", "x" * 300 + ".uff"], ["fit", STUDY, "--out", "x" * 300 + ".h5"]])
def test_a_path_that_the_system_does_not_take_is_a_sentence(
    words: list[str], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "argv", ["identify", *words])
    with pytest.raises(SystemExit, match="2"):
        main()
    said = capsys.readouterr().err
    assert "ame too long" in said and "expected a " in said and said.count("error: ") == 1

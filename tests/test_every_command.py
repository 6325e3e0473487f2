"""Every command on every study in `configs/` that it takes, through the program: exit code and last line.

Studies are as shipped, but for budgets and further measurements and records: a search may not go far, and
what a command says at its end does not depend on it.  A search for what is missing takes minutes, so it is
interrupted once it has begun.
"""

from __future__ import annotations

import signal
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from ruamel.yaml import YAML

from identify.core.analyses import ANALYSES
from tests.programs import begun, part_of, programs, ran, wait_for_more

ROOT = Path(__file__).parents[1]
CONFIGS = {path.stem: path for path in sorted((ROOT / "configs").glob("*.yaml"))}
SHARED = {"kuka_kr300"}
"""Those whose records are not in the repository."""
PUBLISHED = {"kobe_36dof", "umons_tx200", "umons_tx200_rebalanced"}
"""Those with an optimizer of their own that is not Gauss-Newton."""
FIT = {
    "arm_hammer_test": (4, "next: identify discover"),
    "fast_chirp_rx160": (4, "next: identify discover"),
    "fast_chirp_rx160_formula": (4, "next: identify discover"),
    "fast_chirp_rx160_xy": (4, "next: identify discover"),
    "hidden_effects": (4, "next: identify discover"),
    "joint_runs": (0, "next: a study takes these bodies"),
    "kawasaki_rs010l": (4, "next: identify discover"),
    "kobe_36dof": (0, "next: identify discover"),
    "kobe_36dof_defaults": (4, "next: identify discover"),
    "kobe_circle": (4, "next: identify discover"),
    "kobe_friction": (0, "wrote"),
    "nagoya_two_link": (4, "next: identify discover"),
    "nagoya_two_link_control": (2, "error: noise: no record to be fitted"),
    "nagoya_two_link_frf": (2, "error: noise: no record to be fitted"),
    "umons_open": (4, "next: identify discover"),
    "umons_tx200": (4, "wrote"),
    "umons_tx200_rebalanced": (4, "wrote"),
}
THEN = {
    "excite": "excite",
    "kuka_kr300": "explain",
    "nagoya_two_link_control": "simulate",
    "nagoya_two_link_frf": "simulate",
    "tool": "stability FIT.h5 --tool",
}
"""What `check` names as the next command, where it is not a fit."""
VIBRATION = [name for name, path in CONFIGS.items() if "\nschema: identify/1" in f"\n{path.read_text()}"]
MOTION = [name for name, path in CONFIGS.items() if "schema: identify-motion/1" in path.read_text()]
SAME = {"kobe_36dof_defaults"}
"""Those with another cost and optimizer than kobe_36dof, of which modes and plans know nothing."""
VARIANTS = {*SAME, "fast_chirp_rx160_formula", "fast_chirp_rx160_xy"}
"""Those with the robot and data of another: only a check of them is in the suite."""
BRIEF: dict[str, tuple[float, str, dict[str, Any]]] = {
    "kobe_circle": (
        0.12,
        "path",
        {"turns": 1, "feed_mm_min": 8000, "radius_mm": 1, "start_s": 0.0, "acceleration_mm_s2": 4000},
    ),
    "nagoya_two_link": (1.0, "moves", {"by_deg": 4}),
    "nagoya_two_link_frf": (2.0, "excitation", {}),
}
"""Records that end sooner: when, s, and what is then done in them."""
POINTS = (8, 11, 14, 19, 22, 27, 28, 48)
"""Those of kobe_36dof among which a plan chooses, of 48: a few sensors, and what is struck."""
SEARCHED = ("hidden_effects", "umons_open")
"""Those whose set-up is searched because the gap is large; that of the first tests/discovery/test_shipped.py
searches.
"""
NOISE = {"check": 0.9, "fit": 0.3}
"""Over the FRFs, so large that `check` has nothing to search for in those, and `fit` less."""
NO_FRF = [name for name in VIBRATION if name.startswith("umons_tx200")]


def shortened(name: str, folder: Path, command: str = "") -> Path:
    """A copy of a study with little to do for a command."""
    text = CONFIGS[name].read_text().replace("../data", str(ROOT / "data"))
    text = text.replace("../../shared", str(ROOT.parent / "shared"))
    study: dict[str, Any] = YAML(typ="safe").load(text)
    if name in PUBLISHED:
        stages = study["optimizer"] if isinstance(study["optimizer"], list) else [study["optimizer"]]
        study["optimizer"] = [{**one, "evaluations": 100} for one in stages]
    elif name in VIBRATION or name in MOTION:
        study["optimizer"] = {"kind": "gauss-newton", "evaluations": 2}
    if name in VIBRATION:
        del study["measurements"][2 if name.startswith("kobe") else 1 :]  # two stages name two of them
        if command == "plan" and name == "kobe_36dof":
            _few_points(study, folder)
        if command in NOISE and name in SEARCHED:
            study["measurements"][0]["noise"] = {"relative": NOISE[command]}
    if name in MOTION:
        del study["records"][1:]
        if name in BRIEF:
            _end_sooner(study["records"][0], folder, *BRIEF[name])
        study.pop("candidates", None)
        study.pop("extrapolate", None)
    if "starts" in study:
        study["starts"] = 1
    if name == "excite":
        study["steps"] = 1
    path = folder / f"{name}.yaml"
    with path.open("w") as file:
        YAML(typ="safe").dump(study, file)
    return path


def _few_points(study: dict[str, Any], folder: Path) -> None:
    first, *lines = Path(study["points"]).read_text().splitlines(keepends=True)
    kept = [line for line in lines if int(line.split(",")[0]) in POINTS]
    (folder / "points.csv").write_text("".join([first, *kept]))
    study["points"] = "points.csv"
    study["measurements"][1]["outputs"] = study["measurements"][0]["outputs"]


def _end_sooner(
    record: dict[str, Any], folder: Path, until_s: float, key: str, changes: dict[str, Any]
) -> None:
    """A record ends at a time, s, and so does what was measured of it; changes: of what is done in it."""
    for one in record[key] if isinstance(record[key], list) else [record[key]]:
        one.update(changes)
    record["duration_s"] = until_s
    whole = Path(record["measured"]["file"])
    first, *lines = whole.read_text().splitlines(keepends=True)
    kept = [line for line in lines if float(line.split(",")[0]) < until_s]
    (folder / whole.name).write_text("".join([first, *kept]))
    record["measured"]["file"] = whole.name


def _rows() -> Iterator[tuple[str, str, int, str, list[str]]]:
    for name in CONFIGS:
        yield "check", name, 0, f"next: identify {THEN.get(name, 'fit')} ", []
    for name, (code, last) in FIT.items():
        yield "fit", name, code, last, ["--no-report"]
    for name in MOTION:
        yield "simulate", name, 0, "wrote" if name in THEN else "next: identify fit", ["--no-report"]
    for name in (name for name in VIBRATION if name not in SAME):
        code, last = (2, "error: ") if name in NO_FRF else (0, "next: a study takes these modes")
        yield "modes", name, code, last, ["--no-report"]
        little = "--postures 1 --impacts 1 --sensors 1 --among 2 --noise 0.003 --resolution 5 --no-report"
        planned = (2, "error: ") if name in NO_FRF else (0, "wrote")
        yield "plan", name, *planned, little.split()
    yield "excite", "excite", 0, "next: run reports/excite.csv", ["--draws", "10", "--no-report"]
    for name in NO_FRF:
        yield "discover", name, 2, "error: ", ["--no-report"]


ROWS = list(_rows())


def test_the_table_has_every_study_of_every_command() -> None:
    told = {(command, name) for command, name, *_ in ROWS} | {("discover", name) for name in VIBRATION}
    told |= {(command, name) for command in ("explain", "discover") for name in SHARED}
    told |= {(command, name) for command in ("modes", "plan") for name in SAME}
    told |= {("discover", name) for name in MOTION}  # tests/motion/test_missing.py: each takes minutes
    for name, path in CONFIGS.items():
        schema = YAML(typ="safe").load(path.read_text())["schema"]
        commands = {command for one in ANALYSES if one.schema == schema for command in one.runs}
        assert {(command, name) for command in commands | {"check"}} <= told


def _marked(command: str, name: str, *row: Any) -> Any:
    """As parameters of a test: long ones that tell little more are exams."""
    exam = name in VARIANTS and command != "check"
    marks = [pytest.mark.exam] if exam else []
    return pytest.param(command, name, *row, marks=marks, id=f"{command} {name}")


@pytest.mark.parametrize(("command", "name", "code", "last", "options"), [_marked(*row) for row in ROWS])
def test_a_command_ends_as_it_should(
    command: str, name: str, code: int, last: str, options: list[str], tmp_path: Path
) -> None:
    if name in SHARED and not (ROOT.parent / "shared").exists():
        pytest.skip("its records are not in the repository")
    done = ran(command, str(shortened(name, tmp_path, command)), *options, cwd=tmp_path)
    assert "Traceback" not in done.stderr, done.stderr
    assert done.returncode == code, done.stderr
    said = done.stderr if code == 2 else done.stdout
    assert said.strip().splitlines()[-1].startswith(last), said[-300:]


@pytest.mark.parametrize(
    ("command", "name"),
    [
        *(_marked("discover", name) for name in VIBRATION if name not in NO_FRF),
        _marked("explain", "kuka_kr300"),
    ],
)
def test_a_search_begins_and_is_interrupted(command: str, name: str, tmp_path: Path) -> None:
    if name in SHARED and not (ROOT.parent / "shared").exists():
        pytest.skip("its records are not in the repository")
    out, said = tmp_path / "found.h5", tmp_path / "said"
    words = [command, str(shortened(name, tmp_path)), "--out", str(out), "--workers", "1", "--no-report"]
    if command == "discover" and name != "arm_hammer_test":
        words.append("--as-stated")  # `check` looks at their set-ups
    run = begun(programs(), words, said)
    wait_for_more(run, part_of(out), said)
    run.signal(signal.SIGINT)
    code, last = run.ended(), said.read_text().strip().splitlines()[-1]
    # Where there is nothing to find, it may have come to its end in the meantime.
    assert (code, last) == (130, "interrupted; resume with `--resume`") or (code == 0 and out.exists()), last


def test_a_tool_is_used_on_a_fit(tmp_path: Path) -> None:
    study = shortened("arm_hammer_test", tmp_path)
    assert ran("fit", str(study), "--out", "arm.h5", "--no-report", "-q", cwd=tmp_path).returncode in (0, 4)
    words = ["--tool", str(CONFIGS["tool"]), "--speeds", "2", "--draws", "20", "--no-report"]
    done = ran("stability", "arm.h5", *words, cwd=tmp_path)
    assert (done.returncode, done.stdout.strip().splitlines()[-1][:5]) == (0, "wrote"), done.stderr


def test_the_installed_program_is_the_one_that_is_tested(tmp_path: Path) -> None:
    import sys

    program = Path(sys.executable).with_name("identify")
    done = subprocess.run(
        [program, "check", CONFIGS["tool"]], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stdout.splitlines()[-1][:15]) == (0, "next: identify "), done.stderr

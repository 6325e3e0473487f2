"""Bad configs and bad input: each is one clear sentence that says where, what was found, what was expected
and what to do.
"""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from identify.core.errors import InputError, InputErrors
from identify.fitting.fit import fit
from identify.measured.channel import Channel
from identify.measured.frf_set import FrfSet
from identify.measured.uff.write import write_uff58
from identify.vibration.check import run_checks
from identify.vibration.plan import fit_plan
from identify.vibration.problem import load_problem
from identify.vibration.study import read_study
from tests.robot.random_arm import industrial_arm, write

ROOT = Path(__file__).parents[1]
GOOD = """\
schema: identify/1
robot: {urdf: robot.urdf}
points: points.csv
measurements:
  - {file: frf.uff, posture_deg: [10, 20, 30, 40, 50, 60], averages: 4}
band_hz: [5, 60]
effects:
  - {kind: joint-compliance, axes: [rz], stiffness: {initial: 1.0e+6, bounds: [1.0e+3, 1.0e+9]}}
"""
POINTS = "node,name,link,x_m,y_m,z_m\n1,elbow,link3,0.1,0,0.1\n2,tool,link6,0,0,0.1\n"


def _frf_set() -> FrfSet:
    f = np.arange(2.0, 80.0)
    outputs, rng = (
        tuple(Channel(node, axis) for node in (1, 2) for axis in (1, 2, 3)),
        np.random.default_rng(0),
    )
    frf = rng.normal(size=(len(f), 6, 1)) + 1j * rng.normal(size=(len(f), 6, 1))
    coherence = np.full(frf.shape, 0.99)
    return FrfSet(f, frf, outputs, (Channel(2, 3),), "accelerance", coherence)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with a good study of random FRFs, to be spoilt."""
    write(tmp_path, industrial_arm(1))
    (tmp_path / "points.csv").write_text(POINTS)
    write_uff58(tmp_path / "frf.uff", _frf_set())
    (tmp_path / "config.yaml").write_text(GOOD)
    return tmp_path


def _message(folder: Path) -> str:
    with pytest.raises((InputError, InputErrors)) as caught:
        fit(fit_plan(load_problem(read_study(folder / "config.yaml"))))
    return str(caught.value)


def _replace(folder: Path, old: str, new: str) -> None:
    assert old in GOOD
    (folder / "config.yaml").write_text(GOOD.replace(old, new))


def test_the_good_study_loads(folder: Path) -> None:
    problem = load_problem(read_study(folder / "config.yaml"))
    assert len(problem.parameters) == 12
    assert problem.measurements[0].target.data.frf.shape == (56, 6, 1)  # type: ignore[union-attr]


CONFIG_FAULTS: list[tuple[str, str, str, list[str]]] = [
    ("broken YAML", "band_hz: [5, 60]", "band_hz: [5, 60", ["config.yaml line", "broken YAML"]),
    (
        "unknown key",
        "band_hz:",
        "band_hertz:",
        ["line 6: band_hertz: unknown key", "did you mean `band_hz`?"],
    ),
    (
        "a number beyond all computing",
        "band_hz: [5, 60]",
        "band_hz: [5, 1e300]",
        ["line 6", "the number 1e300, beyond all that can be computed with"],
    ),
    (
        "a pair of which one is missing",
        "band_hz: [5, 60]",
        "band_hz: [5]",
        ["line 6: band_hz.1: missing"],
    ),
    (
        "unknown key with a capital",
        "band_hz:",
        "Band_hz:",
        ["line 6: Band_hz: unknown key", "did you mean `band_hz`?"],
    ),
    (
        "unknown key deep down",
        "averages: 4",
        "averagges: 4",
        ["line 5: measurements.0.averagges: unknown key", "did you mean `averages`?"],
    ),
    ("unknown key of an effect", "axes: [rz]", "axis: [rz]", ["effects.0.axis", "unknown key"]),
    (
        "old key of a spring to the ground",
        "{kind: joint-compliance,",
        "{kind: spring-to-ground, link: link2, leaning: true}\n  - {kind: joint-compliance,",
        ["line 8: effects.0: leaning: an old name; expected `cross_coupling`: rename the key"],
    ),
    (
        "old key of a flexible link",
        "{kind: joint-compliance,",
        "{kind: link-flexibility, link: link2, uneven: true}\n  - {kind: joint-compliance,",
        ["line 8: effects.0: uneven: an old name; expected `nonuniform`: rename the key"],
    ),
    (
        "old key of a measured impedance",
        "{kind: joint-compliance,",
        "{kind: measured-impedance, at: [joint2.rx], lean: {joint2.ry: 0.1}}\n  - {kind: joint-compliance,",
        ["line 8: effects.0: lean: an old name; expected `misalignment`: rename the key"],
    ),
    (
        "unknown effect",
        "joint-compliance",
        "joint-complaint",
        ["effects.0", "unknown effect 'joint-complaint'", "one of added-mass"],
    ),
    ("unknown axis", "axes: [rz]", "axes: [rw]", ["effects.0.axes.0", "'rw'"]),
    ("wrong type", "averages: 4", "averages: four", ["measurements.0.averages", "'four'"]),
    ("missing key", "robot: {urdf: robot.urdf}\n", "", ["robot: missing"]),
    ("wrong schema", "identify/1", "identify/9", ["schema", "'identify/9'", "identify/1"]),
    ("band crossed", "[5, 60]", "[60, 5]", ["band_hz", "the lower frequency first"]),
    (
        "bounds crossed",
        "[1.0e+3, 1.0e+9]",
        "[1.0e+9, 1.0e+3]",
        ["effects.0.stiffness.bounds", "the smaller bound first"],
    ),
    (
        "start outside bounds",
        "initial: 1.0e+6",
        "initial: 1.0e+12",
        ["start value 1e+12", "within its bounds"],
    ),
    (
        "posture of the wrong length",
        "40, 50, 60]",
        "40]",
        ["measurements.0.posture_deg: 4 angles", "expected 6"],
    ),
    ("missing data file", "frf.uff", "gone.uff", ["gone.uff", "cannot be read"]),
    ("missing robot file", "robot.urdf", "gone.urdf", ["gone.urdf"]),
    ("missing points file", "points: points.csv", "points: gone.csv", ["gone.csv"]),
    ("nothing to fit", "averages: 4", "averages: 4, use: validate", ["all are for validation"]),
    (
        "no data in band",
        "[5, 60]",
        "[500, 600]",
        ["frf: no frequency line in the band [500, 600] Hz", "2 to 79 Hz", "band_hz"],
    ),
    (
        "unit against the file",
        "averages: 4",
        "averages: 4, unit: mm/N",
        ["the file says accelerance", "remove the key unit"],
    ),
    ("unknown unit", "averages: 4", "averages: 4, unit: furlong/N", ["furlong"]),
    ("averages not given", ", averages: 4", "", ["averages"]),
    (
        "unknown detached link",
        "averages: 4",
        "averages: 4, detached: link9",
        ["unknown link 'link9'", "one of base_link"],
    ),
    (
        "channel not in the file",
        "averages: 4",
        "averages: 4, outputs: ['9:+X']",
        ["channel 9:+X is not in the file", "one of 1:+X"],
    ),
]


@pytest.mark.parametrize(
    ("old", "new", "parts"), [fault[1:] for fault in CONFIG_FAULTS], ids=[fault[0] for fault in CONFIG_FAULTS]
)
def test_config_faults(folder: Path, old: str, new: str, parts: list[str]) -> None:
    _replace(folder, old, new)
    message = _message(folder)
    for part in parts:
        assert part in message, message


def test_a_parameter_that_the_data_cannot_move(folder: Path) -> None:
    """An impact on link 3 seen on link 3 does not move the last joint's spring when the wrist is taken
    off.
    """
    _replace(folder, "file: frf.uff", "file: elbow.uff, detached: link5")
    write_uff58(folder / "elbow.uff", _frf_set().pairs([0, 1, 2], [0]))
    text = (folder / "elbow.uff").read_text().replace("link6", "link3")
    (folder / "elbow.uff").write_text(text)
    (folder / "points.csv").write_text(POINTS.replace("tool,link6", "tool,link3"))
    message = _message(folder)
    assert "no measured data can move joint5.rz.stiffness" in message
    assert "fixed: true" in message


DATA_FAULTS: list[tuple[str, Callable[[Path], object], list[str]]] = [
    (
        "truncated UFF",
        lambda f: f.write_bytes(f.read_bytes()[: f.stat().st_size * 7 // 10]),
        ["frf.uff", "the file ends inside a dataset"],
    ),
    ("empty file", lambda f: f.write_bytes(b""), ["frf.uff"]),
    ("no UFF at all", lambda f: f.write_text("hello\n" * 50), ["frf.uff"]),
]


@pytest.mark.parametrize(
    ("spoil", "parts"), [fault[1:] for fault in DATA_FAULTS], ids=[fault[0] for fault in DATA_FAULTS]
)
def test_data_faults(folder: Path, spoil: Callable[[Path], object], parts: list[str]) -> None:
    spoil(folder / "frf.uff")
    message = _message(folder)
    for part in parts:
        assert part in message, message


def test_other_node_numbers(folder: Path) -> None:
    (folder / "points.csv").write_text(POINTS.replace("\n2,tool", "\n7,tool"))
    assert "channel 2:+X has no point" in _message(folder)


def test_nan_in_the_data(folder: Path) -> None:
    data = _frf_set()
    data.frf[20, 3, 0] = np.nan
    np.savetxt(
        folder / "frf.csv",
        [
            [f, *np.ravel([[h.real, h.imag] for h in row[:, 0]])]
            for f, row in zip(data.frequency_hz, data.frf, strict=True)
        ],
        delimiter=",",
        header="frequency_hz,"
        + ",".join(f"{o}/{data.inputs[0]} {part}" for o in data.outputs for part in ("real", "imag")),
        comments="",
    )
    _replace(
        folder,
        "file: frf.uff",
        "file: frf.csv, quantity: accelerance, unit: m/s^2/N, noise: {relative: 0.02}",
    )
    message = _message(folder)
    assert "frf.csv" in message
    assert "nan" in message.lower(), message


def test_all_faults_of_a_config_are_told_at_once(folder: Path) -> None:
    (folder / "config.yaml").write_text(
        GOOD.replace("band_hz", "band").replace("averages: 4", "averages: x").replace("[rz]", "[ry, ry]")
    )
    message = _message(folder)
    assert len(message.splitlines()) == 3
    assert "an axis is named twice" in message


def test_several_missing_files_are_told_at_once(folder: Path) -> None:
    line = next(line for line in GOOD.splitlines() if "frf.uff" in line)
    _replace(folder, line, line.replace("frf.uff", "a.uff") + "\n" + line.replace("frf.uff", "b.uff"))
    message = _message(folder)
    assert "a.uff" in message
    assert "b.uff" in message


def test_paths_are_relative_to_the_config(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    monkeypatch.chdir(elsewhere)
    shutil.copy(folder / "config.yaml", folder / "copy.yaml")
    assert load_problem(read_study(folder / "copy.yaml")).robot.name


def _refused(tmp_path: Path, text: str) -> str:
    (tmp_path / "config.yaml").write_text(text)
    with pytest.raises(InputErrors) as refused:
        read_study(tmp_path / "config.yaml")
    return str(refused.value)


def test_a_typing_error_is_answered_with_what_was_meant(tmp_path: Path) -> None:
    robot = f"schema: identify/1\nrobot: {{urdf: {ROOT / 'data' / 'arm_hammer_test' / 'robot.urdf'}}}\n"
    one = robot + "measurements: [{file: a.uff, posture_deg: [1]}]\n"
    said = _refused(tmp_path, one + "effects: [{kind: joint-complience}]\ncost: frf-leastsquares\nNmae: x\n")
    assert "config.yaml line 4: effects.0: unknown effect 'joint-complience'" in said
    assert "did you mean `joint-compliance`?" in said
    assert "did you mean `frf-least-squares`?" in said
    assert "config.yaml line 6: Nmae: unknown key" in said
    assert "did you mean" not in _refused(tmp_path, one + "effects: [{kind: xyz}]\n")


def test_angles_that_were_not_filled_in_are_counted(tmp_path: Path) -> None:
    robot = ROOT / "data" / "arm_hammer_test" / "robot.urdf"
    text = "schema: identify/1\nrobot: {{urdf: {}}}\nmeasurements: [{{file: a.uff, posture_deg: null}}]\n"
    assert "not filled in; expected 6 angles, one per joint (joint1, " in _refused(
        tmp_path, text.format(robot)
    )
    without = _refused(tmp_path, text.format("gone.urdf"))
    assert "line 3: measurements.0.posture_deg: not filled in; expected a list" in without


def test_a_file_that_is_not_there_is_named_with_its_line(tmp_path: Path) -> None:
    config = tmp_path / "config.yaml"
    config.write_text(
        "schema: identify/1\nrobot: {urdf: gone.urdf}\nmeasurements: [{file: a.uff, posture_deg: [1]}]\n"
    )
    refused = run_checks(config).refused
    assert any(f"a.uff (measurements.0.file in {config} line 3): " in str(error) for error in refused)

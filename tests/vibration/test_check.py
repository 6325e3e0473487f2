"""`identify check` says before a fit what would make the fit wrong or refuse to start."""

from __future__ import annotations

import csv
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from ruamel.yaml import YAML
from typer.testing import CliRunner

from identify.cli import app
from identify.core.arrays import Array
from identify.measured.finding import STUDY, Checked
from identify.measured.loaders import FrfFileOptions, load_frf_set
from identify.vibration.check import run_checks
from tests.frf_files import write_csv

ROOT = Path(__file__).parents[2]
CONFIG = ROOT / "configs" / "arm_hammer_test.yaml"
Change = Callable[[dict[str, Any], Path], None]


def changed(folder: Path, change: Change) -> Path:
    """The shipped study, its paths made absolute, with something changed, and then of its first posture
    alone, which says as much.
    """
    data = YAML(typ="safe").load(CONFIG.read_text())
    if change is not nothing:
        del data["measurements"][1:]
    data["robot"]["urdf"] = str((CONFIG.parent / data["robot"]["urdf"]).resolve())
    data["points"] = str((CONFIG.parent / data["points"]).resolve())
    for measurement in data["measurements"]:
        measurement["file"] = str((CONFIG.parent / measurement["file"]).resolve())
    change(data, folder)
    path = folder / "config.yaml"
    with path.open("w") as file:
        YAML(typ="safe").dump(data, file)
    return path


def points_scaled(factor: float) -> Change:
    def change(data: dict[str, Any], folder: Path) -> None:
        rows = list(csv.DictReader(Path(data["points"]).read_text().splitlines()))
        with (folder / "points.csv").open("w", newline="") as file:
            writer = csv.DictWriter(file, list(rows[0]))
            writer.writeheader()
            for row in rows:
                writer.writerow({**row, **{key: factor * float(row[key]) for key in ("x_m", "y_m", "z_m")}})
        data["points"] = str(folder / "points.csv")

    return change


def angles(convert: Callable[[float], float]) -> Change:
    def change(data: dict[str, Any], folder: Path) -> None:
        for measurement in data["measurements"]:
            measurement["posture_deg"] = [convert(angle) for angle in measurement["posture_deg"]]

    return change


def same_file_twice(data: dict[str, Any], folder: Path) -> None:
    data["measurements"].append({**data["measurements"][0], "name": "again"})


def four_digits(values: Array) -> Array:
    unit = 10.0 ** (np.floor(np.log10(np.abs(values))) - 3)
    return np.asarray(np.round(values / unit) * unit)


def same_data_in_another_file(data: dict[str, Any], folder: Path) -> None:
    """Under another name, as CSV with four digits, half of the channels, and never fitted."""
    first = data["measurements"][0]
    options = FrfFileOptions(window_decay_per_s=first["window_decay_per_s"], averages=first["averages"])
    few = load_frf_set(Path(first["file"]), options).pairs([3, 4, 7], [1])
    rounded = four_digits(few.frf.real) + 1j * four_digits(few.frf.imag)
    write_csv(folder / "copy.csv", replace(few, frf=rounded))
    again = {**first, "name": "held_out", "file": str(folder / "copy.csv"), "use": "validate"}
    data["measurements"].append(again)


def a_repeat_twice(data: dict[str, Any], folder: Path) -> None:
    first = data["measurements"][0]
    first["repeats"] = [first["file"]]


def other_outputs_of_one_file(data: dict[str, Any], folder: Path) -> None:
    first = data["measurements"][0]
    data["measurements"][0] = {**first, "outputs": ["12:+X"]}
    data["measurements"].append({**first, "name": "again", "outputs": ["12:+Y"]})


def stiff(data: dict[str, Any], folder: Path) -> None:
    data["effects"][0]["stiffness"] = {"initial": 1e13, "bounds": [1e12, 1e14]}
    del data["effects"][0]["damping"]


def one_coordinate(x_m: float) -> Change:
    def change(data: dict[str, Any], folder: Path) -> None:
        *others, last = Path(data["points"]).read_text(encoding="utf-8").splitlines()
        words = last.split(",")
        words[3] = str(x_m)
        (folder / "points.csv").write_text("\n".join([*others, ",".join(words)]))
        data["points"] = str(folder / "points.csv")

    return change


def with_payload(x_m: float) -> Change:
    def change(data: dict[str, Any], folder: Path) -> None:
        data["robot"]["payload"] = [{"link": "link6", "mass_kg": 5.0, "centre_m": [x_m, 0, 0]}]

    return change


def with_hose(x_m: float) -> Change:
    def change(data: dict[str, Any], folder: Path) -> None:
        mass = {"initial": 1.0, "bounds": [0, 10]}
        data["effects"].append({"kind": "added-mass", "link": "link3", "at_m": [x_m, 0, 0], "mass": mass})

    return change


def nothing(data: dict[str, Any], folder: Path) -> None:
    """The shipped study."""


def with_mesh(inside: str) -> Change:
    def change(data: dict[str, Any], folder: Path) -> None:
        text = Path(data["robot"]["urdf"]).read_text(encoding="utf-8")
        body = f"<visual><geometry>{inside}</geometry></visual>"
        (folder / "arm.urdf").write_text(text.replace("</link>", f"{body}</link>", 1), encoding="utf-8")
        data["robot"]["urdf"] = str(folder / "arm.urdf")

    return change


def found(checked: Checked) -> dict[str, str]:
    return {finding.check: finding.level for finding in checked.findings[STUDY]}


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (nothing, {}),
        (with_mesh('<box size="0.2 0.2 0.2"/>'), {}),
        (with_mesh('<mesh filename="package://arm/gone.stl"/>'), {"no-mesh": "info"}),
        (points_scaled(1000.0), {"far-point": "fail"}),
        (points_scaled(0.001), {}),
        (one_coordinate(164.0), {"far-point": "fail"}),
        (with_payload(164.0), {"far-place": "fail", "robot-inertia": "warn"}),
        (with_hose(164.0), {"far-place": "fail"}),
        (with_payload(0.2), {}),
        (with_hose(0.2), {}),
        (angles(math.radians), {"radians": "warn"}),
        (angles(lambda angle: angle + 400.0), {"joint-limit": "warn"}),
        (other_outputs_of_one_file, {}),
        (stiff, {"first-resonance": "warn"}),
    ],
    ids=[
        "as shipped",
        "box",
        "no mesh",
        "mm",
        "km",
        "one coordinate in mm",
        "payload in mm",
        "hose in mm",
        "payload",
        "hose",
        "radians",
        "limits",
        "other outputs",
        "too stiff",
    ],
)
def test_what_a_fit_would_swallow_is_found(tmp_path: Path, change: Change, expected: dict[str, str]) -> None:
    checked = run_checks(changed(tmp_path, change))
    assert found(checked) == expected
    assert checked.refused == ()


def too_few_angles(data: dict[str, Any], folder: Path) -> None:
    data["measurements"][0]["posture_deg"].pop()


def unknown_link(data: dict[str, Any], folder: Path) -> None:
    text = Path(data["points"]).read_text().replace(",link6,", ",link66,", 1)
    (folder / "points.csv").write_text(text)
    data["points"] = str(folder / "points.csv")


def missing_urdf(data: dict[str, Any], folder: Path) -> None:
    data["robot"]["urdf"] = str(folder / "nowhere.urdf")


def xacro(data: dict[str, Any], folder: Path) -> None:
    (folder / "arm.xacro").write_text(
        '<robot xmlns:xacro="http://www.ros.org/wiki/xacro" name="arm"><xacro:arm/></robot>'
    )
    data["robot"]["urdf"] = str(folder / "arm.xacro")


def unknown_joint(data: dict[str, Any], folder: Path) -> None:
    data["effects"] = [{"kind": "joint-compliance", "joints": ["elbow"]}]


def unknown_start(data: dict[str, Any], folder: Path) -> None:
    data["initial"] = {"joint9.rz.stiffness": 1e6}


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (too_few_angles, "5 angles"),
        (unknown_link, "unknown link 'link66'"),
        (missing_urdf, "nowhere.urdf"),
        (xacro, "xacro"),
        (unknown_joint, "unknown joint 'elbow'"),
        (unknown_start, "no parameter is called 'joint9.rz.stiffness'"),
        (same_file_twice, "90 of the FRFs are those of posture1"),
        (same_data_in_another_file, "3 of the FRFs are those of posture1"),
        (a_repeat_twice, "the same FRFs"),
    ],
)
def test_what_a_fit_would_refuse_is_refused(tmp_path: Path, change: Change, said: str) -> None:
    config = changed(tmp_path, change)
    checked = CliRunner().invoke(app, ["check", str(config)])
    fitted = CliRunner().invoke(app, ["fit", str(config), "--out", str(tmp_path / "x.h5"), "--no-report"])
    assert any(said in str(error) for error in run_checks(config).refused)
    assert checked.exception is not None
    assert str(fitted.exception) == str(checked.exception)

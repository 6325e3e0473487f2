"""`identify fit` on a study of joints: the shipped set, files, reports, refusals."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from ruamel.yaml import YAML
from typer.testing import CliRunner

from identify.cli import app
from identify.core.errors import InputError, InputErrors
from identify.joints.base import parse_curve
from identify.joints.run import run_joints
from identify.reports.write import write_reports
from identify.results import file as result_file
from identify.results.joints import JointsResult
from tests.generator import joint_runs, kobe_circle
from tests.joints.memory import bench, value
from tests.joints.test_base_parameters import described

ROOT = Path(__file__).parents[2]
DATA = ROOT / "data/joint_runs"
SIGNALS = {
    "motor_position": {"at": "joint{joint}.motor_rad", "unit": "rad"},
    "link_position": {"at": "joint{joint}.link_rad", "unit": "rad"},
    "motor_torque": {"at": "joint{joint}.torque_N_m", "unit": "N m"},
}
LOADS = {
    "kind": "stiffness-static",
    "joint": 2,
    "files": [str(DATA / "loads.csv")],
    "torque": SIGNALS["motor_torque"],
}
SLOW = {"kind": "transmission-error", "joint": 2, "files": [str(DATA / "slow.csv")], "orders": [1, 2]}
STEPS = {
    "kind": "friction-constant-velocity",
    "joint": 2,
    "files": [str(DATA / f"speed{n:02d}.csv") for n in range(1, 12)],
}
SINE = {"kind": "friction-sinusoidal", "joint": 3, "files": [str(DATA / "sine1.csv")]}


def study(folder: Path, *curves: Any, **keys: Any) -> Path:
    """A config with these curves."""
    plain = {
        "schema": "identify-joints/1",
        "name": "joints",
        "gear_ratio": [180, 160, 140],
        "torque_at": "motor",
        "signals": SIGNALS,
    }
    path = folder / "joints.yaml"
    path.write_text(json.dumps({**plain, "lowpass_hz": 10, "curves": list(curves), **keys}))
    return path


def test_the_shipped_runs_give_the_truth_and_are_reported(tmp_path: Path) -> None:
    result, [path] = run_joints(study(tmp_path, LOADS, SLOW, STEPS, SINE), tmp_path / "run.h5")
    truth = json.loads((DATA / "truth.json").read_text())
    steps, sine = (
        result.curves["joint2 friction-constant-velocity"],
        result.curves["joint3 friction-sinusoidal"],
    )
    for found, joint, names in (
        (steps, "joint2", ("coulomb", "viscous", "stribeck")),
        (sine, "joint3", ("coulomb",)),
    ):
        for name in names:
            assert value(found, name)[0] == pytest.approx(truth[joint][name], rel=0.1)
    assert value(result.curves["joint2 stiffness-static"], "stiffness")[0] == pytest.approx(
        truth["joint2"]["stiffness"], rel=0.03
    )
    again = result_file.read(path, JointsResult)
    assert again.verdict == result.verdict
    label = "joint2 transmission-error"
    np.testing.assert_array_equal(again.curves[label].values.value, result.curves[label].values.value)
    page, printed = write_reports(path)
    assert "cubic_stiffness" in page.read_text()
    assert printed.read_bytes()[:5] == b"%PDF-"


def test_the_kobe_robot_s_friction_is_found_from_its_own_records(tmp_path: Path) -> None:
    """Each joint to and fro alone; base and links swing along.  What the circle of that study is given."""
    config = YAML(typ="safe").load((ROOT / "configs/kobe_friction.yaml").read_text())
    found = run_joints(ROOT / "configs/kobe_friction.yaml", tmp_path / "run.h5")[0].curves
    given = YAML(typ="safe").load((ROOT / "configs/kobe_circle.yaml").read_text())["friction"]
    assert len(found) == len(config["curves"]) == len(kobe_circle.COULOMB)
    for name, truth in (("coulomb", kobe_circle.COULOMB), ("viscous", kobe_circle.VISCOUS)):
        rows = [value(curve, name) for curve in found.values()]
        assert all(low < true < high for (_, low, high, _), true in zip(rows, truth, strict=True))
        assert all(high - low < 0.06 * true for (_, low, high, _), true in zip(rows, truth, strict=True))
        np.testing.assert_allclose([row[0] for row in rows], given[name]["initial"], rtol=1e-3)


def test_the_weights_of_robot_and_disks_give_the_torque(tmp_path: Path) -> None:
    joint_runs.write(tmp_path / "loads.csv", joint_runs.static_loads(), time=False)
    weighed = {
        "kind": "stiffness-static",
        "joint": 2,
        "files": ["loads.csv"],
        "weights": {"at": "disks_kg", "link": "link3"},
    }
    given = {**weighed, "weights": None, "torque": {"at": "joint2.torque_N_m", "unit": "N m"}}
    one, other = (
        parse_curve(settings).identify(bench(None, described(tmp_path), tmp_path))
        for settings in (weighed, given)
    )
    np.testing.assert_allclose(one.values.value[:3], other.values.value[:3], rtol=2e-3)


FAULTS: list[tuple[dict[str, Any], dict[str, Any], str]] = [
    (LOADS, {"torque": None}, "give either `torque` or `weights`"),
    (LOADS, {"kind": "stifness"}, "unknown curve 'stifness'; expected one of base-parameters"),
    (LOADS, {"joint": 7}, "a number from 1 to 3"),
    (
        LOADS,
        {"torque": {"at": "disks_kg", "unit": "N"}, "files": [str(DATA / "sine1.csv")]},
        "nothing of that name",
    ),
    (LOADS, {"torque": {"at": "joint1.motor_rad", "unit": "N m"}}, "all alike"),
    (LOADS, {"torque": None, "weights": {"at": "disks_kg", "link": "link3"}}, "no `robot` in the study"),
    (STEPS, {"files": STEPS["files"][:4]}, "velocities that are driven both ways"),
    (SLOW, {"files": [str(DATA / "speed01.csv")]}, "nothing of that name"),
    (SINE, {"files": [str(DATA / "no.csv")]}, "cannot be read"),
    (SINE, {"joints": 3}, "joints"),
    ({"kind": "base-parameters", "files": [str(DATA / "excited.csv")]}, {}, "no `robot` in the study"),
]


@pytest.mark.parametrize(("curve", "change", "said"), FAULTS, ids=[said[:30] for _, _, said in FAULTS])
def test_bad_input_is_refused_in_a_sentence(
    tmp_path: Path, curve: dict[str, Any], change: dict[str, Any], said: str
) -> None:
    with pytest.raises((InputError, InputErrors)) as caught:
        run_joints(study(tmp_path, {**curve, **change}), tmp_path / "run.h5")
    assert said in str(caught.value)


def test_two_curves_need_two_names(tmp_path: Path) -> None:
    with pytest.raises(InputErrors, match="two are called"):
        run_joints(study(tmp_path, SINE, SINE), tmp_path / "run.h5")


def test_the_command_line_dispatches_and_refuses(tmp_path: Path) -> None:
    config, runner = study(tmp_path, SINE), CliRunner()
    done = runner.invoke(app, ["fit", str(config), "--no-report", "--out", str(tmp_path / "run.h5")])
    assert done.exit_code == 0, done.output
    assert "coulomb" in done.output
    refused = runner.invoke(app, ["fit", str(config), "--no-report", "--starts", "3"])
    assert isinstance(refused.exception, InputError)
    assert "leave the option out" in str(refused.exception)

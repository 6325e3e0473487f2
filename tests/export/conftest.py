"""Results of fits that ended after two steps: models as good as any to be exported."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from ruamel.yaml import YAML

from identify.vibration.run import run_fit

ROOT = Path(__file__).parents[2]
RZ = {"kind": "joint-compliance", "stiffness": {"initial": [2e6, 8e6, 1e7, 2e5, 9e5, 7e4]}}
GEARS = {"joints": [2], "gear_ratio": [100.0], "inertia": {"initial": 1e-3}}
LOOPS = {"position_gain_per_s": 20.0, "integral_time_s": 0.05, "current_bandwidth_hz": 500.0}
EFFECTS: dict[str, list[dict[str, Any]]] = {
    "plain": [RZ],
    "rich": [
        RZ,
        {"kind": "base-compliance", "axes": ["rx", "ry", "tz"]},
        {"kind": "joint-compliance", "joints": [2, 3], "axes": ["rx", "ry"], "coupled": True},
        {"kind": "appended-resonator", "link": "link3", "axis": "y"},
        {"kind": "added-mass", "link": "link6"},
        {"kind": "spring-to-ground", "link": "link2"},
        {"kind": "rotor-inertia", **GEARS, "holding_stiffness": {"initial": 1e7}},
    ],
    "shrink": [RZ, {"kind": "joint-compliance", "joints": [2, 3], "axes": ["rx", "ry"], "shrink": True}],
    "bend": [RZ, {"kind": "link-flexibility", "link": "link2"}],
    "servo": [RZ, {"kind": "servo", **GEARS, **LOOPS}],
    "lossy": [RZ, {"kind": "hysteretic-damping"}, {"kind": "time-delay"}],
}
Result = Callable[[str], Path]


@pytest.fixture(scope="session")
def result(tmp_path_factory: pytest.TempPathFactory) -> Result:
    """A result file by the name of its effects, made when it is first asked for."""
    made: dict[str, Path] = {}
    folder = tmp_path_factory.mktemp("export")

    def of(name: str) -> Path:
        if name not in made:
            study = YAML(typ="safe").load((ROOT / "configs" / "arm_hammer_test.yaml").read_text())
            data = ROOT / "data" / "arm_hammer_test"
            study["robot"]["urdf"], study["points"] = str(data / "robot.urdf"), str(data / "points.csv")
            del study["measurements"][1 if name != "plain" else 2 :]
            for measurement in study["measurements"]:
                measurement["file"] = str(data / Path(measurement["file"]).name)
            study |= {"name": name, "effects": EFFECTS[name], "starts": 1}
            study["optimizer"] = {"kind": "gauss-newton", "evaluations": 2}
            with (folder / f"{name}.yaml").open("w") as file:
                YAML(typ="safe").dump(study, file)
            run_fit(folder / f"{name}.yaml", folder / f"{name}.h5", {})
            made[name] = folder / f"{name}.h5"
        return made[name]

    return of

"""Is what is found of a robot the same however it is described?

    python -m tests.benchmarks.robots_otherwise [--only NAME]

The shipped study of hidden effects, its robot and points described in the ways of `tests.robots_otherwise`,
through `identify discover`: one line of what is missing and the time for each.  Right is the tilt of joint 2
(coupled, where its axes are turned) and a delay of all responses, with a gap of 1.02.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from identify.core.yaml_input import flat, parse_yaml, yaml_text
from tests.robots_otherwise import OTHERWISE, Described

ROOT = Path(__file__).parents[2]
NAME = "hidden_effects"


def written(folder: Path, name: str) -> Path:
    """The study in a folder, described so."""
    shutil.copytree(ROOT / "data" / NAME, folder, dirs_exist_ok=True)
    told = parse_yaml((ROOT / "configs" / f"{NAME}.yaml").read_text().replace(f"../data/{NAME}/", ""), name)
    robot, points = folder / "robot.urdf", folder / "points.csv"
    postures = [list(map(float, one["posture_deg"])) for one in told["measurements"]]
    one = Described.of(robot.read_text(), points.read_text(), postures)
    OTHERWISE[name](one)
    for path, text in zip((robot, points), one.texts(), strict=True):
        path.write_text(text, encoding="utf-8")
    for measurement, posture in zip(told["measurements"], one.postures, strict=True):
        measurement["posture_deg"] = flat(posture)
    study = folder / "study.yaml"
    study.write_text(yaml_text(told), encoding="utf-8")
    return study


def main() -> None:
    """Runs all ways, or one, one after the other."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", choices=list(OTHERWISE))
    only = parser.parse_args().only
    for name in [only] if only else OTHERWISE:
        with tempfile.TemporaryDirectory() as folder:
            study = written(Path(folder), name)
            words = ["discover", str(study), "--workers", "1", "--time", "300", "--no-report"]
            begun = time.perf_counter()
            done = subprocess.run(
                [sys.executable, "-m", "identify", *words],
                cwd=folder,
                capture_output=True,
                text=True,
                check=False,
            )
            said = (done.stdout or done.stderr).strip().splitlines()[:1]
            print(f"{name:18s} {time.perf_counter() - begun:5.0f} s  {' '.join(said)}", flush=True)


if __name__ == "__main__":
    main()

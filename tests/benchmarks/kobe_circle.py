"""The circular test of the Kobe study beside the paper's Fig. 16: python -m tests.benchmarks.kobe_circle;
writes docs/kobe_circle.png.

Besides the study as it is: without friction, without elastic coordinates, and with half the step.
"""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from identify.motion.evaluate import evaluate_simulation
from identify.motion.problem import load_motion
from identify.motion.study import MotionFile, read_motion_study
from identify.reports.kit.figures import style
from identify.reports.motion.sections import circles
from identify.results.circular import CircularTest

ROOT = Path(__file__).parents[2]
VARIANTS: dict[str, dict[str, Any]] = {
    "as it is": {},
    "half the step": {"step_s": 2.5e-4 / 12},
    "without friction": {"friction": {}},
    "rigid joints": {"effects": []},
}


def changed(file: MotionFile, keys: dict[str, Any]) -> MotionFile:
    """The study with other values of some keys."""
    given = {name: getattr(file.study, name) for name in file.study.model_fields_set if name != "schema_"}
    return file.model_copy(
        update={"study": type(file.study).model_validate({"schema": "identify-motion/1", **given, **keys})}
    )


def run(name: str, file: MotionFile) -> dict[str, CircularTest]:
    """Simulate and print."""
    began = time.process_time()
    result = evaluate_simulation(load_motion(file))
    record = result.records["circle"]
    tests = record.circles
    assert tests is not None
    assert record.paths is not None
    print(
        f"{name}: steps of {1e6 * result.step_s:.1f} µs, {time.process_time() - began:.0f} s for"
        f" {record.time_s[-1]:.1f} s",
        flush=True,
    )
    for path, test in tests.items():
        quadrant = (test.angle // (np.pi / 2)).astype(int) % 4
        largest = ", ".join(
            f"{1e6 * np.abs(test.error[quadrant == number]).max():.0f}" for number in range(4)
        )
        sizes = (
            f"mean radius {1e3 * test.radius:.4f} mm, deviation {1e6 * test.deviation:.1f}, RMS"
            f" {1e6 * test.rms:.1f}"
        )
        print(
            f"  {path}: {sizes}, above 8 waves a turn {1e6 * _waves(test):.2f}, largest by quadrant"
            f" {largest} µm",
            flush=True,
        )
    return tests


def _waves(test: CircularTest) -> float:
    """RMS of what is left of the radial error without its first 8 waves a turn: vibration and glitches, m."""
    columns = [
        np.ones_like(test.angle),
        *(shape(n * test.angle) for n in range(1, 9) for shape in (np.cos, np.sin)),
    ]
    matrix = np.column_stack(columns)
    rest = test.error - matrix @ np.linalg.lstsq(matrix, test.error, rcond=None)[0]
    return float(np.sqrt(np.mean(rest**2)))


def main() -> None:
    """All variants; the figure of the first."""
    file = read_motion_study(ROOT / "configs/kobe_circle.yaml")
    with threadpool_limits(1):
        found = {name: run(name, changed(file, keys)) for name, keys in VARIANTS.items()}
    change = found["as it is"]["end"].error - found["half the step"]["end"].error
    print(f"half the step changes the radial error of the end by {1e6 * np.abs(change).max():.2f} µm at most")
    with style():
        circles(found["as it is"]).savefig(ROOT / "docs/kobe_circle.png", dpi=140)


if __name__ == "__main__":
    main()

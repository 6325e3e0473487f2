"""The circular test of the Kobe study beside the paper's Fig. 16: python -m tests.benchmarks.kobe_circle;
writes docs/kobe_circle.png and the tables in results/pages/kobe_circle_variants.json.

Besides the study as it is: without friction, without elastic coordinates, and with half the step.
"""

from __future__ import annotations

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
from tests.benchmarks.pages import keep

ROOT = Path(__file__).parents[2]
VARIANTS: dict[str, dict[str, Any]] = {
    "as it is": {},
    "half the step": {"step_s": 2.5e-4 / 12},
    "without friction": {"friction": {}},
    "rigid joints": {"effects": []},
}


def changed(file: MotionFile, keys: dict[str, Any]) -> MotionFile:
    """The study with other values of some keys, and without the glitches joint by joint, which it tells."""
    given = {name: getattr(file.study, name) for name in file.study.model_fields_set if name != "schema_"}
    given["records"] = [
        record.model_copy(update={"path": record.path.model_copy(update={"glitches": False})})
        for record in file.study.records
        if record.path is not None
    ]
    return file.model_copy(
        update={"study": type(file.study).model_validate({"schema": "identify-motion/1", **given, **keys})}
    )


def run(file: MotionFile) -> dict[str, CircularTest]:
    """The circular tests of a simulation."""
    tests = evaluate_simulation(load_motion(file)).records["circle"].circles
    assert tests is not None
    return tests


def row(variant: str, path: str, test: CircularTest) -> list[str]:
    """What a path of a variant comes to, µm."""
    quadrant = (test.angle // (np.pi / 2)).astype(int) % 4
    largest = [1e6 * np.abs(test.error[quadrant == number]).max() for number in range(4)]
    sizes = f"{1e6 * test.deviation:.0f}", f"{1e6 * test.rms:.1f}", f"{1e6 * _waves(test):.1f}"
    return [variant, path, *sizes, *(f"{one:.0f}" for one in largest)]


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
        found = {name: run(changed(file, keys)) for name, keys in VARIANTS.items()}
    heads = ["Variant", "Path", "Deviation (µm)", "RMS (µm)", "RMS above 8 waves a turn (µm)"]
    heads += [f"Largest, quadrant {number} (µm)" for number in range(1, 5)]
    rows = [
        row(variant, path, test)
        for variant, tests in found.items()
        for path, test in tests.items()
        if path != "command" and (variant == "as it is" or not path.startswith("recorded"))
    ]
    keep("kobe_circle_variants", {"Variants": [heads, *rows]})
    with style():
        circles(found["as it is"]).savefig(ROOT / "docs/kobe_circle.png", dpi=140)


if __name__ == "__main__":
    main()

"""How long a map of depth limits takes: python -m tests.benchmarks.map_limits FIT.h5 TOOL.yaml
[--postures 1000] [--workers 2].

Prints seconds, and the ratio to the goal of 60 s for 1,000 postures on two processors.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

import numpy as np

from identify.map.asked import MapOptions
from identify.map.run import run_map
from identify.results import file as result_file
from identify.results.fit import FitResult

_GOAL_S, _GOAL_POSTURES, _GOAL_WORKERS = 60.0, 1000, 2


def main() -> None:
    """Random postures within 40 degrees of the first that was measured."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.map_limits", description=__doc__)
    parser.add_argument("fit", type=Path)
    parser.add_argument("tool", type=Path)
    parser.add_argument("--postures", type=int, default=_GOAL_POSTURES)
    parser.add_argument("--workers", type=int, default=_GOAL_WORKERS)
    given = parser.parse_args()
    first = next(iter(result_file.read(given.fit, FitResult).measurements.values())).posture_deg
    drawn = first + np.random.default_rng(1).uniform(-40, 40, (given.postures, len(first)))
    with tempfile.TemporaryDirectory() as name:
        table = Path(name) / "postures.csv"
        heads = ",".join(f"joint{number}_deg" for number in range(1, len(first) + 1))
        table.write_text("\n".join([heads, *(",".join(map(str, row)) for row in drawn)]) + "\n")
        options = MapOptions(postures=table, limit="depth", cutter=given.tool)
        result, _ = run_map(given.fit, options, Path(name) / "map.h5", workers=given.workers)
    per_posture = result.seconds * given.workers / given.postures
    goal = _GOAL_S * _GOAL_WORKERS / _GOAL_POSTURES
    print(
        f"{given.postures} depth limits in {result.seconds:.1f} s on {given.workers} workers:"
        f" {1e3 * per_posture:.0f} ms each, {per_posture / goal:.2f} of the goal"
    )


if __name__ == "__main__":
    main()

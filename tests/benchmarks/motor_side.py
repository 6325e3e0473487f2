"""Drives by what their controllers log, without a hammer: python -m tests.benchmarks.motor_side --seed N
[--store].

Random arms of six axes; joints 1 to 3 are excited one at a time in two postures by a torque beside that of
their controllers.  Of each arm: whether the 95 % intervals of a fit hold the true stiffness, damping, rotor
inertia and friction.
"""

from __future__ import annotations

import argparse
import json
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from identify.vibration.run import run_fit
from tests.generator import motor_log

RESULTS = Path(__file__).parent / "results"


def main() -> None:
    """Print a row per arm and the score; store it."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.motor_side", description=__doc__)
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--arms", type=int, default=20)
    parser.add_argument("--store", action="store_true", help="write results/motor_side_SEED.json")
    given = parser.parse_args()
    rows = []
    for number in range(given.arms):
        rows.append(scored(motor_log.drawn(1000 * given.seed + number)))
        print(json.dumps(rows[-1]), flush=True)
    score = summed(rows)
    print(json.dumps(score))
    if given.store:
        path = RESULTS / f"motor_side_{given.seed}.json"
        path.write_text(json.dumps({"seed": given.seed, "score": score, "arms": rows}, indent=1) + "\n")


def scored(test: motor_log.MotorTest) -> dict[str, Any]:
    """One arm: the gap, and of each true value the found one with its interval over it."""
    with tempfile.TemporaryDirectory() as folder:
        config = motor_log.study(Path(folder), test)
        result = run_fit(config, Path(folder) / "out.h5", {})[0]
    table, truth = result.parameters, motor_log.truth(test)
    over = {
        name: [float(f"{value / truth[name]:.5g}") for value in row]
        for name, *row in zip(table.name, table.value, table.low_95, table.high_95, strict=True)
        if name in truth
    }
    return {"seed": test.seed, "gap": float(f"{result.gap:.3g}"), "over_truth": over}


def summed(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Counts and errors over all arms, by kind of value."""
    found: dict[str, Any] = {"arms": len(rows), "largest_gap": max(row["gap"] for row in rows)}
    for kind in ("rz.stiffness", "rz.damping", "rotor.inertia", "rotor.friction"):
        own = np.array([v for row in rows for name, v in row["over_truth"].items() if name.endswith(kind)])
        error = np.abs(own[:, 0] - 1)
        found[kind] = {
            "values": len(own),
            "held": int(np.sum((own[:, 1] <= 1) & (own[:, 2] >= 1))),
            "median_error": float(f"{np.median(error):.2g}"),
            "largest_error": float(f"{error.max():.2g}"),
            "median_half_width": float(f"{np.median(own[:, 2] - own[:, 1]) / 2:.2g}"),
        }
    return found


if __name__ == "__main__":
    main()

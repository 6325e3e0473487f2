"""`identify explain` on drives of two inertias: python -m tests.benchmarks.drives --seed N [--store].

Stiffnesses, dampers, friction, gear ratios, encoders, latencies, filters, sample rates and low-passes are
drawn; a fifth of the drives are rigid.  Of each: whether the stiffness is named with the truth in its 95 %
interval, and what is named that is not there.
"""

from __future__ import annotations

import argparse
import json
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from identify.explain.run import run_explain
from identify.results.explain import ExplainResult
from tests.generator import two_mass

RESULTS = Path(__file__).parent / "results"
SPRINGS = ("joint1.joint-compliance", "joint1.damped-compliance")
THERE = {"joint1.rotor-inertia", "joint1.coulomb-friction", "joint1.viscous-friction"}
ALIKE = {"link1.inertia"}
"""Of a rigid drive, whose rotor and link move alike."""


def main() -> None:
    """Print a row per drive and the score; store it."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.drives", description=__doc__)
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--drives", type=int, default=30)
    parser.add_argument("--store", action="store_true", help="write results/drives_SEED.json")
    given = parser.parse_args()
    rng = np.random.default_rng(given.seed)
    rows = []
    for number in range(given.drives):
        rows.append(scored(rng, 1000 * given.seed + number, soft=number % 5 != 4))
        print(json.dumps(rows[-1]), flush=True)
    score = summed(rows)
    print(json.dumps(score))
    if given.store:
        path = RESULTS / f"drives_{given.seed}.json"
        path.write_text(json.dumps({"seed": given.seed, "score": score, "drives": rows}, indent=1) + "\n")


def scored(rng: np.random.Generator, seed: int, soft: bool) -> dict[str, Any]:
    """One drive: its truth, the stiffness found with its interval over the truth, false names."""
    drive, sensing, lowpass = two_mass.drawn(rng, soft)
    with tempfile.TemporaryDirectory() as folder:
        config = two_mass.study(Path(folder), drive, sensing, lowpass, seed)
        result = run_explain(config, Path(folder) / "out.h5")[0]
    names = {name for found in result.targets.values() for name in found.effects.name}
    late = {"joint1.sensor-latency"} if sensing.latency_s else set()
    found = stiffness(result) if soft else None
    truth = {**two_mass.as_numbers(drive, sensing), "lowpass_hz": lowpass}
    return {
        "truth": {key: float(f"{value:.4g}") if np.isfinite(value) else None for key, value in truth.items()},
        "over_truth": None if found is None else [float(f"{k / drive.stiffness:.4g}") for k in found],
        "holds": bool(found and found[1] <= drive.stiffness <= found[2]),
        "false": sorted(names - THERE - late - (set(SPRINGS) if soft else ALIKE)),
    }


def stiffness(result: ExplainResult) -> tuple[float, float, float] | None:
    """Stiffness and the ends of its interval, N m/rad; None where none was named."""
    table = result.targets["deflection"].values
    for row, (effect, name) in enumerate(zip(table.effect, table.name, strict=True)):
        if effect in SPRINGS and name == "compliance":
            low, high = table.low_95[row], table.high_95[row]
            return 1 / table.value[row], 1 / high, 1 / low if low > 0 else np.inf
    return None


def summed(rows: list[dict[str, Any]]) -> dict[str, float]:
    """Counts over all drives."""
    soft = [row for row in rows if row["truth"]["stiffness"] is not None]
    errors = [abs(row["over_truth"][0] - 1) for row in soft if row["over_truth"]]
    return {
        "soft": len(soft),
        "stiffness_named": len(errors),
        "truth_in_interval": sum(row["holds"] for row in soft),
        "within_1_percent": sum(error < 0.01 for error in errors),
        "median_error": float(f"{np.median(errors):.3g}"),
        "largest_error": float(f"{max(errors):.3g}"),
        "false_names": sum(len(row["false"]) for row in rows),
        "drives_with_a_false_name": sum(bool(row["false"]) for row in rows),
        "rigid_with_a_false_name": sum(bool(row["false"]) for row in rows if row not in soft),
    }


if __name__ == "__main__":
    main()

"""Planned tests against random ones of the same size on random arms: python -m tests.benchmarks.plan
[--arms 20] [--seed 1].

Each arm is described as its user knows it, with rough start values and without any data; printed is how many
times narrower the intervals of a planned test are than those of tests at random (the median of 200), for all
parameters together (D-optimal) and for one of them (I-optimal).
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from identify.planning.run import PlanOptions, run_plan
from tests.generator.makes import MAKES
from tests.generator.measure import draw_postures
from tests.generator.spec import TestSpec

_STUDY = """schema: identify/1
name: arm
robot: {{urdf: robot.urdf}}
points: points.csv
measurements: [{{file: none.uff, posture_deg: {posture}}}]
band_hz: [3, 80]
effects:
  - kind: joint-compliance
    axes: [rz]
    stiffness: {{initial: {stiffness}, bounds: [1.0e+2, 1.0e+9]}}
    damping: {{damping_ratio: 0.04, bounds: [1.0e-3, 1.0e+6]}}
"""


def main() -> None:
    """Score arms drawn from a seed."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.plan", description=__doc__)
    parser.add_argument("--arms", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    ratios = []
    with threadpool_limits(1):
        for number in range(given.arms):
            ratios.append(score(1000 * given.seed + number))
            every, one = np.median(ratios, axis=0)
            print(
                f"arm {number + 1}: {ratios[-1][0]:.2f}, {ratios[-1][1]:.2f}; median {every:.2f}, {one:.2f}",
                flush=True,
            )


def score(seed: int) -> tuple[float, float]:
    """How many times narrower: for all parameters, and for the stiffness of one joint."""
    rng = np.random.default_rng([seed, 0x91])
    arm = MAKES["random"](seed)
    posture = draw_postures(TestSpec(arm=arm, seed=seed, postures=1))[0]
    guess = arm.stiffness * rng.uniform(0.6, 1.7, 6)
    target = f"joint{rng.integers(1, 7)}.rz.stiffness"
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "robot.urdf").write_text(arm.urdf())
        (folder / "points.csv").write_text(arm.points_csv())
        study = folder / "arm.yaml"
        study.write_text(_STUDY.format(posture=posture.tolist(), stiffness=guess.tolist()))
        found = [
            run_plan(study, PlanOptions(target=wanted, noise=0.003, resolution=0.625), folder / "plan.h5")[0]
            for wanted in ((), (target,))
        ]
    return found[0].random_ratio, found[1].random_ratio


if __name__ == "__main__":
    main()

"""Promised intervals against refits: python -m tests.benchmarks.plan_widths [--arms 20] [--seed 1].

Each random arm is hit with a hammer in three postures (a simulation that shares no code).  From a fit of
the first two, the test in the third is promised its intervals, as if it were to be done alone; then it is
fitted alone.  Printed are promised over refitted intervals (the median of the parameters, the least and the
largest), and the errors of the refit over the promised standard deviations (RMS).
"""

from __future__ import annotations

import argparse
import json
import tempfile
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from identify.planning.known import known_of
from identify.results import file as result_file
from identify.results.fit import FitResult
from identify.vibration.run import run_fit
from tests.generator.generate import generate
from tests.generator.makes import MAKES
from tests.generator.spec import TestSpec
from tests.hidden import config_of
from tests.planning.own_test import own_test


def main() -> None:
    """Score arms drawn from a seed."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.plan_widths", description=__doc__)
    parser.add_argument("--arms", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    ratios: list[np.ndarray] = []
    errors: list[np.ndarray] = []
    with threadpool_limits(1):
        for number in range(given.arms):
            ratio, error = score(1000 * given.seed + number)
            ratios.append(ratio)
            errors.append(error)
            every, medians = np.concatenate(ratios), [np.median(one) for one in ratios]
            parts = [np.mean(np.abs(np.log(some)) < np.log(1.2)) for some in (every, medians)]
            print(
                f"arm {number + 1}: {medians[-1]:.2f} ({ratio.min():.2f} to {ratio.max():.2f}),"
                f" errors {_rms([error]):.2f}; so far median {np.median(every):.2f},"
                f" {parts[0]:.0%} of parameters and {parts[1]:.0%} of arms (median) within 20 %,"
                f" errors {_rms(errors):.2f}",
                flush=True,
            )


def _rms(errors: list[np.ndarray]) -> float:
    return float(np.sqrt(np.mean(np.concatenate(errors) ** 2)))


def score(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Promised over refitted intervals (p,), and errors of the refit over promised deviations (p,)."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        generate(TestSpec(arm=MAKES["random"](seed), seed=seed), folder / "arm")
        truth = json.loads((folder / "arm.truth.json").read_text())
        config = config_of(folder / "arm", folder, truth["k"])
        run_fit(config, folder / "first.h5", {"starts": 1})
        swapped = config.read_text().replace("use: fit", "use: -").replace("use: validate", "use: fit")
        config.write_text(swapped.replace("use: -", "use: validate"))
        run_fit(config, folder / "third.h5", {"starts": 1})
        promised = own_test(known_of(folder / "first.h5", None, None), folder / "third.h5")
        table = result_file.read(folder / "third.h5", FitResult).parameters
        right = [truth["kc"[one.endswith("damping")]][int(one[5]) - 1] for one in table.name]
        return promised / table.std, np.log(table.value / right) / promised


if __name__ == "__main__":
    main()

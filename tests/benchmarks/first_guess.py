"""Twenty first guesses within a factor of three of the truth, on each shared null case: every fit must find
the same truth.

python -m tests.benchmarks.first_guess
"""

from __future__ import annotations

import tempfile
import time
from pathlib import Path

import numpy as np

from identify.vibration.run import run_fit
from tests.hidden import truth, write_config


def main(guesses: int = 20) -> None:
    """Print the worst errors and gaps of each case."""
    for case in ("none_101", "none_102"):
        known, rows, began = truth(case), [], time.perf_counter()
        for guess in range(guesses):
            start = np.array(known["k"]) * 3.0 ** np.random.default_rng(guess).uniform(-1, 1, 6)
            with tempfile.TemporaryDirectory() as name:
                result, _ = run_fit(write_config(case, Path(name), start.tolist()), Path(name) / "r.h5", {})
            value = result.parameters.value
            k, c = np.abs(value[::2] / known["k"] - 1).max(), np.abs(value[1::2] / known["c"] - 1).max()
            rows.append((k, c, result.gap, result.gap_validation, len(result.starts.cost)))
        errors = np.array(rows)
        good = int(np.sum((errors[:, 0] < 0.01) & (errors[:, 1] < 0.05)))
        took = (time.perf_counter() - began) / guesses
        print(
            f"{case}: {good} of {guesses} within 1 % and 5 %; worst stiffness {100 * errors[:, 0].max():.2f}"
            f" %, worst damping {100 * errors[:, 1].max():.2f} %; gap {errors[:, 2].min():.3f} to"
            f" {errors[:, 2].max():.3f}, validation {errors[:, 3].min():.3f} to {errors[:, 3].max():.3f};"
            f" {errors[:, 4].mean():.1f} starts, {took:.1f} s each"
        )


if __name__ == "__main__":
    main()

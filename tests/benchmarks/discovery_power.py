"""How often discovery is right against noise and size of what is hidden, and the figure of both.

    python -m tests.benchmarks.discovery_power [ARMS] [FIGURE]

Hammer tests are simulated by tests.generator: 7 points, two postures fitted and one for validation.  Where
nothing is missing: `tests.benchmarks.discovery_nulls`.
"""

from __future__ import annotations

import json
import os
import sys
import tempfile
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from tests.benchmarks.discovery import score
from tests.generator.cases import hide
from tests.generator.generate import generate
from tests.generator.makes import MAKES
from tests.generator.spec import TestSpec

KINDS = ("tilt_j2", "base_rocking", "radial_j3", "absorber_l3", "payload", "delay", "gain")
NOISE = (0.01, 0.1, 1.0, 4.0)
"""Of each response sample, m/s^2.  0.01 is an ordinary accelerometer."""
FORCE_NOISE = 0.3
"""Of each force sample, N.  With 10 N, as strong over the record as the impact itself, H1 is so biased that
masses are named that are not there: 2 of 4 nulls."""
SIZES = (1.0, 0.3, 0.1, 0.03, 0.01)
"""Times the ordinary size of what is hidden; a compliance is divided by it."""
NODES = [2, 5, 7, 9, 11, 13, 14]


def run(task: tuple[str, str, int, float, float]) -> dict[str, Any]:
    """One hammer test: make of arm, case, seed, noise, size; its score with the level of the noise relative
    to the FRFs.
    """
    make, case, seed, noise, size = task
    arm = MAKES[make](seed).at_points(NODES)
    spec = TestSpec(arm=arm, seed=seed, noise_response=noise, noise_force=FORCE_NOISE, binary=True)
    with tempfile.TemporaryDirectory() as folder:
        generate(replace(hide(spec, case, size), case=case), Path(folder) / "case")
        found = score(Path(folder) / "case", 1)
    return {**found, "make": make, "case": case, "seed": seed, "noise": noise, "size": size}


def run_all(tasks: Sequence[tuple[str, str, int, float, float]], kept: Path) -> list[dict[str, Any]]:
    """The scores of all tasks, kept in a file as they come so that an interrupted run goes on."""
    done = (
        {tuple(row["task"]): row for row in map(json.loads, kept.read_text().splitlines())}
        if kept.exists()
        else {}
    )
    new = [task for task in tasks if task not in done]
    with ProcessPoolExecutor(os.cpu_count()) as pool, kept.open("a") as file:
        for task, row in zip(new, pool.map(run, new), strict=True):
            done[task] = {**row, "task": task}
            file.write(json.dumps(done[task]) + "\n")
            file.flush()
            print(
                f"{' '.join(map(str, task)):44s} {'right' if row['right'] else 'WRONG'} named:"
                f" {', '.join(row['named']) or 'nothing'}",
                flush=True,
            )
    return [done[task] for task in tasks]


def power(arms: int, figure: Path | None) -> None:
    """Every kind at every noise at full size, and at every size at ordinary noise."""
    grid = [(noise, 1.0) for noise in NOISE] + [(NOISE[0], size) for size in SIZES[1:]]
    tasks = [
        ("random", case, 700 + arm, noise, size)
        for noise, size in grid
        for case in KINDS
        for arm in range(arms)
    ]
    rows = run_all(tasks, Path(tempfile.gettempdir()) / "discovery_power.jsonl")
    by_noise = [[r for r in rows if r["size"] == 1.0 and r["noise"] == noise] for noise in NOISE]
    by_size = [[r for r in rows if r["noise"] == NOISE[0] and r["size"] == size] for size in SIZES]
    for label, values, groups in (("noise, m/s^2", NOISE, by_noise), ("size", SIZES, by_size)):
        for value, group in zip(values, groups, strict=True):
            right, wrong = (
                np.mean([test(row) for row in group])
                for test in (lambda r: r["right"], lambda r: r["false_additions"] > 0)
            )
            gap = np.median([row["gap_before"] for row in group])
            print(
                f"{label} {value:g}: right {right:.0%}, something false {wrong:.0%} of {len(group)}, median"
                f" gap before {gap:.2f}"
            )
    if figure:
        draw(by_noise, by_size, figure)


def draw(by_noise: list[list[dict[str, Any]]], by_size: list[list[dict[str, Any]]], path: Path) -> None:
    """Share right and share with anything false, over noise and over size, for all kinds together and each on
    its own.
    """
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, 2, figsize=(9, 3.2), sharey=True, layout="constrained")
    for ax, values, groups, label in (
        (axes[0], NOISE, by_noise, "noise of each response sample (m/s²)"),
        (axes[1], SIZES, by_size, "size of what is hidden (1: ordinary)"),
    ):
        for kind in KINDS:
            share = [np.mean([row["right"] for row in group if row["case"] == kind]) for group in groups]
            ax.plot(values, share, color="0.75", linewidth=1, zorder=1)
        ax.plot(
            values,
            [np.mean([row["right"] for row in group]) for group in groups],
            "o-",
            color="#0072B2",
            label="named exactly right",
        )
        false = [np.mean([row["false_additions"] > 0 for row in group]) for group in groups]
        ax.plot(values, false, "s--", color="#D55E00", label="anything false named")
        ax.set_xscale("log")
        ax.set_xlabel(label)
    axes[0].set_ylabel("share of cases")
    axes[0].set_ylim(-0.03, 1.03)
    axes[0].legend(frameon=False)
    axes[1].invert_xaxis()
    figure.savefig(path, dpi=110)


if __name__ == "__main__":
    arguments = sys.argv[1:]
    power(int(arguments[0]) if arguments else 1, Path(arguments[1]) if len(arguments) > 1 else None)

"""How often what `identify discover` names with a probability is true: python -m
tests.benchmarks.reliability docs/discovery_reliability.png.

From the stored scores of hidden effects (`tests/benchmarks/results/discovery_*.json`): each bar is a range of
probabilities, with what was right among the names in it and Wilson's 95 % interval.
"""

from __future__ import annotations

import argparse
import json
from itertools import pairwise
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.stats import binomtest

RESULTS = Path(__file__).parent / "results"
EDGES = (0.0, 0.5, 0.9, 0.99, 0.9999, 1.0)
"""Ends of the ranges; most names have odds that are overwhelming."""


def main() -> None:
    """Print the table and draw it."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.reliability", description=__doc__)
    parser.add_argument("picture", type=Path)
    given = parser.parse_args()
    probability, true = names(sorted(RESULTS.glob("discovery_*.json")))
    rows = table(probability, true)
    for low, high, said, right, count, (least, most) in rows:
        print(f"{low:g} to {high:g}: said {said:.3f}, right {right} of {count}, {least:.2f} to {most:.2f}")
    drawn(rows).savefig(given.picture, dpi=150)


def names(files: list[Path]) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Probability of every name in scores, and whether it is true."""
    scores = [one for file in files for one in json.loads(file.read_text()).values() if "true" in one]
    probability = [p for one in scores for p in one["probabilities"]]
    return np.array(probability), np.array([true for one in scores for true in one["true"]], dtype=bool)


Row = tuple[float, float, float, int, int, tuple[float, float]]


def table(probability: NDArray[np.float64], true: NDArray[np.bool_]) -> list[Row]:
    """Of each range that has any: its ends, mean probability, how many were right of how many, interval."""
    found = list[Row]()
    place = np.clip(np.digitize(probability, EDGES), 1, len(EDGES) - 1)
    for number, (low, high) in enumerate(pairwise(EDGES), start=1):
        some = place == number
        if some.any():
            right, count = int(true[some].sum()), int(some.sum())
            interval = binomtest(right, count).proportion_ci(method="wilson")
            found.append((low, high, float(probability[some].mean()), right, count, tuple(interval)))
    return found


def drawn(rows: list[Row]) -> Figure:
    """Right over said, range by range."""
    figure, axes = plt.subplots(figsize=(5.2, 3.2), layout="constrained")
    places = np.arange(len(rows))
    right = np.array([row[3] / row[4] for row in rows])
    low, high = np.array([row[5] for row in rows]).T
    axes.bar(places, 100 * right, color="#9ecae1", label="right")
    axes.errorbar(
        places, 100 * right, 100 * np.array([right - low, high - right]), fmt="none", color="#222222"
    )
    axes.plot(places, [100 * row[2] for row in rows], "D", color="#d95f02", label="said (mean)")
    axes.set_xticks(places, [f"{100 * row[0]:g} to\n{100 * row[1]:g} %\n{row[4]} names" for row in rows])
    axes.set_ylabel("names that are right, %")
    axes.set_ylim(0, 105)
    axes.legend(loc="upper left")
    return figure


if __name__ == "__main__":
    main()

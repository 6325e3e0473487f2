"""What the open question of UMONS comes to: the gap at the wrist by band and direction before and after
(results/pages/umons_open.json), and the FRF in x as a figure.

python -m tests.benchmarks.umons_open reports/umons_open_discovery.h5 docs/umons_open.png
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from identify.reports.kit.figures import style
from identify.results import file as result_file
from identify.results.discovery import DiscoveryResult
from identify.results.fit import FrfComparison
from tests.benchmarks.pages import keep

Array = NDArray[np.float64]
AXES = {"x": "1:+Z", "y": "1:+Y", "z": "1:+X"}
"""Directions of the paper at its sensor."""
BANDS_HZ = ((3, 10), (10, 15), (15, 20), (20, 25), (25, 35), (35, 80))


def main() -> None:
    """Print the tables, write the figure."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.umons_open", description=__doc__)
    parser.add_argument("result", type=Path, help="result of identify discover configs/umons_open.yaml")
    parser.add_argument("figure", type=Path, help="PNG to write")
    given = parser.parse_args()
    result = result_file.read(given.result, DiscoveryResult)
    tables = {}
    for posture in result.after.measurements:
        before, after = _frf(result, posture)
        tables[posture] = [["Hz", *(f"H{axis}{axis}" for axis in AXES)]]
        for band in (*BANDS_HZ, (0, 1000)):
            pairs = [f"{gap(before, axis, band):.3g} -> {gap(after, axis, band):.2f}" for axis in AXES]
            tables[posture].append([f"{band[0]} to {band[1]}" if band[1] < 1000 else "all", *pairs])
    keep("umons_open", tables)
    with style():
        draw(*_frf(result, "posture1")).savefig(given.figure, dpi=150, metadata={"Software": None})


def gap(frf: FrfComparison, axis: str, band: tuple[float, float]) -> float:
    """RMS residual over noise of the drive-point FRF along an axis, on the lines in a band; noise is that of
    real and imaginary part.
    """
    column = _column(frf, axis)
    assert frf.noise is not None
    lines = (frf.frequency_hz >= band[0]) & (frf.frequency_hz < band[1])
    residual = np.abs(frf.fitted - frf.measured)[lines, column] / frf.noise[lines, column]
    return float(np.sqrt(np.mean(residual**2) / 2))


def draw(before: FrfComparison, after: FrfComparison) -> Figure:
    """Hxx at the paper's sensor, in dB of g/N: simulated test, and the models before and after."""
    figure = Figure(figsize=(6.85, 2.9), layout="constrained")
    axes, column = figure.subplots(), _column(after, "x")
    curves = (
        (after.measured, "#5c6673", "simulated test", 3.0),
        (before.fitted, "#d55e00", "springs about the axes of motion", 1.2),
    )
    for values, colour, label, width in (
        *curves,
        (after.fitted, "#0072b2", "with what discovery added", 1.2),
    ):
        axes.plot(
            after.frequency_hz,
            20 * np.log10(np.abs(values[:, column]) / 9.80665),
            color=colour,
            label=label,
            linewidth=width,
        )
    axes.set(
        xlabel="Hz",
        ylabel="|Hxx|, dB (g/N)",
        xlim=(0, 80),
        title="Wrist, across the robot's plane, the paper's posture",
    )
    axes.legend()
    return figure


def _frf(result: DiscoveryResult, posture: str) -> tuple[FrfComparison, FrfComparison]:
    before, after = (run.measurements[posture].frf for run in (result.before, result.after))
    assert before is not None
    assert after is not None
    return before, after


def _column(frf: FrfComparison, axis: str) -> int:
    return list(zip(frf.output, frf.input, strict=True)).index((AXES[axis], AXES[axis]))


if __name__ == "__main__":
    main()

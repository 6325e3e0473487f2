"""Draw the dynamic stiffness that a hammer test measures at a place, without a law: python -m
tests.benchmarks.measured_curve FOLDER PLACE --out PICTURE.png [--truth FOLDER.truth.json].

PLACE is coordinates with commas between them, such as joint2.rx,joint2.ry; a coordinate that the study frees
already is drawn with the spring and damper that the model has there, so that the whole joint is seen, and for
each strength of impacts by itself.  With the truth of a joint whose law no effect has, the share of lines
whose 95 % band holds it is printed.  The pictures of docs/measured_curve.md come from here.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from threadpoolctl import threadpool_limits

from identify.core.arrays import Array, Complex
from identify.core.thresholds import SIGMAS_95
from identify.discovery.places.catalogue import with_misalignment
from identify.discovery.places.curve import Curve, measured_curve
from identify.discovery.places.predict import StructuralModel, misalignments
from identify.discovery.places.screen import Job, PlaceFitter
from identify.model.effects.place import Beside, Release
from identify.reports.kit.figures import INK, MUTED, PALETTE, WIDTH_IN, style
from identify.vibration.problem import Problem
from tests.benchmarks.places import fitted

_BETWEEN = 0.15
"""Inertia between the elements of a relaxing joint, of that of what moves (`tests.generator.structure`)."""


def main() -> None:
    """Fit the present model, then the place, and draw."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.measured_curve", description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("place", help="coordinates with commas between them")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--truth", type=Path)
    given = parser.parse_args()
    names = tuple(given.place.split(","))
    with threadpool_limits(1), style():
        curves = list(curves_of(given.folder, names))
        drawn(names, curves).savefig(given.out, dpi=130)
    if given.truth:
        [hidden] = json.loads(given.truth.read_text())["effects"]
        decay = json.loads((given.folder / "test.json").read_text())["exponential_window_decay_per_s"]
        for _, curve in curves:
            own = curve.values[:, 0], curve.std_real[:, 0] + 1j * curve.std_imag[:, 0]
            share, error = held(curve.frequency_hz, *own, hidden, decay)
            print(f"held: {share:.3f}, error {error:.4f}")


def held(
    frequency_hz: Array, value: Complex, std: Complex, hidden: dict[str, Any], decay: float
) -> tuple[float, float]:
    """Share of real and imaginary parts whose band holds the truth of a relaxing joint, whose elements are in
    series, each with an inertia of its own but the first; and the median error relative to the truth.

    value, std (l,): the curve, and the standard deviations of its parts as real and imaginary part; where
    these are not known, any truth is held.
    """
    s = decay + 2j * np.pi * frequency_hz
    between = [0.0, *[_BETWEEN * hidden["inertia"]] * (len(hidden["stiffness"]) - 1)]
    elements = zip(hidden["stiffness"], hidden["damping"], between, strict=True)
    true = 1 / sum(1 / (k + s * c + s**2 * m) for k, c, m in elements)
    off = value - true
    outside = [np.abs(off.real) > SIGMAS_95 * std.real, np.abs(off.imag) > SIGMAS_95 * std.imag]
    return float(1 - np.mean(outside)), float(np.nanmedian(np.abs(off / true)))


def curves_of(folder: Path, names: tuple[str, ...]) -> Iterator[tuple[str, Curve]]:
    """The curve of each strength of impacts, all postures together."""
    problem, present = fitted(folder)
    values = problem.at(present.values)
    free = {name for m in problem.measurements for name in m.system.coordinates}
    place = Beside(names) if set(names) <= free else Release(names)
    for label, part in _levels(problem):
        fitter, own = PlaceFitter(part), with_misalignment(place, part)
        model, straight = fitter.model(own), [p.initial for p in misalignments(own)]
        assert isinstance(model, StructuralModel)
        [fit] = fitter.fit([Job(own, np.array([*values, *straight]))], 40)
        assert fit is not None
        curve = measured_curve(model, fit, fitter.scale(own)).pooled
        print(f"{label or 'all impacts'}: gap {present.gap:.2f}, with the place {fit.gap:.2f}")
        if isinstance(place, Beside):
            found = dict(zip((p.name for p in part.parameters), fit.values, strict=True))
            curve = replace(curve, values=curve.values + _own(found, names[0], curve.frequency_hz)[:, None])
        yield label, curve


def _levels(problem: Problem) -> Iterator[tuple[str, Problem]]:
    peaks = sorted({m.given.impact.peak for m in problem.measurements if m.given.impact is not None})
    for peak in peaks or [0.0]:
        own = tuple(m for m in problem.measurements if len(peaks) < 2 or m.given.impact.peak == peak)  # type: ignore[union-attr]
        yield ("" if len(peaks) < 2 else f"impacts of {peak:.0f} N"), replace(problem, measurements=own)


def _own(values: dict[str, float], name: str, frequency_hz: Array) -> Complex:
    """The spring and damper of a coordinate."""
    s = 2j * np.pi * frequency_hz
    return np.asarray(values[f"{name}.stiffness"] + s * values[f"{name}.damping"])


def drawn(names: tuple[str, ...], curves: list[tuple[str, Curve]]) -> Figure:
    """Real and imaginary part of each coordinate."""
    size = len(names)
    diagonal = [sum(size - k for k in range(n)) for n in range(size)]
    figure = Figure((WIDTH_IN, 0.6 + 1.6 * size), layout="constrained")
    grid = figure.subplots(size, 2, squeeze=False, sharex=True)
    for row, entry in enumerate(diagonal):
        unit, prefix = _prefix(names[row], [curve.values[:, entry] for _, curve in curves])
        for column, part in enumerate(("real", "imag")):
            axes = grid[row][column]
            for number, (label, curve) in enumerate(curves):
                std = (curve.std_real, curve.std_imag)[column][:, entry]
                value = getattr(curve.values[:, entry], part)
                sure = std <= 4 * np.median(std)
                axes.errorbar(
                    curve.frequency_hz[sure],
                    value[sure] / unit,
                    SIGMAS_95 * std[sure] / unit,
                    fmt=".",
                    ms=3,
                    color=PALETTE[number],
                    ecolor=(PALETTE[number], 0.4) if len(curves) > 1 else MUTED,
                    elinewidth=0.7,
                    label=label,
                )
            axes.axhline(0, color=INK, lw=0.4)
            axes.set_title(("Real part", "Imaginary part")[column] if row == 0 else "")
            axes.set_xlabel("Frequency (Hz)" if row == size - 1 else "")
        grid[row][0].set_ylabel(f"{names[row]} ({prefix})")
    if len(curves) > 1:
        handles = grid[0][0].get_legend_handles_labels()
        figure.legend(*handles, loc="outside upper center", ncols=len(curves))
    return figure


def _prefix(name: str, values: list[Complex]) -> tuple[float, str]:
    """What a coordinate's values are divided by so that they are short, and their unit then."""
    own = "N m/rad" if name.rsplit(".", 1)[1].startswith("r") else "N/m"
    typical = np.nanmedian(np.abs(np.concatenate(values)))
    return next(
        ((size, prefix + own) for size, prefix in ((1e6, "M"), (1e3, "k")) if typical >= size), (1.0, own)
    )


if __name__ == "__main__":
    main()

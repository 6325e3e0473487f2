"""What mistakes of the set-up look like: python -m tests.benchmarks.setup_picture docs/setup_mistakes.png.

Each panel has the FRF that the best fit of a wrongly stated test misses most, measured and fitted, on a
simulated test of a 200 kg arm.
"""

from __future__ import annotations

import argparse
import tempfile
from copy import deepcopy
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from identify.setup.score import Score, scored
from identify.setup.stated import stated
from identify.vibration.problem import load_problem
from identify.vibration.study import read_study
from tests.benchmarks.setup_slips import SIMULATED, SLIPS, Told, told, write
from tests.generator.makes import MAKES
from tests.generator.spec import TestSpec

PANELS = {
    "": "right: nothing is missed",
    "g_for_ms2": "g taken for m/s²: all FRFs ten times too small",
    "hammer_x10": "sensitivity of the hammer ten times too small",
    "mm_for_m": "mm/s² taken for m/s²",
    "velocity": "velocities: slope off by one power of ω",
    "inverted": "1/H, force over response: peaks are dips",
    "rad_per_s": "rad/s taken for Hz: no peaks, drives far too stiff",
    "magnitudes": "magnitudes alone: there is no phase",
    "sign_j2": "sign of joint 2: another arm",
    "zero_j23": "zeros of joints 2 and 3 off by 90°",
    "order_reversed": "angles from the last joint to the first",
    "from_ground": "joint 3 counted from the ground",
    "postures_mixed": "posture files mixed up",
    "world_axes": "axes of the room: peaks in the wrong channels",
    "nodes_exchanged": "two points exchanged: two sensors are off",
    "channel_sign": "one channel reversed: magnitudes fit, phase does not",
    "masses_lb": "masses in pounds",
    "inertia_kg_cm2": "inertias in kg cm²",
    "wrong_link": "a point on another link: one sensor is off",
    "links_shifted": "all points on the link before theirs",
    "cube_turned": "a sensor turned by a right angle",
    "force_x10": "one force ten times too small",
    "no_payload": "a payload that is not told",
    "braked": "a brake on in this file: one drive stiffer",
}
_SECOND = ("braked",)
"""What is seen in the second posture."""
_LEVELLED = ("rad_per_s",)
"""Where the fit is as good with any drives, up to a factor that it has then."""
_PHASE = ("channel_sign", "magnitudes")
"""What is seen in the phase."""


def main() -> None:
    """Draw."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.setup_picture", description=__doc__)
    parser.add_argument("out", type=Path)
    parser.add_argument("--seed", type=int, default=5)
    given = parser.parse_args()
    spec = TestSpec(MAKES["large"](given.seed), seed=given.seed, binary=True, postures=2)
    right = told(spec)
    figure, axes = plt.subplots(6, 4, figsize=(15, 16), sharex=True, layout="constrained")
    for panel, (name, title) in zip(axes.flat, PANELS.items(), strict=True):
        test = SIMULATED[name](spec)[0] if name in SIMULATED else deepcopy(right)
        if name in SLIPS:
            SLIPS[name](test, np.random.default_rng(given.seed))
        fitted = _fitted(test)
        factor = float(np.exp(fitted.level)) if name in _LEVELLED else 1.0
        _draw(panel, fitted, title, int(name in _SECOND), factor=factor, phase=name in _PHASE)
    axes[0, 0].legend(frameon=False, fontsize=9)
    for panel in axes[-1]:
        panel.set_xlabel("frequency, Hz")
    figure.savefig(given.out, dpi=90)


def _fitted(test: Told) -> Score:
    with tempfile.TemporaryDirectory() as folder:
        problem = load_problem(read_study(write(test, Path(folder) / "test")))
        found = scored(stated(problem).problem())
    return Score(problem, found.values, found.cost, found.level)


def _draw(panel: plt.Axes, score: Score, title: str, number: int, *, factor: float, phase: bool) -> None:
    """The FRF of a posture that is missed most, of those well above their noise."""
    target = score.problem.targets().frf[number]
    measured, fitted = target.measured, factor * target.predict_pairs(score.values)
    loud = np.median(np.abs(measured), axis=0) > 10 * np.median(target.sigma, axis=0)
    moved = np.abs(fitted).max(axis=0) > 1e-6 * np.abs(fitted).max()
    with np.errstate(divide="ignore"):  # of a point that the model does not move
        away = np.mean(np.abs(np.log(np.abs(fitted / measured))), axis=0)
    missed = np.where(loud & moved, away, -1.0)
    if phase:
        turned = np.mean(np.abs(np.angle(fitted / measured)), axis=0)
        missed = np.where(loud & moved, turned, -1.0)
    pair = int(np.argmax(missed))
    show = (lambda h: np.degrees(np.angle(h))) if phase else np.abs
    hertz = target.data.frequency_hz
    panel.plot(hertz, show(measured[:, pair]), "k.", ms=3, label="measured")
    panel.plot(hertz, show(fitted[:, pair]), color="#d95f02", lw=1.6, label="best fit")
    panel.set_yscale("linear" if phase else "log")
    outputs, inputs = target.pairs
    names = f"{target.data.outputs[outputs[pair]]} / {target.data.inputs[inputs[pair]]}"
    panel.set_title(title, fontsize=9.5)
    panel.text(0.98, 0.04, names, transform=panel.transAxes, ha="right", fontsize=8, color="0.4")
    panel.set_ylabel("phase, °" if phase else "m/s²/N", fontsize=8)


if __name__ == "__main__":
    main()

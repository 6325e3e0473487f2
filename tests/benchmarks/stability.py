"""Depth limits of fitted random arms against a simulation of the true arms: python -m
tests.benchmarks.stability [--arms 20] [--seed 1].

Each arm is hit with a hammer in three postures, fitted, and given a tool, a cut, a feed and a posture that
was not measured.  Printed are the limit that `identify stability` predicts at some speeds, its band, and the
limit of a simulation in time of the true arm (`tests.generator.milling`), which shares no code with it.  Its
step is halved and what that changes taken to its end, so that it is some 1e-4 from the truth; "step" says how
far the halved step moved it.
"""

from __future__ import annotations

import argparse
import tempfile
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np
from threadpoolctl import threadpool_limits

from identify.machining.run import run_stability
from identify.vibration.run import run_fit
from tests.generator import milling
from tests.generator.generate import generate
from tests.generator.linear import linearise
from tests.generator.makes import MAKES
from tests.generator.measure import draw_postures, make_plant
from tests.generator.spec import TestSpec
from tests.hidden import config_of

_CLOSE = 0.1
_SPEEDS = 3
_NOISE = 0.2
"""Of each response sample, m/s^2: twenty times that of the shared tests."""
_CUTS = {"up": (0.0, 1.0), "down": (1.0, 0.0)}


def main() -> None:
    """Score arms drawn from a seed."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.stability", description=__doc__)
    parser.add_argument("--arms", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    rows: list[Row] = []
    with threadpool_limits(1):
        for number in range(given.arms):
            rows += score(1000 * given.seed + number)
            close = np.mean([row.error < _CLOSE for row in rows])
            held = np.mean([row.held for row in rows])
            print(
                f"so far {len(rows)} limits: {100 * close:.0f} % within 10 %, {100 * held:.0f} % in the band"
            )


@dataclass(frozen=True)
class Row:
    """A limit, m, predicted with its band, and simulated."""

    rpm: float
    predicted: float
    low: float
    high: float
    simulated: float
    step: float

    @property
    def error(self) -> float:
        """Relative; infinite where the simulated limit is far off."""
        return abs(self.predicted / self.simulated - 1) if np.isfinite(self.simulated) else np.inf

    @property
    def held(self) -> bool:
        """Whether the band holds the simulated limit."""
        return bool(self.low <= self.simulated <= self.high)


def score(seed: int) -> list[Row]:
    """One arm."""
    rng = np.random.default_rng([seed, 0x5B])
    spec = TestSpec(arm=MAKES["random"](seed), seed=seed, noise_response=_NOISE)
    kind, swept = str(rng.choice(list(_CUTS))), float(rng.uniform(0.3, 0.8))
    feed, speeds = rng.normal(size=3), np.sort(rng.uniform(2000.0, 9000.0, 2))
    cut_yaml = f"{{kind: {kind}, width_mm: {20 * swept:.6f}}}"
    posture = draw_postures(TestSpec(arm=spec.arm, seed=seed + 500, postures=1))[0]
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        generate(spec, folder / "arm")
        run_fit(config_of(folder / "arm", folder), folder / "fit.h5", {})
        (folder / "tool.yaml").write_text(
            "schema: identify-tool/1\nname: mill\nteeth: 2\ndiameter_mm: 20\nspindle_axis: [0, 0, -1]\n"
            f"feed: {feed.tolist()}\ncut: {cut_yaml}\nmax_depth_mm: 500\nspindle_rpm: {speeds.tolist()}\n"
            "coefficients: {tangential_n_per_mm2: 700, radial_n_per_mm2: 200, axial_n_per_mm2: 100}\n"
        )
        angles = ",".join(map(str, posture))
        found, _ = run_stability(folder / "fit.h5", folder / "tool.yaml", posture=angles, speeds=_SPEEDS)
    full = np.arccos(1 - 2 * swept)
    entry, leave = (0.0, full) if kind == "up" else (np.pi - full, np.pi)
    cut = milling.Cut(2, float(entry), float(leave), 7e8, 2e8, 1e8)
    rows = []
    limits = found.limits
    for k, rpm in enumerate(limits.rpm):
        simulated, step = _simulated(spec, posture, found.axes, cut, float(rpm), float(limits.depth_m[k]))
        rows.append(Row(rpm, limits.depth_m[k], limits.low_95[k], limits.high_95[k], simulated, step))
        one = rows[-1]
        mm = " ".join(f"{1e3 * v:.4f}" for v in (one.predicted, one.low, one.high, one.simulated))
        held = "held" if one.held else "out"
        print(
            f"arm {seed} {kind} {rpm:6.0f} rpm: predicted, band, simulated {mm} mm (step {step:.0e}) {held}",
            flush=True,
        )
    return rows


def _simulated(
    spec: TestSpec, posture: np.ndarray, axes: np.ndarray, cut: milling.Cut, rpm: float, near: float
) -> tuple[float, float]:
    """The limit of the true arm, m, and how far the halved step moved it; axes (3, 3): of the tool, as rows
    in the base's axes.
    """
    plant = make_plant(spec, posture)
    tip = spec.arm.points[-1]
    linear = linearise(plant, tip.name)
    size = len(linear.a) // 2
    lower, row = linear.a[size:], [point.name for point in spec.arm.points].index(tip.name)
    motion = linear.c[3 * row : 3 * row + 3] @ np.linalg.pinv(lower)  # of the tip, in the link's axes
    turn = axes @ _link_axes(spec, posture)
    matrices = np.eye(size), -lower[:, size:], -lower[:, :size]
    arm = milling.Arm(*matrices, turn @ motion, push=linear.b[size:] @ turn.T)
    return milling.exact_limit(arm, cut, rpm, near)


def _link_axes(spec: TestSpec, posture: np.ndarray) -> np.ndarray:
    """(3, 3): the axes of the last link, as columns in the base's axes."""
    plant = make_plant(spec, posture)
    plant.rest()
    mujoco.mj_forward(plant.model, plant.data)
    return np.asarray(plant.data.site(spec.arm.points[-1].name).xmat.reshape(3, 3))


if __name__ == "__main__":
    main()

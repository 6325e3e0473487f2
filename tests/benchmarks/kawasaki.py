"""The Kawasaki study beside the paper: identified values against the truth, the RMS table in the form of its
Table 3, the bee colony alone.

identify discover configs/kawasaki_rs010l.yaml
python -m tests.benchmarks.pages store kawasaki_rs010l_discovery reports/kawasaki_rs010l_discovery.h5
python -m tests.benchmarks.kawasaki: of that stored run, and fits of the published model (a minute or two);
writes docs/kawasaki_rms.png and the tables in results/pages/kawasaki_rs010l.json
"""

from __future__ import annotations

import json
import tempfile
import time
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from identify.motion.run import run_motion_fit
from identify.reports.kit.figures import BLUE, MUTED, ORANGE, WIDTH_IN, style
from tests.benchmarks.pages import keep, tables

Array = NDArray[np.float64]
ROOT = Path(__file__).parents[2]
CONFIG = ROOT / "configs/kawasaki_rs010l.yaml"
TRUTH = {
    "gear.ratio": "gear_ratio",
    "servo.position_gain": "position_gain_v_rad",
    "servo.derivative_gain": "derivative_gain_v_s_rad",
    "servo.integral_gain": "integral_gain_v_rad_s",
    "motor.viscous": "viscous_motor_n_m_s_rad",
    "friction.coulomb": "coulomb_n_m",
    "friction.creep_velocity": "creep_velocity_rad_s",
}
PAPER = {
    ("pos1_q1", 1): (0.003, 0.01, 0.002, 0.03, 1.24, 2.45),
    ("pos1_q2", 2): (0.006, 0.01, 0.005, 0.01, 1.21, 3.42),
    ("pos1_q2", 3): (0.008, 0.04, 0.004, 0.04, 1.22, 2.74),
    ("pos1_q3", 3): (0.007, 0.01, 0.009, 0.03, 2.2, 4.22),
    ("pos1_q3", 2): (0.034, 0.074, 0.008, 0.05, 0.73, 2.61),
    ("pos1_eq", 3): (0.008, 0.09, 0.01, 0.07, 2.71, 4.21),
    ("pos2_q1", 1): (0.009, 0.02, 0.01, 0.03, 1.34, 4.1),
    ("pos2_q2", 2): (0.007, 0.17, 0.019, 0.14, 2.63, 4.11),
    ("pos2_q2", 3): (0.03, 0.32, 0.034, 0.17, 1.77, 3.9),
    ("pos2_q3", 2): (0.017, 0.06, 0.03, 0.26, 1.32, 1.98),
    ("pos2_q3", 3): (0.008, 0.11, 0.02, 0.13, 3.89, 4.76),
}
"""Table 3 by our record and joint: angle (degrees), velocity (degrees/s) and current (A), slow and fast each.
"""
STORED = "kawasaki_rs010l_discovery"
QUANTITIES = ("position", "velocity", "current")


def table() -> dict[tuple[str, int], Array]:
    """Ours in the same form, of the stored run."""
    found = {}
    for name, joint in PAPER:
        cells = []
        for quantity in QUANTITIES:
            one = tables(STORED)[f"RMS difference of motor {quantity}"]
            slow, fast = (
                next(n for n, head in enumerate(one["head"]) if head.startswith(f"{phase} ("))
                for phase in ("Slow", "Fast")
            )
            [row] = [
                row
                for row in one["rows"]
                if row[0] in (name, f"{name} (not fitted)") and row[1] == f"joint{joint}"
            ]
            cells += [float(row[slow]), float(row[fast])]
        found[name, joint] = np.array(cells)
    return found


def numbers() -> list[list[str]]:
    """Parameters of the stored run beside the truth."""
    truth = json.loads((ROOT / "data/kawasaki_rs010l/truth.json").read_text())
    rows = [["Number", "Truth", "Found", "95 % from", "to", "Unit", "Truth inside"]]
    for parameter, value, unit, low, high, *_ in tables(STORED)["Parameters"]["rows"]:
        number, key = parameter.split(".", 1)
        true = truth[TRUTH[key]][int(number[5:]) - 1]
        inside = "yes" if float(low) <= true <= float(high) else "no"
        rows.append([parameter, f"{true:g}", value, low, high, unit, inside])
    return rows


def beside_the_paper() -> list[list[str]]:
    """Table 3, ours and in brackets the paper's."""
    kinds = ("Angle (°)", "Velocity (°/s)", "Current (A)")
    rows = [["Record, joint", *(f"{kind}, {phase}" for kind in kinds for phase in ("slow", "fast"))]]
    for (name, joint), ours in table().items():
        cells = (f"{mine:.2g} ({theirs:g})" for mine, theirs in zip(ours, PAPER[name, joint], strict=True))
        rows.append([f"{name}, {joint}", *cells])
    return rows


def draw(path: Path) -> None:
    """RMS of every row of Table 3, ours and the paper's, on logarithmic axes."""
    ours, rows = table(), np.arange(len(PAPER))
    with style():
        figure = Figure((WIDTH_IN, 3.6), layout="constrained")
        panels = figure.subplots(1, 3, sharey=True)
        for number, (axes, title) in enumerate(
            zip(panels, ("Angle (°)", "Velocity (°/s)", "Current (A)"), strict=True)
        ):
            for phase, (label, mark) in enumerate((("slow", "o"), ("fast", "s"))):
                column = 2 * number + phase
                axes.plot(
                    [p[column] for p in PAPER.values()],
                    rows,
                    mark,
                    mfc="none",
                    color=ORANGE,
                    ms=5,
                    label=f"paper, {label}",
                )
                axes.plot(
                    [o[column] for o in ours.values()], rows, mark, color=BLUE, ms=3.5, label=f"here, {label}"
                )
            axes.set(xscale="log", xlabel=f"RMS of {title[0].lower()}{title[1:]}")
            axes.xaxis.set_minor_formatter(NullFormatter())
        names = [f"{name.replace('_', ' ')}, joint {joint}" for name, joint in PAPER]
        panels[0].set_yticks(rows, names)
        panels[0].invert_yaxis()
        panels[0].axhline(5.5, color=MUTED, lw=0.5)
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper left", ncols=4)
        figure.savefig(path, dpi=150)


def published() -> list[list[str]]:
    """The paper's model, PD control and viscous friction and nothing else, fitted on position 1: by the bee
    colony alone, joint by joint, and then on by Gauss-Newton.
    """
    text = CONFIG.read_text().replace("../data", str(ROOT / "data"))
    head, rest = text.split("candidates:\n", 1)
    stages = rest[rest.index("optimizer:") : rest.index("  - {kind: gauss-newton")]
    descent = rest[rest.index("  - {kind: gauss-newton") : rest.index("records:")]
    records = rest[rest.index("records:") :]
    rows = [["Optimizer", "Gap", "Ratio of joint 1", "2", "3", "Processor (s)"]]
    with tempfile.TemporaryDirectory() as folder:
        for label, chosen in (("bees alone", stages), ("bees, then Gauss-Newton", stages + descent)):
            path = Path(folder) / "pd.yaml"
            path.write_text(head + chosen + records)
            began = time.process_time()
            found, _ = run_motion_fit(path, Path(folder) / "pd.h5", {})
            assert found.parameters is not None
            values = dict(zip(found.parameters.name, found.parameters.value, strict=True))
            ratios = (f"{values[f'joint{n}.gear.ratio']:.3g}" for n in (1, 2, 3))
            rows.append([label, f"{found.gap:.2f}", *ratios, f"{time.process_time() - began:.0f}"])
    return rows


def main() -> None:
    """Fit, store, draw."""
    draw(ROOT / "docs/kawasaki_rms.png")
    with threadpool_limits(1):
        known = {"Numbers": numbers(), "Table 3": beside_the_paper()}
        keep("kawasaki_rs010l", {**known, "Published model": published()})


if __name__ == "__main__":
    main()

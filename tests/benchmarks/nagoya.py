"""The Nagoya study beside the paper: identified numbers against the truth, six controllers; figures of its
page.

identify fit configs/nagoya_two_link.yaml
python -m tests.benchmarks.pages store nagoya_two_link reports/nagoya_two_link.h5
python -m tests.benchmarks.nagoya: with the numbers of that stored run, writes docs/nagoya_frf.png,
docs/nagoya_control.png and the tables in results/pages/nagoya_two_link_truth.json
"""

from __future__ import annotations

import json
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from identify.core.arrays import Complex
from identify.motion.changed import with_numbers
from identify.motion.excitation import closed_loop_frf
from identify.motion.problem import MotionProblem, load_motion
from identify.motion.study import read_motion_study
from identify.motion.trajectory import simulated
from tests.benchmarks.pages import keep, tables

ROOT = Path(__file__).parents[2]
Array = NDArray[np.float64]
COLOURS = ("#0072B2", "#D55E00", "#CC79A7", "#009E73")
POSTURES = {"upright": "90°, -90°", "reaching": "45°, -20°", "folded": "110°, -150°"}
CONTROLS = {
    "conventional": "conventional, feed-forward of the rigid arm",
    "inertia": "conventional, feed-forward of two inertias a joint",
    "feedback": "conventional, two inertias a joint and state feedback",
    "shaped": "notch alone, feed-forward of the rigid arm",
    "flexible": "two degrees of freedom",
    "notched": "two degrees of freedom, notch",
}
MODELS = {"conventional": "rigid", "shaped": "rigid", "inertia": "two-inertia"}
STOP_S = 1.31
"""When the command of the control records has stopped."""


@dataclass(frozen=True)
class Seen:
    """Signals of a record as measured and as the fitted model has them, (samples, joints) by quantity, and
    the command there.
    """

    time_s: Array
    measured: dict[str, Array]
    model: dict[str, Array]
    command: Array

    def of(self, which: str) -> dict[str, Array]:
        """Measured or model."""
        return self.measured if which == "measured" else self.model


def problem_of(text: str) -> MotionProblem:
    """The study in `text`."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "config.yaml"
        path.write_text(text.replace("../data", str(ROOT / "data")))
        return load_motion(read_motion_study(path))


def seen(text: str, values: dict[str, float]) -> dict[str, Seen]:
    """Every record of the study in `text` beside the model with these numbers."""
    problem = with_numbers(problem_of(text), {}, values)
    motion = problem.run(problem.initial[None], problem.records)
    found = {}
    for number, record in enumerate(problem.records):
        assert record.measured is not None
        model = {
            q: rows[0] for q, rows in simulated(problem, motion, record, number, len(problem.records)).items()
        }
        every = round(record.measured.time_s[1] / problem.file.study.servo.period_s)
        command = record.command.position[::every][: len(record.measured.time_s)]
        found[record.settings.name] = Seen(
            record.measured.time_s, dict(record.measured.signals), model, command
        )
    return found


def frfs(records: dict[str, Seen], posture: str, which: str) -> tuple[Array, Complex, Complex]:
    """Frequencies, Hz; motor velocity and link acceleration per motor torque (lines, 2, 2), in the excited
    band.
    """
    pair = [records[f"{posture}{joint}"] for joint in (1, 2)]
    step = float(pair[0].time_s[1])
    torque = [record.of(which)["motor_torque"] for record in pair]
    found = [
        closed_loop_frf(torque, [r.of(which)[f"{side}_position"] for r in pair], step, 1.0)
        for side in ("motor", "link")
    ]
    f = found[0][0]
    band, jw = (f >= 2) & (f <= 55), 2j * np.pi * f[:, None, None]
    return f[band], (jw * found[0][1])[band], (jw**2 * found[1][1])[band]


def control_text(text: str, control: str, gain: int) -> str:
    """The study of the control records with another controller."""
    if control not in ("notched", "shaped"):
        text = text.replace("  notch_width: 0.3\n", "").replace("  notch_depth: 0.3\n", "")
    if control in MODELS:
        text = text.replace(
            "  position_gain: 12\n", f"  position_gain: 12\n  feedforward: {MODELS[control]}\n"
        )
    if control == "feedback":
        text = text.replace("kind: two-degree-of-freedom", "kind: state-feedback")
    text = text.replace("velocity_gain: [24000, 8000]", f"velocity_gain: [{12000 * gain}, {4000 * gain}]")
    return text.replace("notched2", f"{control}{gain}")


def quality(record: Seen, which: str) -> tuple[Array, Array]:
    """RMS tracking error of the links while they are to move, and of their vibration about a cubic in the
    half second behind; rad, (2,).
    """
    link, time = record.of(which)["link_position"], record.time_s
    error = (link - record.command)[(time >= 0.2) & (time <= STOP_S)]
    behind = link[(time > STOP_S) & (time <= STOP_S + 0.5)]
    slow = np.polynomial.chebyshev.chebfit(np.linspace(-1, 1, len(behind)), behind, 3)
    vibration = behind - np.polynomial.chebyshev.chebval(np.linspace(-1, 1, len(behind)), slow).T
    return np.sqrt(np.mean(error**2, axis=0)), np.sqrt(np.mean(vibration**2, axis=0))


def numbers(fitted: list[list[str]], truth: dict[str, list[float]]) -> list[list[str]]:
    """Identified, with interval, beside what was put in; fitted: rows of name, value, unit and interval."""
    keys = {
        "rz.stiffness": "stiffness_n_m_rad",
        "rz.damping": "damping_n_m_s_rad",
        "gear.cubic_stiffness": "cubic_n_m_rad3",
        "gear.transmission_error.0.amplitude": "te_amplitude_rad",
        "gear.transmission_error.0.phase": "te_phase_rad",
        "friction.coulomb": "coulomb_n_m",
        "friction.viscous": "viscous_n_m_s_rad",
        "friction.stribeck": "stribeck_n_m",
        "friction.stribeck_velocity": "stribeck_velocity_rad_s",
    }
    rows = [["Number", "Put in", "Identified", "95 % from", "to", "Unit", "Truth inside"]]
    for name, value, unit, low, high, *_ in fitted:
        joint, key = name.split(".", 1)
        true = np.broadcast_to(truth[keys[key]], 2)[int(joint[5:]) - 1]
        inside = "yes" if float(low) <= true <= float(high) else "no"
        rows.append([name, f"{true:.4g}", value, low, high, unit, inside])
    return rows


def control(runs: dict[tuple[str, int], Seen]) -> list[list[str]]:
    """Tracking and residual vibration of both links."""
    rows = [
        [
            "Controller",
            "Gain",
            *(
                f"{what} RMS, link {link} (0.001°): measured / model"
                for what in ("Tracking", "Residual vibration")
                for link in (1, 2)
            ),
        ]
    ]
    for (name, gain), record in runs.items():
        measured, model = (np.degrees(quality(record, which)) * 1e3 for which in ("measured", "model"))
        pairs = zip(measured.ravel(), model.ravel(), strict=True)
        rows.append([CONTROLS[name], str(gain), *(f"{m:.1f} / {s:.1f}" for m, s in pairs)])
    return rows


def draw_frfs(records: dict[str, Seen], path: Path) -> None:
    """Gain and phase of the motor's velocity and gain of the link's acceleration, per joint, measured and
    model (Figs. 9 and 10).
    """
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(3, 4, figsize=(13, 7.2), sharex=True, sharey="row", layout="constrained")
    for column, (joint, which) in enumerate((j, w) for j in (0, 1) for w in ("measured", "model")):
        for colour, (posture, angles) in zip(COLOURS, POSTURES.items(), strict=False):
            f, velocity, acceleration = frfs(records, posture, which)
            h, a = velocity[:, joint, joint], acceleration[:, joint, joint]
            axes[0, column].semilogx(f, 20 * np.log10(np.abs(h)), color=colour, label=f"{posture} ({angles})")
            axes[1, column].semilogx(f, np.degrees(np.angle(h)), color=colour)
            axes[2, column].semilogx(f, 20 * np.log10(np.abs(a)), color=colour)
        axes[0, column].set_title(f"joint {joint + 1}: {which}", fontsize=10)
        axes[2, column].set_xlabel("frequency, Hz")
        axes[2, column].set_xticks([2, 5, 10, 20, 50], ["2", "5", "10", "20", "50"])
        axes[2, column].minorticks_off()
    for ax, label in zip(
        axes[:, 0],
        ("motor velocity, dB of 1 rad/s/(N m)", "its phase, °", "link acceleration, dB of 1 rad/s²/(N m)"),
        strict=True,
    ):
        ax.set_ylabel(label, fontsize=9)
    for ax in axes.ravel():
        ax.grid(alpha=0.3, which="both")
    axes[0, 0].legend(fontsize=8)
    figure.savefig(path, dpi=75)


def draw_control(runs: dict[tuple[str, int], Seen], path: Path) -> None:
    """Errors of the links over time: measured drawn through, model dashed."""
    import matplotlib.pyplot as plt

    chosen = (("conventional", 1), ("inertia", 1), ("feedback", 1), ("flexible", 1))
    figure, axes = plt.subplots(2, 2, figsize=(11, 6), sharex="col", layout="constrained")
    for colour, key in zip(COLOURS, chosen, strict=True):
        record = runs[key]
        for which, style in (("measured", "-"), ("model", "--")):
            error = np.degrees(record.of(which)["link_position"] - record.command)
            label = f"{CONTROLS[key[0]]}, gain x {key[1]}" if which == "measured" else None
            behind = (record.time_s > STOP_S) & (record.time_s < STOP_S + 0.5)
            for ax, lines in ((axes[:, 0], error), (axes[:, 1], error - error[behind].mean(axis=0))):
                for joint in (0, 1):
                    ax[joint].plot(
                        record.time_s,
                        lines[:, joint],
                        style,
                        color=colour,
                        lw=1.2 if style == "-" else 2.0,
                        label=label,
                    )
    for joint, row in enumerate(axes):
        row[0].set_ylabel(f"link {joint + 1} less its command, °")
        row[1].set_title(f"link {joint + 1} behind the stop, about its mean", fontsize=9)
        row[1].set_xlim(STOP_S, STOP_S + 0.5)
        row[1].set_ylim(-0.025, 0.025)
        for ax in row:
            ax.grid(alpha=0.3)
    for ax in axes[1]:
        ax.set_xlabel("time, s")
    handles, names = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, names, fontsize=8, loc="outside lower center", ncols=2)
    axes[0, 0].set_title("drawn through: measured; dashed: model", fontsize=9)
    figure.savefig(path, dpi=90)


def main() -> None:
    """Tables, figures."""
    fitted = tables("nagoya_two_link")["Parameters"]["rows"]
    values = {name: float(value) for name, value, *_ in fitted}
    truth = json.loads((ROOT / "data" / "nagoya_two_link" / "truth.json").read_text())
    records = seen((ROOT / "configs" / "nagoya_two_link_frf.yaml").read_text(), values)
    draw_frfs(records, ROOT / "docs" / "nagoya_frf.png")
    text = (ROOT / "configs" / "nagoya_two_link_control.yaml").read_text()
    runs = {}
    for name in CONTROLS:
        for gain in (1, 2):
            runs[name, gain] = next(iter(seen(control_text(text, name, gain), values).values()))
    keep("nagoya_two_link_truth", {"Numbers": numbers(fitted, truth), "Controllers": control(runs)})
    draw_control(runs, ROOT / "docs" / "nagoya_control.png")


if __name__ == "__main__":
    with threadpool_limits(1):
        main()

"""The fast-chirp study beside the paper: forces, errors per zone, the validation zone and Hzz; tables and
figures of its page.

python -m tests.benchmarks.fast_chirp          some minutes; writes docs/fast_chirp_forces.png,
docs/fast_chirp_hzz.png and the tables in results/pages/fast_chirp_rx160.json
"""

from __future__ import annotations

import tempfile
import time
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.signal import find_peaks
from threadpoolctl import threadpool_limits

from identify.core.errors import InputError
from identify.fitting.fit import Fit, fit
from identify.measured.frf_set import FrfSet
from identify.measured.modal_tables import ModalTable
from identify.modal.analysis import analyse
from identify.modal.pairing import pair
from identify.vibration.costs.target import FrfTarget
from identify.vibration.plan import fit_plan
from identify.vibration.problem import Problem, load_problem
from identify.vibration.study import read_study
from tests.benchmarks.pages import keep

ROOT = Path(__file__).parents[2]
Array = NDArray[np.float64]
SEAM_HZ = 24.0
PAPER = {
    "zone1": ("1.8 / 4.7", ""),
    "zone2": ("5.2 / 7.1", ""),
    "zone3": ("2.4 / 8.5", ""),
    "zone4": ("1.6 / 10.2", ""),
    "mean of zones": ("2.7 / 7.6", ""),
    "X/A": ("10.3", ""),
    "Y/A": ("9.7", ""),
    "Z/A": ("18", ""),
    "H_zz": ("25.7", "12.9"),
}
"""Table I and Figs. 5 and 6: errors (%) of frequency / damping by zone, of magnitudes at modes; with x and y
alone, and with z.
"""


@dataclass(frozen=True)
class Run:
    """A fit with its problem and seconds of processor time."""

    name: str
    problem: Problem
    fit: Fit
    seconds: float

    def target(self, name: str) -> FrfTarget:
        """The FRFs of a measurement."""
        found = next(m.target for m in self.problem.measurements if m.name == name)
        assert isinstance(found, FrfTarget)
        return found


def problem_of(text: str) -> Problem:
    """The study in `text`."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "config.yaml"
        path.write_text(text.replace("../data", str(ROOT / "data")))
        return load_problem(read_study(path))


def run(name: str, text: str) -> Run:
    """Fit the study in `text`."""
    problem, began = problem_of(text), time.process_time()
    found = fit(fit_plan(problem))
    print(f"{name}: {time.process_time() - began:.0f} s, cost {found.cost:.4g}", flush=True)
    return Run(name, problem, found, time.process_time() - began)


def peaks(magnitude: Array, frequency_hz: Array) -> NDArray[np.intp]:
    """Lines of the peaks of a response: local maxima that stand out by 8 %, more than 3 % of the highest."""
    smooth = np.exp(np.convolve(np.log(np.pad(magnitude, 2, "edge")), np.full(5, 0.2), "valid"))
    found, _ = find_peaks(np.log(smooth), prominence=0.08)
    return np.array(
        [n for n in found if smooth[n] > 0.03 * smooth.max() and 8.0 < frequency_hz[n] < 36.0], dtype=int
    )


def peak_errors(measured: Array, model: Array, frequency_hz: Array) -> tuple[list[float], list[float]]:
    """Frequencies (Hz) of the measured peaks and the errors (%) of the model's magnitude within 5 % of
    each.
    """
    at, errors = [], []
    for line in peaks(measured, frequency_hz):
        near = np.abs(frequency_hz / frequency_hz[line] - 1) < 0.05
        at.append(float(frequency_hz[line]))
        errors.append(float(100 * abs(model[near].max() / measured[near].max() - 1)))
    return at, errors


def response_modes(target: FrfTarget, values: Array | None) -> ModalTable:
    """Modes of the normalised responses, measured or, at values, of the model, by the same analysis."""
    frf = target.data.frf if values is None else target.predict(values)
    return analyse(
        replace(target.data, frf=frf, simultaneous_inputs=None, noise=None).pairs(
            list(range(frf.shape[1])), [0]
        )
    ).table


def zone_errors(item: Run, zone: str) -> tuple[float, float]:
    """Mean errors (%) of the frequencies and damping ratios of the modes that were paired."""
    try:
        paired = pair(
            response_modes(item.target(zone), None), response_modes(item.target(zone), item.fit.values)
        )
    except InputError:
        return np.nan, np.nan
    return (
        100 * float(np.abs(paired.frequency_error).mean()),
        100 * float(np.nanmean(np.abs(paired.damping_error))),
    )


def column(item: Run) -> list[str]:
    """Ours in the order of `PAPER`."""
    zones = np.array([zone_errors(item, f"zone{n}") for n in range(1, 5)])
    cells = [f"{f:.1f} / {z:.1f}" for f, z in (*zones, np.nanmean(zones, axis=0))]
    return cells + [f"{np.mean(errors):.1f}" for errors in (*responses(item), axial(item))]


def responses(item: Run) -> list[list[float]]:
    """Errors (%) of the magnitudes of X/A, Y/A, Z/A at their peaks in the validation zone."""
    full = item.target("zone5")
    h = full.predict(item.fit.values)[:, :, 0]
    return [
        peak_errors(np.abs(full.data.frf[:, n, 0]), np.abs(h[:, n]), full.data.frequency_hz)[1]
        for n in range(h.shape[1])
    ]


def axial(item: Run) -> list[float]:
    """Errors (%) of the model's magnitude at the peaks of Hzz of the hammer test (Eqs. 6 to 8: the last
    element of the inverse of G).
    """
    target = item.target("hammer")
    model, measured = target.predict(item.fit.values)[:, 2, 2], target.data.frf[:, 2, 2]
    return peak_errors(np.abs(measured), np.abs(model), target.data.frequency_hz)[1]


def forces(problems: dict[str, Problem]) -> list[list[str]]:
    """Errors (%) of |X/A|, |Y/A|, |Z/A| against the hammer test by Eq. 2, for each force: mean at modes below
    the seam, RMS above.
    """
    rows = [["Force", "Error at the modes below 24 Hz (%)", "RMS error above 24 Hz (%)"]]
    for name, problem in problems.items():
        chirp, hammer = (
            next(m.target.data for m in problem.measurements if m.name == one) for one in ("zone5", "hammer")
        )
        assert isinstance(chirp, FrfSet) and isinstance(hammer, FrfSet)
        f, reference = chirp.frequency_hz, np.abs(reference_response(hammer, chirp.frequency_hz))
        size = np.abs(chirp.frf[:, :, 0])
        found = [peak_errors(reference[:, n], size[:, n], f) for n in range(size.shape[1])]
        low = [
            error for at, errors in found for where, error in zip(at, errors, strict=True) if where < SEAM_HZ
        ]
        high = (size / reference - 1)[f >= SEAM_HZ]
        rows.append([name, f"{np.mean(low):.1f}", f"{100 * np.sqrt(np.mean(high**2)):.1f}"])
    return rows


def reference_response(hammer: FrfSet, frequency_hz: Array) -> NDArray[np.complex128]:
    """H_x - j H_y of the hammer test as receptance at other lines, (lines, outputs)."""
    combined = (hammer.frf[:, :, 0] - 1j * hammer.frf[:, :, 1]) / hammer.s[:, None] ** 2
    parts = [
        [np.interp(frequency_hz, hammer.frequency_hz, part[:, n]) for n in range(3)]
        for part in (combined.real, combined.imag)
    ]
    return np.asarray(np.array(parts[0]).T + 1j * np.array(parts[1]).T)


def draw(runs: list[Run], problems: dict[str, Problem], folder: Path) -> None:
    """Fig. 4 and Figs. 5 and 6."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, 3, figsize=(12, 3.8), layout="constrained")
    for n, ax in enumerate(axes):
        for name, problem in problems.items():
            data = next(m.target.data for m in problem.measurements if m.name == "zone5")
            ax.semilogy(data.frequency_hz, np.abs(data.frf[:, n, 0]), label=f"chirp, {name}")
        hammer = next(m.target.data for m in problem.measurements if m.name == "hammer")
        ax.semilogy(
            data.frequency_hz,
            np.abs(reference_response(hammer, data.frequency_hz)[:, n]),
            "k--",
            lw=1,
            label="hammer, Eq. 2",
        )
        ax.set_title(f"{'XYZ'[n]}/A, validation zone", fontsize=10)
        ax.set_xlabel("frequency, Hz")
        ax.grid(alpha=0.3)
    axes[0].set_ylabel("m/N")
    axes[0].legend(fontsize=8)
    figure.savefig(folder / "fast_chirp_forces.png", dpi=110)
    figure, axes = plt.subplots(1, 4, figsize=(15, 3.8), layout="constrained")
    for item in runs:
        zone, hammer_test = item.target("zone5"), item.target("hammer")
        h = zone.predict(item.fit.values)[:, :, 0]
        for n in range(h.shape[1]):
            axes[n].semilogy(zone.data.frequency_hz, np.abs(h[:, n]), lw=1.2, label=item.name)
        axes[3].semilogy(
            hammer_test.data.frequency_hz, np.abs(hammer_test.predict(item.fit.values)[:, 2, 2]), lw=1.2
        )
    measured = runs[-1].target("zone5").data
    for n in range(3):
        axes[n].semilogy(measured.frequency_hz, np.abs(measured.frf[:, n, 0]), "k:", lw=1.6, label="measured")
        axes[n].set_title(f"{'XYZ'[n]}/A, validation zone", fontsize=10)
    axes[3].semilogy(hammer_test.data.frequency_hz, np.abs(hammer_test.data.frf[:, 2, 2]), "k:", lw=1.6)
    axes[3].set_title("Hzz, hammer test", fontsize=10)
    for ax in axes:
        ax.set_xlabel("frequency, Hz")
        ax.grid(alpha=0.3)
    axes[0].set_ylabel("m/N")
    axes[3].set_ylabel("m/s²/N")
    axes[1].legend(fontsize=8)
    figure.savefig(folder / "fast_chirp_hzz.png", dpi=110)


def likely(text: str) -> str:
    """The study with identify's default cost and optimizer, one start as it has."""
    return text[: text.index("cost:")] + "starts: 1\n"


def main() -> None:
    """All fits, tables, figures."""
    both = {axes: (ROOT / "configs" / f"fast_chirp_rx160{axes}.yaml").read_text() for axes in ("_xy", "")}
    problems = {
        force: problem_of(both[""].replace("force: blend", f"force: {force}"))
        for force in ("formula", "load-cell", "blend")
    }
    runs = []
    for axes, name in (("_xy", "x, y"), ("", "with z")):
        runs += [run(f"swarm: {name}", both[axes]), run(f"defaults: {name}", likely(both[axes]))]
    heads = ["Errors (%)", "paper: x, y", "paper: with z", *(item.name for item in runs)]
    ours = np.transpose([column(item) for item in runs]).tolist()
    rows = [[name, *paper, *cells] for (name, paper), cells in zip(PAPER.items(), ours, strict=True)]
    seconds = ["processor (s)", "", "", *(f"{item.seconds:.0f}" for item in runs)]
    keep("fast_chirp_rx160", {"Forces": forces(problems), "Errors": [heads, *rows, seconds]})
    draw([runs[0], runs[2], runs[3]], problems, ROOT / "docs")


if __name__ == "__main__":
    with threadpool_limits(1):
        main()

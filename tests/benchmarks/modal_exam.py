"""Exam of `identify modes`: structures drawn at random, what is missed, what is not there, what ± is worth.

Run `python -m tests.benchmarks.modal_exam --structures 24 --seed 7` from the repository's root; `--json` for
numbers to keep, `--noise` for other noise levels.  A true mode is found where a mode of the table lies within
its half-bandwidth (zeta omega) and has its shape (MAC above one half); a mode of the table that is within a
half-power bandwidth of no free true mode is spurious.  Spacing: to the nearest mode, in mean half-power
bandwidths.  A mode is lost in the noise where what only it does to the FRFs is less than noise does by chance
in one case of a thousand (true poles, free residues): nobody can find it.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass

import numpy as np
from scipy.stats import chi2

from identify.measured.modal_tables import ModalTable
from identify.modal.analysis import analyse
from tests.benchmarks.modal_structures import Structure, draw

EDGES = (0.0, 0.5, 1.0, 2.0, 5.0, np.inf)
CLASSES = ("< 0.5", "0.5 to 1", "1 to 2", "2 to 5", "> 5")


@dataclass(frozen=True)
class TrueMode:
    """One true mode of one run and what became of it; errors in stated standard deviations, NaN if missed."""

    structure: int
    noise: float
    frequency_hz: float
    damping_ratio: float
    spacing: float
    lost: bool
    found: bool
    frequency_error: float
    damping_error: float


@dataclass(frozen=True)
class Run:
    """One analysis: its true modes, the frequencies of spurious modes, seconds of processor time."""

    modes: tuple[TrueMode, ...]
    spurious_hz: tuple[float, ...]
    seconds: float


def examine(structure: Structure, number: int, noise: float, seed: int) -> Run:
    """Analyse one structure once; modes whose half-power band crosses an edge of the band are left out."""
    data = structure.measured(noise, seed)
    begun = time.process_time()
    table = analyse(data).table
    seconds = time.process_time() - begun
    poles, shapes = structure.modes()
    f, half = np.abs(poles) / (2 * np.pi), -poles.real / (2 * np.pi)
    low, high = structure.frequency_hz[[0, -1]]
    inside = (f - half >= low) & (f + half <= high)
    lost, spacing = _lost(structure, poles, shapes, noise), _spacing(f, half)
    match, spurious = matched(poles, shapes, table)
    modes = []
    for r in map(int, np.flatnonzero(inside)):
        errors = _errors(poles[r], table, match[r]) if r in match else (np.nan, np.nan)
        ratio = float(half[r] / f[r])
        where = float(f[r]), ratio, float(spacing[r])
        modes.append(TrueMode(number, noise, *where, bool(lost[r]), r in match, *errors))
    return Run(tuple(modes), tuple(spurious), seconds)


def _spacing(f: np.ndarray, half: np.ndarray) -> np.ndarray:
    apart = np.abs(f[:, None] - f) / np.maximum(half[:, None] + half, 1e-12)
    return np.asarray(np.min(apart + np.diag(np.full(len(f), np.inf)), axis=1))


def _lost(structure: Structure, poles: np.ndarray, shapes: np.ndarray, noise: float) -> np.ndarray:
    s, frf = structure.s, structure.frf()
    deviation = np.sqrt(np.mean(structure.deviation(frf, noise) ** 2, axis=2))
    functions = np.concatenate([1 / (s[:, None] - poles), 1 / (s[:, None] - poles.conj())], axis=1)
    functions = functions / np.linalg.norm(functions, axis=0)
    lost = []
    for r in range(len(poles)):
        others = np.delete(functions, [r], axis=1)
        alone = functions[:, r] - others @ np.linalg.lstsq(others, functions[:, r], rcond=1e-13)[0]
        residue = _residues(frf, functions, r)
        size = np.sum(np.abs(alone[:, None, None] * residue / deviation[:, :, None]) ** 2)
        lost.append(2 * size < chi2.isf(1e-3, 2 * frf.shape[1] * frf.shape[2]))
    return np.array(lost)


def _residues(frf: np.ndarray, functions: np.ndarray, r: int) -> np.ndarray:
    extra = np.vander(np.linspace(-1, 1, len(frf)), 3)
    basis = np.concatenate([functions, extra], axis=1)
    return np.asarray(
        np.linalg.lstsq(basis, frf.reshape(len(frf), -1), rcond=1e-13)[0][r].reshape(frf.shape[1:])
    )


def matched(poles: np.ndarray, shapes: np.ndarray, table: ModalTable) -> tuple[dict[int, int], list[float]]:
    """{true mode: row of the table}, nearest first, and the frequencies of spurious rows."""
    size = 2 * np.pi * table.frequency_hz
    found = size * (-table.damping_ratio + 1j * np.sqrt(1 - table.damping_ratio**2))
    apart = np.abs(poles[:, None] - found) / -poles.real[:, None]
    assert table.shapes is not None
    unit = [v / np.maximum(np.linalg.norm(v, axis=1, keepdims=True), 1e-300) for v in (shapes, table.shapes)]
    alike = np.abs(unit[0].conj() @ unit[1].T) ** 2
    match = _nearest_first(np.where(alike > 0.5, apart, np.inf), 1.0)
    width = 2 * np.maximum(-poles.real[:, None], size * table.damping_ratio)
    near = np.abs(np.abs(poles)[:, None] - size) / width
    near[list(match)] = np.inf
    near[:, list(match.values())] = np.inf
    explained = set(match.values()) | set(_nearest_first(near, 1.0).values())
    return match, [float(hz) for k, hz in enumerate(table.frequency_hz) if k not in explained]


def _nearest_first(apart: np.ndarray, limit: float) -> dict[int, int]:
    match: dict[int, int] = {}
    apart = apart.copy()
    while apart.size and np.min(apart) <= limit:
        r, k = np.unravel_index(np.argmin(apart), apart.shape)
        match[int(r)] = int(k)
        apart[r], apart[:, k] = np.inf, np.inf
    return match


def _errors(pole: complex, table: ModalTable, k: int) -> tuple[float, float]:
    assert table.frequency_std_hz is not None and table.damping_std is not None
    frequency = (table.frequency_hz[k] - abs(pole) / (2 * np.pi)) / table.frequency_std_hz[k]
    return float(frequency), float((table.damping_ratio[k] + pole.real / abs(pole)) / table.damping_std[k])


def runs(structures: int, seed: int, levels: list[float]) -> Iterator[tuple[int, float, Run]]:
    """Every structure at every noise level; structure k of a seed is the same however many are asked for."""
    for number in range(structures):
        structure = draw(np.random.default_rng([seed, number]))
        for level in levels:
            yield number, level, examine(structure, number, level, seed=seed * 1000 + number)


def table(done: list[Run], levels: list[float]) -> list[dict[str, float | str]]:
    """One row for each class of spacing and noise."""
    rows: list[dict[str, float | str]] = []
    modes = [mode for run in done for mode in run.modes]
    for level in levels:
        for k, name in enumerate(CLASSES):
            here = [m for m in modes if m.noise == level and EDGES[k] <= m.spacing < EDGES[k + 1]]
            seen = [m for m in here if not m.lost]
            found = [m for m in here if m.found]
            if here:
                row: dict[str, float | str] = {"noise": level, "spacing": name, "modes": len(here)}
                row["missed %"] = 100 * (1 - len(found) / len(here))
                row["lost in noise"] = len(here) - len(seen)
                row["missed of the rest %"] = (
                    100 * float(np.mean([not m.found for m in seen])) if seen else np.nan
                )
                row["f in 95 %"] = _covered([m.frequency_error for m in found])
                row["zeta in 95 %"] = _covered([m.damping_error for m in found])
                rows.append(row)
    return rows


def _covered(errors: list[float]) -> float:
    return 100 * float(np.mean(np.abs(errors) < 1.96)) if errors else np.nan


def main() -> None:
    """Print the tables, or all numbers as JSON."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--structures", type=int, default=24)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--noise", type=float, nargs="*", default=[0.001, 0.01, 0.1])
    parser.add_argument("--json", action="store_true", help="numbers of every mode in place of tables")
    asked = parser.parse_args()
    done = []
    for number, level, run in runs(asked.structures, asked.seed, asked.noise):
        done.append(run)
        missed = sum(not mode.found for mode in run.modes)
        said = f"{missed} of {len(run.modes)} missed, spurious {np.round(run.spurious_hz, 2).tolist()}"
        print(
            f"structure {number}, noise {level:g}: {said}, {run.seconds:.1f} s", file=sys.stderr, flush=True
        )
    if asked.json:
        print(json.dumps([asdict(run) for run in done]))
        return
    rows = table(done, asked.noise)
    print(" | ".join(rows[0]))
    for row in rows:
        print(" | ".join(f"{cell:.4g}" if isinstance(cell, float) else str(cell) for cell in row.values()))
    spurious = sum(len(run.spurious_hz) for run in done)
    seconds = sum(run.seconds for run in done)
    print(f"{spurious} spurious modes in {len(done)} runs; {seconds:.0f} s of analysis")


if __name__ == "__main__":
    main()

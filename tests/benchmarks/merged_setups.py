"""Exam of `identify modes` on several setups: plates and trusses on which sensors of 30 to 50 g were moved.

Run `python -m tests.benchmarks.merged_setups --structures 20 --seed 7` from the repository's root; `--out`
keeps the numbers as JSON, `--one-set` analyses all FRFs at once as well, as if they
shared their poles.  A
true mode is one of the structure without moved sensors; it is found where a mode of the table lies within its
half-bandwidth (zeta omega) and has its shape (MAC above one half), spurious is what is within a half-power
bandwidth of no free true mode.  Every mode in the band counts, also what forces or sensors hardly move.
"""

from __future__ import annotations

import argparse
import json
import time
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from identify.measured.modal_tables import ModalTable
from identify.modal.analysis import analyse
from identify.modal.settings import ModalSettings
from identify.modal.setups.result import pooled
from identify.modal.setups.run import analyse_setups
from tests.benchmarks.merged_structures import Test, draw
from tests.benchmarks.modal_exam import matched

NOISE = (0.001, 0.003, 0.01, 0.03)


@dataclass(frozen=True)
class Score:
    """One test: frequency errors of modes that were found in half-bandwidths, and over their stated standard
    deviations; damping errors in per cent and over theirs; shifts (half-bandwidths) that sensors make; kg as
    it is and as it was told (NaN: not).
    """

    number: int
    kind: str
    setups: int
    sensors: int
    noise: float
    modes: int
    missed: int
    spurious_hz: list[float]
    shift: list[float]
    frequency: list[float]
    frequency_std: list[float]
    damping: list[float]
    damping_std: list[float]
    one_minus_mac: list[float]
    kg: float
    told_kg: float
    seconds: float
    one_set_missed: int
    one_set_spurious: int


def examine(test: Test, number: int, noise: float, rng: np.random.Generator, one_set: bool) -> Score:
    """Analyse the setups of one test."""
    sets = [test.measured(k, noise, rng) for k in range(len(test.roved))]
    data = pooled(sets, "drawn at random")
    begun = time.process_time()
    found, setups = analyse_setups(data, sets, [one.source for one in sets], ModalSettings())
    seconds = time.process_time() - begun
    poles, shapes = test.body.modes(test.body.mass)
    rows = [test.row(channel) for channel in found.table.channels]
    shapes, hz, half = shapes[:, rows], np.abs(poles) / (2 * np.pi), -poles.real / (2 * np.pi)
    low, high = test.frequency_hz[[0, -1]]
    inside = np.flatnonzero((hz - half >= low) & (hz + half <= high))
    pairs, spurious = matched(poles, shapes, found.table)
    kept = [r for r in inside if r in pairs]
    table, j = found.table, [pairs[r] for r in kept]
    assert table.frequency_std_hz is not None and table.damping_std is not None and table.shapes is not None
    off, zeta = table.frequency_hz[j] - hz[kept], -poles.real[kept] / np.abs(poles[kept])
    loaded = [np.abs(test.body.modes(test.body.loaded(n, test.kg))[0]) / (2 * np.pi) for n in test.roved]
    shift = np.max([(hz - one)[kept] for one in loaded], axis=0) / half[kept]
    alike = [_mac(shapes[r], table.shapes[k]) for r, k in zip(kept, j, strict=True)]
    missed, more = _one_set(poles, shapes, inside, analyse(data).table) if one_set else (-1, -1)
    return Score(
        number,
        "plate" if test.body.direction[0] == 3 else "truss",
        len(sets),
        len(test.roved[0]),
        noise,
        len(inside),
        len(inside) - len(kept),
        spurious,
        _listed(shift),
        _listed(off / half[kept]),
        _listed(off / table.frequency_std_hz[j]),
        _listed(100 * (table.damping_ratio[j] / zeta - 1)),
        _listed((table.damping_ratio[j] - zeta) / table.damping_std[j]),
        _listed(1 - np.array(alike)),
        test.kg,
        np.nan if setups is None else setups.merged.kg,
        seconds,
        missed,
        more,
    )


def _one_set(poles: np.ndarray, shapes: np.ndarray, inside: np.ndarray, table: ModalTable) -> tuple[int, int]:
    """Missed and spurious modes of an analysis of all FRFs at once; the loaded poles of setups are not those
    of the structure, so a mode within four half-bandwidths counts as found.
    """
    wide = poles.imag * 1j + 4 * poles.real
    pairs, spurious = matched(wide, shapes, table)
    return len(inside) - len([r for r in inside if r in pairs]), len(spurious)


def _mac(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.abs(np.vdot(a, b)) ** 2 / (np.vdot(a, a).real * np.vdot(b, b).real))


def _listed(values: np.ndarray) -> list[float]:
    return [float(f"{value:.4g}") for value in values]


def summary(done: list[Score]) -> dict[str, float]:
    """The numbers of the docs page."""
    every = {
        name: np.concatenate([getattr(one, name) for one in done])
        for name in ("shift", "frequency", "frequency_std", "damping", "damping_std", "one_minus_mac")
    }
    kg = np.array([[one.kg, one.told_kg] for one in done if np.isfinite(one.told_kg)]).reshape(-1, 2)
    mass, one_set = {}, {}
    if len(kg):
        off = 100 * np.abs(kg[:, 1] / kg[:, 0] - 1)
        parts = {"median": np.median(off), "90 %": np.quantile(off, 0.9), "most": np.max(off)}
        mass = {f"mass error, {name}, %": float(value) for name, value in parts.items()}
    if done[0].one_set_missed >= 0:
        one_set["one set: missed"] = sum(one.one_set_missed for one in done)
        one_set["one set: spurious"] = sum(one.one_set_spurious for one in done)
    return {
        "structures": len(done),
        "setups": sum(one.setups for one in done),
        "modes": sum(one.modes for one in done),
        "missed": sum(one.missed for one in done),
        "spurious": sum(len(one.spurious_hz) for one in done),
        "shift by sensors, median, half-bandwidths": float(np.median(every["shift"])),
        "shift by sensors, most, half-bandwidths": float(np.max(every["shift"])),
        "frequency error, median, half-bandwidths": float(np.median(np.abs(every["frequency"]))),
        "frequency error, 90 %, half-bandwidths": float(np.quantile(np.abs(every["frequency"]), 0.9)),
        "frequencies in their 95 % interval, %": 100 * float(np.mean(np.abs(every["frequency_std"]) < 1.96)),
        "damping error, median, %": float(np.median(np.abs(every["damping"]))),
        "damping error, 90 %, %": float(np.quantile(np.abs(every["damping"]), 0.9)),
        "damping in its 95 % interval, %": 100 * float(np.mean(np.abs(every["damping_std"]) < 1.96)),
        "1 - MAC, median": float(np.median(every["one_minus_mac"])),
        "1 - MAC, 90 %": float(np.quantile(every["one_minus_mac"], 0.9)),
        "mass told": len(kg),
        **mass,
        "seconds, median": float(np.median([one.seconds for one in done])),
        **one_set,
    }


def main() -> None:
    """Draw, analyse, print, keep."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--structures", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--one-set", action="store_true")
    parser.add_argument("--each", action="store_true", help="30 to 50 g each sensor, not all of a setup")
    parser.add_argument("--out", type=Path)
    asked = parser.parse_args()
    done = []
    for number in range(asked.structures):
        rng = np.random.default_rng([asked.seed, number])
        test = draw(rng, each=asked.each)
        noise = float(rng.choice(NOISE))
        done.append(examine(test, number, noise, rng, asked.one_set))
        one = done[-1]
        print(
            f"{number}: {one.kind}, {one.setups} setups of {one.sensors}, noise {noise:g}: {one.missed} of"
            f" {one.modes} missed, spurious {one.spurious_hz}, {1e3 * one.kg:.1f} g told"
            f" {1e3 * one.told_kg:.1f}, one set {one.one_set_missed}, {one.one_set_spurious};"
            f" {one.seconds:.0f} s",
            flush=True,
        )
    numbers = {"seed": asked.seed, **summary(done)}
    for name, value in numbers.items():
        print(f"{name}: {value:.4g}")
    if asked.out is not None:
        kept = [
            {k: v if not isinstance(v, float) or np.isfinite(v) else None for k, v in asdict(one).items()}
            for one in done
        ]
        asked.out.write_text(json.dumps({**numbers, "tests": kept}, indent=1, allow_nan=False) + "\n")


if __name__ == "__main__":
    main()

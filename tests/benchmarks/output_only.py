"""Modes of arms that mill, from their responses alone, beside the true ones: missed, spurious, errors.

Run `python -m tests.benchmarks.output_only --seed N [--count 20]` from the repository's root.  Arms,
postures, sensors, speeds and lengths of the records are drawn by the seed; half the speeds are told.  Beside
it pyOMA2 (SSI-cov of the same rows and orders, without intervals; poles picked where orders agree, for it
leaves the choice to its user) if it is installed, and left out, saying so, if not: `pip install pyOMA-2`.
"""

from __future__ import annotations

import argparse
import importlib
import importlib.util
import io
import logging
import time
from contextlib import redirect_stderr
from dataclasses import dataclass, field

import numpy as np

from identify.core.thresholds import SIGMAS_95
from identify.measured.channel import Channel
from identify.measured.time_history import TimeHistory
from identify.modal.operational.analysis import OperationalModes, analyse
from identify.modal.operational.settings import OperationalSettings
from identify.modal.settings import ModalSettings
from tests.generator.linear import linearise
from tests.generator.makes import MAKES
from tests.generator.measure import draw_postures, make_plant
from tests.generator.spec import TestSpec
from tests.generator.working import Work, cutting, recorded, truth, visible

_NEAR = 0.05
"""How far a found frequency may be from a true one, and be it."""
_SEEN = 0.1
"""Part of the power at its own frequency that a mode must make to count."""


@dataclass(frozen=True)
class Case:
    """A record with what is true: poles (m,) in the band, those that count (m,), and the work."""

    name: str
    history: TimeHistory
    poles: np.ndarray
    counts: np.ndarray
    work: Work
    told: bool
    band_hz: tuple[float, float]


@dataclass
class Score:
    """What all cases together give; errors: (frequency, damping) relative; z: errors over deviations;
    seconds: of processor, each.
    """

    modes: int = 0
    missed: int = 0
    spurious: int = 0
    tones: int = 0
    errors: list[tuple[float, float]] = field(default_factory=list)
    z: list[tuple[float, float]] = field(default_factory=list)
    seconds: list[float] = field(default_factory=list)


def drawn(seed: int, number: int) -> Case:
    """A case of a draw."""
    rng = np.random.default_rng([seed, number])
    make = str(rng.choice(list(MAKES)))
    spec = TestSpec(MAKES[make](int(rng.integers(1, 10**6))), seed=int(rng.integers(1, 10**6)), postures=1)
    plant = make_plant(spec, draw_postures(spec)[0])
    work = Work(
        seconds=float(rng.choice([120.0, 300.0, 600.0])),
        rpm=float(rng.uniform(900, 6000)),
        teeth=int(rng.integers(1, 5)),
        wander=float(rng.choice([0.0, 2e-4, 1e-3])),
        pulses=float(rng.choice([0.3, 1.0, 3.0])),
    )
    links = [spec.arm.points[-1].name, *rng.choice([p.name for p in spec.arm.points[:-1]], 2, replace=False)]
    models = [linearise(plant, name) for name in links]
    forces = [cutting(work, rng), *(0.3 * rng.normal(size=(work.samples, 3)) for _ in links[1:])]
    values = recorded(list(zip(models, forces, strict=True)), work, rng)
    moving = np.flatnonzero(values.std(axis=0) > 1e-6 * values.std())  # the floor does not
    chosen = np.sort(rng.choice(moving, min(len(moving), int(rng.integers(6, 16))), replace=False))
    channels = tuple(Channel(spec.arm.points[i // 3].node, i % 3 + 1) for i in chosen)
    history = TimeHistory(work.rate_hz, values[None][:, :, chosen], channels, ("m/s^2",) * len(chosen), make)
    poles, _ = truth(models[0])
    band = (4.0, 150.0)
    inside = (np.abs(poles) > 2 * np.pi * band[0]) & (np.abs(poles) < 2 * np.pi * band[1])
    ratio = -poles.real / np.abs(poles)
    counts = visible(models, _SEEN)[inside] & (ratio[inside] < ModalSettings().max_damping_ratio)
    return Case(make, history, poles[inside], counts, work, bool(rng.integers(2)), band)


def found_modes(case: Case) -> OperationalModes:
    """Ours."""
    told = OperationalSettings(speeds_rpm=(case.work.rpm,) if case.told else ())
    return analyse(case.history, told, ModalSettings(band_hz=case.band_hz))


def score(case: Case, hz: np.ndarray, ratio: np.ndarray, std: np.ndarray | None, total: Score) -> str:
    """Add a case; a line on it.  std (m, 2): of frequency and damping ratio."""
    true_hz, true_ratio = np.abs(case.poles) / (2 * np.pi), -case.poles.real / np.abs(case.poles)
    taken: set[int] = set()
    spurious: list[float] = []
    for row in np.argsort([np.min(np.abs(f / true_hz - 1)) for f in hz]):
        free = [j for j in range(len(true_hz)) if j not in taken]
        near = min(free, key=lambda j: abs(hz[row] / true_hz[j] - 1), default=None)
        if near is None or abs(hz[row] / true_hz[near] - 1) > _NEAR:
            spurious.append(float(hz[row]))
            continue
        taken.add(near)
        errors = hz[row] - true_hz[near], ratio[row] - true_ratio[near]
        total.errors.append((errors[0] / true_hz[near], errors[1] / true_ratio[near]))
        if std is not None:
            total.z.append((errors[0] / std[row, 0], errors[1] / std[row, 1]))
    missed = [float(true_hz[j]) for j in np.flatnonzero(case.counts) if j not in taken]
    tooth = case.work.rpm / 60
    total.tones += sum(abs(f / tooth - round(f / tooth)) < 0.01 for f in spurious)
    total.modes += int(case.counts.sum())
    total.missed += len(missed)
    total.spurious += len(spurious)
    return f"missed {np.round(missed, 1)} spurious {np.round(spurious, 1)}"


def told(name: str, total: Score) -> str:
    """The score in words."""
    errors, z = np.abs(np.array(total.errors)), np.abs(np.array(total.z))
    within = [float(np.mean(errors[:, k] < limit)) for k, limit in ((0, 0.01), (1, 0.2))]
    held = [f"{np.mean(z[:, k] < SIGMAS_95):.1%}" for k in (0, 1)] if len(z) else ["none"] * 2
    return (
        f"{name}: {total.modes} modes, missed {total.missed}, spurious {total.spurious} (at multiples of the"
        f" speed {total.tones}); frequency median {np.median(errors[:, 0]):.2%}, within"
        f" 1 % {within[0]:.1%}; damping median {np.median(errors[:, 1]):.1%}, within 20 % {within[1]:.1%};"
        f" coverage of 95 % intervals {held[0]} (frequency), {held[1]} (damping); processor seconds a record:"
        f" median {np.median(total.seconds):.1f}, at most {max(total.seconds):.1f}"
    )


def theirs(case: Case) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies and damping ratios of pyOMA2: SSI-cov of the same rows and orders, its default criteria."""
    setup = importlib.import_module("pyoma2.setup")
    algorithms = importlib.import_module("pyoma2.algorithms")
    data = case.history.data[0]
    single = setup.SingleSetup(data, fs=case.history.sample_rate_hz)
    rows = int(np.ceil(0.75 * case.history.sample_rate_hz / case.band_hz[0]))
    ssi = algorithms.SSI(name="SSIcov", method="cov", br=min(rows, 1200 // data.shape[1]), ordmax=80, step=2)
    single.add_algorithms(ssi)
    with redirect_stderr(io.StringIO()):
        single.run_by_name("SSIcov")
    return _clustered(np.array(ssi.result.Fn_poles), np.array(ssi.result.Xi_poles), case.band_hz)


def _clustered(
    hz: np.ndarray, ratio: np.ndarray, band_hz: tuple[float, float]
) -> tuple[np.ndarray, np.ndarray]:
    """Its poles have to be picked by hand: here, wherever two in five orders agree to 1 % in frequency."""
    rows, columns = np.nonzero(np.isfinite(hz) & (hz > band_hz[0]) & (hz < band_hz[1]))
    value, damping = hz[rows, columns], ratio[rows, columns]
    left, found = np.ones(len(value), dtype=bool), []
    while left.any():
        counts = [
            len(set(columns[left & (np.abs(value / f - 1) < 0.01)])) if ok else 0
            for f, ok in zip(value, left, strict=True)
        ]
        best = int(np.argmax(counts))
        near = left & (np.abs(value / value[best] - 1) < 0.01)
        if counts[best] < 0.4 * hz.shape[1]:
            break
        found.append((np.median(value[near]), np.median(damping[near])))
        left &= ~(np.abs(value / value[best] - 1) < 0.02)
    pairs = np.array(found).reshape(-1, 2)
    return pairs[:, 0], pairs[:, 1]


def main() -> None:
    """Print a line a case, and the scores."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.output_only", description=__doc__)
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--count", type=int, default=20)
    given = parser.parse_args()
    has_other = importlib.util.find_spec("pyoma2") is not None
    logging.disable(logging.INFO)
    ours, other = Score(), Score()
    for number in range(given.count):
        case, begun = drawn(given.seed, number), time.process_time()
        found = found_modes(case)
        ours.seconds.append(time.process_time() - begun)
        std = np.stack([found.scatter.frequency_hz, found.scatter.damping], axis=1)
        line = score(case, found.frequency_hz, found.damping_ratio, std, ours)
        said = f"{case.work.seconds:.0f} s, {case.work.rpm / 60:.1f} Hz, {case.work.pulses:g} pulses,"
        said = f"{said} {len(case.history.channels)} channels"
        print(f"{number:2d} {case.name} ({said}): {line}; {ours.seconds[-1]:.1f} s", flush=True)
        if has_other:
            begun = time.process_time()
            others = theirs(case)
            other.seconds.append(time.process_time() - begun)
            line = score(case, *others, None, other)
            print(f"   pyOMA2: {line}; {other.seconds[-1]:.1f} s", flush=True)
    print(told("identify", ours))
    print(told("pyOMA2", other) if has_other else "pyOMA2 is not installed")


if __name__ == "__main__":
    main()

"""Modal masses of modes from responses alone, by an FRF and by an added mass, beside the true ones.

Run `python -m tests.benchmarks.modal_scaling --seed N [--count 10]` from the repository's root.  Arms,
postures, sensors, masses and records are drawn by the seed; both records are of the arm that mills.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass, field, replace

import numpy as np

from identify.core.thresholds import SIGMAS_95
from identify.measured.channel import Channel
from identify.measured.frf_set import FrfSet
from identify.measured.time_history import TimeHistory
from identify.modal.analysis import analyse as analyse_frfs
from identify.modal.operational.analysis import OperationalModes, analyse
from identify.modal.operational.by_added_mass import by_added_mass
from identify.modal.operational.by_frfs import by_frfs
from identify.modal.operational.masses import ModalMasses
from identify.modal.operational.settings import OperationalSettings
from identify.modal.settings import ModalSettings
from tests.generator.linear import Linear, linearise
from tests.generator.makes import MAKES
from tests.generator.measure import draw_postures, make_plant
from tests.generator.spec import TestSpec
from tests.generator.working import Work, cutting, modal_masses, recorded, truth, with_mass

_NEAR = 0.03
"""How far a found frequency may be from a true one, and be it."""
BAND = (4.0, 120.0)


@dataclass(frozen=True)
class Case:
    """An arm: models pushed at the tool and elsewhere, without and with the mass; sensors recorded, channels
    of them and rows of the models' outputs; the node and the mass, kg.
    """

    models: list[Linear]
    heavier: list[Linear]
    channels: tuple[Channel, ...]
    rows: np.ndarray
    tool: tuple[int, int]
    kg: float
    work: Work


@dataclass
class Score:
    """told of all modes found; errors relative, and over their standard deviations."""

    modes: int = 0
    errors: list[float] = field(default_factory=list)
    z: list[float] = field(default_factory=list)

    def add(self, found: OperationalModes, masses: ModalMasses, case: Case) -> str:
        """The masses of one case; a line on them."""
        poles, _ = truth(case.models[0])
        sensor = np.arange(3 * case.tool[1], 3 * case.tool[1] + 3)
        true, lines = modal_masses(case.models[0], sensor, case.rows), []
        for hz, kg, std in zip(found.frequency_hz, masses.kg, masses.std_kg, strict=True):
            near = int(np.argmin(np.abs(np.abs(poles) / (2 * np.pi * hz) - 1)))
            if abs(abs(poles[near]) / (2 * np.pi * hz) - 1) > _NEAR:
                continue
            self.modes += 1
            if np.isfinite(kg):
                self.errors.append(kg / true[near] - 1)
                self.z.append((kg - true[near]) / std)
                lines.append(f"{hz:.1f} Hz {100 * self.errors[-1]:+.1f} % ({self.z[-1]:+.1f})")
        return ", ".join(lines)

    def said(self, name: str) -> str:
        """All of it in words."""
        errors, z = np.abs(self.errors), np.abs(self.z)
        return (
            f"{name}: {len(z)} of {self.modes} modes told; error median {np.median(errors):.1%}, 90 % within"
            f" {np.quantile(errors, 0.9):.1%}, worst {errors.max():.0%}; 95 % intervals hold"
            f" {np.mean(z < SIGMAS_95):.1%}, deviations {np.sqrt(np.mean(z**2)):.2f} of those stated (RMS)"
        )


def drawn(seed: int, number: int) -> Case:
    """A case of a draw."""
    rng = np.random.default_rng([seed, number])
    make = str(rng.choice(list(MAKES)))
    spec = TestSpec(MAKES[make](int(rng.integers(1, 10**6))), seed=int(rng.integers(1, 10**6)), postures=1)
    plant = make_plant(spec, draw_postures(spec)[0])
    points = spec.arm.points
    work = Work(
        seconds=float(rng.choice([300.0, 600.0])),
        rpm=float(rng.uniform(900, 6000)),
        teeth=int(rng.integers(1, 5)),
        wander=float(rng.choice([0.0, 2e-4, 1e-3])),
        pulses=float(rng.choice([0.0, 0.3, 1.0])),
    )
    links = [points[-1].name, *rng.choice([p.name for p in points[:-1]], 2, replace=False)]
    models, kg = [linearise(plant, name) for name in links], float(rng.uniform(2, 12))
    tool = len(points) - 1
    heavier = [with_mass(model, models[0], tool, kg) for model in models]
    moving = np.array([n for n in range(tool) if np.abs(models[0].c[3 * n : 3 * n + 3]).max() > 0])
    sensors = np.sort(rng.choice(moving, min(len(moving), int(rng.integers(2, 6))), replace=False))
    rows = np.concatenate([np.arange(3 * n, 3 * n + 3) for n in (*sensors, tool)])
    channels = tuple(Channel(points[i // 3].node, i % 3 + 1) for i in rows)
    return Case(models, heavier, channels, rows, (points[-1].node, tool), kg, work)


def modes_of(case: Case, models: list[Linear], rng: np.random.Generator) -> OperationalModes:
    """Found in a record of the arm that mills."""
    work = replace(case.work, rpm=case.work.rpm * rng.uniform(0.9, 1.1))
    forces = [cutting(work, rng), *(0.3 * rng.normal(size=(work.samples, 3)) for _ in models[1:])]
    values = recorded(list(zip(models, forces, strict=True)), work, rng)[:, case.rows]
    live = np.flatnonzero(values.std(axis=0) > 1e-6 * values.std())
    history = TimeHistory(
        work.rate_hz,
        values[None][:, :, live],
        tuple(case.channels[i] for i in live),
        ("m/s^2",) * len(live),
        "arm",
    )
    return analyse(history, OperationalSettings(speeds_rpm=(work.rpm,)), ModalSettings(band_hz=BAND))


def frfs_of(case: Case, rng: np.random.Generator, responses: int) -> FrfSet:
    """Accelerances of the tool's sensor, and of others, pushed at the tool, with a hundredth of noise."""
    hz = np.arange(1.0, 180.0, 0.25)
    whole = case.models[0].accelerance(2j * np.pi * hz)
    at = [n for n, c in enumerate(case.channels) if c.node == case.tool[0]]
    chosen = [*at, *(n for n in range(len(case.channels)) if n not in at)][:responses]
    frf = whole[:, case.rows[chosen]][:, :, :1]
    size = 0.01 * np.sqrt(np.mean(np.abs(frf) ** 2, axis=0) / 2)
    frf = frf + size * (rng.normal(size=frf.shape) + 1j * rng.normal(size=frf.shape))
    outputs = tuple(case.channels[i] for i in chosen)
    return FrfSet(hz, frf, outputs, (Channel(case.tool[0], 1),), "accelerance", source="FRFs")


def main() -> None:
    """Print a line a case, and the scores."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.modal_scaling", description=__doc__)
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--count", type=int, default=10)
    given = parser.parse_args()
    by_mass, by_frf = Score(), Score()
    for number in range(given.count):
        case, rng = drawn(given.seed, number), np.random.default_rng([given.seed, number, 1])
        found, heavier = (modes_of(case, models, rng) for models in (case.models, case.heavier))
        told = by_mass.add(found, by_added_mass(found, heavier, {case.tool[0]: case.kg}), case)
        print(f"{number} mass of {case.kg:.1f} kg: {told}", flush=True)
        frfs = frfs_of(case, rng, (1, 3, len(case.channels))[number % 3])
        forced = analyse_frfs(frfs, ModalSettings(band_hz=BAND))
        told = by_frf.add(found, by_frfs(found, forced), case)
        print(f"{number} {len(frfs.outputs)} FRFs: {told}", flush=True)
    print(by_mass.said("added mass"))
    print(by_frf.said("FRFs"))


if __name__ == "__main__":
    main()

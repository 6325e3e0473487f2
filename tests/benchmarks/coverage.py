"""How often the stated 95 % intervals hold the truth, over many noise seeds of an independent time-domain
hammer test.

    python -m tests.benchmarks.coverage [SEEDS]

Impacts and responses are simulated once; then noise is drawn on forces and responses, windows applied, FRFs
and coherences estimated and the model fitted anew for every seed, with the noise taken from the coherence as
a user would.
"""

from __future__ import annotations

import sys
import tempfile
import time
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from identify.core.parameters import Scale
from identify.fitting.optimizers.base import Search, parse_optimizer
from identify.measured.noise import noise_std
from identify.vibration.costs.base import parse_cost
from identify.vibration.costs.make_target import Targets
from identify.vibration.costs.target import FrfTarget
from identify.vibration.problem import Problem, load_problem
from identify.vibration.study import read_study
from identify.vibration.uncertainty import uncertainty
from tests.generator.chain import Chain
from tests.generator.estimate import h1
from tests.generator.generate import generate
from tests.generator.hammer import Impact, swing
from tests.generator.linear import linearise
from tests.generator.makes import MAKES
from tests.generator.measure import draw_postures, make_chain, make_plant, stated_decay
from tests.generator.spec import TestSpec

NODES = [5, 7, 9, 11, 13, 14]


@dataclass(frozen=True)
class Hit:
    """One simulated impact: what the hammer did and how the arm moved, without noise."""

    impact: Impact
    motion: np.ndarray


class Repeated:
    """A hammer test whose motions are simulated once and measured as often as wanted."""

    def __init__(self, seed: int, postures: int = 2, oversampling: int = 16) -> None:
        arm = MAKES["random"](seed)
        self.spec = TestSpec(
            arm=arm.at_points(NODES),
            seed=seed,
            postures=postures,
            noise_force=0.2,
            noise_response=0.1,
            oversampling=oversampling,
        )
        plants = [make_plant(self.spec, posture) for posture in draw_postures(self.spec)]
        linear = [linearise(plant, self.spec.hammer_points[0]) for plant in plants]
        self.chain: Chain = make_chain(self.spec, stated_decay(self.spec, linear), plants)
        self.names, rng = plants[0].sensors, np.random.default_rng(seed)
        self.hits = [[self._hits(plant, axis, rng) for axis in range(3)] for plant in plants]

    def _hits(self, plant: object, axis: int, rng: np.random.Generator) -> list[Hit]:
        hits = []
        for _ in range(self.spec.averages):
            impact = swing(rng, axis, self.spec.peak_n, 0.0, self.chain.step)
            motion = plant.respond(
                self.spec.hammer_points[0], impact.force, impact.end, self.chain.step, self.chain.steps
            )  # type: ignore[attr-defined]
            hits.append(Hit(impact, motion))
        return hits

    def measure(self, posture: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
        """FRFs and coherences (lines, outputs, 3) of one posture with fresh noise."""
        times, window, columns = self.chain.step * np.arange(self.chain.steps), self.chain.window(), []
        for hits in self.hits[posture]:
            forces, responses = [], []
            for hit in hits:
                forces.append(window * self.chain.force(hit.impact.reading(times), rng))
                records = self.chain.responses(hit.motion, self.names, rng)
                responses.append(window[:, None] * records.reshape(self.chain.samples, -1))
            columns.append(
                h1(np.array(forces), np.array(responses), self.spec.sample_rate_hz).band(*self.spec.band_hz)
            )
        return np.stack([c.h1 for c in columns], axis=2), np.stack([c.coherence for c in columns], axis=2)


def study(test: Repeated, folder: Path) -> Problem:
    """The study of the test, as a user would write it."""
    generate(test.spec, folder / "test")
    lines = [
        "schema: identify/1",
        "robot: {urdf: test/robot.urdf}",
        "points: test/points.csv",
        "band_hz: [3, 79]",
        "measurements:",
    ]
    for number, posture in enumerate(draw_postures(test.spec), start=1):
        decay = test.chain.window_decay
        lines.append(
            f"  - {{file: test/posture{number}.uff, posture_deg: {posture.tolist()}, averages: 4,"
            f" window_decay_per_s: {decay}}}"
        )
    k, c = test.spec.arm.stiffness.tolist(), test.spec.arm.damping.tolist()
    lines += [
        "effects:",
        f"  - {{kind: joint-compliance, stiffness: {{initial: {k}}}, damping: {{initial: {c}}}}}",
    ]
    (folder / "config.yaml").write_text("\n".join(lines))
    return load_problem(read_study(folder / "config.yaml"))


@dataclass(frozen=True)
class Coverage:
    """Per seed: whether each interval held the truth (seeds, parameters), fitted over true values, gaps,
    stated standard deviations.
    """

    hits: np.ndarray
    ratios: np.ndarray
    gaps: np.ndarray
    stated: np.ndarray


def covered(test: Repeated, problem: Problem, seeds: int) -> Coverage:
    """Measure and fit again for every seed."""
    scale, hits, ratios, gaps, stated = Scale(problem.parameters), [], [], [], []
    truth = np.array([parameter.initial for parameter in problem.parameters])
    for seed in range(seeds):
        targets = []
        for number, target in enumerate(problem.targets().frf):
            frf, coherence = test.measure(number, np.random.default_rng([seed, number]))
            f = test_lines(test)
            inside = (f >= 3) & (f <= 79)
            data = replace(target.data, frf=frf[inside], coherence=coherence[inside])
            targets.append(
                FrfTarget(target.name, data, target.system, target.out, target.force, noise_std(data))
            )
        together = Targets(tuple(targets))
        search = Search(parse_cost("frf-least-squares").objective(together), scale, 500)
        parse_optimizer("gauss-newton").minimize(search, scale.to_x(truth), np.random.default_rng(0))
        values = scale.to_values(search.best_x)  # type: ignore[arg-type]
        trusted = uncertainty(together, scale, values)
        hits.append((trusted.low <= truth) & (truth <= trusted.high))
        ratios.append(values / truth)
        gaps.append(search.best_cost)
        stated.append(trusted.std)
    return Coverage(np.array(hits), np.array(ratios), np.array(gaps), np.array(stated))


def test_lines(test: Repeated) -> np.ndarray:
    """The frequencies of the band, Hz."""
    f = np.fft.rfftfreq(test.chain.samples, 1 / test.spec.sample_rate_hz)
    return np.asarray(f[(f >= test.spec.band_hz[0]) & (f <= test.spec.band_hz[1])])


test_lines.__test__ = False  # type: ignore[attr-defined]


def main(seeds: int) -> None:
    """Print the coverage of every parameter and of all together."""
    with threadpool_limits(1), tempfile.TemporaryDirectory() as name:
        test = Repeated(seed=3)
        problem = study(test, Path(name))
        began = time.perf_counter()
        c = covered(test, problem, seeds)
        gaps = f"gap {c.gaps.mean():.3f} (from {c.gaps.min():.3f} to {c.gaps.max():.3f})"
        print(f"{seeds} noise seeds, {time.perf_counter() - began:.0f} s, {gaps}")
        scatter = np.log(c.ratios).std(axis=0)
        for number, parameter in enumerate(problem.parameters):
            bias, stated = (
                np.log(c.ratios[:, number]).mean() / scatter[number],
                c.stated[:, number].mean() / scatter[number],
            )
            held = f"{100 * c.hits[:, number].mean():5.1f} %"
            print(f"  {parameter.name:22s} {held}   bias {bias:+.2f} scatters, stated {stated:.2f} scatters")
        print(f"  all parameters         {100 * c.hits.mean():5.1f} %")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 200)

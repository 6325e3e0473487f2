"""Which optimizers reach the noise floor, with how many evaluations and in what time: same cost, same data,
same budget.

    python -m tests.benchmarks.optimizers kobe       36 coordinates, 72 parameters, 12 points, about 1 % noise
    (some ten minutes)
    python -m tests.benchmarks.optimizers starts     6 stiffnesses, starts within a factor of 5, 2 % noise, 20
    seeds
    python -m tests.benchmarks.optimizers told       the arm of `kobe`, told a little wrong: what stated
    uncertainty costs a fit

Data come from the independent time-domain generator in tests/generator; the truth is used for scoring and to
draw starts.
"""

from __future__ import annotations

import contextlib
import json
import sys
import tempfile
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from identify.core.parameters import Scale
from identify.fitting.fit import fit
from identify.fitting.objective import Objective
from identify.fitting.optimizers.base import Ended, Search, parse_optimizer
from identify.fitting.uncertainty import inseparable
from identify.vibration.costs.base import parse_cost
from identify.vibration.plan import fit_plan
from identify.vibration.problem import Problem, load_problem
from identify.vibration.study import read_study
from identify.vibration.uncertainty import gap, uncertainty
from tests.generator.cases import hide
from tests.generator.dirt import CAREFUL, soil
from tests.generator.generate import generate
from tests.generator.makes import MAKES
from tests.generator.spec import TestSpec

POPULATION = [
    "genetic-algorithm",
    "particle-swarm",
    "artificial-bee-colony",
    "differential-evolution",
    "cma-es",
]
SIX_EACH = ["  - {kind: joint-compliance, joints: all, axes: [tx, ty, tz, rx, ry, rz]}"]
CLASSES = {"tilt": ["rx", "ry"], "radial": ["tx", "ty"], "axial": ["tz"]}


@dataclass(frozen=True)
class Row:
    """What one optimizer did: evaluations and seconds until the gap fell to each of `LEVELS` (inf: never),
    and its best gap.
    """

    kind: str
    best: float
    evaluations: int
    seconds: float
    reached: dict[float, tuple[float, float]]


LEVELS = (1.5, 1.05)


def run(
    kind: str, settings: dict[str, Any], objective: Objective, scale: Scale, start: np.ndarray, budget: int
) -> Row:
    """Run one optimizer from x = start and note when the gap falls to each level."""
    reached: dict[float, tuple[float, float]] = {level: (np.inf, np.inf) for level in LEVELS}
    began = time.perf_counter()

    def watch(count: int, best: float) -> None:
        for level in LEVELS:
            if best <= level and np.isinf(reached[level][0]):
                reached[level] = (count, time.perf_counter() - began)

    search = Search(objective, scale, budget, watch=watch)
    with contextlib.suppress(Ended):
        parse_optimizer({"kind": kind, **settings}).minimize(search, start, np.random.default_rng(1))
    return Row(kind, search.best_cost, search.evaluations, time.perf_counter() - began, reached)


def config(
    folder: Path, effects: list[str], inputs: str = "", band: str = "[3, 79]", postures: int = 1
) -> Problem:
    """The study of a generated test as a user would write it."""
    test = json.loads((folder / "test" / "test.json").read_text())
    lines = [
        "schema: identify/1",
        "robot: {urdf: test/robot.urdf}",
        "points: test/points.csv",
        f"band_hz: {band}",
        "measurements:",
    ]
    for entry in test["files"][:postures]:
        decay = test["exponential_window_decay_per_s"]
        lines.append(
            f"  - {{file: test/{entry['file']}, posture_deg: {entry['posture_deg']}, averages: 4,"
            f" window_decay_per_s: {decay}{inputs}}}"
        )
    (folder / "config.yaml").write_text("\n".join([*lines, "effects:", *effects]))
    return load_problem(read_study(folder / "config.yaml"))


def true_springs(truth: dict[str, Any], spec: TestSpec) -> dict[str, float]:
    """Stiffness and damping of every coordinate by parameter name."""
    values = {}
    for number in range(6):
        values[f"joint{number + 1}.rz.stiffness"], values[f"joint{number + 1}.rz.damping"] = (
            truth["k"][number],
            truth["c"][number],
        )
    for effect in spec.effects:
        axes = CLASSES[effect.axes_class]  # type: ignore[attr-defined]
        if abs(spec.arm.joints[effect.joint - 1].axis[0]) > 0.5:  # type: ignore[attr-defined]
            axes = axes[::-1]  # about a joint along x, the generator's frame has x and y the other way round
        for axis, k, c in zip(axes, effect.stiffness, effect.damping, strict=True):  # type: ignore[attr-defined]
            name = f"joint{effect.joint}.{axis}"  # type: ignore[attr-defined]
            values[f"{name}.stiffness"], values[f"{name}.damping"] = k, c
    return values


def soft_bearings() -> TestSpec:
    """The test of a six-axis arm whose every joint gives way in six directions."""
    arm = MAKES["random"](7).at_points(list(range(3, 15)))
    spec = TestSpec(arm=arm, seed=7, postures=1, noise_force=0.05, noise_response=0.02)
    return hide(spec, "+".join(f"{kind}_j{joint}" for joint in range(1, 7) for kind in CLASSES))


def kobe(folder: Path, budget: int = 20_000) -> None:
    """72 parameters of a six-axis arm with six coordinates per joint, from starts within a factor of two of
    the truth.
    """
    spec = soft_bearings()
    generate(spec, folder / "test")
    known = true_springs(json.loads((folder / "test.truth.json").read_text()), spec)
    problem = config(folder, SIX_EACH, ", inputs: ['14:+Y']")
    truth = np.array([known[parameter.name] for parameter in problem.parameters])
    target = problem.targets().frf[0]
    noise = np.median(
        np.sqrt(2) * np.linalg.norm(target.sigma, axis=0) / np.linalg.norm(target.measured, axis=0)
    )
    objective = parse_cost("frf-least-squares").objective(problem.targets())
    scale = Scale(tuple(_bounded(problem, truth)))
    start = scale.to_x(truth * 2.0 ** np.random.default_rng(5).uniform(-1, 1, len(truth)))
    size = (
        f"{len(target.system.coordinates)} coordinates, {len(truth)} parameters, {target.measured.shape[1]}"
        " FRFs of 12 points"
    )
    print(
        f"{size}, {len(target.data.s)} lines, noise {100 * noise:.1f} % (median), gap at the truth"
        f" {objective.costs(truth[None])[0]:.3f}"
    )
    rows = [
        run(kind, {"spread": 2.0, "evaluations": budget}, objective, scale, start, budget)
        for kind in POPULATION
    ]
    rows.append(run("nelder-mead", {"evaluations": budget}, objective, scale, start, budget))
    rows.append(run("gauss-newton", {"evaluations": 300}, objective, scale, start, budget))
    rows.append(
        run("hybrid", {"spread": 2.0, "evaluations": 4000, "rounds": 1}, objective, scale, start, budget)
    )
    rows.append(staged(problem, scale, start, budget))
    print(
        f"  {'optimizer':32s} {'best gap':>9s} {'evaluations':>12s} {'seconds':>8s}   to 1.5: evaluations, s "
        "  to 1.05: evaluations, s"
    )
    for row in rows:
        levels = "   ".join(
            "never".rjust(22) if np.isinf(n) else f"{n:12.0f} {t:9.2f}" for n, t in row.reached.values()
        )
        print(f"  {row.kind:32s} {row.best:9.3f} {row.evaluations:12d} {row.seconds:8.1f}   {levels}")
    best = min(row.reached[1.05][1] for row in rows)
    genetic = rows[0].reached[1.5][1]
    word = (
        f"never reached 1.5 in {rows[0].seconds:.0f} s"
        if np.isinf(genetic)
        else f"reached 1.5 after {genetic:.1f} s"
    )
    print(
        f"  the genetic algorithm {word}; the fastest to 1.05 took {best:.2f} s,"
        f" {min(genetic, rows[0].seconds) / best:.0f} times less"
    )
    trusted = uncertainty(problem.targets(), scale, truth)
    names = [parameter.name for parameter in problem.parameters]
    weak = [name for name, status in zip(names, trusted.status, strict=True) if status != "determined"]
    print(f"  not determined by these data ({len(weak)} of {len(names)}): {', '.join(weak) or 'none'}")
    print(
        "  combinations that hardly matter:"
        f" {'; '.join(' + '.join(group) for group in inseparable(trusted, names)) or 'none'}"
    )


def told(folder: Path) -> None:
    """What it costs to fit the errors of a careful lab along: `identify fit` with and without `uncertainty:`,
    from the same starts within a factor of two of the truth.
    """
    spec = soft_bearings()
    generate(soil(spec, CAREFUL), folder / "test")
    known = true_springs(json.loads((folder / "test.truth.json").read_text()), spec)
    took = list[float]()
    for stated in (["uncertainty: careful"], []):
        problem = config(folder, [*SIX_EACH, *stated, "starts: 1"], ", inputs: ['14:+Y']")
        rng = np.random.default_rng(5)
        own = [
            p if p.nuisance else p.at(known[p.name] * 2.0 ** rng.uniform(-1, 1)) for p in problem.parameters
        ]
        began = time.perf_counter()
        found = fit(fit_plan(replace(problem, parameters=tuple(own))))
        took.append(time.perf_counter() - began)
        target, size = problem.targets().frf[0], problem.size
        off = [abs(np.log(found.values[n] / known[p.name])) for n, p in enumerate(own) if not p.nuisance]
        print(
            f"  {len(target.system.coordinates)} coordinates, {size} parameters, {len(own) - size} errors of"
            f" what was stated, {target.measured.shape[1]} FRFs, {len(target.data.s)} lines: gap"
            f" {gap(problem.targets(), found.values):.2f}, median stiffness or damping"
            f" {100 * float(np.median(off)):.1f} % off, {took[-1]:.1f} s"
        )
    print(f"  with stated uncertainty {took[0] / took[1]:.1f} times as long as without")


def staged(problem: Problem, scale: Scale, start: np.ndarray, budget: int) -> Row:
    """The default of a study: log residuals, then the likelihood, both by Gauss-Newton."""
    began, x = time.perf_counter(), start
    search = Search(
        parse_cost({"kind": "frf-least-squares", "residual": "log"}).objective(problem.targets()),
        scale,
        budget,
    )
    parse_optimizer("gauss-newton").minimize(search, x, np.random.default_rng(0))
    first, took = search.evaluations, time.perf_counter() - began
    row = run(
        "gauss-newton",
        {},
        parse_cost("frf-least-squares").objective(problem.targets()),
        scale,
        search.best_x,
        budget,
    )  # type: ignore[arg-type]
    reached = {level: (n + first, t + took) for level, (n, t) in row.reached.items()}
    return Row(
        "default: log, then likelihood", row.best, row.evaluations + first, row.seconds + took, reached
    )


def _bounded(problem: Problem, truth: np.ndarray) -> list[Any]:
    return [
        replace(p, initial=t, lower=t / 30, upper=t * 30)
        for p, t in zip(problem.parameters, truth, strict=True)
    ]


def starts(folder: Path, seeds: int = 20) -> None:
    """Share of runs that find all six stiffnesses within 1 % from starts within a factor of five; dampers
    known.
    """
    arm = MAKES["random"](7)
    spec = TestSpec(arm=arm.at_points([11, 14]), seed=7, postures=1, noise_force=0.05, noise_response=0.05)
    generate(spec, folder / "test")
    truth, c = arm.stiffness, arm.damping.tolist()
    kinds = [*POPULATION, "nelder-mead", "gauss-newton", "hybrid", "default"]
    found: dict[str, list[bool]] = {kind: [] for kind in kinds}
    took: dict[str, float] = dict.fromkeys(kinds, 0.0)
    for seed in range(seeds):
        guess = truth * 5.0 ** np.random.default_rng(seed).uniform(-1, 1, 6)
        bounds = f"bounds: [{truth.min() / 100:.6g}, {truth.max() * 100:.6g}]"
        spring = f"stiffness: {{initial: {guess.tolist()}, {bounds}}}, damping: {{initial: {c}, fixed: true}}"
        problem = config(folder, [f"  - {{kind: joint-compliance, {spring}}}", f"seed: {seed}"])
        objective, scale = (
            parse_cost("frf-least-squares").objective(problem.targets()),
            Scale(problem.parameters),
        )
        if seed == 0:
            target = problem.targets().frf[0]
            noise = np.median(
                np.sqrt(2) * np.linalg.norm(target.sigma, axis=0) / np.linalg.norm(target.measured, axis=0)
            )
            size = f"{target.measured.shape[1]} FRFs, {len(target.data.s)} lines"
            print(f"6 stiffnesses, {size}, noise {100 * noise:.1f} % (median), 4000 evaluations each")
        for kind in kinds:
            began = time.perf_counter()
            values = _fitted(
                kind,
                problem,
                objective,
                scale,
                scale.to_x(np.array([p.initial for p in problem.parameters])),
                seed,
            )
            took[kind] += (time.perf_counter() - began) / seeds
            found[kind].append(bool(np.all(np.abs(values[::2] / truth - 1) < 0.01)))
    for kind in kinds:
        print(f"  {kind:24s} {sum(found[kind]):3d} of {seeds}   {took[kind]:6.2f} s each")


def _fitted(
    kind: str, problem: Problem, objective: Objective, scale: Scale, start: np.ndarray, seed: int
) -> np.ndarray:
    if kind == "default":
        return fit(fit_plan(problem)).values
    search = Search(objective, scale, 4000)
    settings = {} if kind == "gauss-newton" else {"evaluations": 4000}
    with contextlib.suppress(Ended):
        parse_optimizer({"kind": kind, **settings}).minimize(search, start, np.random.default_rng(seed))
    return scale.to_values(search.best_x)  # type: ignore[arg-type]


if __name__ == "__main__":
    chosen = sys.argv[1:] or ["starts", "kobe", "told"]
    for name in chosen:
        with threadpool_limits(1), tempfile.TemporaryDirectory() as place:
            {"kobe": kobe, "starts": starts, "told": told}[name](Path(place))

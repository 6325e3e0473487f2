"""What people wait for: processor and wall time of single evaluations and of whole commands.

    python -m tests.benchmarks.speed [--whole] [--repeat 5]

Medians, each beside its alternative in the same run.  Single evaluations in one BLAS thread and one thread of
ours; --whole: commands too, each in a process of its own with modules compiled before.  To compare two
programs run both in turn, on a machine that does nothing else: times of a busy one come out up to three times
as long.  Modal analysis: `modal_speed`; start-up: `startup`; how times grow: `growth`.
"""

from __future__ import annotations

import argparse
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import scipy
from scipy.optimize import least_squares
from threadpoolctl import threadpool_limits

from identify.core.arrays import Array, Complex
from identify.core.parameters import Scale
from identify.core.threads import work_in
from identify.fitting.optimizers.base import Search, parse_optimizer
from identify.map.posture_map import map_postures
from identify.model.frf import frf
from identify.results import file as result_file
from identify.results.fit import FitResult
from identify.vibration.costs import information
from identify.vibration.costs.base import parse_cost
from identify.vibration.costs.frf_least_squares import FrfLeastSquares
from identify.vibration.costs.make_target import Targets
from identify.vibration.fitted_model import fitted_model, tool_point
from identify.vibration.problem import load_problem
from identify.vibration.study import read_study
from tests.arms import initial
from tests.benchmarks.frf import ALL_AXES, problem
from tests.benchmarks.startup import ROOT, writing_bytecode

_STUDY = str(ROOT / "configs" / "arm_hammer_test.yaml")
_TOP_HZ = 200.0


class Row(NamedTuple):
    """What, and the processor and wall time that it takes, s; and of its alternative, where it has one."""

    what: str
    processor: float
    wall: float
    other: str = ""
    of_other: float = float("nan")

    def __str__(self) -> str:
        said = f"  {self.what:46s} {1e3 * self.processor:9.2f} {1e3 * self.wall:9.2f}"
        return said + (f" {1e3 * self.of_other:9.2f}  {self.other}" if self.other else "")


Call = Callable[[], object]


def timed(what: str, call: Call, repeat: int, count: int = 1, other: tuple[str, Call] | None = None) -> Row:
    """The medians of some calls, each for `count` things, in turn with those of an alternative for one."""
    calls = [call] if other is None else [call, other[1]]
    spent: list[list[tuple[float, float]]] = [[] for _ in calls]
    for turn in range(repeat + 1):
        for one, times in zip(calls, spent, strict=True):
            begun = time.process_time(), time.perf_counter()
            one()
            if turn:  # the first is for caches
                times.append((time.process_time() - begun[0], time.perf_counter() - begun[1]))
    processor, wall = (statistics.median(each) / count for each in zip(*spent[0], strict=True))
    if other is None:
        return Row(what, processor, wall)
    return Row(what, processor, wall, other[0], statistics.median(each for each, _ in spent[1]))


Ends = tuple[Array, Array, Array, Array, Array]
"""M, C, K, out (outputs, n) and force (n, inputs)."""


def by_lines(ends: Ends, s: Complex) -> Complex:
    """Accelerances by a solve a line."""
    m, c, k, out, force = ends
    return np.array([one**2 * (out @ np.linalg.solve(k + one * c + one**2 * m, force)) for one in s])


def by_batch(ends: Ends, s: Complex) -> Complex:
    """The same by one call for all lines."""
    m, c, k, out, force = ends
    line = s[:, None, None]
    x = np.linalg.solve(
        k + line * c + line**2 * m, np.broadcast_to(force.astype(complex), (len(s), *force.shape))
    )
    return np.asarray(line**2 * (out @ x))


def by_modes(ends: Ends, s: Complex) -> Complex:
    """The same by eigenvalues and a sum over modes, as a user of NumPy would."""
    m, c, k, out, force = ends
    size = len(m)
    state = np.block([[np.zeros((size, size)), np.eye(size)], [-np.linalg.solve(m, np.hstack([k, c]))]])
    values, vectors = np.linalg.eig(state)
    pushed = np.concatenate([np.zeros_like(force), np.linalg.solve(m, force)])
    residues = (out @ vectors[:size])[:, :, None] * np.linalg.solve(vectors, pushed.astype(complex))
    return np.asarray(np.einsum("orj,lr->loj", residues, s[:, None] ** 2 / (s[:, None] - values)))


def by_exponential(ends: Ends, s: Complex, record: float) -> Complex:
    """Those of records that end: what they lack by a matrix exponential, all else by solves."""
    m, c, k, out, force = ends
    size = len(m)
    state = np.block([[np.zeros((size, size)), np.eye(size)], [-np.linalg.solve(m, np.hstack([k, c]))]])
    pushed = np.concatenate([np.zeros_like(force), np.linalg.solve(m, force)])
    x, v = np.split(scipy.linalg.expm(record * state) @ pushed, 2)
    line = s[:, None, None]
    late = np.exp(-line * record)
    load = force - late * ((line * m + c) @ x + m @ v)
    moved = np.linalg.solve(k + line * c + line**2 * m, load)
    return np.asarray(out @ (line**2 * moved + late * (line * x + v)))


def evaluations(folder: Path, repeat: int) -> Iterator[Row]:
    """FRFs of 36 coordinates, 400 lines, 12 outputs, and fits of 72 parameters."""
    objective, parameters, data = problem(folder, ALL_AXES)
    windowed = replace(data.data, window_decay_per_s=1.2)
    ended = parse_cost("frf-least-squares").objective(
        Targets(frf=(replace(data, data=windowed, record=2.0),))
    )
    values, rng = initial(parameters), np.random.default_rng(0)
    ends: Ends = (*data.system.matrices(values), data.out, data.force)
    s, decaying = data.data.s, windowed.s
    population = values * np.exp(0.2 * rng.normal(size=(20, len(values))))
    plain = ("numpy, a solve a line", lambda: by_lines(ends, s))
    batched = ("numpy, a batch of solves", lambda: by_batch(ends, s))
    summed = ("numpy, a sum over modes", lambda: by_modes(ends, s))
    exponential = ("scipy, expm and a batch of solves", lambda: by_exponential(ends, decaying, 2.0))
    for what, one, others in (
        ("one candidate", objective, (batched, plain, summed)),
        ("the same with records that end", ended, (exponential, exponential)),
    ):
        yield timed(f"{what}, of a population", lambda one=one: one.costs(population), repeat, 20, others[0])  # type: ignore[misc]
        for other in others[1:]:
            yield timed(f"{what}, alone", lambda one=one: one.costs(population[:1]), repeat, 1, other)  # type: ignore[misc]
    many = 2j * np.pi * np.linspace(0.5, _TOP_HZ, 10_000)
    yield timed(
        "10,000 lines",
        lambda: frf(*ends[:3], many, *ends[3:], 2),
        repeat,
        1,
        (summed[0], lambda: by_modes(ends, many)),
    )
    free = np.arange(len(values))
    yield timed("its gradient, 72 parameters", lambda: data.gradient(values, free), repeat)
    scale = Scale(tuple(parameters))
    start = scale.to_x(values * np.exp(0.1 * rng.normal(size=len(values))))

    def fit() -> None:
        search = Search(objective, scale, 10_000)
        parse_optimizer("gauss-newton").minimize(search, start, np.random.default_rng(0))

    def by_differences() -> None:
        def residual(x: Array) -> Array:
            e = ((data.predict_pairs(scale.to_values(x)) - data.measured) / data.sigma).ravel()
            return np.concatenate([e.real, e.imag])

        least_squares(
            residual, start, bounds=scale.bounds(), x_scale="jac", ftol=1e-10, xtol=1e-10, max_nfev=100
        )

    differences = ("scipy, differences of the same FRFs", by_differences)
    yield timed("a fit of 72 parameters, one start", fit, repeat, 1, differences)


def stated(folder: Path, repeat: int) -> Iterator[Row]:
    """A step of a fit with nuisance parameters: the example, 6 coordinates."""
    text = Path(_STUDY).read_text(encoding="utf-8").replace("../data", str(ROOT / "data"))
    (folder / "stated.yaml").write_text(f"{text}\nuncertainty: typical\n")
    told = load_problem(read_study(folder / "stated.yaml"))
    objective = FrfLeastSquares().objective(told.targets())
    free = Scale(told.parameters).free

    def sensor_by_sensor() -> None:
        kept = information.inside_of
        information.inside_of = lambda *given: None  # type: ignore[assignment]
        objective.product(told.initial, free)
        information.inside_of = kept

    what = f"a step with {len(free)} unknowns, stated errors"
    other = ("derivatives for every sensor", sensor_by_sensor)
    yield timed(what, lambda: objective.product(told.initial, free), repeat, 1, other)


def postures(file: Path, repeat: int, count: int = 50) -> Iterator[Row]:
    """A posture of a map of the example, 100 lines."""
    model = fitted_model(result_file.read(file, FitResult), str(file))
    turns = model.posture + np.linspace(-0.5, 0.5, count)[:, None]
    names, lines = [str(n) for n in range(count)], np.linspace(3.0, 80.0, 100)
    tool = tool_point(model, None)
    system = model.system(turns[0])
    out = system.base_jacobian(tool.link, tool.position)
    ends: Ends = (*system.matrices(model.values), out, out.T)
    other = ("numpy, its FRFs alone, a solve a line", lambda: by_lines(ends, 2j * np.pi * lines))
    yield timed("its model", lambda: [model.system(one) for one in turns], repeat, count)
    yield timed(
        "a posture of a map", lambda: map_postures(model, tool, names, turns, lines, 6), repeat, count, other
    )


def commands(folder: Path, repeat: int) -> Iterator[Row]:
    """Whole commands."""
    axes = [word for joint in (2, 3, 4) for word in ("--grid", f"{joint}:-60:60:10")]
    for what, words in (
        ("check", ("check", _STUDY)),
        ("fit of the example", ("fit", _STUDY, "--out", "fit.h5", "--no-report", "-q")),
        ("the same with reports", ("fit", _STUDY, "--out", "fit.h5", "-q")),
        ("its page and PDF", ("report", "fit.h5")),
        ("a map of nine postures", ("map", "fit.h5", "--grid", "2:-60:60:9", "--no-report", "--out", "m.h5")),
        ("a map of 1,000 postures", ("map", "fit.h5", *axes, "--no-report", "--out", "m.h5")),
    ):
        yield _command(what, words, folder, repeat)


def _command(what: str, words: tuple[str, ...], folder: Path, repeat: int) -> Row:
    alone = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "PYTHONPATH": str(ROOT)}
    spent = []
    for _ in range(repeat + 1):
        before, begun = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
        subprocess.run(
            [sys.executable, "-m", "identify", *words],
            check=True,
            cwd=folder,
            env={**writing_bytecode(), **alone},
            capture_output=True,
        )
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        used = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        spent.append((used, time.perf_counter() - begun))
    processor, wall = (statistics.median(one[1:]) for one in zip(*spent, strict=True))
    return Row(what, processor, wall)


def main() -> None:
    """Prints a line for each."""
    asked = argparse.ArgumentParser(description=__doc__)
    asked.add_argument("--whole", action="store_true", help="whole commands too")
    asked.add_argument("--repeat", type=int, default=5)
    given = asked.parse_args()
    work_in(1)
    with threadpool_limits(1), tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        _command("fit", ("fit", _STUDY, "--out", "fit.h5", "--no-report", "-q"), folder, 1)
        rows = [evaluations(folder, given.repeat), stated(folder, given.repeat)]
        rows += [postures(folder / "fit.h5", given.repeat)]
        rows += [commands(folder, given.repeat)] if given.whole else []
        print(f"{os.cpu_count()} processors, ms, medians of {given.repeat}: processor time, wall time, and")
        print("processor time of an alternative, each in turn with ours")
        for row in (row for part in rows for row in part):
            print(row, flush=True)


if __name__ == "__main__":
    main()

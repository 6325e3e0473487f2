"""What people wait for: processor and wall time of single evaluations and of whole commands.

    python -m tests.benchmarks.speed [--whole] [--repeat 5]

Medians.  Single evaluations in one BLAS thread and one thread of ours; --whole: commands too, each in a
process of its own with modules compiled before.  To compare two programs run both in turn, on a machine that
does nothing else: times of a busy one come out up to three times as long.
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

import numpy as np
from threadpoolctl import threadpool_limits

from identify.core.parameters import Scale
from identify.core.threads import work_in
from identify.fitting.optimizers.base import Search, parse_optimizer
from identify.map.posture_map import map_postures
from identify.results import file as result_file
from identify.results.fit import FitResult
from identify.vibration.costs.base import parse_cost
from identify.vibration.costs.target import Targets
from identify.vibration.fitted_model import fitted_model, tool_point
from tests.arms import initial
from tests.benchmarks.frf import ALL_AXES, problem
from tests.benchmarks.startup import ROOT, writing_bytecode

Row = tuple[str, float, float]
"""What, processor time, wall time, s."""
_STUDY = str(ROOT / "configs" / "arm_hammer_test.yaml")


def timed(what: str, call: Callable[[], object], repeat: int, count: int = 1) -> Row:
    """The medians of some calls, each for `count` things."""
    call()
    spent = []
    for _ in range(repeat):
        begun = time.process_time(), time.perf_counter()
        call()
        spent.append((time.process_time() - begun[0], time.perf_counter() - begun[1]))
    processor, wall = (statistics.median(one) / count for one in zip(*spent, strict=True))
    return what, processor, wall


def evaluations(folder: Path, repeat: int) -> Iterator[Row]:
    """FRFs of 36 coordinates, 400 lines, 12 outputs, and fits of 72 parameters."""
    objective, parameters, data = problem(folder, ALL_AXES)
    windowed = replace(data.data, window_decay_per_s=1.2)
    ended = parse_cost("frf-least-squares").objective(
        Targets(frf=(replace(data, data=windowed, record=2.0),))
    )
    values, rng = initial(parameters), np.random.default_rng(0)
    population = values * np.exp(0.2 * rng.normal(size=(20, len(values))))
    for what, one in (("one candidate", objective), ("the same with records that end", ended)):
        yield timed(f"{what}, of a population", lambda one=one: one.costs(population), repeat, 20)  # type: ignore[misc]
        yield timed(f"{what}, alone", lambda one=one: one.costs(population[:1]), repeat)  # type: ignore[misc]
    free = np.arange(len(values))
    yield timed("its gradient, 72 parameters", lambda: data.gradient(values, free), repeat)
    scale = Scale(tuple(parameters))
    start = scale.to_x(values * np.exp(0.1 * rng.normal(size=len(values))))

    def fit() -> None:
        search = Search(objective, scale, 10_000)
        parse_optimizer("gauss-newton").minimize(search, start, np.random.default_rng(0))

    yield timed("a fit of 72 parameters, one start", fit, repeat)


def postures(file: Path, repeat: int, count: int = 50) -> Iterator[Row]:
    """A posture of a map of the example, 100 lines."""
    model = fitted_model(result_file.read(file, FitResult), str(file))
    turns = model.posture + np.linspace(-0.5, 0.5, count)[:, None]
    names, lines = [str(n) for n in range(count)], np.linspace(3.0, 80.0, 100)
    tool = tool_point(model, None)
    yield timed("its model", lambda: [model.system(one) for one in turns], repeat, count)
    yield timed(
        "a posture of a map", lambda: map_postures(model, tool, names, turns, lines, 6), repeat, count
    )


def commands(folder: Path, repeat: int) -> Iterator[Row]:
    """Whole commands."""
    axes = [word for joint in (2, 3, 4) for word in ("--grid", f"{joint}:-60:60:10")]
    for what, words in (
        ("check", ("check", _STUDY)),
        ("fit of the example", ("fit", _STUDY, "--out", "fit.h5", "--no-report", "-q")),
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
    return what, processor, wall


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
        rows = [evaluations(folder, given.repeat), postures(folder / "fit.h5", given.repeat)]
        rows += [commands(folder, given.repeat)] if given.whole else []
        print(f"{os.cpu_count()} processors; processor time and wall time, ms, medians of {given.repeat}")
        for row in (row for part in rows for row in part):
            print(f"  {row[0]:45s} {1e3 * row[1]:9.2f} {1e3 * row[2]:9.2f}", flush=True)


if __name__ == "__main__":
    main()

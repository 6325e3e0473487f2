"""How times grow with coordinates, lines, outputs, postures and workers, each beside what limits it.

    python -m tests.benchmarks.growth [--out tests/benchmarks/results/growth.json] [--draw docs/growth.png]
                                      [--workers]

Processor time in one thread, medians of 5, of an arm with so many coordinates free; wall time for workers.
The limits are measured in the same run: of records that end LAPACK's eigenvectors, of all other FRFs the one
product of real numbers by which motions become outputs, of a map its FRFs by NumPy, of workers the time of
one over their number, as far as there are processors.  --workers measures these too, on a machine that does
nothing else; --draw draws what --out has, without measuring, where that is there.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from identify.core.arrays import Array
from identify.core.threads import processors, work_in
from identify.fitting.fit import fit
from identify.fitting.plan import FitPlan
from identify.fitting.processes import several
from identify.map.asked import MapOptions
from identify.map.posture_map import map_postures
from identify.map.run import run_map
from identify.model.frf import frf
from identify.results import file as result_file
from identify.results.fit import FitResult
from identify.vibration.fitted_model import fitted_model, tool_point
from identify.vibration.plan import fit_plan
from identify.vibration.problem import load_problem
from identify.vibration.run import run_fit
from identify.vibration.study import read_study
from tests.arms import arm, initial, system
from tests.benchmarks.frf import ALL_AXES
from tests.benchmarks.speed import ROOT, by_lines, timed

_RESULTS = ROOT / "tests" / "benchmarks" / "results" / "growth.json"
_REPEAT, _RECORD_S, _TOP_HZ = 5, 2.0, 200.0
_SIZES = {"coordinates": 36, "lines": 400, "outputs": 12}
_GROWN = {
    "coordinates": (6, 12, 18, 24, 30, 36),
    "lines": (100, 300, 1000, 3000, 10_000),
    "outputs": (3, 12, 42, 126),
}


@dataclass(frozen=True)
class Curve:
    """Times, s, over what grows; limit: what it cannot be faster than, s."""

    grows: str
    what: str
    unit: str
    size: tuple[int, ...]
    time_s: tuple[float, ...]
    limit_s: tuple[float, ...]
    limit: str


def frfs(folder: Path) -> Iterator[Curve]:
    """One candidate; records that end or not."""
    for grows, sizes in _GROWN.items():
        for record in (None, _RECORD_S):
            spent = [_frf_s(folder, {**_SIZES, grows: size}, record) for size in sizes]
            times, limits = zip(*spent, strict=True)
            limit = "product with the outputs" if record is None else "eigenvectors by LAPACK"
            what = "FRFs" if record is None else "FRFs of records that end"
            yield Curve(grows, what, "a candidate", sizes, times, limits, limit)


def _frf_s(folder: Path, sizes: dict[str, int], record: float | None) -> tuple[float, float]:
    """Of ours and of the limit."""
    axes = ALL_AXES[-(sizes["coordinates"] // 6) :]
    model, parameters, _ = system(arm(folder), [{"kind": "joint-compliance", "axes": axes}])
    matrices, rng = model.matrices(initial(parameters)), np.random.default_rng(0)
    size = len(matrices[0])
    out, force = rng.normal(size=(sizes["outputs"], size)), rng.normal(size=(size, 1))
    s = (0.0 if record is None else 1.2) + 2j * np.pi * np.linspace(0.5, _TOP_HZ, sizes["lines"])
    shapes, table = out @ rng.normal(size=(size, 2 * size)), rng.normal(size=(2 * size, 2 * len(s)))
    state = np.zeros((2 * size, 2 * size))
    state[:size, size:] = np.eye(size)
    state[size:] = -np.linalg.solve(matrices[0], np.hstack([matrices[2], matrices[1]]))

    def limit() -> object:
        return shapes @ table if record is None else np.linalg.eig(state)

    ours = timed("", lambda: frf(*matrices, s, out, force, 2, record), _REPEAT)
    return ours.processor, timed("", limit, _REPEAT).processor


def postures(file: Path) -> Iterator[Curve]:
    """A map of the example's model, 100 lines, without what workers take to begin."""
    model, lines = fitted_model(result_file.read(file, FitResult), str(file)), np.linspace(3.0, 80.0, 100)
    tool, sizes = tool_point(model, None), (10, 100, 1000, 10_000)
    ends = model.system(model.posture)
    out = ends.base_jacobian(tool.link, tool.position)
    alone = (*ends.matrices(model.values), out, out.T)
    limit = timed("", lambda: by_lines(alone, 2j * np.pi * lines), _REPEAT).processor
    spent = [
        _map_s(lambda turns: map_postures(model, tool, [""] * len(turns), turns, lines, 6), model.posture, n)
        for n in sizes
    ]
    limits = tuple(limit * n for n in sizes)
    yield Curve("postures", "map", "in all", sizes, tuple(spent), limits, "its FRFs by NumPy, a solve a line")


def _map_s(work: Callable[[Array], object], posture: Array, count: int) -> float:
    turns = posture + np.linspace(-0.5, 0.5, count)[:, None]
    return timed("", lambda: work(turns), _REPEAT if count <= 1000 else 1).processor


def workers(config: Path, file: Path) -> Iterator[Curve]:
    """Wall time of a fit of four starts, nuisance parameters fitted along, and of a map of 1,000."""
    plan, counts = fit_plan(load_problem(read_study(config))), (1, 2, 4)
    plan = replace(plan, starts=4, believed_cost=0.0)  # so that no agreement ends it
    grid = MapOptions(grid=((2, -60.0, 60.0, 10), (3, -60.0, 60.0, 10), (4, -60.0, 60.0, 10)))
    for what, work in (
        ("fit of four starts", lambda count: _fit(plan, count)),
        ("map of 1,000 postures", lambda count: run_map(file, grid, file.with_name("m.h5"), workers=count)),
    ):
        times = []
        for count in counts:
            begun = time.perf_counter()
            work(count)
            times.append(time.perf_counter() - begun)
        limits = tuple(times[0] / min(count, processors()) for count in counts)
        yield Curve(
            "workers",
            what,
            "in all",
            counts,
            tuple(times),
            limits,
            "one worker over as many as there are processors",
        )


def _fit(plan: FitPlan, count: int) -> None:
    with several(count, "identify.vibration.plan") as processes:
        fit(plan, workers=processes)


def measured(*, side_by_side: bool) -> list[Curve]:
    """All of them; side_by_side: workers too."""
    work_in(1)
    with threadpool_limits(1), tempfile.TemporaryDirectory() as name:
        folder, study = Path(name), ROOT / "configs" / "arm_hammer_test.yaml"
        run_fit(study, folder / "fit.h5", {})
        text = (ROOT / "configs" / "hidden_effects.yaml").read_text(encoding="utf-8")
        config = folder / "stated.yaml"  # whose valley is long, because something is missing
        config.write_text(f"{text.replace('../data', str(ROOT / 'data'))}\nuncertainty: typical\n")
        file = folder / "fit.h5"
        return [*frfs(folder), *postures(file), *(workers(config, file) if side_by_side else ())]


def draw(curves: list[Curve], path: Path) -> None:
    """A panel for each that grows, limits dashed."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib.figure import Figure

    grown = list(dict.fromkeys(curve.grows for curve in curves))
    figure = Figure(figsize=(3.0 * len(grown), 3.4), layout="constrained")
    for axes, grows in zip(figure.subplots(1, len(grown)), grown, strict=True):
        for number, curve in enumerate(one for one in curves if one.grows == grows):
            [line] = axes.loglog(curve.size, curve.time_s, "o-", label=curve.what, color=f"C{number}")
            axes.loglog(curve.size, curve.limit_s, "--", label=curve.limit, color=line.get_color(), lw=1)
        axes.set_xlabel(grows)
        axes.set_xticks(curve.size, [f"{size:,}" for size in curve.size])
        axes.minorticks_off()
        axes.set_title(f"s {curve.unit}", fontsize=9)
        axes.grid(alpha=0.3)
        axes.legend(fontsize=6)
    figure.savefig(path, dpi=110)


def main() -> None:
    """Measures what is not there, draws, and prints what each grows like."""
    asked = argparse.ArgumentParser(description=__doc__)
    asked.add_argument("--out", type=Path, default=_RESULTS)
    asked.add_argument("--draw", type=Path)
    asked.add_argument("--workers", action="store_true")
    given = asked.parse_args()
    if not given.draw or not given.out.exists():
        curves = measured(side_by_side=given.workers)
        given.out.write_text(json.dumps([asdict(one) for one in curves], indent=1) + "\n")
    curves = [Curve(**one) for one in json.loads(given.out.read_text())]
    for one in curves:
        steep = np.log(one.time_s[-1] / one.time_s[-2]) / np.log(one.size[-1] / one.size[-2])
        times = ", ".join(f"{1e3 * each:.4g}" for each in one.time_s)
        limits = ", ".join(f"{1e3 * each:.3g}" for each in one.limit_s)
        print(f"{one.what} over {one.grows} {one.size}: {times} ms; in the end like n^{steep:.2f}")
        print(f"    {one.limit}: {limits} ms")
    if given.draw:
        draw(curves, given.draw)


if __name__ == "__main__":
    main()

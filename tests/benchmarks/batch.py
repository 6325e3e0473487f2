"""Batches and maps: throughput with one and two local workers and on a Dask cluster of two, memory of the
parent, cost by part.

    python -m tests.benchmarks.batch [FITS [POSTURES]]

The data are FRFs of a planar three-joint arm from closed forms (`tests/batch/planar.py`), the map that of a
six-axis arm. On a machine that does other work the wall time says little: the processor time beside it is
what a fit or a posture costs.
"""

from __future__ import annotations

import os
import resource
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from identify.batch.loop import BatchIndex, Entry
from identify.batch.run import run_batch
from identify.map.asked import MapOptions
from identify.map.posture_map import map_postures
from identify.map.run import run_map
from identify.results import file as result_file
from identify.results.fit import FitResult
from identify.vibration.fitted_model import fitted_model, tool_point
from identify.vibration.run import run_fit
from tests.batch import planar

ROOT = Path(__file__).parents[2]
ARM = ROOT / "configs" / "arm_hammer_test.yaml"
_PAGE = os.sysconf("SC_PAGE_SIZE")


def memory_mb() -> float:
    """Resident memory of this process, MB."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * _PAGE / 1e6


@dataclass
class Watched:
    """The parent's memory after each change, and when the first and last job ended."""

    sizes: list[float] = field(default_factory=list)

    def __call__(self, index: BatchIndex) -> None:
        """Called by the loop."""
        self.sizes.append(memory_mb())

    @property
    def grown(self) -> float:
        """Growth from the first to the last tenth of the changes, MB."""
        tenth = max(1, len(self.sizes) // 10)
        return float(np.median(self.sizes[-tenth:]) - np.median(self.sizes[:tenth]))


@contextmanager
def dask() -> Iterator[str]:
    """The address of a Dask scheduler with two worker processes."""
    from distributed import LocalCluster

    with LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address="127.0.0.1:0", memory_limit=0
    ) as cluster:
        yield cluster.scheduler_address


def measured(what: str, count: int, work: Callable[[Watched], float]) -> None:
    """Time a batch or a map; work returns the seconds of its workers per job."""
    watched, before = Watched(), resource.getrusage(resource.RUSAGE_CHILDREN)
    begun = time.perf_counter()
    busy = work(watched)
    wall = time.perf_counter() - begun
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    spent = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    told = (
        f"{1000 * spent / count:6.0f} ms of processor each, starts included"
        if spent > 1
        else "processor time is the cluster's"
    )
    memory = f"parent {watched.sizes[0]:.0f} MB at first, {watched.grown:+.1f} MB over the run"
    print(
        f"  {what:18s} {wall:7.1f} s {count / wall:7.2f} per second, {1000 * busy:6.0f} ms in the worker"
        f" each, {told}; {memory}",
        flush=True,
    )


def fits(folder: Path, count: int) -> None:
    """The same batch three times."""
    planar.write_study(folder, planar.postures(count))
    config = planar.write_batch(folder)
    print(
        f"{count} fits of a planar arm: 6 parameters, 8 FRFs of 61 lines, one start (load of the machine"
        f" {os.getloadavg()[0]:.1f})"
    )

    def batch(watched: Watched, workers: int | None = None, cluster: str | None = None) -> float:
        result, _ = run_batch(config, folder / "out.h5", workers=workers, cluster=cluster, progress=watched)
        assert result.jobs.state == ("done",) * count
        return float(result.jobs.seconds.mean())

    measured("1 worker", count, lambda watched: batch(watched, 1))
    measured("2 workers", count, lambda watched: batch(watched, 2))
    with dask() as address:
        measured("Dask, 2 workers", count, lambda watched: batch(watched, cluster=address))
    begun = time.perf_counter()
    run_batch(config, folder / "out.h5", workers=2, resume=True)
    size = sum(path.stat().st_size for path in (folder / "out").glob("*.h5")) / count
    print(
        f"  --resume of the finished batch: {time.perf_counter() - begun:.1f} s; a result file:"
        f" {size / 1e3:.0f} kB",
        flush=True,
    )


def maps(folder: Path, count: int) -> None:
    """The same map three times, and its cost by part."""
    model = folder / "arm.h5"
    run_fit(ARM, model, {})
    options = MapOptions(grid=((2, -40.0, 60.0, 25), (3, -80.0, 60.0, count // 25)))
    print(
        f"{count} postures of a six-axis arm: 6 modes, 9 FRFs of 100 lines, all with intervals (load"
        f" {os.getloadavg()[0]:.1f})"
    )

    def run(watched: Watched, workers: int | None = None, cluster: str | None = None) -> float:
        begun = time.perf_counter()
        result, _ = run_map(
            model, options, folder / "map.h5", workers=workers, cluster=cluster, progress=watched
        )
        assert len(result.rows.name) == count
        return (time.perf_counter() - begun) * (workers or 2) / count

    measured("1 worker", count, lambda watched: run(watched, 1))
    measured("2 workers", count, lambda watched: run(watched, 2))
    with dask() as address:
        measured("Dask, 2 workers", count, lambda watched: run(watched, cluster=address))
    print(f"  the map's file: {(folder / 'map.h5').stat().st_size / count / 1e3:.1f} kB a posture")
    fitted = fitted_model(result_file.read(model, FitResult), "arm.h5")
    tool, postures = tool_point(fitted, None), np.tile(fitted.posture, (40, 1))
    for lines in (2, 100, 400):
        begun = time.process_time()
        map_postures(fitted, tool, [str(n) for n in range(40)], postures, np.linspace(3, 80, lines), 6)
        print(
            f"  one posture with {lines} lines: {1000 * (time.process_time() - begun) / 40:.2f} ms of"
            " processor"
        )


def index(folder: Path) -> None:
    """What the index costs as it grows."""
    for count in (1_000, 10_000, 100_000):
        made = BatchIndex(
            folder / "index.json",
            {"batch": "x"},
            {f"posture{n:06d}": Entry("done", 1, f"posture{n:06d}.h5", 0.5123) for n in range(count)},
        )
        begun = time.perf_counter()
        made.write()
        print(
            f"index of {count} jobs: {time.perf_counter() - begun:.3f} s a write,"
            f" {made.path.stat().st_size / 1e6:.1f} MB"
        )


def main(count: int, postures: int) -> None:
    """Print everything."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        index(folder)
        fits(folder / "fits", count)
        maps(folder, postures)


if __name__ == "__main__":
    given = [int(text) for text in sys.argv[1:]]
    main(given[0] if given else 100, given[1] if len(given) > 1 else 1000)

"""Seconds of `identify discover` from the command line to the page: python -m
tests.benchmarks.discovery_speed FOLDER [--cases NAME ...] [--against CHECKOUT].

With another checkout of the project every case is run by both, one after the other, so that the machine is
the same; processor seconds count all processes of a command.  One run first, which compiles what is not yet
compiled, does not count.  Nothing is scored (`tests.benchmarks.discovery`
does).
"""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from tests.benchmarks.startup import writing_bytecode
from tests.hidden import config_of
from tests.shared import ROOT


def main() -> None:
    """Print a table row a case."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.discovery_speed", description=__doc__)
    parser.add_argument("folder", type=Path, nargs="?", default=ROOT / "hidden")
    parser.add_argument("--cases", nargs="+", help="only these")
    parser.add_argument("--against", type=Path, help="another checkout, run before this one")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    given = parser.parse_args()
    trees = [*([given.against] if given.against else []), Path(__file__).parents[2]]
    names = given.cases or sorted(
        p.name.removesuffix(".truth.json") for p in given.folder.glob("*.truth.json")
    )
    print("| case | " + " | ".join(f"{tree.resolve().name}, s (processor)" for tree in trees) + " |")
    print("|---" * (1 + len(trees)) + "|")
    for tree in trees:
        seconds(tree, given.folder / names[0], given.workers)
    for name in names:
        cells = [seconds(tree, given.folder / name, given.workers) for tree in trees]
        print(
            f"| {name} | " + " | ".join(f"{wall:.1f} ({cpu:.1f})" for wall, cpu in cells) + " |", flush=True
        )


def seconds(tree: Path, case: Path, workers: int) -> tuple[float, float]:
    """Of the clock and of the processor, until the page is written."""
    with tempfile.TemporaryDirectory() as folder:
        config, out = config_of(case, Path(folder)), Path(folder) / "found.h5"
        command = [sys.executable, "-m", "identify", "discover", str(config), "--out", str(out)]
        before, began = _processor(), time.perf_counter()
        subprocess.run(
            [*command, "--workers", str(workers), "--quiet"],
            cwd=tree,
            env={**writing_bytecode(), "PYTHONPATH": str(tree.resolve())},
            check=True,
        )
        wall, processor = time.perf_counter() - began, _processor() - before
        if not out.with_suffix(".html").exists():
            raise FileNotFoundError(f"{tree}: no page was written")
        return wall, processor


def _processor() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


if __name__ == "__main__":
    main()

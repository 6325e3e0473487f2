"""Processor time until a command can begin, and of writing reports, beside their budgets.

    python -m tests.benchmarks.startup

Each is the least of five runs in a process of its own, children included; modules are compiled before.  On a
busy machine times come out up to twice as long: the first line, Python alone, tells.
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parents[2]
_RUNS = 5
_IDENTIFY = ("-m", "identify")
_FRFS = str(ROOT / "data" / "arm_hammer_test" / "posture1.uff")
_STUDY = str(ROOT / "configs" / "arm_hammer_test.yaml")


def processor_s(*words: str, folder: Path) -> float:
    """Least processor time, s, of Python with these words."""
    alone = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MUJOCO_GL": "disable"}
    spent = []
    for _ in range(_RUNS):
        before = _children_s()
        subprocess.run(
            [sys.executable, *words],
            check=True,
            cwd=folder,
            env={**writing_bytecode(), **alone, "PYTHONPATH": str(ROOT)},
            stdout=subprocess.DEVNULL,
        )
        spent.append(_children_s() - before)
    return min(spent)


def writing_bytecode() -> dict[str, str]:
    """This environment for processes that keep what they compile: else each takes seconds to begin."""
    return {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}


def _children_s() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def main() -> None:
    """Prints a line for each: what, time and budget."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        modes = (*_IDENTIFY, "modes", _FRFS, "--out", "modes.h5", "--no-report", "--quiet")
        fit = (*_IDENTIFY, "fit", _STUDY, "--out", "fit.h5", "--no-report", "--quiet")
        cases: list[tuple[str, tuple[str, ...], float | None]] = [
            ("Python alone", ("-c", "pass"), None),
            ("identify --version", (*_IDENTIFY, "--version"), 0.15),
            ("identify --help", (*_IDENTIFY, "--help"), 0.3),
            ("identify fit --help", (*_IDENTIFY, "fit", "--help"), None),
            ("import numpy", ("-c", "import numpy"), None),
            ("imports of identify check", ("-c", "import identify.vibration.check"), None),
            ("imports of identify fit", ("-c", "import identify.vibration.run"), 1.0),
            ("imports of identify modes", ("-c", "import identify.modes.run"), None),
            ("identify modes on a file of FRFs", modes, None),
            ("identify fit of the example", fit, None),
            ("its page and PDF", (*_IDENTIFY, "report", "fit.h5"), 3.0),
        ]
        for what, words, budget in cases:
            seen = processor_s(*words, folder=folder)
            print(f"{what:34s} {seen:5.2f} s" + (f"  budget {budget:g} s" if budget else ""), flush=True)


if __name__ == "__main__":
    main()

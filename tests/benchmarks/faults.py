"""Which faults the tests notice: each of `faults.yaml` is put into a copy of the checkout, and the tests
beside it are run there.

    python -m tests.benchmarks.faults [--only NAME] [--json OUT]

A fault is `killed` where a test fails with it, `survived` where none does, `stale` where its text is no
longer found exactly once, `broken` where the tests could not be run.  Exit code 1 where any is not killed,
or where the tests fail without a fault.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from ruamel.yaml import YAML

ROOT = Path(__file__).parents[2]
FAULTS = Path(__file__).with_suffix(".yaml")
_LONGEST_S = 900.0
"""A fault that makes its tests run longer than this is noticed too."""
_VERDICTS = {0: "survived", 1: "killed"}
"""Of pytest's exit codes; others mean that no test was found or that pytest itself failed."""


@dataclass(frozen=True)
class Fault:
    """A text that stands once in a file (relative to the checkout), what is put in its place, and the tests
    (files, or names as pytest has them) that should notice.
    """

    name: str
    file: str
    text: str
    fault: str
    tests: tuple[str, ...]

    def found(self, root: Path) -> int:
        """How often the text stands in its file."""
        path = root / self.file
        return path.read_text(encoding="utf-8").count(self.text) if path.is_file() else 0


@dataclass(frozen=True)
class Outcome:
    """What became of a fault, and the seconds that took; test: the first one that failed."""

    name: str
    verdict: str
    seconds: float
    test: str = ""


def read_faults(path: Path = FAULTS) -> list[Fault]:
    """The faults of a file; ValueError where a name is there twice or a fault changes nothing."""
    rows = YAML(typ="safe").load(path)
    faults = [Fault(**{**row, "tests": tuple(row["tests"])}) for row in rows]
    names = [fault.name for fault in faults]
    for fault in faults:
        if names.count(fault.name) > 1:
            raise ValueError(f"{path.name}: two faults are called {fault.name}")
        if fault.text == fault.fault:
            raise ValueError(f"{path.name}: {fault.name} changes nothing")
    return faults


def copied(folder: Path) -> Path:
    """A copy of the checkout as it stands, whatever git ignores left out."""
    command = ["git", "ls-files", "--cached", "--others", "--exclude-standard"]
    listed = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True)
    for name in listed.stdout.splitlines():
        if (ROOT / name).is_file():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, folder / name)
    return folder


def run_tests(folder: Path, tests: Sequence[str]) -> tuple[str, str]:
    """Verdict on tests run in a copy of the checkout, and the first that failed."""
    environment = {
        **os.environ,
        "PYTHONPATH": str(folder),
        "OMP_NUM_THREADS": "1",
        "OPENBLAS_NUM_THREADS": "1",
        "IDENTIFY_SHARED": os.environ.get("IDENTIFY_SHARED", str(ROOT.parent / "shared")),
    }
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", "--no-header", "--tb=no"]
    try:
        ended = subprocess.run(
            [*command, *tests],
            check=False,
            cwd=folder,
            env=environment,
            capture_output=True,
            text=True,
            timeout=_LONGEST_S,
        )
    except subprocess.TimeoutExpired:
        return "killed", "none ended"
    lines = ended.stdout.splitlines()
    failed = [line.split(" ")[1] for line in lines if line.startswith(("FAILED", "ERROR"))]
    return _VERDICTS.get(ended.returncode, "broken"), failed[0] if failed else ""


def tried(folder: Path, fault: Fault, number: int) -> Outcome:
    """A fault put into the copy, its tests run, and the file as it was again."""
    if fault.found(folder) != 1:
        return Outcome(fault.name, "stale", 0.0)
    path, start = folder / fault.file, time.perf_counter()
    before = path.read_text(encoding="utf-8")
    _write(path, before.replace(fault.text, fault.fault), 2 * number + 1)
    try:
        verdict, test = run_tests(folder, fault.tests)
    finally:
        _write(path, before, 2 * number + 2)
    return Outcome(fault.name, verdict, time.perf_counter() - start, test)


def _write(path: Path, text: str, later: int) -> None:
    """With a time of change of its own, by whole seconds of which compiled files are told apart."""
    path.write_text(text, encoding="utf-8")
    now = time.time() + 2 * later
    os.utime(path, (now, now))


def _control(folder: Path, faults: Sequence[Fault]) -> str:
    """Why the faults cannot be judged: the copy is not what is imported, or a test fails without a fault."""
    where = "import identify; print(identify.__file__)"
    command = [sys.executable, "-c", where]
    environment = {**os.environ, "PYTHONPATH": str(folder)}
    imported = subprocess.run(
        command, cwd=folder, env=environment, check=True, capture_output=True, text=True
    )
    if not Path(imported.stdout.strip()).is_relative_to(folder):
        return f"not the copy is imported but {imported.stdout.strip()}"
    verdict, test = run_tests(folder, sorted({test for fault in faults for test in fault.tests}))
    return "" if verdict == "survived" else f"without a fault the tests are {verdict}: {test}"


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the faults and print what became of each; the exit code."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.faults", description=__doc__)
    parser.add_argument("--only", action="append", help="name of a fault, or a part of it; may be repeated")
    parser.add_argument("--json", type=Path, help="file for the outcomes")
    given = parser.parse_args(arguments)
    faults = [f for f in read_faults() if not given.only or any(part in f.name for part in given.only)]
    if not faults:
        parser.error("no fault has that name")
    with tempfile.TemporaryDirectory() as place:
        folder = copied(Path(place).resolve())
        wrong = _control(folder, faults)
        if wrong:
            print(wrong)
            return 1
        outcomes = []
        for number, fault in enumerate(faults):
            outcomes.append(tried(folder, fault, number))
            one = outcomes[-1]
            print(f"{one.verdict:9}{one.seconds:6.1f} s  {one.name:52}{one.test}", flush=True)
    killed = sum(one.verdict == "killed" for one in outcomes)
    print(f"{killed} of {len(outcomes)} killed")
    if given.json:
        given.json.write_text(json.dumps([asdict(one) for one in outcomes], indent=1), encoding="utf-8")
    return 0 if killed == len(outcomes) else 1


if __name__ == "__main__":
    sys.exit(main())

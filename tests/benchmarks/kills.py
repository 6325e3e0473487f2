"""Long commands killed at random moments and resumed: does each end with the very datasets of an undisturbed
run, and is what is finished never lost?

    python -m tests.benchmarks.kills [--kills 100] [--seed 1] [--only fit]

Of fit with each optimizer, discover, explain and batch on small studies: SIGINT, SIGTERM and SIGKILL, at any
moment, in the middle of a write and twice in a row; a full disk; a second run on the same output.  Prints a
line per command and exits with 1 where anything was not as it should be.
"""

from __future__ import annotations

import argparse
import inspect
import signal
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from multiprocessing.context import ForkServerContext
from pathlib import Path

import numpy as np

from identify.cli import app
from identify.fitting.optimizers.base import OPTIMIZERS
from tests.batch import planar
from tests.motion.hidden_drive import Hidden, Motion, study
from tests.programs import Run, Trouble, begun, differences, part_of, programs, wait_for_more

DONE = (0, 4)
_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGKILL)
_INTERRUPTED = "interrupted"


@dataclass
class Case:
    """A command on a study: its words without the output; watched: what grows beside the output as it goes
    on.
    """

    name: str
    words: list[str]
    watched: Callable[[Path], tuple[Path, ...]] = lambda out: (part_of(out),)
    befell: Counter[str] = field(default_factory=Counter)
    faults: list[str] = field(default_factory=list)
    resumed: int = 0

    @property
    def resumable(self) -> bool:
        """Whether the command has `--resume`."""
        [callback] = [
            one.callback for one in app.registered_commands if one.callback.__name__ == self.words[0]
        ]
        return "resume" in inspect.signature(callback).parameters


def fits(folder: Path, evaluations: int) -> list[Case]:
    """A fit with each optimizer, of one posture of a planar arm."""
    base = planar.write_study(folder, planar.postures(1)).read_text()
    angles = (folder / "postures.csv").read_text().splitlines()[1].split(",")[1:]
    cases = []
    for kind in OPTIMIZERS.names():
        config = folder / f"{kind}.yaml"
        lines = [
            f"measurements: [{{file: p1.csv, posture_deg: [{', '.join(angles)}],",
            f"  noise: {{relative: {planar.NOISE}}}}}]",
            f"optimizer: {{kind: {kind}, evaluations: {evaluations}}}",
        ]
        measured = "\n".join([*lines, ""])
        config.write_text(base.replace("starts: 1", "starts: 3") + measured)
        cases.append(Case(f"fit {kind}", ["fit", str(config)]))
    return cases


def batch(folder: Path) -> Case:
    """A batch of three postures."""
    planar.write_study(folder, planar.postures(3))
    config = planar.write_batch(folder)
    words = ["batch", str(config), "--workers", "1"]
    return Case("batch", words, lambda out: (out.with_suffix("") / "index.json",))


def discover(folder: Path) -> Case:
    """A search with nothing hidden, in this process."""
    base = planar.write_study(folder, planar.postures(1)).read_text()
    angles = (folder / "postures.csv").read_text().splitlines()[1].split(",")[1:]
    row = f"{{file: p1.csv, posture_deg: [{', '.join(angles)}], noise: {{relative: {planar.NOISE}}}}}"
    config = folder / "study.yaml"
    config.write_text(f"{base}measurements: [{row}]\nband_hz: [5, 40]\n")
    return Case("discover", ["discover", str(config), "--workers", "1"])


def _friction(m: Motion) -> np.ndarray:
    return 1.5 * np.sign(m.v) + m.v


def explain(folder: Path) -> Case:
    """Friction and latency in the records of an arm."""
    hidden = Hidden((_friction,), latency_s=(0.004, 0.004, 0.004, 0, 0))
    config = study(folder, 3, hidden, effects="[coulomb-friction, viscous-friction, sensor-latency]")
    return Case("explain", ["explain", str(config)])


class Killer:
    """Disturbs the runs of a case until enough has befallen them."""

    def __init__(
        self, case: Case, folder: Path, context: ForkServerContext, rng: np.random.Generator
    ) -> None:
        self.case, self.folder, self.context, self.rng = case, folder, context, rng
        folder.mkdir()
        self.calm, self.out, self.said = folder / "calm.h5", folder / "out.h5", folder / "said.txt"
        began = time.perf_counter()
        code = self.begin(self.calm).ended()
        self.seconds = time.perf_counter() - began
        if code not in DONE:
            self.fault(f"the undisturbed run ended with {code}")

    def fault(self, sentence: str) -> None:
        """Something that should not be."""
        said = self.said.read_text().strip()[-300:] if self.said.exists() else ""
        self.case.faults.append(f"{sentence}: {said}")

    def begin(self, out: Path, trouble: Trouble | None = None, said: Path | None = None) -> Run:
        """A run of the case, resumed where there is something."""
        words = [*self.case.words, "--out", str(out), "--no-report", "--quiet"]
        words += ["--resume"] if self.case.resumable and out == self.out else []
        return begun(self.context, words, said or self.said, trouble)

    def disturb(self) -> None:
        """One run, to which one thing happens; a run that ends all the same is compared and taken away."""
        kinds = (
            self._signal,
            self._signal,
            self._signal,
            self._at_write,
            self._twice,
            self._full,
            self._second,
        )
        kind = kinds[int(self.rng.integers(len(kinds)))]
        name, code = kind()
        if code in DONE:
            self.compare()
        else:
            self.case.befell[name] += 1

    def compare(self) -> None:
        """Whether the finished run is the undisturbed one; it makes room for the next."""
        different = differences(self.calm, self.out)
        if different:
            self.fault(f"not equal: {', '.join(different[:5])}")
        left = [path.name for path in self.folder.glob(".*")] + [
            path.name for path in self.folder.glob("*.part")
        ]
        if left:
            self.fault(f"left behind: {left}")
        self.case.resumed += 1
        self.out.unlink()

    def finish(self) -> None:
        """What was interrupted last, resumed to its end."""
        code = self.begin(self.out).ended()
        if code in DONE:
            self.compare()
        else:
            self.fault(f"the last run ended with {code}")

    def _pause(self, run: Run) -> None:
        if self.rng.random() < 0.5:
            wait_for_more(run, *self.case.watched(self.out))
        time.sleep(self.rng.uniform(0.0, 0.5 * self.seconds))

    def _ended(self, run: Run, number: int) -> int | None:
        code = run.ended()
        wanted = -signal.SIGKILL if number == signal.SIGKILL else 130
        if code == 130 and _INTERRUPTED not in self.said.read_text():
            self.fault("130 without a sentence")
        if code not in (*DONE, wanted):
            self.fault(f"{signal.Signals(number).name} ended with {code}")
        return code

    def _signal(self) -> tuple[str, int | None]:
        number = _SIGNALS[int(self.rng.integers(3))]
        run = self.begin(self.out)
        self._pause(run)
        if run.process.is_alive():
            run.signal(number)
        return signal.Signals(number).name, self._ended(run, number)

    def _twice(self) -> tuple[str, int | None]:
        run = self.begin(self.out)
        self._pause(run)
        for _ in range(2):
            if run.process.is_alive():
                run.signal(signal.SIGINT)
                time.sleep(self.rng.uniform(0.0, 0.1))
        return "twice", self._ended(run, signal.SIGINT)

    def _at_write(self) -> tuple[str, int | None]:
        number, which = _SIGNALS[int(self.rng.integers(3))], int(self.rng.integers(1, 4))
        run = self.begin(self.out, Trouble(signal_at_write=(number, which)))
        return f"{signal.Signals(number).name} in a write", self._ended(run, number)

    def _full(self) -> tuple[str, int | None]:
        run = self.begin(self.out, Trouble(largest_file=int(self.rng.integers(1, 12000))))
        code = run.ended()
        if code not in (*DONE, 2):
            self.fault(f"a full disk ended with {code}")
        return "full disk", code

    def _second(self) -> tuple[str, int | None]:
        run = self.begin(self.out)
        lock = self.out.with_name(f".{self.out.name}.lock")
        while run.process.is_alive() and not lock.exists():
            time.sleep(0.005)
        other = self.begin(self.out, said=self.folder / "second.txt")
        code = other.ended()
        if code == 2 and "another run is writing it" in (self.folder / "second.txt").read_text():
            self.case.befell["second run"] += 1
        elif code not in DONE:  # as where the first one was faster
            self.fault(f"a second run ended with {code}")
        return "second run", run.ended()


def main() -> None:
    """Run the benchmark."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--kills", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", default="", help="part of the names of the cases")
    asked = parser.parse_args()
    folder = Path(tempfile.mkdtemp(prefix="kills_"))
    makers: list[Callable[[Path], list[Case]]] = [
        lambda f: fits(f, 400),
        lambda f: [batch(f)],
        lambda f: [discover(f)],
        lambda f: [explain(f)],
    ]
    cases: list[Case] = []
    for number, make in enumerate(makers):
        (folder / f"study{number}").mkdir()
        cases += [case for case in make(folder / f"study{number}") if asked.only in case.name]
    context, each = programs(), -(-asked.kills // len(cases))
    for number, case in enumerate(cases):
        killer = Killer(case, folder / f"case{number}", context, np.random.default_rng([asked.seed, number]))
        tries = 0
        while case.befell.total() < each and tries < 4 * each and not case.faults:
            tries += 1
            killer.disturb()
        killer.finish()
        befell = ", ".join(f"{count} {name}" for name, count in sorted(case.befell.items()))
        print(f"{case.name}: {befell}; {case.resumed} ends, {len(case.faults)} faults", flush=True)
        for fault in case.faults:
            print(f"  {fault}", flush=True)
    total = sum(case.befell.total() for case in cases)
    print(f"{total} kills, {sum(len(case.faults) for case in cases)} faults")
    sys.exit(any(case.faults for case in cases))


if __name__ == "__main__":
    main()

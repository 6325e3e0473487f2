"""Mutated inputs: each is read as a command reads it, in a child, and must be accepted with nothing
else changed, or refused in a sentence.

    python -m tests.benchmarks.hostile --mutants 10000 --seed 1 [--only KIND] [--keep FOLDER]
"""

from __future__ import annotations

import argparse
import json
import os
import select
import signal
import tempfile
import traceback
import warnings
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from identify.core.errors import InputError, InputErrors
from tests.hostile.kinds import Facts, Kind, excess, kinds
from tests.hostile.mutate import Mutant

LIMIT_S = 10.0
CLASSES = ("accepted", "refused", "traceback", "crash", "hang", "silent")
Outcome = tuple[int, str, str]
"""Number of the mutant, its class, and what there is to say."""


def mutant_of(kind: Kind, content: bytes, seed: int, number: int) -> Mutant:
    """The mutant of that number, always the same."""
    draw = np.random.default_rng([seed, number, *kind.name.encode()])
    return kind.mutations[int(draw.integers(len(kind.mutations)))](draw, content)


def judged(kind: Kind, content: bytes, whole: Facts, mutant: Mutant, folder: Path) -> tuple[str, str]:
    """The class of a mutant and what there is to say."""
    path = folder / f"mutant{kind.file.suffix}"
    path.write_bytes(mutant.content)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            found = kind.read(path)
    except (InputError, InputErrors) as error:
        lines = str(error).splitlines()
        plain = all(line.isprintable() for line in lines) and len(str(error)) < 100_000
        return ("refused", lines[0]) if plain else ("traceback", f"no sentence: {str(error)[:300]!r}")
    except Exception:
        return "traceback", traceback.format_exc()
    more = excess(kind, mutant, content, whole, found)
    return ("silent", f"{mutant.what}: {more}") if more else ("accepted", "")


def run(kind: Kind, numbers: Sequence[int], seed: int, folder: Path) -> Iterator[Outcome]:
    """Judge mutants in a forked child; one that crashes or hangs ends it, and another goes on."""
    content, whole = kind.file.read_bytes(), kind.read(kind.file)
    rest = list(numbers)
    while rest:
        source, sink = os.pipe()
        pid = os.fork()
        if pid == 0:
            _work(kind, (content, whole), rest, seed, (folder, sink))
        os.close(sink)
        done = 0
        for number, verdict, words in _heard(source, rest, pid):
            done += 1
            yield number, verdict, words
        os.close(source)
        os.waitpid(pid, 0)
        rest = rest[done:]


def _work(
    kind: Kind, original: tuple[bytes, Facts], numbers: Sequence[int], seed: int, out: tuple[Path, int]
) -> None:
    """What the child does, to its end."""
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    content, whole = original
    for number in numbers:
        mutant = mutant_of(kind, content, seed, number)
        verdict, words = judged(kind, content, whole, mutant, out[0])
        os.write(out[1], json.dumps([number, verdict, words[-1500:]]).encode() + b"\n")
    os._exit(0)


def _heard(source: int, numbers: Sequence[int], pid: int) -> Iterator[Outcome]:
    """The outcomes that a child says, and the one that ended it."""
    waiting, buffer = list(numbers), b""
    while waiting:
        while b"\n" not in buffer:
            if not select.select([source], [], [], 3 * LIMIT_S)[0]:
                os.kill(pid, signal.SIGKILL)
                yield waiting[0], "hang", f"no answer in {3 * LIMIT_S:g} s"
                return
            more = os.read(source, 65536)
            if not more:
                yield waiting[0], "crash", "the process died"
                return
            buffer += more
        line, _, buffer = buffer.partition(b"\n")
        number, verdict, words = json.loads(line)
        waiting.pop(0)
        yield number, verdict, words


def table(counts: dict[str, Counter[str]]) -> str:
    """A line a kind."""
    rows = [f"{'kind':26s}" + "".join(f"{name:>10s}" for name in CLASSES)]
    total: Counter[str] = Counter()
    for name, count in counts.items():
        total += count
        rows.append(f"{name[:26]:26s}" + "".join(f"{count[one]:10d}" for one in CLASSES))
    return "\n".join([*rows, f"{'all':26s}" + "".join(f"{total[one]:10d}" for one in CLASSES)])


def examine(
    mutants: int, seed: int, only: str, keep: Path | None
) -> tuple[dict[str, Counter[str]], list[str]]:
    """The classes of so many mutants over all kinds, and the words on each that failed."""
    counts: dict[str, Counter[str]] = {}
    failures: list[str] = []
    with tempfile.TemporaryDirectory() as name:
        chosen = [kind for kind in kinds(Path(name)) if only in kind.name]
        for position, kind in enumerate(chosen):
            numbers = range(position, mutants, len(chosen))
            counts[kind.name] = Counter()
            for number, verdict, words in run(kind, numbers, seed, Path(name)):
                counts[kind.name][verdict] += 1
                if verdict not in ("accepted", "refused"):
                    failures.append(f"{kind.name} {number}: {verdict}: {words}")
                    _keep(keep, kind, number, seed)
    return counts, failures


def _keep(keep: Path | None, kind: Kind, number: int, seed: int) -> None:
    if keep is not None:
        keep.mkdir(parents=True, exist_ok=True)
        content = mutant_of(kind, kind.file.read_bytes(), seed, number).content
        (keep / f"{kind.name.replace(' ', '_')}_{number}{kind.file.suffix}").write_bytes(content)


def main() -> None:
    """Print the table and what failed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--mutants", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", default="")
    parser.add_argument("--keep", type=Path)
    asked = parser.parse_args()
    counts, failures = examine(asked.mutants, asked.seed, asked.only, asked.keep)
    print("\n\n".join(failures))
    print(table(counts))


if __name__ == "__main__":
    main()

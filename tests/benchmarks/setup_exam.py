"""Slips of practice on simulated hammer tests: are they named, and nothing where all is right?

    python -m tests.benchmarks.setup_exam --seed 1 [--slips 40] [--right 20] [--arms compact large random]

Every kind of slip of `tests.benchmarks.setup_slips` is drawn about as often, every sixth together with
another; of the right set-ups every other one has an effect of the catalogue hidden in it.  Tests are
simulated in the time domain by `tests.generator`, which shares no code with the package.  Draw after the
work, and score once.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from copy import deepcopy
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from identify.core.errors import InputError, InputErrors
from identify.measured.frf_set import FrfSet
from identify.setup.bounds import no_phases, placeholders
from identify.setup.diagnosis import look
from identify.vibration.problem import load_problem
from identify.vibration.study import read_study
from tests.benchmarks.setup_slips import SLIPS, Named, Told, told, write
from tests.generator.cases import hide
from tests.generator.makes import MAKES
from tests.generator.spec import TestSpec

RESULTS = Path(__file__).with_name("results") / "setup_exam.json"
HIDDEN = ("base_rocking", "tilt_j2", "radial_j2", "axial_j3", "link2_flex", "absorber_l3", "rotor_j2")
_WITHOUT_FIT = ("magnitudes", "decibels", "real_parts", "placeholders")
"""Slips beside which there is no other to be seen."""
_PAIRS = 6


@dataclass(frozen=True)
class Row:
    """One test: what was wrong, what was said (code, sentence), whether that is exact; gaps; seconds of the
    processor.
    """

    arm: str
    hidden: str
    slips: tuple[str, ...]
    said: tuple[Named, ...]
    right: bool
    gap: float
    gap_after: float
    probability: float
    seconds: float


def main() -> None:
    """Draw, score, write."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.setup_exam", description=__doc__)
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--slips", type=int, default=40, help="tests with slips, per arm")
    parser.add_argument("--right", type=int, default=20, help="tests that are right, per arm")
    parser.add_argument("--arms", nargs="+", default=["compact", "large", "random"], choices=sorted(MAKES))
    parser.add_argument("--json", type=Path, default=RESULTS)
    parser.add_argument("--merge", nargs="*", type=Path, default=[], help="results of single arms, as one")
    given = parser.parse_args()
    rows: list[Row] = [_row(one) for path in given.merge for one in json.loads(path.read_text())["rows"]]
    if rows:
        given.json.write_text(json.dumps(_summary(given.seed, rows), indent=1) + "\n")
        return
    for arm in given.arms:
        rng = np.random.default_rng([given.seed, sorted(MAKES).index(arm)])
        for row in _of_arm(arm, given, rng):
            rows.append(row)
            print(_line(row), flush=True)
            given.json.write_text(json.dumps(_summary(given.seed, rows), indent=1) + "\n")
    print(json.dumps(_summary(given.seed, rows)["score"]))


def _row(data: dict[str, Any]) -> Row:
    told = {"slips": tuple(data["slips"]), "said": tuple(map(tuple, data["said"]))}
    return Row(**{**data, **told})


def _of_arm(arm: str, given: Any, rng: np.random.Generator) -> Any:
    seed = int(rng.integers(1, 10**6))
    plain = _test(arm, seed, "none")
    for number, name in enumerate(_drawn(given, arm)):
        names = [str(name)]
        if number % _PAIRS == _PAIRS - 1 and name not in _WITHOUT_FIT:
            others = [one for one in SLIPS if one not in (*_WITHOUT_FIT, name) and _apart(one, str(name))]
            names.append(str(rng.choice(others)))
        yield _scored(arm, "none", deepcopy(plain), names, rng)
    for number in range(given.right):
        hidden = HIDDEN[number // 2 % len(HIDDEN)] if number % 2 else "none"
        yield _scored(arm, hidden, _test(arm, int(rng.integers(1, 10**6)), hidden), [], rng)


def _drawn(given: Any, arm: str) -> list[str]:
    """The slips of an arm: all kinds once before any comes again, over all arms."""
    rng, place = np.random.default_rng([given.seed, 0xE]), sorted(MAKES).index(arm) * given.slips
    rounds = -(-len(MAKES) * given.slips // len(SLIPS))
    order = [str(name) for _ in range(rounds) for name in rng.permutation(list(SLIPS))]
    return order[place : place + given.slips]


def _apart(one: str, other: str) -> bool:
    """Whether two slips are of different families, so that both can be seen."""
    families = (
        ("g_for", "ms2", "hammer", "mm_for", "pound", "inches", "velocity", "displacement", "robot_lb"),
        ("nodes", "links", "wrong", "cube", "channel", "cables", "sensor", "world"),
        ("sign", "all", "zero", "radians", "order", "from", "postures"),
        ("masses", "robot", "inertia", "lengths"),
        ("force",),
        ("rad_per_s", "window", "one_file"),
    )
    return not any(one.startswith(names) and other.startswith(names) for names in families)


def _test(arm: str, seed: int, hidden: str) -> Told:
    spec = TestSpec(MAKES[arm](seed), seed=seed, binary=True, postures=2)
    return told(hide(spec, hidden))


def _scored(arm: str, hidden: str, test: Told, names: list[str], rng: np.random.Generator) -> Row:
    wanted = [named for name in names for named in SLIPS[name](test, rng)]
    began = time.process_time()
    with tempfile.TemporaryDirectory() as folder:
        path = write(test, Path(folder) / "test")
        try:
            problem = load_problem(read_study(path))
        except (InputError, InputErrors) as error:
            said = [("refused", str(error))]
            right = bool(names) and names[0] in _WITHOUT_FIT
            return Row(arm, hidden, tuple(names), tuple(said), right, np.nan, np.nan, np.nan, 0.0)
        found = [one for one in placeholders(problem.robot)]
        data = problem.measurements[0].given.data
        assert isinstance(data, FrfSet)
        found += no_phases(data)
        said = [(one.check, one.sentence) for one in found]
        looked = look(problem)
    diagnosis = None if said else looked.diagnosis
    if diagnosis is not None:
        said += [(one.code, one.sentence) for one in diagnosis.mistakes]
    right = len(said) == len(wanted) and all(any(_is(one, want) for one in said) for want in wanted)
    after = np.nan if diagnosis is None else diagnosis.gap_after
    sure = np.nan if diagnosis is None else diagnosis.probability
    seconds = time.process_time() - began
    return Row(arm, hidden, tuple(names), tuple(said), right, looked.gap, after, sure, round(seconds, 1))


def _is(said: Named, wanted: Named) -> bool:
    codes, parts = (text.split("|") for text in wanted)
    return said[0] in codes and any(part in said[1] for part in parts)


def _line(row: Row) -> str:
    what = "+".join(row.slips) or f"right ({row.hidden})"
    said = "" if row.right else f"  said {[f'{code}: {text}' for code, text in row.said]}"
    return f"{'ok' if row.right else 'NO'} {row.arm} {what} gap {row.gap:.4g} {row.seconds} s{said}"


def _known(value: Any) -> Any:
    return None if isinstance(value, float) and np.isnan(value) else value


def _summary(seed: int, rows: list[Row]) -> dict[str, Any]:
    slips, right = [row for row in rows if row.slips], [row for row in rows if not row.slips]
    return {
        "seed": seed,
        "score": {
            "slips": len(slips),
            "named exactly": sum(row.right for row in slips),
            "kinds": len({row.slips[0] for row in slips}),
            "right set-ups": len(right),
            "named in right ones": sum(not row.right for row in right),
            "longest, s": max((row.seconds for row in rows), default=0.0),
        },
        "rows": [{key: _known(value) for key, value in asdict(row).items()} for row in rows],
    }


if __name__ == "__main__":
    main()

"""Slips of practice on simulated hammer tests: are they named, and nothing where all is right?

    python -m tests.benchmarks.setup_exam --seed 1 [--slips 40] [--right 20] [--arms ...] [--many]

Every kind of slip of `tests.benchmarks.setup_slips` is drawn about as often, every fourth together with
another; of the right set-ups every other one has an effect of the catalogue hidden in it.  Every other test
is of an arm that is not quite as stated, by as much as its study states, `careful` or `typical`.  Tests are
simulated in the time domain by `tests.generator`, which shares no code with the package.  With --many every
arm has all the effects of a production hall: six soft bearings, base, two links and two hoses.  Draw after
the work, and score once.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from collections.abc import Iterator
from copy import deepcopy
from dataclasses import asdict, dataclass
from itertools import zip_longest
from pathlib import Path
from typing import Any

import numpy as np

from identify.core.errors import InputError, InputErrors
from identify.core.thresholds import QUIET
from identify.measured.frf_set import FrfSet
from identify.setup.bounds import no_phases, placeholders
from identify.setup.diagnosis import Looked, look
from identify.vibration.problem import load_problem
from identify.vibration.study import read_study
from tests.benchmarks.setup_slips import SIMULATED, SLIPS, Named, Told, told, write
from tests.generator.cases import hide
from tests.generator.dirt import CAREFUL, ORDINARY, Dirt, soil
from tests.generator.makes import MAKES
from tests.generator.spec import TestSpec

RESULTS = Path(__file__).with_name("results") / "setup_exam.json"
HIDDEN = ("base_rocking", "tilt_j2", "radial_j2", "axial_j3", "link2_flex", "absorber_l3", "rotor_j2")
MANY = "+".join(
    (
        "base_rocking",
        "base_sliding",
        *(f"{kind}_j{number}" for kind in ("tilt", "radial", "axial") for number in range(1, 7)),
        "link2_flex",
        "link4_flex",
        "absorber_l3",
        "absorber_l5",
    )
)
_SLIGHT = 0.2
"""How strong each of many effects is, beside one that is clearly visible."""
_WITHOUT_FIT = ("magnitudes", "decibels", "real_parts", "placeholders")
"""Slips beside which there is no other to be seen."""
_ALONE = (*_WITHOUT_FIT, "inverted")
"""Slips that are drawn alone: what is wrong by a factor beside 1/H is wrong by its inverse."""
_PAIRS = 4
_STATED: tuple[tuple[str, Dirt | None], ...] = (
    ("", None),
    ("careful", CAREFUL),
    ("", None),
    ("typical", ORDINARY),
)
"""In turn: what a study states, and how far its arm is off."""


@dataclass(frozen=True)
class Row:
    """One test: what was stated as uncertain, what was wrong, what was said (code, sentence), what else was
    said to explain as much; whether the first is exact, or it is among what was said; gaps; seconds of the
    processor.
    """

    arm: str
    stated: str
    hidden: str
    slips: tuple[str, ...]
    said: tuple[Named, ...]
    as_well: tuple[str, ...]
    right: bool
    among: bool
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
    parser.add_argument("--many", action="store_true", help="hide all effects of a production hall")
    parser.add_argument("--json", type=Path, default=RESULTS)
    parser.add_argument("--merge", nargs="*", type=Path, default=[], help="results of single arms, as one")
    given = parser.parse_args()
    rows: list[Row] = [_row(one) for path in given.merge for one in json.loads(path.read_text())["rows"]]
    if rows:
        given.json.write_text(json.dumps(_summary(given.seed, rows), indent=1) + "\n")
        return
    draws = [draw(arm, given) for arm in given.arms for draw in (_wrong, _right)]
    for row in _in_turn(draws):
        rows.append(row)
        print(_line(row), flush=True)
        given.json.write_text(json.dumps(_summary(given.seed, rows), indent=1) + "\n")
    print(json.dumps(_summary(given.seed, rows)["score"]))


def _row(data: dict[str, Any]) -> Row:
    told = {name: tuple(data[name]) for name in ("slips", "as_well")} | {
        "said": tuple(map(tuple, data["said"]))
    }
    return Row(**{**data, **told})


def _in_turn(draws: list[Iterator[Row]]) -> Iterator[Row]:
    """A row of each arm, wrong and right, again and again: an exam that is ended early has some of all."""
    for some in zip_longest(*draws):
        yield from (row for row in some if row is not None)


def _wrong(arm: str, given: Any) -> Iterator[Row]:
    rng = np.random.default_rng([given.seed, sorted(MAKES).index(arm)])
    seed = int(rng.integers(1, 10**6))
    hidden = MANY if given.many else "none"
    plain = {one[0]: told(_spec(arm, seed, hidden, _STATED.index(one))) for one in dict.fromkeys(_STATED)}
    for number, name in enumerate(_drawn(given, arm)):
        names, wanted, stated = [name], list[Named](), _STATED[number % len(_STATED)][0]
        if number % _PAIRS == rng.integers(_PAIRS) and name not in _ALONE:
            names.append(str(rng.choice([one for one in SLIPS if _apart(one, name)])))
        if name in SIMULATED:
            test, wanted = SIMULATED[name](_spec(arm, int(rng.integers(1, 10**6)), hidden, number))
        else:
            test = deepcopy(plain[stated])
        test.uncertainty = stated
        for one in names:
            wanted += SLIPS[one](test, rng) if one in SLIPS else []
        yield _scored((arm, stated, "many" if given.many else "none", tuple(names)), test, wanted)


def _right(arm: str, given: Any) -> Iterator[Row]:
    rng = np.random.default_rng([given.seed, sorted(MAKES).index(arm), 1])
    for number in range(given.right):
        stated = _STATED[number // 2 % len(_STATED)][0]
        hidden = HIDDEN[number // 2 % len(HIDDEN)] if number % 2 else "none"
        hidden = MANY if given.many else hidden
        test = told(_spec(arm, int(rng.integers(1, 10**6)), hidden, number // 2))
        test.uncertainty = stated
        yield _scored((arm, stated, "many" if given.many else hidden, ()), test, [])


def _drawn(given: Any, arm: str) -> list[str]:
    """The slips of an arm: all kinds once before any comes again, over all arms."""
    rng, place = np.random.default_rng([given.seed, 0xE]), sorted(MAKES).index(arm) * given.slips
    kinds = [*SLIPS, *SIMULATED]
    rounds = -(-len(MAKES) * given.slips // len(kinds))
    order = [str(name) for _ in range(rounds) for name in rng.permutation(kinds)]
    return order[place : place + given.slips]


def _apart(one: str, other: str) -> bool:
    """Whether two slips are of different families, so that both can be seen."""
    families = (
        ("g_for", "ms2", "hammer", "mm_for", "pound", "inches", "velocity", "displacement", "robot_lb"),
        ("nodes", "links", "wrong", "cube", "channel", "cables", "sensor", "world"),
        ("sign", "all", "zero", "radians", "order", "from", "postures"),
        ("masses", "robot", "inertia", "lengths", "payload", "no_payload"),
        ("force",),
        ("rad_per_s", "window", "one_file", "braked"),
        ("mm_for_m", "inertia_kg_mm2", "robot_g"),  # two of these are the third
    )
    alone = one in _ALONE or other in _ALONE
    return not alone and not any(one.startswith(names) and other.startswith(names) for names in families)


def _spec(arm: str, seed: int, hidden: str, number: int) -> TestSpec:
    many = hidden == MANY
    whole = TestSpec(MAKES[arm](seed), seed=seed, binary=True, postures=2, linear=many)
    spec = hide(whole, hidden, _SLIGHT if many else 1.0)
    dirt = _STATED[number % len(_STATED)][1]
    return spec if dirt is None else soil(spec, dirt)


def _scored(what: tuple[str, str, str, tuple[str, ...]], test: Told, wanted: list[Named]) -> Row:
    began = time.process_time()
    with tempfile.TemporaryDirectory() as folder:
        path = write(test, Path(folder) / "test")
        try:
            problem = load_problem(read_study(path))
        except (InputError, InputErrors) as error:
            right = any(one in _WITHOUT_FIT for one in what[-1])
            return Row(*what, (("refused", str(error)),), (), right, right, np.nan, np.nan, np.nan, 0.0)
        data = problem.measurements[0].given.data
        assert isinstance(data, FrfSet)
        found = [*placeholders(problem.robot), *no_phases(data)]
        said = [(one.check, one.sentence) for one in found]
        looked = Looked(np.nan) if said else look(problem)
    diagnosis, others = looked.diagnosis, list[list[Named]]()
    if diagnosis is not None:
        said += [(one.code, one.sentence) for one in diagnosis.mistakes]
        every = (diagnosis.mistakes, *diagnosis.instead)
        others = [[(m.code, text) for m in some for text in (m.sentence, *m.otherwise)] for some in every]
    right = len(said) == len(wanted) and all(any(_is(one, want) for one in said) for want in wanted)
    among = right or any(
        all(any(_is(one, want) for one in some) for want in wanted) for some in others if wanted
    )
    after = np.nan if diagnosis is None else diagnosis.gap_after
    sure = np.nan if diagnosis is None else diagnosis.probability
    seconds = round(time.process_time() - began, 1)
    texts = tuple(
        dict.fromkeys(text for some in others for _, text in some if text not in dict(said).values())
    )
    return Row(*what, tuple(said), texts, right, among, looked.gap, after, sure, seconds)


def _is(said: Named, wanted: Named) -> bool:
    codes, parts = (text.split("|") for text in wanted)
    return said[0] in codes and any(part in said[1] for part in parts)


def _line(row: Row) -> str:
    what = "+".join(row.slips) or f"right ({row.hidden})"
    said = "" if row.right else f"  said {[f'{code}: {text}' for code, text in row.said]}"
    where = " ".join(filter(None, (row.arm, row.stated)))
    return f"{'ok' if row.right else 'NO'} {where} {what} gap {row.gap:.4g} {row.seconds} s{said}"


def _known(value: Any) -> Any:
    return None if isinstance(value, float) and np.isnan(value) else value


def _summary(seed: int, rows: list[Row]) -> dict[str, Any]:
    slips, right = [row for row in rows if row.slips], [row for row in rows if not row.slips]
    return {
        "seed": seed,
        "score": {
            "slips": len(slips),
            "named exactly": sum(row.right for row in slips),
            "named, or told not to be told apart": sum(row.among for row in slips),
            "not named, of what the study as stated explains": sum(
                not row.right and row.gap <= QUIET for row in slips
            ),
            "kinds": len({row.slips[0] for row in slips}),
            "of two": sum(len(row.slips) > 1 for row in slips),
            "of two, named exactly": sum(row.right for row in slips if len(row.slips) > 1),
            "beside stated uncertainty": sum(row.stated != "" for row in slips),
            "of these, named exactly": sum(row.right for row in slips if row.stated),
            "right set-ups": len(right),
            "named in right ones": sum(not row.right for row in right),
            "median, s": float(np.median([row.seconds for row in rows])),
            "longest, s": max((row.seconds for row in rows), default=0.0),
        },
        "rows": [{key: _known(value) for key, value in asdict(row).items()} for row in rows],
    }


if __name__ == "__main__":
    main()

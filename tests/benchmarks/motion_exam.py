"""`identify discover` on studies of simulated motion: python -m tests.benchmarks.motion_exam --seed N.

Arms of two links and of six axes by `tests.generator.hidden_motion`, a fourth of them with nothing hidden,
the others with one of its kinds.  Bodies are a per cent or two off in all of them: to find that is not false.
Each case is scored as soon as it is done, so that a run that is stopped leaves a score of what it did.
"""

from __future__ import annotations

import argparse
import json
import re
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from identify.fitting.selection.workbench import Story
from identify.motion.missing.run import run_motion_discover
from tests.generator.hidden_motion import KINDS, drawn, write

RESULTS = Path(__file__).parent / "results"
OF_BODIES = "mass beyond the description"


def main() -> None:
    """Print a row per case and the score, and keep both."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.motion_exam", description=__doc__)
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--cases", type=int, default=40)
    parser.add_argument("--six", type=float, default=0.25, help="share of arms with six axes")
    parser.add_argument("--hours", type=float, default=24.0, help="no case is begun after that")
    parser.add_argument("--out", type=Path)
    given = parser.parse_args()
    rng, began, rows = np.random.default_rng(given.seed), time.monotonic(), list[dict[str, Any]]()
    kinds = ["", *KINDS] if given.cases < len(KINDS) else list(KINDS)
    plan = [str(k) for k in rng.permutation(list(kinds) * (given.cases // len(kinds) + 1))[: given.cases]]
    plan = ["" if number % 4 == 3 else kind for number, kind in enumerate(plan)]
    out = given.out or RESULTS / f"motion_exam_{given.seed}.json"
    for number, kind in enumerate(plan):
        six = bool(rng.random() < given.six)
        if time.monotonic() - began > 3600 * given.hours:
            break
        with tempfile.TemporaryDirectory() as name, threadpool_limits(1):
            rows.append(case(Path(name), given.seed, number, kind, six))
        print(json.dumps(rows[-1]), flush=True)
        told = {"seed": given.seed, "planned": given.cases, **score(rows), "cases": rows}
        out.write_text(json.dumps(told, indent=1) + "\n")
    print(score(rows))


def case(folder: Path, seed: int, number: int, kind: str, six: bool) -> dict[str, Any]:
    """One case drawn, searched and scored."""
    rng = np.random.default_rng([seed, number])
    hidden = drawn(rng, kind, six)
    write(hidden, folder, rng)
    began = time.process_time()
    result, _ = run_motion_discover(folder / "motion.yaml", folder / "found.h5", {}, Story())
    t = result.trials
    assert t is not None
    names = [name for name, kept in zip(t.name[1:], t.kept[1:], strict=True) if kept]
    row = scored(names, hidden.truth["kind"], set(hidden.truth["joints"]))
    about = {"number": number, "six": six, **hidden.truth, "found": names}
    gaps = {"gap": result.gap, "gap_before": float(t.gap[0]), "gap_judged": result.gap_validation}
    seconds = {"seconds": time.process_time() - began}
    return {**about, **row, **{k: round(v, 3) for k, v in (gaps | seconds).items()}}


def scored(names: list[str], kind: str, joints: set[int]) -> dict[str, Any]:
    """Whether the kind was named, at all of its joints; names that are false, and joints beyond."""
    own = [name for name in names if kind and name.startswith(kind)]
    at = set[int]().union(*(joints_of(name) for name in own)) if own else set()
    false = [name for name in names if name not in own and not name.startswith(OF_BODIES)]
    return {
        "named": bool(own) and joints <= at,
        "kind_named": bool(own),
        "beyond": sorted(at - joints) if joints else [],
        "false": false,
    }


def joints_of(name: str) -> set[int]:
    """The joints, or the links behind them, that a name tells of."""
    if "(" in name:
        return {int(number) for number in re.findall(r"(?:joint|link)(\d+)", name)}
    return {int(number) for number in re.findall(r"\d+", name)}


def score(rows: list[dict[str, Any]]) -> dict[str, int]:
    """Counts over all cases."""
    hidden = [row for row in rows if row["kind"]]
    nulls = [row for row in rows if not row["kind"]]
    beyond = [row for row in hidden if row["beyond"] and row["kind"] != OF_BODIES]
    return {
        "done": len(rows),
        "hidden": len(hidden),
        "named": sum(row["named"] for row in hidden),
        "kind_named": sum(row["kind_named"] for row in hidden),
        "false_names": sum(len(row["false"]) for row in rows),
        "with_joints_beyond": len(beyond),
        "nulls": len(nulls),
        "false_in_nulls": sum(bool(row["false"]) for row in nulls),
    }


if __name__ == "__main__":
    main()

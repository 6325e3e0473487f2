"""What a map learns from measured postures of a model that lacks something: python -m
tests.benchmarks.map_unknown [--arms 12] [--seed 1] [--keep FOLDER].

Each random arm is hit with a hammer in 18 postures (a simulation that shares no code), with an effect hidden
that the model has not; half of the arms turn all joints, half only the second and the third.  Three postures
are fitted; what the model leaves of the first 2, 3, 6 and 10 is learned, and the last 8, which nothing saw,
are predicted.  Printed and written as JSON are RMS errors of natural frequencies, damping ratios and peaks of
direct FRFs (of logarithms) without the correction and with it, and how many lie in the 95 % interval.
"""

from __future__ import annotations

import argparse
import json
import re
import tempfile
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from identify.map.process import learn
from identify.map.residuals import Observed, Source, coordinates_of, observed
from identify.results.discovery import fit_of
from identify.vibration.fitted_model import fitted_model, tool_point
from identify.vibration.run import run_fit
from tests.generator.cases import hide
from tests.generator.generate import generate
from tests.generator.makes import MAKES
from tests.generator.spec import TestSpec
from tests.hidden import config_of

RESULTS = Path(__file__).parent / "results"
CASES = ("tilt_j2", "base_rocking", "link2_flex", "tilt_j3", "base_rocking+tilt_j2", "link3_flex")
FITTED, AT_HAND, POSTURES = 3, (2, 3, 6, 10), 18
SPREAD_DEG = {
    "all joints": np.array([40.0, 25.0, 40.0, 50.0, 40.0, 70.0]),
    "joints 2 and 3": np.array([0.0, 35.0, 60.0, 0.0, 0.0, 0.0]),
}


def main() -> None:
    """Score arms drawn from a seed."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.map_unknown", description=__doc__)
    parser.add_argument("--arms", type=int, default=12)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument(
        "--keep", type=Path, help="folder of the simulated tests and fits, kept for another run"
    )
    given = parser.parse_args()
    rows: list[dict[str, Any]] = []
    with (
        threadpool_limits(1),
        nullcontext(given.keep) if given.keep else tempfile.TemporaryDirectory() as kept,
    ):
        for number in range(given.arms):
            case, design = CASES[number // 2 % len(CASES)], list(SPREAD_DEG)[number % 2]
            found = scored(made(1000 * given.seed + number, case, design, Path(str(kept))))
            rows += [{"arm": number, "case": case, "postures": design, **row} for row in found]
            print(f"arm {number}: {case}, {design}", flush=True)
    summary = summed(rows)
    for line in summary:
        print(*(f"{key}={_short(value)}" for key, value in line.items()))
    content = {"seed": given.seed, "arms": given.arms, "summary": summary, "rows": rows}
    (RESULTS / f"map_unknown_{given.seed}.json").write_text(json.dumps(content, indent=1) + "\n")


def _short(value: object) -> str:
    return f"{value:.3g}" if isinstance(value, float) else str(value)


def made(seed: int, case: str, design: str, kept: Path) -> Path:
    """The result of a fit of the first postures, with all others beside them."""
    folder = kept / str(seed)
    if not (folder / "fit.h5").exists():
        folder.mkdir(parents=True, exist_ok=True)
        spec = hide(TestSpec(arm=MAKES["random"](seed), seed=seed, postures=POSTURES, binary=True), case)
        spread = SPREAD_DEG[design]
        turned = np.random.default_rng([seed, 0x6D]).uniform(-spread, spread, (POSTURES, 6))
        generate(spec, folder / "arm", postures=np.round(spec.arm.home + turned, 1))
        config = config_of(folder / "arm", folder)
        config.write_text(re.sub(r"(posture(\d+)\.uff'.*use: )\w+", _use, config.read_text()))
        run_fit(config, folder / "fit.h5", {"starts": 2})
    return folder / "fit.h5"


def _use(match: re.Match[str]) -> str:
    return match[1] + ("fit" if int(match[2]) <= FITTED else "validate")


def scored(path: Path) -> list[dict[str, Any]]:
    """By quantity and number of postures at hand: errors and intervals at the last postures."""
    fit = fit_of(path)
    model = fitted_model(fit, str(path))
    names = list(fit.measurements)
    point, coordinates = tool_point(model, None), coordinates_of([model])

    def of(some: list[str]) -> dict[str, Observed]:
        few = replace(fit, measurements={name: fit.measurements[name] for name in some})
        return observed([Source(few, model, point, 0)], coordinates)

    unseen, rows = names[max(AT_HAND) :], []
    for count in AT_HAND:
        every = of([*names[:count], *unseen])
        for quantity, one in every.items():
            known = np.isin(one.measurement, names[:count])
            learned, right = learn(one.seen.rows(known), one.error[known]), one.error[~known]
            mean, low, high, share = learned.at(one.seen.rows(~known))
            rows.append(
                {
                    "quantity": quantity,
                    "at_hand": count,
                    "log_odds": learned.log_odds,
                    "n": len(right),
                    "before": float(np.sum(right**2)),
                    "after": float(np.sum((right - mean) ** 2)),
                    "inside": int(np.sum((low < right) & (right < high))),
                    "width": float(np.median(high - low)),
                    "known": float(np.mean(share)),
                }
            )
    return rows


def summed(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Over the arms of each design: how often the correction is switched on; RMS errors; the median and the
    worst of their ratio over arms; how many numbers of all lie inside.
    """
    found = []
    keys = dict.fromkeys((row["postures"], row["quantity"], row["at_hand"]) for row in rows)
    for key in keys:
        some = [row for row in rows if (row["postures"], row["quantity"], row["at_hand"]) == key]
        total = sum(row["n"] for row in some)
        before, after = (np.array([row[name] for row in some]) for name in ("before", "after"))
        found.append(
            {
                **dict(zip(("postures", "quantity", "at_hand"), key, strict=True)),
                "arms": len(some),
                "switched_on": sum(row["log_odds"] > 0 for row in some),
                "rms_before": float(np.sqrt(before.sum() / total)),
                "rms_after": float(np.sqrt(after.sum() / total)),
                "ratio_median": float(np.median(np.sqrt(after / before))),
                "ratio_worst": float(np.max(np.sqrt(after / before))),
                "inside": sum(row["inside"] for row in some) / total,
                "numbers": total,
            }
        )
    return found


if __name__ == "__main__":
    main()

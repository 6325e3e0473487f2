"""How often the 95 % intervals of a fit with stated uncertainty hold the truth where what is stated is really
a little wrong: python -m tests.benchmarks.coverage_stated [--uncertainty careful|typical] [--seeds 200].

The arm told and its postures stay as they are.  For every seed the arm is soiled anew
(`tests.generator.dirt`), hit with new impacts by a hammer held askew anew, and recorded with new noise; then
a study that states `uncertainty:` is fitted as `identify fit` does, from a guess that is off by up to a
factor of 1.7.  As in all hidden cases two postures are fitted and the third is for validation.  True are the
stiffness and damping of the joints, to which no dirt is added.

Every seed is a JSON row in a file as soon as it is done; the same command goes on where a killed run ended,
and with more seeds adds to it.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from identify.core.parameters import Scale
from identify.fitting.fit import fit
from identify.vibration.elsewhere import gap_elsewhere
from identify.vibration.plan import fit_plan
from identify.vibration.problem import load_problem
from identify.vibration.study import read_study
from identify.vibration.uncertainty import gap, uncertainty
from tests.benchmarks.discovery_draw import DIRT
from tests.benchmarks.discovery_nulls import remembered
from tests.generator.dirt import soil
from tests.generator.generate import generate
from tests.generator.makes import MAKES
from tests.generator.measure import draw_postures
from tests.generator.spec import TestSpec
from tests.hidden import config_of

Row = dict[str, Any]


def told(arm: int) -> TestSpec:
    """The test of a random arm as its user knows it."""
    return TestSpec(MAKES["random"](arm), seed=arm, binary=True)


def tested(spec: TestSpec, level: str, seed: int) -> Row:
    """One soiled arm measured and fitted: fitted values over true ones, standard deviations of their
    logarithms and whether the intervals hold the truth, by parameter; gaps, doubts and times.
    """
    with tempfile.TemporaryDirectory() as name:
        case, began = Path(name) / "test", time.perf_counter()
        generate(soil(replace(spec, seed=seed), DIRT[level]), case, postures=draw_postures(spec))
        simulated, began = time.perf_counter() - began, time.perf_counter()
        problem = load_problem(read_study(config_of(case, Path(name), extra=f"uncertainty: {level}")))
        found = fit(fit_plan(problem))
        trusted = uncertainty(problem.targets(), Scale(problem.parameters), found.values)
        seconds = time.perf_counter() - began
    truth = _truth(spec)
    names = [parameter.name for parameter in problem.parameters[: problem.size]]
    true = np.array([truth[name] for name in names])
    return {
        "test": [level, spec.seed, seed],
        "names": names,
        "ratio": (found.values[: problem.size] / true).tolist(),
        "std": trusted.std.tolist(),
        "held": ((trusted.low <= true) & (true <= trusted.high)).tolist(),
        "status": trusted.status,
        "gap": gap(problem.targets(), found.values),
        "gap_validation": gap_elsewhere(problem, trusted, found.values),
        "doubted": any("cannot be relied on" in note for note in trusted.notes),
        "starts": [found.agreeing, len(found.starts)],
        "seconds": seconds,
        "seconds_simulated": simulated,
    }


def _truth(spec: TestSpec) -> dict[str, float]:
    """True values of the joints by name of parameter."""
    pairs = enumerate(zip(spec.arm.stiffness, spec.arm.damping, strict=True), start=1)
    return {
        f"joint{number}.rz.{name}": float(value)
        for number, both in pairs
        for name, value in zip(("stiffness", "damping"), both, strict=True)
    }


def table(rows: list[Row]) -> str:
    """Coverage of every parameter, with bias and stated deviation in units of the scatter; of stiffnesses, of
    dampings and of all; gaps and doubts.
    """
    names, held = rows[0]["names"], np.array([row["held"] for row in rows])
    logs, std = np.log([row["ratio"] for row in rows]), np.array([row["std"] for row in rows])
    scatter, found = logs.std(axis=0, ddof=1), list[str]()
    stated, bias = np.sqrt(np.mean(std**2, axis=0)) / scatter, logs.mean(axis=0) / scatter
    for number, name in enumerate(names):
        found.append(
            f"  {name:22s} {held[:, number].mean():6.1%}   scatter {scatter[number]:.4f}, bias"
            f" {bias[number]:+.2f} scatters, stated {stated[number]:.2f} scatters"
        )
    for word in ("stiffness", "damping", ""):
        own = [number for number, name in enumerate(names) if name.endswith(word)]
        each = held[:, own].mean(axis=1)
        found.append(
            f"  all {word or 'parameters':18s} {each.mean():6.1%} +- {each.std() / np.sqrt(len(rows)):.1%}"
            f"   stated {np.sqrt(np.mean(stated[own] ** 2)):.2f} scatters"
        )
    for key in ("gap", "gap_validation"):
        gaps = [row[key] for row in rows]
        found.append(f"  {key} {np.mean(gaps):.3f} (from {min(gaps):.3f} to {max(gaps):.3f})")
    fitting, simulating = (np.mean([row[key] for row in rows]) for key in ("seconds", "seconds_simulated"))
    found.append(
        f"  intervals doubted in {sum(row['doubted'] for row in rows)} of {len(rows)}; {fitting:.1f} s a fit,"
        f" {simulating:.1f} s a simulation"
    )
    return "\n".join(found)


def main() -> None:
    """Run the seeds that are not yet in the file, and print the table."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.coverage_stated", description=__doc__)
    parser.add_argument("--uncertainty", choices=sorted(DIRT), default="careful")
    parser.add_argument("--seeds", type=int, default=200)
    parser.add_argument("--first", type=int, default=1, help="the first seed")
    parser.add_argument("--arm", type=int, default=3, help="seed of the arm told")
    parser.add_argument("--out", type=Path, help="file of the rows")
    given = parser.parse_args()
    kept = given.out or Path(tempfile.gettempdir()) / f"coverage_{given.uncertainty}_{given.arm}.jsonl"
    done = {tuple(row["test"]): row for row in remembered(kept)}
    tests = [(given.uncertainty, given.arm, given.first + number) for number in range(given.seeds)]
    with threadpool_limits(1):
        for test in tests:
            if test not in done:
                done[test] = tested(told(given.arm), given.uncertainty, test[2])
                with kept.open("a") as file:
                    file.write(json.dumps(done[test]) + "\n")
    print(table([done[test] for test in tests]))


if __name__ == "__main__":
    main()

"""How often `identify discover` adds something where nothing is missing: python -m
tests.benchmarks.discovery_nulls --seed N [--arms 40] [--repeats 5].

In half the arms nothing is hidden.  In the other half one effect acts that the study already has, in its true
place and with all its parameters fitted from their defaults, so that nothing is missing there either:
whatever is added is false.  Each arm's impacts are simulated once and recorded several times: tests of an arm
share impacts and postures and differ in the noise of force and responses alone.

A study may say an effect in another form than the generator: a payload or resonator, a small ball, is a body
whose centre and inertia are fitted too, a rotor of unknown gear has a ratio of 100.  Left out are a bending
link, which has no one place (the generator cuts it into hinges), and what depends on amplitude, which takes
three force levels.

Every test is a JSON row in a file as soon as it is done; the same command goes on where a killed run ended,
and with more arms or repeats adds to it.  Draw after the work is done, and score once.
"""

from __future__ import annotations

import argparse
import json
import os
import tempfile
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from identify.discovery.loop import discover
from identify.discovery.workers import Workers
from identify.model.effects.joint_compliance import CLASSES
from identify.vibration.problem import load_problem
from identify.vibration.study import read_study
from tests.benchmarks.discovery_draw import named
from tests.benchmarks.discovery_power import FORCE_NOISE, NOISE
from tests.generator.cases import hide
from tests.generator.effect import Effect
from tests.generator.generate import generate_recorded
from tests.generator.makes import MAKES
from tests.generator.spec import TestSpec
from tests.hidden import config_of

Row = dict[str, Any]
HALVES = ("nothing hidden", "effect in the study")
KINDS = (
    *("base_rocking", "base_turning", "base_sliding", "base_lifting", "tilt", "radial", "axial"),
    *("absorber", "payload", "sensor_mass", "ground_spring", "rotor"),
    *("delay", "polarity", "gain", "swap", "turned", "window"),
)
"""What acts and is in the study."""
_NEAR = 1.2
"""A first fit with a larger gap did not come to the noise, and is listed: what is added to it may compensate
for that."""


def _body(true: Row) -> Row:
    """Not a point: on a light wrist, the inertia of a ball of a few centimetres is missing from it."""
    return {"link": true["link"], "at_m": true["position"], "extent": "body"}


_NAMES = {"turned-axes": "sensor-rotation"}
_WRITTEN: dict[str, Callable[[Row], Row]] = {
    "base-compliance": lambda true: {"axes": true["axes"]},
    "joint-compliance": lambda true: {"joints": [true["joint"]], "axes": CLASSES[true["axes_class"]]},
    "appended-resonator": lambda true: {**_body(true), "axis": true["axis"]},
    "added-mass": _body,
    "sensor-mass": lambda true: {},
    "spring-to-ground": lambda true: {
        "link": true["link"],
        "at_m": true["position"],
        "direction": true["direction"],
    },
    "rotor-inertia": lambda true: {
        "joints": [true["joint"]],
        "gear_ratio": [100.0],
        "inertia": {"initial": 1e-4, "bounds": [1e-7, 1.0]},
    },
    "time-delay": lambda true: {},
    "channel-polarity": lambda true: {"channel": f"{true['point']}:{true['axis'].upper()}"},
    "channel-gain": lambda true: {"channel": f"{true['point']}:{true['axis'].upper()}"},
    "channel-swap": lambda true: {"point": true["point"], "axes": true["axes"]},
    "turned-axes": lambda true: {"point": true["point"], "axis": true["axis"]},
    "window-decay": lambda true: {},
}
"""Where a true effect is, in a study's words, by its kind in the generator."""


@dataclass(frozen=True)
class Drawn:
    """The arm of a half (0 or 1) with a number in a draw; the same whatever else is drawn."""

    seed: int
    half: int
    number: int

    @property
    def make(self) -> str:
        """In turn."""
        return sorted(MAKES)[self.number % len(MAKES)]

    @property
    def spec(self) -> TestSpec:
        """Its test; three strengths of noise in turn, all kinds of effects before any comes again."""
        rng = np.random.default_rng([self.seed, self.half, self.number])
        own = int(rng.integers(1, 10**6))
        noise = NOISE[self.number // len(MAKES) % 3]
        spec = TestSpec(
            MAKES[self.make](own), seed=own, noise_force=FORCE_NOISE, noise_response=noise, binary=True
        )
        block, place = divmod(self.number, len(KINDS))
        kind = np.random.default_rng([self.seed, block]).permutation(KINDS)[place]
        return hide(spec, named(str(kind), rng) if self.half else "none")


def written(effect: Effect) -> str:
    """An entry for `effects:` of a study."""
    true = effect.truth()
    kind = _NAMES.get(effect.kind, effect.kind)
    return f"  - {json.dumps({'kind': kind, **_WRITTEN[effect.kind](true)})}"


def run(arm: Drawn, repeats: Sequence[int], kept: Path, workers: int) -> list[Row]:
    """The tests of an arm with these numbers, each added to the file `kept` once it is done."""
    spec, rows, began = arm.spec, [], processor()
    with tempfile.TemporaryDirectory() as name:
        folders = [Path(name) / f"test{repeat}" for repeat in range(max(repeats) + 1)]
        generate_recorded(spec, folders)
        simulated = (processor() - began) / len(repeats)
        for repeat in repeats:
            began = processor()
            try:
                outcome = tested(folders[repeat], [written(effect) for effect in spec.effects], workers)
            except Exception as error:  # a test that fails is counted, and the others go on
                outcome = {"error": f"{type(error).__name__}: {error}", "additions": [], "gap_first": None}
            rows.append(
                {
                    "test": [arm.seed, arm.half, arm.number, repeat],
                    "arm": f"{arm.make} {spec.seed}",
                    "case": spec.case,
                    "noise": spec.noise_response,
                    **outcome,
                    "seconds": processor() - began,
                    "seconds_simulated": simulated,
                }
            )
            with kept.open("a") as file:
                file.write(json.dumps(rows[-1]) + "\n")
    return rows


def tested(case: Path, effects: list[str], workers: int) -> Row:
    """One discovery with a study that has these effects: gap of the first fit, and each addition with the gap
    before and after it.
    """
    with tempfile.TemporaryDirectory() as folder:
        problem = load_problem(read_study(config_of(case, Path(folder), extra="\n".join(effects))))
        with Workers(problem, workers) as at_work:
            found = discover(problem, at_work)
    gaps = [found.first.gap, *(option.model.gap for option in found.added)]
    return {
        "error": found.first.failure,
        "gap_first": found.first.gap,
        "gap_validation": found.first.gap_validation,
        "additions": [
            {"sentence": option.effect.sentence(), "before": before, "after": after}
            for option, before, after in zip(found.added, gaps, gaps[1:], strict=False)
        ],
    }


def processor() -> float:
    """Seconds of the processor that this process and its ended children took."""
    return sum(os.times()[:4])


def remembered(kept: Path) -> list[Row]:
    """The rows of earlier runs; one that was cut short is taken out of the file, so that it is done anew."""
    lines = kept.read_text().splitlines(keepends=True) if kept.exists() else []
    if lines and not lines[-1].endswith("\n"):
        lines.pop()
        kept.write_text("".join(lines))
    return [json.loads(text) for text in lines]


def line(row: Row) -> str:
    """One test in a row."""
    _, half, number, repeat = row["test"]
    gap = "none" if row["gap_first"] is None else f"{row['gap_first']:.3f}"
    error = " ERROR" if row["error"] else ""
    return (
        f"{HALVES[half]:20s} {number:3d}.{repeat} {row['arm']:16s} {row['case']:16s} noise {row['noise']:<5g}"
        f" first gap {gap}, {len(row['additions'])} added, {row['seconds']:.1f} s{error}"
    )


def table(rows: Sequence[Row]) -> str:
    """Both halves in a row each; then every addition, error and first fit that did not come to the noise."""
    found = ["half | tests | additions | errors | first gap, median and largest | processor seconds a test"]
    for half, name in enumerate(HALVES):
        own = [row for row in rows if row["test"][1] == half]
        gaps = [row["gap_first"] for row in own if row["gap_first"] is not None] or [float("nan")]
        seconds = [row["seconds"] + row["seconds_simulated"] for row in own] or [float("nan")]
        found.append(
            f"{name} | {len(own)} | {sum(len(row['additions']) for row in own)} |"
            f" {sum(bool(row['error']) for row in own)} | {np.median(gaps):.3f}, {max(gaps):.3f} |"
            f" {np.mean(seconds):.1f}"
        )
    for row in rows:
        for one in row["additions"]:
            found.append(f"{line(row)}: {one['sentence']}, gap {one['before']:.3f} -> {one['after']:.3f}")
        if row["error"]:
            found.append(f"{line(row)}: {row['error']}")
        elif row["gap_first"] > _NEAR:
            found.append(f"{line(row)}: the first fit is not near the noise")
    return "\n".join(found)


def main() -> None:
    """Run what is not yet in the file, and print the table."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.discovery_nulls", description=__doc__)
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--arms", type=int, default=40, help="in each half")
    parser.add_argument("--repeats", type=int, default=5, help="records of each arm's impacts")
    parser.add_argument("--workers", type=int, default=1, help="processes of each discovery")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="arms side by side")
    parser.add_argument("--out", type=Path, help="file of the rows")
    given = parser.parse_args()
    kept = given.out or Path(tempfile.gettempdir()) / f"discovery_nulls_{given.seed}.jsonl"
    done = {tuple(row["test"]): row for row in remembered(kept)}
    arms = [Drawn(given.seed, half, number) for number in range(given.arms) for half in (0, 1)]
    tests = {arm: [(given.seed, arm.half, arm.number, n) for n in range(given.repeats)] for arm in arms}
    with ProcessPoolExecutor(given.jobs) as pool:
        running = [
            pool.submit(run, arm, missing, kept, given.workers)
            for arm in arms
            if (missing := [test[3] for test in tests[arm] if test not in done])
        ]
        for arm_done in as_completed(running):
            for row in arm_done.result():
                done[tuple(row["test"])] = row
                print(line(row), flush=True)
    print(table([done[test] for half in (0, 1) for arm in arms if arm.half == half for test in tests[arm]]))


if __name__ == "__main__":
    main()

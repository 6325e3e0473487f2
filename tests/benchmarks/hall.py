"""Score `identify discover` on production-hall tests with many small effects: python -m
tests.benchmarks.hall FOLDER [--cases ...] [--json OUT].

A case is a folder as of `tests.benchmarks.discovery` with NAME.heldout.npz beside it: noise-free
accelerance H0, H1 ... (lines, outputs, inputs) at postures q0, q1 ... (the first as measured, the others
unseen), at lines f, as an exponential window of the decay in test.json leaves them (at s = decay + j omega).
Scored at unseen postures: median over FRFs of the area between model and truth over that below the truth,
and the largest relative error of the first five natural frequencies of the model, each beside the nearest of
the truth that no other has: what hangs on the robot, and the model lacks, has modes of its own.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
import scipy.optimize

from identify.core.arrays import Array, Complex
from identify.discovery.loop import Discovery, discover
from identify.discovery.workers import Workers
from identify.fitting.selection.workbench import Story
from identify.model.modes import complex_modes
from identify.vibration.costs.target import FrfTarget
from identify.vibration.problem import Problem, load_problem, uncertain_as, with_effects
from identify.vibration.study import read_study
from tests.benchmarks.discovery import labels, stiffness_held, true_labels
from tests.hidden import config_of
from tests.shared import ROOT

_FIRST, _OVERDAMPED = 5, 0.5
_MOST, _AMONG, _LIKELY = 3, 5, 0.5


def main() -> None:
    """Run all cases of a folder, or those named, and print how each went."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.hall", description=__doc__)
    parser.add_argument("folder", type=Path, nargs="?", default=ROOT / "hall")
    parser.add_argument("--json", type=Path, help="also write the scores to this file")
    parser.add_argument("--cases", nargs="+", help="only these")
    parser.add_argument("--uncertainty", choices=("careful", "typical"), help="stated in every study")
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--time", type=float, default=np.inf, help="s after which nothing new is begun")
    given = parser.parse_args()
    names = given.cases or sorted(
        p.name.removesuffix(".heldout.npz") for p in given.folder.glob("*.heldout.npz")
    )
    scores = {}
    for name in names:
        scores[name] = score(given.folder / name, given.workers, given.uncertainty, given.time)
        print(json.dumps({name: scores[name]}, indent=1), flush=True)
        if given.json:
            given.json.write_text(json.dumps(scores, indent=1))


def score(case: Path, workers: int, uncertainty: str | None, limit: float) -> dict[str, Any]:
    """One case: gaps, errors at unseen postures, drives in their intervals, what was named, seconds."""
    truth = json.loads(case.with_name(f"{case.name}.truth.json").read_text())
    extra = f"uncertainty: {uncertainty}" if uncertainty else ""
    with tempfile.TemporaryDirectory() as folder:
        config = config_of(case, Path(folder), extra=extra)
        began, story = time.perf_counter(), Story(until=time.monotonic() + limit)
        problem = load_problem(read_study(config))
        with Workers(problem, workers) as at_work:
            found = discover(problem, at_work, story)
        seconds = time.perf_counter() - began
        errors = unseen(case, config, found)
    held, told, doubted = stiffness_held(found.problem, found, truth["k"])
    return {
        "importance": truth["importance"],
        **_against(truth, found),
        "named": {option.effect.sentence(): round(option.gain.log_odds, 1) for option in found.added},
        "gap": [round(one, 3) for one in (found.first.gap, found.final.gap)],
        "gap_validation": [round(one, 3) for one in (found.first.gap_validation, found.final.gap_validation)],
        **errors,
        "stiffness_held": [held, told, doubted],
        "stiffness_error_percent": _stiffness_errors(found, truth["k"]),
        "seconds": round(seconds, 1),
    }


def _against(truth: dict[str, Any], found: Discovery) -> dict[str, Any]:
    """Of the most important true effects, how many are among the first named; and what is named falsely:
    where importance is told effect by effect.  Named is what is likelier there than not.
    """
    importance: dict[str, float] = truth["importance"]
    if not set(importance) <= {label for effect in truth["effects"] for label in true_labels(effect)}:
        return {}
    likely = [one for one, p in zip(found.added, found.probabilities, strict=True) if p > _LIKELY]
    named = [set(labels(found.problem, option.effect)) for option in likely]
    first = set[str]().union(*named[:_AMONG])
    return {
        "three most important among first five": sum(one in first for one in list(importance)[:_MOST]),
        "false": [
            option.effect.sentence()
            for option, told in zip(likely, named, strict=True)
            if not told <= set(importance)
        ],
        "not named": [one for one in importance if one not in set[str]().union(*named)],
    }


def _stiffness_errors(found: Discovery, true: list[float]) -> list[float]:
    names = [f"joint{n}.rz.stiffness" for n in range(1, len(true) + 1)]
    return [round(100 * (found.final.values[name] / k - 1), 2) for name, k in zip(names, true, strict=True)]


def unseen(case: Path, config: Path, found: Discovery) -> dict[str, Any]:
    """Errors of the model at postures that no data were given for, without faults of the measurement."""
    heldout = np.load(case.with_name(f"{case.name}.heldout.npz"))
    decay = json.loads((case / "test.json").read_text())["exponential_window_decay_per_s"]
    areas, frequencies = list[float](), list[float]()
    for number in range(3, 1 + max(int(name[1:]) for name in heldout if name[0] == "q")):
        problem = _at_posture(config, heldout[f"q{number}"], found)
        target, values = problem.measurements[0].target, problem.initial
        assert isinstance(target, FrfTarget)
        there, own = target.at(values)
        mass, damping, stiffness = there.system.matrices(own)
        true = heldout[f"H{number}"]
        s = decay + 2j * np.pi * heldout["f"]
        h = _accelerance(there, (mass, damping, stiffness), s)
        areas.append(float(np.nanmedian(np.sum(np.abs(h - true), axis=0) / np.sum(np.abs(true), axis=0))))
        modes = complex_modes(mass, damping, stiffness)
        found_hz = modes.frequency_hz[modes.damping_ratio < _OVERDAMPED][:_FIRST]
        frequencies.append(_off(found_hz, heldout[f"modes{number}"][0]))
    return {
        "unseen_area_percent": [round(100 * one, 2) for one in areas],
        "unseen_frequency_percent": [round(100 * one, 3) for one in frequencies],
    }


def _off(found_hz: Array, true_hz: Array) -> float:
    """The largest relative error where each frequency found has one of the true ones to itself."""
    errors = np.abs(found_hz[:, None] / true_hz - 1)
    return float(errors[scipy.optimize.linear_sum_assignment(errors)].max())


def _at_posture(config: Path, posture: Array, found: Discovery) -> Problem:
    """The model that was found at another posture, read exactly."""
    file = read_study(config)
    first = file.study.measurements[0].model_copy(update={"posture_deg": [float(q) for q in posture]})
    study = file.study.model_copy(update={"measurements": [first]})
    final = found.final
    values = {name: 0.0 if name.startswith("posture") else one for name, one in final.values.items()}
    problem = load_problem(file.model_copy(update={"study": study}))
    return with_effects(uncertain_as(problem, found.problem), final.task.effects, values)


def _accelerance(target: FrfTarget, matrices: tuple[Array, Array, Array], s: Complex) -> Complex:
    """(lines, outputs, inputs) of the structure at s (lines,), as sensors without faults would see it."""
    mass, damping, stiffness = matrices
    s = s[:, None, None]
    moved = np.linalg.solve(s**2 * mass + s * damping + stiffness, target.force.astype(complex))
    return np.asarray(s**2 * (target.out[: len(target.data.outputs)] @ moved))


if __name__ == "__main__":
    main()

"""Where the screen of places looks first in hammer tests with something hidden: python -m
tests.benchmarks.places FOLDER [--cases NAME ...].

The present model is fitted, then every place gets its semi-parametric fit; printed are the gap before, the
gap that the right place leaves and its rank, the best of the others, and seconds of processor time.  The
truth is read for scoring only.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from pathlib import Path
from typing import Any

from threadpoolctl import threadpool_limits

from identify.discovery.decimated import decimated
from identify.discovery.places.catalogue import places_of
from identify.discovery.places.screen import PlaceFit, PlaceFitter, screen_places
from identify.discovery.present import present_model
from identify.discovery.task import Trial
from identify.discovery.workers import Workers
from identify.model.effects.joint_compliance import CLASSES
from identify.model.effects.place import Attachment, Beside, Column, Place, Release, Rows
from identify.vibration.problem import Problem, load_problem
from identify.vibration.study import read_study
from tests.hidden import config_of
from tests.shared import ROOT


def main() -> None:
    """Score the cases of a folder."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.places", description=__doc__)
    parser.add_argument("folder", type=Path, nargs="?", default=ROOT / "hidden")
    parser.add_argument("--cases", nargs="+", help="only these")
    given = parser.parse_args()
    names = given.cases or sorted(
        p.name.removesuffix(".truth.json") for p in given.folder.glob("*.truth.json")
    )
    with threadpool_limits(1):
        for name in names:
            print(line(given.folder / name), flush=True)


def line(case: Path) -> str:
    """One case in a row."""
    truth = json.loads(case.with_name(f"{case.name}.truth.json").read_text())["effects"]
    problem, present = fitted(case)
    began = time.process_time()
    ranked = screened(problem, present)
    seconds = time.process_time() - began
    right = [n for n, one in enumerate(ranked) if any(is_at(effect, one.place, problem) for effect in truth)]
    other = next(one for n, one in enumerate(ranked) if n not in right)
    left = f"{ranked[right[0]].fit.gap:.2f}, rank {right[0] + 1}" if right else "not a place"
    best = f"{other.fit.gap:.2f} ({other.place.sentence()})"
    return f"{case.name:24s} gap {present.gap:6.2f}; right place {left}; next {best}; {seconds:.1f} s"


def fitted(case: Path) -> tuple[Problem, Trial]:
    """The study of a case and its present model."""
    with tempfile.TemporaryDirectory() as folder:
        problem = load_problem(read_study(config_of(case, Path(folder))))
    with Workers(problem, 1) as workers:
        return problem, present_model(problem, workers)


def screened(problem: Problem, present: Trial) -> list[PlaceFit]:
    """All places from the present model."""
    thin = decimated(problem)
    return screen_places(places_of(thin), PlaceFitter(thin), problem.at(present.values))


def is_at(effect: dict[str, Any], place: Place, problem: Problem) -> bool:
    """Whether a hidden effect sits at a place."""
    kind = effect["kind"]
    if kind in ("joint-compliance", "base-compliance"):
        body = "base" if kind[0] == "b" else f"joint{effect['joint']}"
        axes = effect.get("axes", ["rx", "ry"]) if kind[0] == "b" else CLASSES[effect["axes_class"]]
        return isinstance(place, Release) and set(place.coordinates) == {f"{body}.{axis}" for axis in axes}
    if kind == "link-flexibility":
        return isinstance(place, Release) and place.coordinates[0].startswith(f"{effect['link']}.")
    if kind in ("joint-friction", "hardening-stiffness"):
        return place == Beside((f"joint{effect['joint']}.rz",))
    if "link" in effect:
        return isinstance(place, Attachment) and place.link == effect["link"]
    if "point" in effect:
        return isinstance(place, Rows) and place.name == effect["point"]
    return place == Column()


if __name__ == "__main__":
    main()

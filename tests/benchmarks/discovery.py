"""Score `identify discover` on a folder of hammer tests with something hidden: python -m
tests.benchmarks.discovery FOLDER [--json OUT].

A case is a folder NAME with robot.urdf, points.csv, test.json and FRF files, beside NAME.truth.json, which is
read for scoring only. Postures named posture3 are for validation.  Right means: the kinds, places and classes
of axes of the truth, and nothing else.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from identify.core.parameters import Scale
from identify.discovery.curves import acting, curve_of, wanted
from identify.discovery.loop import Discovery, discover
from identify.discovery.workers import Workers
from identify.fitting.selection.workbench import Story
from identify.model.effects.base import Effect
from identify.model.effects.joint_compliance import CLASSES
from identify.robot.posture import at_posture
from identify.vibration.intervals import with_left_open
from identify.vibration.problem import Problem, load_problem, with_effects
from identify.vibration.study import read_study
from identify.vibration.uncertainty import uncertainty
from tests.benchmarks.measured_curve import held
from tests.generator.rigid import frame_with_z
from tests.hidden import config_of
from tests.shared import ROOT

_BASE = {"rx": "rocking", "ry": "rocking", "rz": "turning", "tx": "sliding", "ty": "sliding", "tz": "lifting"}
_ALSO = {"turned-axes": "sensor-rotation", "held-rotor": "joint-relaxation"}
"""Other words for the same thing: a rotor that is held relaxes its drive, which a light one cannot be told
from.
"""


def main() -> None:
    """Run all cases of a folder, or those named, and print how each went."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.discovery", description=__doc__)
    parser.add_argument("folder", type=Path, nargs="?", default=ROOT / "hidden")
    parser.add_argument("--json", type=Path, help="also write the scores to this file")
    parser.add_argument("--cases", nargs="+", help="only these")
    parser.add_argument("--uncertainty", choices=("careful", "typical"), help="stated in every study")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    given = parser.parse_args()
    names = given.cases or sorted(
        path.name.removesuffix(".truth.json") for path in given.folder.glob("*.truth.json")
    )
    scores = {}
    for name in names:
        scores[name] = score(given.folder / name, given.workers, given.uncertainty)
        print(line(name, scores[name]), flush=True)
        if given.json:
            given.json.write_text(json.dumps(scores, indent=1))
    print(total(scores))


def score(case: Path, workers: int, uncertainty: str | None = None) -> dict[str, Any]:
    """One case: what was hidden, what was named, right or wrong, gaps before and after, seconds."""
    truth = json.loads(case.with_name(f"{case.name}.truth.json").read_text())
    with tempfile.TemporaryDirectory() as folder:
        began = time.perf_counter()
        problem = load_problem(
            read_study(
                config_of(case, Path(folder), extra=f"uncertainty: {uncertainty}" if uncertainty else "")
            )
        )
        with Workers(problem, workers) as at_work:
            found = discover(problem, at_work, Story())
        seconds, problem = time.perf_counter() - began, found.problem
    held, told, doubted = stiffness_held(problem, found, truth.get("k", []))
    inside = _inside(problem, found, truth["effects"])
    hidden, named = (
        {label for effect in truth["effects"] for label in true_labels(effect)},
        _named(problem, found),
    )
    if any(effect["kind"] == "friction-springs" for effect in truth["effects"]):
        named |= _acting(problem, found)
    return {
        "truth": sorted(hidden),
        "named": sorted(named),
        "sentences": [option.effect.sentence() for option in found.added],
        "probabilities": [round(one, 6) for one in found.probabilities],
        "true": [set(labels(problem, option.effect)) <= hidden for option in found.added],
        "right": hidden == named,
        "false_additions": len(named - hidden),
        "gap_before": found.first.gap,
        "gap_after": found.final.gap,
        "gap_validation_before": _number(found.first.gap_validation),
        "gap_validation_after": _number(found.final.gap_validation),
        "stiffness_held": held,
        "stiffness_told": told,
        "intervals_doubted": doubted,
        "lines_held": None if inside is None else inside[0],
        "curve_error": None if inside is None else inside[1],
        "seconds": seconds,
    }


def _acting(problem: Problem, found: Discovery) -> set[str]:
    """The joint at which the program says that something acts that depends on amplitude and has no name."""
    name = acting(problem, found)
    return {f"joint-friction {name.partition('.')[0].removeprefix('joint')}"} if name else set()


def _inside(problem: Problem, found: Discovery, effects: list[dict[str, Any]]) -> tuple[float, float] | None:
    """Of a joint whose law no effect has: share of the real and imaginary parts of its measured curve whose
    95 % band holds the truth, and the median relative error; None where it has no curve.
    """
    hidden = next((effect for effect in effects if effect["kind"] == "relaxing-joint"), None)
    if hidden is None:
        return None
    name = _coordinate(problem, hidden)
    for table in (curve_of(problem, one) for one in wanted(problem, found)):
        if table is not None and name in table.entries:
            n = table.entries.index(name)
            std = table.std_real[:, n] + 1j * table.std_imag[:, n]
            decay = problem.measurements[0].target.data.window_decay_per_s  # type: ignore[union-attr]
            return held(table.frequency_hz, table.value[:, n], std, hidden, decay)
    return None


def _coordinate(problem: Problem, hidden: dict[str, Any]) -> str:
    """The coordinate nearest to the first axis across a joint's own, as the generator has it."""
    joint = problem.robot.joints[hidden["joint"] - 1]
    _, turn = at_posture(problem.robot, problem.measurements[0].given.posture).frames[joint.child]
    along = turn[:3, :3] @ frame_with_z(joint.axis)[:, 0]
    return f"joint{hidden['joint']}.{('rx', 'ry')[int(np.argmax(np.abs(along[:2])))]}"


def stiffness_held(problem: Problem, found: Discovery, stiffness: list[float]) -> tuple[int, int, bool]:
    """How many true stiffnesses of joints lie within their 95 % intervals, of how many that are told, and
    whether the program says that its intervals cannot be relied on.
    """
    model = with_effects(problem, found.final.task.effects, found.final.values)
    scale = Scale(model.parameters)
    trusted = uncertainty(model.targets(), scale, model.initial)
    trusted = with_left_open(model, trusted, model.initial, found.unnamed)
    names = [model.parameters[number].name for number in scale.free if number < model.size]
    held = told = 0
    for number, true in enumerate(stiffness, start=1):
        name = f"joint{number}.rz.stiffness"
        if name in names and trusted.status[names.index(name)] == "determined":
            row = names.index(name)
            told, held = told + 1, held + bool(trusted.low[row] <= true <= trusted.high[row])
    return held, told, any("cannot be relied on" in note for note in trusted.notes)


def line(name: str, s: dict[str, Any]) -> str:
    """One case in a row."""
    validation = " -> ".join(
        "none" if s[key] is None else f"{s[key]:.2f}"
        for key in ("gap_validation_before", "gap_validation_after")
    )
    result = "right" if s["right"] else "WRONG"
    band = "" if s["lines_held"] is None else f" band holds {s['lines_held']:.1%} of the curve,"
    return (
        f"{name:26s} {result}  truth: {', '.join(s['truth']) or 'nothing':44s} named:"
        f" {', '.join(s['named']) or 'nothing':44s} gap {s['gap_before']:.2f} -> {s['gap_after']:.2f},"
        f" validation {validation}, {s['false_additions']} false,{band} stiffness {s['stiffness_held']} of"
        f" {s['stiffness_told']} held{' (doubted)' if s['intervals_doubted'] else ''}, {s['seconds']:.1f} s"
    )


def total(scores: dict[str, dict[str, Any]]) -> str:
    """All cases in a row."""
    right, false = (
        sum(s["right"] for s in scores.values()),
        sum(s["false_additions"] for s in scores.values()),
    )
    slowest = max((s["seconds"] for s in scores.values()), default=0.0)
    held, told, doubted_held, doubted_told = (
        sum(s[key] for s in scores.values() if s["intervals_doubted"] == doubted)
        for doubted in (False, True)
        for key in ("stiffness_held", "stiffness_told")
    )
    return (
        f"{right} of {len(scores)} right, {false} false additions, {held} of {told} stiffnesses within their"
        f" intervals, {doubted_held} of {doubted_told} where the program says that these cannot be relied on,"
        f" slowest {slowest:.1f} s"
    )


def _number(value: float) -> float | None:
    return None if math.isnan(value) else value


def true_labels(effect: dict[str, Any]) -> Iterator[str]:
    """Labels of a hidden effect: its kind with the place and the class of its axes."""
    kind = _ALSO.get(effect["kind"], effect["kind"])
    if kind == "base-compliance":
        yield from {f"{kind} {_BASE[axis]}" for axis in effect.get("axes", ["rx", "ry"])}
    elif kind == "joint-compliance":
        yield f"{kind} {effect['joint']} {effect['axes_class']}"
    elif kind == "relaxing-joint":  # no effect of the catalogue: right is a measured law at that joint
        yield f"measured-impedance joint{effect['joint']}"
    elif kind == "friction-springs":  # likewise, and not linear: right is dry friction there, or no name
        yield f"joint-friction {effect['joint']}"
    else:
        places = (
            ("point",) if "point" in effect else ("joint", "link", "axis")
        )  # a fault is told by its point
        yield " ".join([kind, *(str(effect[key]) for key in places if key in effect)])


def _named(problem: Problem, found: Discovery) -> set[str]:
    """The same labels of what was found."""
    return {label for option in found.added for label in labels(problem, option.effect)}


def labels(problem: Problem, effect: Effect) -> Iterator[str]:
    """The same labels of an effect of the catalogue."""
    data = effect.model_dump(mode="json")
    if effect.kind == "base-compliance":
        yield from {f"{effect.kind} {_BASE[axis]}" for axis in data["axes"]}
    elif effect.kind == "joint-compliance":
        classes = {name for name, axes in CLASSES.items() if set(axes) & set(data["axes"])}
        yield from {f"{effect.kind} {joint} {name}" for joint in data["joints"] for name in classes}
    elif effect.kind == "measured-impedance":
        yield from {f"{effect.kind} {name.partition('.')[0]}" for name in data["at"]}
    elif "joints" in data:
        kind = "joint-relaxation" if data.get("holding_stiffness") else effect.kind
        yield from {f"{kind} {joint}" for joint in data["joints"]}
    else:
        point = _point(problem, data)
        places = [data.get("link"), data.get("axis")] if point is None else [point]
        yield " ".join([effect.kind, *(str(place) for place in places if place is not None)])


def _point(problem: Problem, data: dict[str, Any]) -> str | None:
    """Name of the point that an effect of the measurement acts on."""
    place = data.get("channel", data.get("point"))
    if place is None:
        return None
    node = str(place).split(":")[0]
    return problem.points[int(node)].name if node.isdigit() and int(node) in problem.points else node


if __name__ == "__main__":
    main()

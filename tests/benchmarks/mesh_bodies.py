"""Bodies out of meshes against robots whose bodies are known.

`python -m tests.benchmarks.mesh_bodies spread FOLDER...`: how far masses, inertias and centres are from the
true ones, of every description below the folders whose bodies nobody doubts.

`python -m tests.benchmarks.mesh_bodies journey FILE [--argument NAME=VALUE] [--seed N]`: a hammer test of the
true robot is simulated and fitted with bodies out of its meshes and `uncertainty: meshes`.  The robot is told
the mass of what moves, or of all of it where the file knows its base.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from identify.core.arrays import Array
from identify.core.errors import InputError
from identify.fitting.fit import fit
from identify.robot.description import Link, Robot
from identify.robot.mesh_body import Wanted, made_bodies, shapes
from identify.robot.plausible import masses
from identify.robot.urdf import read_urdf
from identify.vibration.elsewhere import gap_elsewhere
from identify.vibration.intervals import intervals
from identify.vibration.nuisances.meshes import LIGHT
from identify.vibration.plan import fit_plan
from identify.vibration.problem import load_problem
from identify.vibration.study import read_study
from identify.vibration.uncertainty import gap
from tests.benchmarks.descriptions import descriptions, read
from tests.generator import arm as made
from tests.generator.dirt import Dirt, soil
from tests.generator.generate import generate
from tests.generator.rigid import Inertia, to_rpy
from tests.generator.spec import TestSpec
from tests.generator.tree import at_posture
from tests.hidden import config_of

STORED = Path(__file__).parent / "results"
_HZ = np.array([[11, 20], [12, 22], [18, 34], [38, 80], [32, 60], [55, 120]], dtype=float)
"""Frequencies of each joint alone, all others locked."""
_DIRT = Dirt(mass=0.0, centre=0.0, inertia=0.0, place=0.005, turn=1.5, gain=0.02, impact=1.5)
_SOLID = 1e-4


def told_mass(robot: Robot) -> Wanted:
    """What is known of its mass."""
    base = robot.links[0].mass
    total = base + sum(link.mass for link in robot.links[1:])
    return Wanted(total, None if base else 0.0, everything=True)


def spread(folders: list[Path]) -> dict[str, Any]:
    """Quantiles of the differences from true bodies, of ordinary and of light links."""
    rows: list[tuple[bool, float, Array, Array]] = []
    seen, robots = set(), []
    for folder in folders:
        for path in descriptions(folder):
            robot, _ = read(path)
            if (
                robot is None
                or len(robot.joints) < 6
                or any(not np.any(one.inertia) for one in robot.links[1:])
            ):
                continue
            key = tuple(round(link.mass, 2) for link in robot.links[1:])
            if key in seen or masses(robot).doubts:
                continue
            try:
                bodies = {body.name: body for body in made_bodies(robot, told_mass(robot))}
            except InputError:
                continue
            seen.add(key)
            robots.append(path.name)
            moving = sum(link.mass for link in robot.links[1:])
            rows += [_differences(link, bodies[link.name], moving) for link in robot.links[1:]]
    found = {}
    for name, light in (("ordinary", False), ("light", True)):
        own = [row for row in rows if row[0] == light]
        parts = (
            np.array([row[1] for row in own]),
            *(np.concatenate([row[k] for row in own]) for k in (2, 3)),
        )
        found[name] = {"links": len(own)} | {
            what: {"median": _short(np.median(x)), "within_68": _short(np.quantile(abs(x), 0.68))}
            for what, x in zip(("ln_mass", "ln_moments", "centre_over_gyration"), parts, strict=True)
        }
    return {"robots": robots, **found}


def _differences(true: Link, body: Link, moving: float) -> tuple[bool, float, Array, Array]:
    own, other = (np.linalg.eigvalsh(one.inertia) for one in (true, body))
    kept = own > _SOLID * own[-1]
    gyration = np.sqrt(np.trace(body.inertia) / (2 * body.mass))
    moments = np.log(other[kept] / own[kept])
    return (
        body.mass < LIGHT * moving,
        float(np.log(body.mass / true.mass)),
        moments,
        (body.centre - true.centre) / gyration,
    )


def _short(value: float) -> float:
    return float(f"{value:.3g}")


def arm_of(robot: Robot, seed: int) -> made.Arm:
    """The robot as the simulation has it, with two points on each link and springs."""
    rng = np.random.default_rng([seed, 0x55])
    links = tuple(made.Link(one.name, Inertia(one.mass, one.centre, one.inertia)) for one in robot.links)
    if not robot.links[0].mass:
        links = (made.Link(robot.links[0].name, Inertia(50.0, np.zeros(3), np.eye(3))), *links[1:])
    joints = tuple(
        made.Joint(j.name, j.origin[:3, 3], to_rpy(j.origin[:3, :3]), j.axis) for j in robot.joints
    )
    points, surfaces = [], shapes(robot)
    for link in robot.links[1:]:
        corners = surfaces[link.name].mesh.vertices
        for _ in range(1 if link is robot.links[-1] else 2):
            place = corners[rng.integers(len(corners))]
            points.append(made.Point(len(points) + 1, f"p{len(points) + 1}", link.name, np.round(place, 4)))
    low, high = (np.degrees([getattr(j, end) for j in robot.joints]) for end in ("lower", "upper"))
    middle = np.clip((np.maximum(low, -120) + np.minimum(high, 120)) / 2, -90, 90)
    home = np.round(middle + rng.uniform(-20, 20, len(joints)), 1)
    plain = made.Arm(robot.name, links, joints, tuple(points), home, np.ones(6), np.zeros(6))
    tree = at_posture(plain, home)
    inertia = np.array(
        [tree.outboard_about(j.child, k.axis) for j, k in zip(robot.joints, joints, strict=True)]
    )
    size = (1.8 / max(robot.stretched(1), 0.3)) ** 0.3
    speed = 2 * np.pi * size * np.exp(rng.uniform(*np.log(_HZ).T))
    return replace(
        plain, stiffness=inertia * speed**2, damping=2 * rng.uniform(0.03, 0.07, 6) * inertia * speed
    )


def journey(path: Path, arguments: dict[str, str], seed: int) -> dict[str, Any]:
    """A fit with bodies out of meshes: gaps, and each stiffness with its interval."""
    robot = read_urdf(path, any_bodies=True, arguments=arguments)
    arm = arm_of(robot, seed)
    bodies = {body.name: body for body in made_bodies(robot, told_mass(robot))}
    spec = soil(TestSpec(arm=arm, seed=seed, binary=True, oversampling=4), _DIRT)
    known = [bodies.get(link.name, link) for link in robot.links[1:]]
    links = tuple(made.Link(one.name, Inertia(one.mass, one.centre, one.inertia)) for one in known)
    spec = replace(spec, told=replace(arm, links=(arm.links[0], *links)))
    begun = time.monotonic()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        generate(spec, folder / "case")
        config = config_of(folder / "case", folder, extra="uncertainty: meshes")
        text = config.read_text().replace("[1.0e+2, 1.0e+9]", "[1.0e-3, 1.0e+9]")
        config.write_text(text.replace("[1.0e-3, 1.0e+6]", "[1.0e-7, 1.0e+6]"))
        problem = load_problem(read_study(config))
        outcome = fit(fit_plan(problem))
        trusted = intervals(problem, outcome.values)
        targets = problem.targets()
        held, rows = 0, {}
        for number, parameter in enumerate(p for p in problem.of_effects if p.name.endswith("stiffness")):
            place = problem.parameters.index(parameter)
            column = [p.name for p in problem.of_effects if p.free].index(parameter.name)
            off = float(np.log(outcome.values[place] / arm.stiffness[number]))
            std = float(trusted.std[column])
            held += abs(off) <= 1.96 * std
            rows[parameter.name] = [round(off, 4), round(std, 4)]
        errors = outcome.values[problem.size :]
        return {
            "file": path.name,
            "gap": _short(gap(targets, outcome.values)),
            "gap_validation": _short(gap_elsewhere(problem, trusted, outcome.values)),
            "errors_rms": _short(float(np.sqrt(np.mean(errors**2)))),
            "held": held,
            "of": len(rows),
            "ln_error_and_std": rows,
            "seconds": round(time.monotonic() - begun),
        }


def main(words: list[str]) -> None:
    """Do what is asked for, print it, and store it."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.mesh_bodies")
    parser.add_argument("what", choices=("spread", "journey"))
    parser.add_argument("paths", nargs="+", type=Path)
    parser.add_argument("--argument", action="append", default=[])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--write", action="store_true", help="store the result")
    told = parser.parse_args(words)
    if told.what == "spread":
        found: Any = spread(told.paths)
        print(json.dumps(found, indent=1))
    else:
        given = dict(one.split("=", 1) for one in told.argument)
        found = []
        for path in told.paths:
            found.append(journey(path, given, told.seed))
            print(json.dumps(found[-1]), flush=True)
    if told.write:
        (STORED / f"mesh_bodies_{told.what}.json").write_text(json.dumps(found, indent=1) + "\n")


if __name__ == "__main__":
    main(sys.argv[1:])

"""The walk of a new user: from a maker's description without bodies, the mass of its data sheet and one file
of an analyser to the name of what is missing, with the commands that anybody has.

    python -m tests.benchmarks.walk FILE.xacro --mass-kg 54 [--hide base|tilt|none] [--seed N] [--store NAME]

FILE describes a robot with bodies and meshes (STL).  Its bodies are the truth of a simulated hammer test in
which something is hidden, and are then taken out of the description.  The test is one universal file, as
analysers write it: nodes on surfaces that nothing covers, in the analyser's own frame and in mm, triaxial
sensors with their axes along the surface and its normal, as coordinate systems (datasets 164, 18, 15), and
FRFs.  Joint angles, places, directions and gains are off as in an ordinary laboratory.

Told of each walk: every command, every value that was typed, every line of a file that was edited, what was
printed, seconds, and whether what was hidden is named.
"""

from __future__ import annotations

import argparse
import json
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from identify.model.effects.base import parse_effect
from identify.results.discovery import DiscoveryResult
from identify.results.file import read
from identify.results.fit import FitResult
from identify.robot.description import Robot
from identify.robot.read import read_robot
from identify.robot.urdf import read_urdf
from identify.robot.visual import by_link, looks
from identify.vibration.study import read_study
from identify.vibration.study_points import points_of
from tests.benchmarks.mesh_bodies import arm_of
from tests.benchmarks.registration import Arm, Nodes, draw_nodes, placed, rotation
from tests.generator import arm as made
from tests.generator.effect import Effect
from tests.generator.generate import generate
from tests.generator.rigid import Array, box, frame_with_z
from tests.generator.spec import TestSpec
from tests.generator.structure import BaseCompliance, JointCompliance
from tests.generator.tree import at_posture

RESULTS = Path(__file__).parent / "results"
PAIR_M, ANGLE_DEG, PLACE_M, TURN_DEG, GAIN, IMPACT_DEG = 0.03, 0.1, 0.003, 1.5, 0.02, 1.5
HIDDEN_HZ = {"base": (16.0, 21.0), "tilt": (30.0, 38.0)}
"""Of what is hidden alone, all else locked, about x and y."""
AVERAGES = 4
FOUND = "found.h5"
_LOOK = re.compile(r"^(error|note|study: (warn|fail)|\w+: (warn|fail))")
"""Lines of a command that a user has to do something about."""


@dataclass(frozen=True)
class Test:
    """What the user has: the xacro, the file of the analyser and what the log of the test says; and what is
    true.
    """

    __test__ = False
    xacro: Path
    uff: Path
    stated_deg: Array
    decay_per_s: float
    spec: TestSpec
    nodes: Nodes
    frames: list[str]

    def pair(self, row: int, chance: np.random.Generator) -> str:
        """A line of points.csv, as roughly as somebody reads it off a drawing."""
        link = self.frames[self.nodes.link[row]]
        x, y, z = self.nodes.local[row] + chance.normal(0, PAIR_M, 3)
        return f"{row + 1},,{link},{x:.2f},{y:.2f},{z:.2f}"


def simulated(source: Path, folder: Path, hide: str, seed: int, count: int) -> Test:
    """The files of a test; source: a description with bodies, which are left out of the copy in folder."""
    chance = np.random.default_rng([seed, 0x3A1C])
    xacro = _without_bodies(source, folder)
    robot = read_urdf(source)
    shape = _looks(robot, source)
    arm = arm_of(_with_real_bodies(robot, shape), seed)
    stated = np.round(arm.home + chance.uniform(-15, 15, 6), 1)
    true = stated + chance.normal(0, ANGLE_DEG, 6)
    nodes = _above_floor(draw_nodes(shape, np.radians(true), 2 * count, chance), count - 1)
    nodes = _with_flange(nodes, arm, true, shape)
    axes = [_axes(normal, chance) for normal in nodes.normal]
    axes[-1] = np.eye(3)
    spec = _spec(arm, nodes, axes, true, hide, seed, chance)
    generate(spec, folder / "case", postures=true[None])
    test = json.loads((folder / "case" / "test.json").read_text())
    uff = folder / "test.uff"
    cloud, systems = _seen(nodes, axes, chance)
    uff.write_bytes(_geometry(cloud, systems).encode() + (folder / "case" / "posture1.uff").read_bytes())
    decay = float(test["exponential_window_decay_per_s"])
    return Test(xacro, uff, stated, decay, spec, nodes, shape.names)


def _looks(robot: Robot, file: Path) -> Arm:
    """The robot as it looks, for nodes on its surfaces."""
    arm = Arm(file, [link.name for link in robot.links], [(j.origin, j.axis) for j in robot.joints])
    for mesh in by_link(robot, looks(robot, 2**31).meshes):
        arm.solids.append(np.zeros((0, 3, 3)) if mesh is None else np.stack(mesh.corners, axis=1))
    return arm


def _with_real_bodies(robot: Robot, shape: Arm) -> Robot:
    """With a box as large as its mesh where a moving link's inertia is a placeholder, wider than the link."""
    links = list(robot.links)
    for number, (link, solid) in enumerate(zip(links, shape.solids, strict=True)):
        if number == 0 or not len(solid):
            continue
        low, high = solid.min(axis=(0, 1)), solid.max(axis=(0, 1))
        gyration = np.sqrt(np.trace(link.inertia) / (2 * link.mass))
        if gyration > np.linalg.norm(high - low) / 2:
            whole = box(link.mass, (low + high) / 2, high - low)
            links[number] = replace(link, centre=whole.centre, inertia=whole.tensor)
    return replace(robot, links=tuple(links))


def _without_bodies(source: Path, folder: Path) -> Path:
    """A copy of the package and those beside it, without any <inertial>."""
    packages = source.resolve().parents[2]
    for package in packages.iterdir():
        if package.is_dir():
            shutil.copytree(package, folder / "robot" / package.name)
    for path in (folder / "robot").rglob("*.xacro"):
        path.write_text(re.sub(r"<inertial>.*?</inertial>", "", path.read_text(), flags=re.DOTALL))
    return folder / "robot" / source.resolve().relative_to(packages)


def _above_floor(nodes: Nodes, count: int) -> Nodes:
    """The first nodes that are not under the foot."""
    rows = np.flatnonzero((nodes.link > 0) | (nodes.normal[:, 2] > -0.5))[:count]
    return Nodes(nodes.link[rows], nodes.local[rows], nodes.base[rows], nodes.normal[rows])


def _with_flange(nodes: Nodes, arm: made.Arm, posture: Array, shape: Arm) -> Nodes:
    """The nodes, with that on the flange which is hit, its axes those of the flange, the last."""
    last = len(shape.names) - 1
    local = next(point.xyz for point in arm.points if point.link == arm.links[last].name)
    pose = shape.poses(np.radians(posture))[last]
    rows = [(nodes.link, [last]), (nodes.local, [local]), (nodes.base, [placed(pose, local)])]
    return Nodes(*(np.concatenate([own, more]) for own, more in [*rows, (nodes.normal, [pose[:3, 2]])]))


def _axes(normal: Array, chance: np.random.Generator) -> Array:
    """A cube glued to a surface, rows in the base's frame: Z along the normal, turned about it anyhow."""
    return np.asarray((frame_with_z(normal) @ rotation(np.eye(3)[2], chance.uniform(-np.pi, np.pi))).T)


def _spec(
    arm: made.Arm,
    nodes: Nodes,
    axes: list[Array],
    posture: Array,
    hide: str,
    seed: int,
    chance: np.random.Generator,
) -> TestSpec:
    """The test as it really is; axes of sensors become those in the frames of their links."""
    tree = at_posture(arm, posture)
    points, sensors = [], {}
    for row, (link, place) in enumerate(zip(nodes.link, nodes.local, strict=True)):
        turn, _ = tree.pose(int(link))
        own = axes[row] @ turn if row < len(axes) - 1 else np.eye(3)
        axes[row] = own @ turn.T
        askew = rotation(chance.normal(size=3), np.radians(TURN_DEG) * abs(chance.normal()))
        name = f"n{row + 1}"
        sensors[name] = np.diag(np.exp(GAIN * chance.normal(size=3))) @ askew @ own
        points.append(made.Point(row + 1, name, arm.links[link].name, place))
    effects = _hidden(arm, posture, hide)
    return TestSpec(
        arm=replace(arm, points=tuple(points)),
        effects=effects,
        seed=seed,
        postures=1,
        binary=True,
        oversampling=4,
        averages=AVERAGES,
        sensors=sensors,
        held_askew_deg=IMPACT_DEG,
    )


def _hidden(arm: made.Arm, posture: Array, hide: str) -> tuple[Effect, ...]:
    if hide == "none":
        return ()
    tree, speed = at_posture(arm, posture), 2 * np.pi * np.array(HIDDEN_HZ[hide])
    part, across = (0, np.eye(3)) if hide == "base" else (2, frame_with_z(arm.joints[1].axis))
    inertia = np.array([tree.outboard(part).about_axis(np.zeros(3), across[:, k]) for k in (0, 1)])
    stiffness, damping = inertia * speed**2, 2 * 0.04 * inertia * speed
    if hide == "base":
        return (BaseCompliance(("rx", "ry"), tuple(stiffness), tuple(damping)),)
    return (JointCompliance(2, "tilt", tuple(stiffness), tuple(damping)),)


def _seen(nodes: Nodes, axes: list[Array], chance: np.random.Generator) -> tuple[Array, list[Array]]:
    """Places and axes in the frame of the analyser, as somebody measured them."""
    turn = rotation(np.array([0.1, -0.05, 1.0]), chance.uniform(-np.pi, np.pi))
    cloud = nodes.base @ turn.T + chance.uniform(-2, 2, 3) + chance.normal(0, PLACE_M, nodes.base.shape)
    return cloud, [own @ turn.T for own in axes]


def _geometry(cloud: Array, systems: list[Array]) -> str:
    """Datasets 164 (mm), 18 and 15; a displacement system for each node."""

    def reals(values: Array) -> str:
        words = [f"{x:13.5E}" for x in values]
        return "".join("".join(words[n : n + 6]) + "\n" for n in range(0, len(words), 6))

    text = f"    -1\n   164\n{4:10d}{'mm (milli-newton)':20s}{2:10d}\n"
    text += f"{1e3:25.17E}{1.0:25.17E}{1.0:25.17E}\n{273.15:25.17E}\n    -1\n    -1\n    18\n"
    for number, (x, _, z) in enumerate(systems, start=1):
        text += f"{100 + number:10d}{0:10d}{0:10d}{1:10d}{1:10d}\nCUBE{number}\n"
        text += reals(np.concatenate([np.zeros(3), x, z]))
    text += "    -1\n    -1\n    15\n"
    for number, place in enumerate(1e3 * cloud, start=1):
        text += f"{number:10d}{0:10d}{100 + number:10d}{1:10d}" + reals(place)
    return text + "    -1\n"


@dataclass
class User:
    """Somebody at a terminal in a folder: what was typed, edited, printed, and how long it took."""

    folder: Path
    typed: list[str] = field(default_factory=list)
    edits: list[str] = field(default_factory=list)
    steps: list[dict[str, Any]] = field(default_factory=list)

    def run(self, command: str, *files: str, **options: str) -> str:
        """A command; every number and word of an option that is no file is a typed value."""
        words = [command, *files]
        for name, value in options.items():
            words += [f"--{name.replace('_', '-')}", value]
            if not (self.folder / value).exists():
                self.typed += value.split(",")
        began = time.monotonic()
        done = subprocess.run(
            [sys.executable, "-m", "identify", *words],
            cwd=self.folder,
            capture_output=True,
            text=True,
            check=False,
        )
        printed = [line for line in (done.stdout + done.stderr).splitlines() if line.strip()]
        self.steps.append(
            {
                "command": " ".join(["identify", *words]),
                "exit": done.returncode,
                "seconds": round(time.monotonic() - began, 1),
                "to_look_at": [line for line in printed if _LOOK.match(line)],
            }
        )
        print(f"$ {self.steps[-1]['command']}\n" + "\n".join(printed), flush=True)
        return "\n".join(printed)

    def edit(self, file: str, changes: Mapping[str, str]) -> None:
        """Values that are put in place of those of keys."""
        path = self.folder / file
        text = path.read_text()
        for key, value in changes.items():
            text, count = re.subn(rf"({key}: )[^ \n]+", rf"\g<1>{value}", text, count=1)
            assert count, f"no {key} in {file}"
            self.typed.append(value)
            self.edits.append(f"{file}: {key}: {value}")
        path.write_text(text)

    def uncomment(self, file: str, key: str) -> None:
        """A line that stands there for it."""
        path = self.folder / file
        text, count = re.subn(rf"(?m)^# ({key}: )", r"\1", path.read_text(), count=1)
        assert count, f"no {key} in {file}"
        path.write_text(text)
        self.edits.append(f"{file}: # {key}")

    def write(self, file: str, lines: list[str]) -> None:
        """A file of commas, each cell of which is typed but the heading."""
        (self.folder / file).write_text("\n".join(lines) + "\n")
        self.typed += [cell for line in lines[1:] for cell in line.split(",") if cell]
        self.edits.append(f"{file}: {len(lines) - 1} lines")


def walk(
    test: Test, folder: Path, mass_kg: float, chance: np.random.Generator, further: Sequence[str]
) -> User:
    """From the files to a study that `check` has nothing against, and further commands."""
    user = User(folder)
    xacro, uff = (str(path.relative_to(folder)) for path in (test.xacro, test.uff))
    posture = ",".join(f"{angle:g}" for angle in test.stated_deg)
    user.run("init", xacro, uff, posture=posture, mass_kg=f"{mass_kg:g}")
    user.edit("config.yaml", {"averages": str(AVERAGES), "window_decay_per_s": f"{test.decay_per_s:g}"})
    said = user.run("check", "config.yaml")
    struck = len(test.nodes.link) - 1
    rows = _triangle(test.nodes) if "pair three nodes" in said else []
    if re.search(rf"[:;] {struck + 1} on ", " ".join(said.split())):
        rows.append(struck)  # where the hammer was, everybody knows
    if rows:
        user.write("pairs.csv", ["node,name,link,x_m,y_m,z_m", *(test.pair(row, chance) for row in rows)])
        user.uncomment("config.yaml", "registration")
        user.run("check", "config.yaml")
    for command in further:
        user.run(*command.split())
    return user


def _triangle(nodes: Nodes) -> list[int]:
    """Three nodes far from each other."""
    first = int(np.argmax(np.linalg.norm(nodes.base - nodes.base.mean(axis=0), axis=1)))
    second = int(np.argmax(np.linalg.norm(nodes.base - nodes.base[first], axis=1)))
    line = nodes.base[second] - nodes.base[first]
    return [
        first,
        second,
        int(np.argmax(np.linalg.norm(np.cross(nodes.base - nodes.base[first], line), axis=1))),
    ]


def story(test: Test, user: User, hide: str) -> dict[str, Any]:
    """What there is to tell of a walk, and whether it came to the right name."""
    told = {
        "hidden": [effect.sentence for effect in test.spec.effects],
        "typed": len(user.typed),
        "values": user.typed,
        "edits": user.edits,
        "minutes": round(sum(step["seconds"] for step in user.steps) / 60, 1),
        "nodes": len(test.nodes.link),
        "right_links": _right_links(test, user.folder / "config.yaml"),
        "steps": [
            {key: step[key] for key in ("command", "exit", "seconds", "to_look_at")} for step in user.steps
        ],
    }
    for path in (user.folder / "reports").glob("*.h5"):
        told |= _fitted(read(path, FitResult), test.spec.arm.stiffness)
    path = user.folder / FOUND
    if not path.exists():
        return told
    found = read(path, DiscoveryResult)
    named = [_place(json.loads(entry)) for entry in found.added.config]
    true = {"none": [], "base": ["base-compliance rx ry"], "tilt": ["joint-compliance 2 rx ry"]}[hide]
    return told | {
        "named": list(found.added.sentence),
        "probability": [round(float(p), 4) for p in found.added.probability],
        "right": sorted(named) == true,
        "gap_before": round(found.before.gap, 2),
        "gap_after": round(found.after.gap, 2),
        "notes": list(found.notes),
    }


def _fitted(result: FitResult, true: Array) -> dict[str, Any]:
    """What `fit` came to, and which drives are within their intervals, where they are determined."""
    table = result.parameters
    rows = [(table.name.index(f"joint{n}.rz.stiffness"), k) for n, k in enumerate(true, start=1)]
    told = [(row, k) for row, k in rows if table.status[row] == "determined"]
    held = [bool(table.low_95[row] <= k <= table.high_95[row]) for row, k in told]
    off = [round(float(np.log(table.value[row] / k)), 3) for row, k in rows]
    return {"gap_of_fit": round(result.gap, 2), "held": f"{sum(held)} of {len(held)}", "ln_error": off}


def _place(entry: dict[str, Any]) -> str:
    """An entry of a config as kind, place and axes, defaults among them."""
    told = parse_effect(entry).model_dump()
    where = " ".join(str(told[key]) for key in ("joint", "link", "point") if told.get(key))
    where = where or " ".join(map(str, told["joints"] if isinstance(told.get("joints"), list) else []))
    return " ".join([told["kind"], *([where] if where else []), *sorted(told.get("axes", []))])


def _right_links(test: Test, config: Path) -> int:
    """How many nodes are on the links that they were drawn on."""
    file = read_study(config)
    points = points_of(file, read_robot(file.study.robot, config.parent))
    links = [points[n + 1].link if n + 1 in points else "" for n in range(len(test.nodes.link))]
    return sum(link == test.frames[k] for link, k in zip(links, test.nodes.link, strict=True))


def main() -> None:
    """Walk, print and store."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.walk", description=__doc__)
    parser.add_argument("file", type=Path)
    parser.add_argument("--mass-kg", type=float, required=True)
    parser.add_argument("--hide", choices=("none", *HIDDEN_HZ), default="base")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--nodes", type=int, default=36)
    parser.add_argument("--time", type=int, default=120, help="seconds of `identify discover`")
    parser.add_argument("--keep", type=Path, help="a folder for the files")
    parser.add_argument("--store", help="name of the walk in tests/benchmarks/results/walk.json")
    parser.add_argument("--until", choices=("check", "fit", "discover", "both"), default="both")
    asked = parser.parse_args()
    commands = ["fit config.yaml", f"discover config.yaml --workers 1 --time {asked.time} --out {FOUND}"]
    further = {"check": [], "fit": commands[:1], "discover": commands[1:], "both": commands}[asked.until]
    with tempfile.TemporaryDirectory() as name:
        folder = asked.keep or Path(name)
        folder.mkdir(parents=True, exist_ok=True)
        test = simulated(asked.file, folder, asked.hide, asked.seed, asked.nodes)
        user = walk(test, folder, asked.mass_kg, np.random.default_rng([asked.seed, 0xFA1]), further)
        told = {"file": asked.file.name, "seed": asked.seed, **story(test, user, asked.hide)}
    print(json.dumps({key: told[key] for key in told if key != "steps"}, indent=1))
    if asked.store:
        path = RESULTS / "walk.json"
        stored = json.loads(path.read_text()) if path.exists() else {}
        path.write_text(json.dumps(stored | {asked.store: told}, indent=1) + "\n")


if __name__ == "__main__":
    main()

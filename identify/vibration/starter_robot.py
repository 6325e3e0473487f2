"""The robot of a new study: read from whatever describes it, with bodies out of its meshes where it has none,
and what is to be known of it.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from identify.core.atomic import write_text
from identify.core.errors import InputError
from identify.core.text import listed
from identify.measured.quality_robot import robot_notes
from identify.robot.chain import Choice
from identify.robot.description import Robot
from identify.robot.mesh_body import Wanted, made_bodies, unknown
from identify.robot.plausible import masses
from identify.robot.read import read_robot, settings_of
from identify.robot.rewrite import with_bodies
from identify.robot.settings import RobotSettings
from identify.robot.urdf import read_urdf
from identify.vibration.nuisances.meshes import made_of_mesh

_HOW = "make them of the meshes: `--mass-kg` with the mass of the data sheet"


@dataclass(frozen=True)
class RobotOptions:
    """What the user says of a robot: which part of the description is the arm, arguments of a xacro, and what
    is wanted of its bodies.
    """

    choice: Choice = field(default_factory=Choice)
    arguments: Mapping[str, str] = field(default_factory=dict)
    wanted: Wanted = field(default_factory=Wanted)

    def words(self) -> list[str]:
        """Which part of which description, as options of a command."""
        pairs = [("--tip", self.choice.tip)] if self.choice.tip else []
        pairs += [("--lock", f"{joint}={value}") for joint, value in self.choice.lock.items()]
        pairs += [("--argument", f"{name}={value}") for name, value in self.arguments.items()]
        return [word for pair in pairs for word in pair]


@dataclass(frozen=True)
class NewRobot:
    """The robot, the file that a config names, further keys of its `robot:`, the value of `uncertainty:` in
    YAML where it follows from how bodies were made, and what is said, in sentences.
    """

    robot: Robot
    file: Path
    keys: str
    uncertainty: str
    said: tuple[str, ...]


def new_robot(file: Path, folder: Path, options: RobotOptions) -> NewRobot:
    """The robot that a file describes, for a config in a folder.

    Where bodies are made, a URDF with them is written there.  InputError for a file that cannot be read, and
    where bodies are missing that cannot be made.
    """
    settings = settings_of(file, options.choice, options.arguments)
    if settings.dh is not None:
        return _read(settings, file, options)
    whole = read_urdf(file, any_bodies=True, choice=options.choice, arguments=options.arguments)
    names = unknown(whole, options.wanted.everything)
    if not names:
        return _read(settings, file, options)
    if options.wanted.mass_kg is None and any(whole.link(name).mass == 0 for name in names):
        why = "; ".join(whole.notes)
        found = f"no mass or inertia of {listed(names)}" + (f" ({why})" if why else "")
        raise InputError(file.name, found, "bodies of all moving links", _HOW)
    return _made(settings, file, folder, whole, names, options)


def _read(settings: RobotSettings, file: Path, options: RobotOptions) -> NewRobot:
    """As it is; InputError for what is stated of bodies that are not made."""
    for option, value in (("--motor", options.wanted.motors), ("--base-kg", options.wanted.base_kg)):
        if value:
            why = "no body is made of a mesh, because the file has them all"
            raise InputError(option, why, "links without a body", "add `--inertias meshes`, or leave it out")
    robot = read_robot(settings, Path())
    found = masses(robot, options.wanted.mass_kg)
    sheet = "" if options.wanted.mass_kg is not None else ": compare its data sheet"
    doubts = [f"{one}; `--inertias meshes` makes bodies of the meshes" for one in found.doubts]
    said = (*robot.notes, *robot_notes(robot), found.sentence + sheet, *doubts)
    return NewRobot(robot, file, _keys(options), "", said)


def _made(
    settings: RobotSettings,
    file: Path,
    folder: Path,
    whole: Robot,
    names: list[str],
    options: RobotOptions,
) -> NewRobot:
    """With bodies out of meshes, in a file of its own."""
    bodies = made_bodies(whole, options.wanted)
    path = folder / f"{file.name.partition('.')[0]}_bodies.urdf"
    if path.exists():
        fix = "choose another folder with `--out`, or remove it"
        raise InputError(str(path), "the file exists", "a new file", fix)
    write_text(path, with_bodies(settings, Path(), whole, bodies, to=folder))
    robot = read_urdf(path, choice=options.choice)
    found = masses(robot)
    new = listed([body.name for body in bodies])
    said = (
        *robot.notes,
        *robot_notes(robot),
        f"wrote {path}: bodies of {new} made of their meshes",
        found.sentence,
    )
    stated = _uncertainty(whole, robot, names, options.wanted.everything)
    return NewRobot(robot, path, _keys(replace(options, arguments={})), stated, said)


def _uncertainty(before: Robot, robot: Robot, names: list[str], everything: bool) -> str:
    """What is stated of bodies that were made: the level where all were, else each of its own."""
    new = everything or all(before.link(name).mass == 0 for name in names)
    if new and len(names) == len(robot.links) - 1:
        return "meshes"
    each = {}
    for name in names:
        stated = made_of_mesh(robot, robot.link(name))
        old = before.link(name)
        known = {"mass"} if old.mass > 0 else set()
        known |= {"centre_m"} if np.any(old.centre) else set()
        each[name] = {key: float(f"{value:.2g}") for key, value in stated.items() if key not in known}
    return json.dumps({"like": "typical", "links": {"each": each}}).replace('"', "")


def _keys(options: RobotOptions) -> str:
    """Further keys of `robot:`, each after a comma."""
    choice, mass = options.choice, options.wanted.mass_kg
    keys = {
        "tip": choice.tip,
        "lock": dict(choice.lock),
        "arguments": dict(options.arguments),
        "mass_kg": mass,
    }
    return "".join(f", {name}: {json.dumps(value)}" for name, value in keys.items() if value)


def relative(path: Path, folder: Path) -> str:
    """A path as a config in a folder has it."""
    return os.path.relpath(path.resolve(), folder).replace(os.sep, "/")

"""A census of robot descriptions: `python -m tests.benchmarks.descriptions FOLDER... [--write]`.

Every URDF, every xacro that is no part of another, and every MJCF below the folders is read as
`identify init` does.  Printed, and with --write stored, are how many arms load, with which bodies, and why
others do not.  Bodies are those of the file (true, or doubted by `identify.robot.plausible`), or missing and
to be made of meshes (or of no mesh).
"""

from __future__ import annotations

import argparse
import json
import re
import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from identify.core.errors import InputError
from identify.robot.chain import Choice
from identify.robot.description import Robot
from identify.robot.mesh_body import unknown
from identify.robot.plausible import masses
from identify.robot.urdf import read_urdf

STORED = Path(__file__).parent / "results" / "descriptions.json"
ARGUMENTS = {
    "name": "robot",
    "namespace": "robot",
    "robot_name": "robot",
    "ur_type": "ur10e",
    "robot_model": "ur10",
    "hand": "false",
}
"""Values for arguments that some xacros ask for."""
_ARM = 4
"""Joints of the smallest arm."""


def descriptions(folder: Path) -> Iterator[Path]:
    """The files that describe a robot."""
    for path in sorted(folder.rglob("*")):
        suffix = path.suffix.lower()
        if not path.is_file() or suffix not in (".urdf", ".xacro", ".xml"):
            continue
        text = path.read_text(encoding="utf-8", errors="replace")
        if suffix == ".xacro" and ("macro" in path.name or not re.search(r"<(link|xacro:include)\b", text)):
            continue
        if suffix == ".xml" and not ("<mujoco" in text and "<joint" in text):
            continue
        yield path


def read(path: Path) -> tuple[Robot | None, str]:
    """The robot, or the sentence that refuses it; arguments that are asked for are given."""
    given: dict[str, str] = {}
    while True:
        try:
            return read_urdf(path, any_bodies=True, arguments=given), ""
        except InputError as error:
            asked = re.search(r"needs the argument '(\w+)'", error.found)
            tips = re.findall(r"such as '([^']+)'", error.expected or "")
            if asked and asked[1] in ARGUMENTS and asked[1] not in given:
                given[asked[1]] = ARGUMENTS[asked[1]]
            elif tips:
                return read_tip(path, given, tips[0])
            else:
                return None, str(error)


def read_tip(path: Path, given: dict[str, str], tip: str) -> tuple[Robot | None, str]:
    """The first of several arms."""
    try:
        return read_urdf(path, any_bodies=True, arguments=given, choice=Choice(tip)), ""
    except InputError as error:
        return None, str(error)


def entry(path: Path, folder: Path) -> dict[str, Any]:
    """What the census says of one file."""
    try:
        robot, refused = read(path)
    except Exception as error:  # the census counts what must not happen
        robot, refused = None, f"CRASH {type(error).__name__}: {error}"
    found: dict[str, Any] = {"file": f"{folder.name}/{path.relative_to(folder).as_posix()}"}
    if robot is None:
        return found | {"loads": False, "why": refused}
    moving = robot.links[1:]
    known = [link for link in moving if link.mass > 0]
    whole = [link for link in known if np.any(link.inertia)]
    if len(whole) == len(moving):
        bodies = "doubted" if masses(robot).doubts else "true"
    else:
        missing = set(unknown(robot)) - seen(robot)
        bodies = "of no mesh" if missing else "of meshes"
    return found | {
        "loads": True,
        "joints": len(robot.joints),
        "bodies": bodies,
        "moving_kg": round(sum(link.mass for link in moving), 3),
        "base_kg": round(robot.links[0].mass, 3),
        "notes": list(robot.notes),
    }


def seen(robot: Robot) -> set[str]:
    """Links with a mesh or a plain body, without reading it."""
    found = set()
    for one in robot.visuals:
        surfaces = [surface for choice in one.choices for surface in choice if not surface.fault]
        if any(surface.file is None or surface.file.is_file() for surface in surfaces):
            found.add(robot.frames.get(one.link, (one.link, None))[0])
    return found


def summary(entries: list[dict[str, Any]]) -> dict[str, Any]:
    """Counts over all files."""
    loaded = [one for one in entries if one["loads"]]
    arms = [one for one in loaded if one["joints"] >= _ARM]
    refused = [one["why"].partition(":")[2] for one in entries if not one["loads"]]
    none = [text for text in refused if "no link" in text or "no moving joint" in text]
    why = Counter(re.sub(r"'[^']*'|\d+", "..", text)[:70] for text in refused)
    return {
        "files": len(entries),
        "of_no_robot": len(none),
        "load": len(loaded),
        "arms": len(arms),
        "bodies_of_arms": dict(Counter(one["bodies"] for one in arms)),
        "refused": dict(why.most_common()),
        "crashes": sum("CRASH" in one.get("why", "") for one in entries),
    }


def main(words: list[str]) -> None:
    """Print the census, and store it where that is asked for."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.descriptions")
    parser.add_argument("folders", nargs="+", type=Path)
    parser.add_argument("--write", action="store_true", help="store the result")
    told = parser.parse_args(words)
    entries = []
    for folder in told.folders:
        for path in descriptions(folder):
            entries.append(entry(path, folder))
            one = entries[-1]
            numbers = "{joints} joints, bodies: {bodies}, {moving_kg} kg"
            said = numbers.format(**one) if one["loads"] else one["why"]
            print(f"{one['file']}: {said}", flush=True)
    found = summary(entries)
    print(json.dumps(found, indent=1))
    if told.write:
        rows = [json.dumps({key: value for key, value in one.items() if key != "notes"}) for one in entries]
        listed = ",\n ".join(rows)
        STORED.write_text(f'{{"summary": {json.dumps(found)},\n"files": [\n {listed}\n]}}\n')


if __name__ == "__main__":
    main(sys.argv[1:])

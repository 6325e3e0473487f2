"""Options about robots: which part of which description is the arm, its bodies, and where nodes are on it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Annotated

import typer

from identify.api.options import Columns, Names, Quiet, option
from identify.core.errors import InputError

RobotFile = Annotated[
    Path, typer.Argument(help="URDF, xacro or MJCF, or YAML with a Denavit-Hartenberg table")
]
Tip = Annotated[str | None, typer.Option(help="link at the end of the arm; default: of the longest chain")]
Lock = Annotated[
    list[str] | None,
    typer.Option(help="a joint that is held, such as rail=1.2 (rad or m); may be repeated"),
]
Argument = Annotated[
    list[str] | None,
    typer.Option(help="an argument of a xacro, such as ur_type=ur10e; may be repeated"),
]


class Inertias(Enum):
    """Where the bodies of a new study come from."""

    file = "file"
    meshes = "meshes"


def words_of(texts: Iterable[str] | None, where: str) -> dict[str, str]:
    """Values by name, from texts `name=value`."""
    found = {}
    for text in texts or ():
        name, _, value = text.partition("=")
        if not (name.strip() and value.strip()):
            raise InputError(where, repr(text), "a name and a value, such as name=value")
        if name.strip() in found:
            raise InputError(where, f"{name.strip()!r} twice", "each name once")
        found[name.strip()] = value.strip()
    return found


def pairs_of(texts: Iterable[str] | None, where: str) -> dict[str, float]:
    """Numbers by name, from texts `name=number`."""
    found = {}
    for name, value in words_of(texts, where).items():
        try:
            found[name] = float(value)
        except ValueError:
            found[name] = float("nan")
        if not abs(found[name]) < float("inf"):
            raise InputError(where, repr(f"{name}={value}"), "a name and a number, such as name=1.2")
    return found


@dataclass(frozen=True)
class InitOptions:
    """Of `identify init`."""

    out: Path = option("config file to write", Path("config.yaml"))
    points: Path | None = option("CSV of measurement points; default: points.csv beside the robot")
    columns: Columns = None
    names: Names = None
    posture: str | None = option("joint angles of the first posture in degrees, 0,30,-60,0,45,0")
    mass_kg: float | None = option("mass of the robot by its data sheet, without a payload", min=0.001)
    base_kg: float | None = option(
        "mass of its part that stands still; default: by its mesh, like the links", min=0
    )
    inertias: Inertias = option("of the file as far as it has them, or all made of the meshes", Inertias.file)
    motor: list[str] | None = option(
        "mass of the motor that turns a joint, such as 2=35 (kg); may be repeated"
    )
    tip: Tip = None
    lock: Lock = None
    argument: Argument = None


@dataclass(frozen=True)
class PointsOptions:
    """Of `identify points`."""

    posture: str | None = option("joint angles of the test in degrees: 0,30,-60,0,45,0; default: all 0")
    tip: Tip = None
    lock: Lock = None
    argument: Argument = None
    pairs: Path | None = option("CSV of points: some nodes, three if need be, whose place is roughly known")
    pair_error: float = option("of each coordinate of these, m", 0.03, min=0.001)
    angle_error: float = option("of each joint angle, degrees (one standard deviation)", 3.0, min=0.01)
    length_unit: str | None = option("of a geometry without a unit: m, mm, cm, in, ft")
    out: Path = option("CSV of points to write, where the files have a geometry", Path("points.csv"))
    page: Path | None = option("page to write; default: beside the points, with the suffix .html")
    quiet: Quiet = False

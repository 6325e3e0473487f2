"""The options of the command line, each declared once, with its help; a command takes those it has as one
object.
"""

from __future__ import annotations

import dataclasses
import inspect
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeVar, get_type_hints

import typer

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

Wanted = TypeVar("Wanted", bound="DataclassInstance")
NEEDED: Any = dataclasses.MISSING
"""The default of an option that must be given."""


def option(said: str, default: Any = None, **how: Any) -> Any:
    """A field of an object of options: its help, its default, and what typer is told of it besides, such as
    `min`; named: what it is called, where not as the field.  A flag that is off by default has no opposite.
    """
    return dataclasses.field(default=default, metadata={"help": said, **how})


Out = Annotated[Path | None, typer.Option(help="result file; default: reports/<name of the study>.h5")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="print nothing but errors")]
Report = Annotated[bool, typer.Option(help="write the HTML and PDF reports beside the result")]
Starts = Annotated[int | None, typer.Option(help="overrides `starts` of the study")]
Workers = Annotated[
    int | None, typer.Option(min=1, help="local worker processes; default: one per processor")
]
Cluster = Annotated[
    str | None,
    typer.Option(help="address of a Dask scheduler, which then does the work; see docs/cluster.md"),
]
KeepFinished = Annotated[
    bool, typer.Option("--resume", help="keep what is finished, resume what was interrupted, do the rest")
]
KeepTried = Annotated[
    bool, typer.Option("--resume", help="resume an interrupted run; what was tried is not tried again")
]
Posture = Annotated[
    str | None,
    typer.Option(help="joint angles in degrees, 0,30,-60,0,45,0, or a measurement; default: the first"),
]

Columns = Annotated[
    str | None,
    typer.Option(help="names of the columns of text files without a header: frequency_hz,real,imag"),
]
Names = Annotated[
    str | None,
    typer.Option(help="how names of files tell the channels of their FRFs: FRF_{output}_{input}"),
]


@dataclass(frozen=True)
class FitOptions:
    """Of `identify fit`."""

    out: Out = None
    seed: int | None = option("overrides `seed` of the study")
    starts: Starts = None
    workers: int | None = option(
        "processes that run starts side by side, with the same result; default: 1", min=1
    )
    report: Report = True
    resume: bool = option("resume an interrupted run; the result is that of an undisturbed one", False)
    profile: list[str] | None = option("also the profile likelihood of this parameter; repeatable")
    write_back: Path | None = option(
        "with `uncertainty:`: the robot, points and study as the fit found them, into this folder"
    )
    quiet: Quiet = False


@dataclass(frozen=True)
class SimulateOptions:
    """Of `identify simulate`."""

    out: Out = None
    tables: Path | None = option("also a CSV of every record into this folder")
    values: Path | None = option(
        "result of a fit: numbers of the same names as found there, not their start values"
    )
    report: Report = True
    quiet: Quiet = False


@dataclass(frozen=True)
class DiscoverOptions:
    """Of `identify discover`."""

    out: Path | None = option("result file; default: reports/<name of the study>_discovery.h5")
    starts: Starts = None
    workers: int | None = option("processes; default: one per core", min=1)
    as_stated: bool = option("search even where a mistake of the set-up explains the gap", False)
    time_s: float | None = option(
        "begin nothing new after this; what is found is the result", named="--time", min=0, metavar="SECONDS"
    )
    report: Report = True
    resume: KeepTried = False
    quiet: Quiet = False


@dataclass(frozen=True)
class ExplainOptions:
    """Of `identify explain`."""

    out: Out = None
    workers: int | None = option("processes, with the same result to the last bit; default: one", min=1)
    report: Report = True
    resume: KeepTried = False
    quiet: Quiet = False


@dataclass(frozen=True)
class ExciteOptions:
    """Of `identify excite`."""

    out: Out = None
    draws: int | None = option("rehearsals of the motion, with noise; default: 40", min=10)
    report: Report = True
    quiet: Quiet = False


def columns_of(text: str | None) -> list[str] | None:
    """Names of columns that stand between commas."""
    return None if text is None else [name.strip() for name in text.split(",")]


@dataclass(frozen=True)
class BatchOptions:
    """Of `identify batch`."""

    out: Out = None
    workers: Workers = None
    cluster: Cluster = None
    resume: KeepFinished = False
    report: bool = option("write the HTML and PDF reports beside the summary", True)
    quiet: Quiet = False


@dataclass(frozen=True)
class MapCommandOptions:
    """Of `identify map`."""

    postures: Path | None = option("CSV of postures: joint1_deg, joint2_deg, ..., and name if wanted")
    grid: list[str] | None = option("JOINT:FIRST:LAST:COUNT in degrees, such as 2:-60:60:9; repeatable")
    tool: int | None = option("node of the tool's point; default: the last of the points")
    band: tuple[float, float] | None = option(
        "lowest and highest frequency, Hz; default: of the fit", metavar="LOW HIGH"
    )
    lines: int = option("frequencies over the band", 100)
    modes: int = option("how many modes", 6, min=1)
    limit: str | None = option("depth, deflection or frequency: its best and worst place")
    cutter: Path | None = option("YAML file of a milling tool, for depths and for a workpiece")
    rpm: list[float] | None = option("spindle speed of depths; repeatable; default: the highest of the tool")
    feeds: int = option("feed directions about the spindle, of depths", 1, min=1)
    force: str | None = option("FX,FY,FZ of deflections, N, along the base's axes")
    workpiece: str | None = option(
        "places of the tip in place of postures, m: 1.2:1.8:7,-0.4:0.4:5,0.8:0.8:1"
    )
    turns: int = option("angles about the spindle at each place", 1, min=1)
    spindle: str | None = option("X,Y,Z from spindle to tip at the workpiece; default: as in the fit")
    like: list[Path] | None = option(
        "result of another robot of the type, measured in other postures; repeatable"
    )
    out: Path | None = option("result file; default: <model>_map.h5")
    workers: Workers = None
    cluster: Cluster = None
    resume: KeepFinished = False
    report: bool = option("write the HTML and PDF reports beside the map", True)
    quiet: Quiet = False


@dataclass(frozen=True)
class StabilityOptions:
    """Of `identify stability`."""

    tool: Path = option("YAML file of the tool and its cut, schema: identify-tool/1", NEEDED)
    posture: Posture = None
    speeds: int = option("spindle speeds over the tool's range", 61, min=2)
    draws: int = option("draws of what is uncertain, for the bands", 2000, min=20)
    unit: str | None = option("unit of FRFs of the tip, such as m/s^2/N, where the file has none")
    averages: int | None = option("averages behind these FRFs, for their noise by coherence", min=2)
    out: Path | None = option("result file; default: <model>_stability.h5")
    report: Report = True
    quiet: Quiet = False


@dataclass(frozen=True)
class DeflectionOptions:
    """Of `identify deflection`."""

    force: str | None = option("FX,FY,FZ on the tool, N, along the base's axes: 100,0,-50")
    path: Path | None = option("CSV of a path: joint1_deg, ..., fx_n, fy_n, fz_n, and name if wanted")
    tool: Path | None = option("YAML file of the tool: where its tip is, and with a cut its force")
    depth: float | None = option("depth of a cut with the tool, mm")
    feed_per_tooth: float | None = option("feed of a cut with the tool, mm")
    node: int | None = option("node of the tip's point; default: the last of the points")
    posture: Posture = None
    draws: int = option("draws of the parameters, for the intervals", 400, min=20)
    out: Path | None = option("result file; default: <model>_deflection.h5")
    report: Report = True
    quiet: Quiet = False


@dataclass(frozen=True)
class ExportCommandOptions:
    """Of `identify export`."""

    to: str = option("mjcf, urdf, mat, npz, statespace, uff or simscape: docs/export.md", NEEDED)
    posture: list[str] | None = option(
        "joint angles in degrees, 0,30,-60,0,45,0, a measurement, or `all` of these; repeatable;"
        " default: the first"
    )
    modes: int | None = option("also a model with so many modes")
    error: float | None = option(
        "also one with the fewest modes that leave this error of each FRF, such as 0.01"
    )
    band: tuple[float, float] | None = option(
        "where the model is to hold, Hz; default: of the fit", metavar="LOW HIGH"
    )
    out: Path | None = option(
        "file, or with several postures what their names follow; default: beside the result"
    )
    quiet: Quiet = False


@dataclass(frozen=True)
class PlanCommandOptions:
    """Of `identify plan`."""

    postures: int = option("how many postures the test has", 3, min=1)
    impacts: int = option("impacts (a point and a direction) in each", 3, min=1)
    sensors: int = option("triaxial sensors, at the same places in all", 6, min=1)
    among: int = option("random postures of which to choose", 40, min=1)
    table: Path | None = option("CSV of the postures of which to choose: joint1_deg, joint2_deg, ...")
    target: list[str] | None = option(
        "what is to be known best: a parameter, mode2.frequency, mode2.damping, or depth;"
        " repeatable; default: all parameters"
    )
    cutter: Path | None = option("YAML file of the milling tool of a depth")
    at: str | None = option("posture of a mode or depth, degrees: 0,30,-60,0,45,0; default: the first")
    rival: Path | None = option("a fit with another effect: the test that tells the two apart best")
    anew: bool = option("as if the data of the fit did not exist", False)
    noise: float | None = option("noise of an accelerance, m/s^2/N; default: that of the fit's")
    force_noise: float | None = option(
        "of the force, relative, such as 0.002; default: that of the fit's, else none"
    )
    resolution: float | None = option("Hz between lines; default: as in the fit")
    seed: int = option("of the random postures and starts", 1)
    out: Path | None = option("result file; default: <model>_plan.h5")
    report: Report = True
    quiet: Quiet = False


def given(options: Any) -> dict[str, Any]:
    """The options of an object that were given, by name, but those that every command has."""
    fields = [field for field in dataclasses.fields(options) if field.name not in ("out", "report", "quiet")]
    values = {field.name: getattr(options, field.name) for field in fields}
    defaults = {field.name: field.default for field in fields}
    return {
        name: value
        for name, value in values.items()
        if value != defaults[name] or type(value) is not type(defaults[name])
    }


def of_same_names(kind: type[Wanted], options: Any, **own: Any) -> Wanted:
    """What an analysis is asked for, whose fields are options of the same names, but for its own."""
    common = {field.name for field in dataclasses.fields(options)} & set(kind.__dataclass_fields__)
    return kind(**{name: getattr(options, name) for name in common} | own)


def takes_options(command: Callable[..., None]) -> Callable[..., None]:
    """A command for typer, whose options are the fields of the last parameter, an object of options."""
    *arguments, last = inspect.signature(command, eval_str=True).parameters.values()
    kind: type[Any] = last.annotation
    hints = get_type_hints(kind, include_extras=True)
    names = [field.name for field in dataclasses.fields(kind)]

    def called(**values: Any) -> None:
        options = {name: _said(values.pop(name)) for name in names}
        command(**values, **{last.name: kind(**options)})

    parameters = [
        *(argument.replace(kind=inspect.Parameter.KEYWORD_ONLY) for argument in arguments),
        *(
            inspect.Parameter(
                field.name,
                inspect.Parameter.KEYWORD_ONLY,
                default=inspect.Parameter.empty if field.default is NEEDED else field.default,
                annotation=_annotated(field, hints[field.name]),
            )
            for field in dataclasses.fields(kind)
        ),
    ]
    called.__name__, called.__doc__ = command.__name__, command.__doc__
    called.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    called.__annotations__ = {parameter.name: parameter.annotation for parameter in parameters}
    return called


def _annotated(field: dataclasses.Field[Any], hint: Any) -> Any:
    """The type of an option with what typer is told of it, where it does not say so itself."""
    if not field.metadata:
        return hint
    how = dict(field.metadata)
    named = how.pop("named", f"--{field.name.replace('_', '-')}" if field.default is False else None)
    return Annotated[hint, typer.Option(*([named] if named else []), **how)]


def _said(value: Any) -> Any:
    """A repeatable option that was never given is none, not an empty list."""
    return None if value == [] else value

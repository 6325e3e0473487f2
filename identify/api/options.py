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
_NEEDED = inspect.Parameter.empty
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
    seed: Annotated[int | None, typer.Option(help="overrides `seed` of the study")] = None
    starts: Starts = None
    workers: Annotated[
        int | None,
        typer.Option(min=1, help="processes that run starts side by side, with the same result; default: 1"),
    ] = None
    report: Report = True
    resume: Annotated[
        bool,
        typer.Option("--resume", help="resume an interrupted run; the result is that of an undisturbed one"),
    ] = False
    profile: Annotated[
        list[str] | None, typer.Option(help="also the profile likelihood of this parameter; repeatable")
    ] = None
    write_back: Annotated[
        Path | None,
        typer.Option(
            help="with `uncertainty:`: the robot, points and study as the fit found them, into this folder"
        ),
    ] = None
    quiet: Quiet = False


@dataclass(frozen=True)
class SimulateOptions:
    """Of `identify simulate`."""

    out: Out = None
    tables: Annotated[Path | None, typer.Option(help="also a CSV of every record into this folder")] = None
    values: Annotated[
        Path | None,
        typer.Option(
            help="result of a fit: numbers of the same names as found there, not their start values"
        ),
    ] = None
    report: Report = True
    quiet: Quiet = False


@dataclass(frozen=True)
class DiscoverOptions:
    """Of `identify discover`."""

    out: Annotated[
        Path | None, typer.Option(help="result file; default: reports/<name of the study>_discovery.h5")
    ] = None
    starts: Starts = None
    workers: Annotated[int | None, typer.Option(min=1, help="processes; default: one per core")] = None
    as_stated: Annotated[
        bool, typer.Option("--as-stated", help="search even where a mistake of the set-up explains the gap")
    ] = False
    time_s: Annotated[
        float | None,
        typer.Option(
            "--time",
            min=0,
            metavar="SECONDS",
            help="begin nothing new after this; what is found is the result",
        ),
    ] = None
    report: Report = True
    resume: KeepTried = False
    quiet: Quiet = False


@dataclass(frozen=True)
class ExplainOptions:
    """Of `identify explain`."""

    out: Out = None
    workers: Annotated[
        int | None, typer.Option(min=1, help="processes, with the same result to the last bit; default: one")
    ] = None
    report: Report = True
    resume: KeepTried = False
    quiet: Quiet = False


@dataclass(frozen=True)
class ExciteOptions:
    """Of `identify excite`."""

    out: Out = None
    draws: Annotated[
        int | None, typer.Option(min=10, help="rehearsals of the motion, with noise; default: 40")
    ] = None
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
    report: Annotated[bool, typer.Option(help="write the HTML and PDF reports beside the summary")] = True
    quiet: Quiet = False


@dataclass(frozen=True)
class MapCommandOptions:
    """Of `identify map`."""

    postures: Annotated[
        Path | None, typer.Option(help="CSV of postures: joint1_deg, joint2_deg, ..., and name if wanted")
    ] = None
    grid: Annotated[
        list[str] | None,
        typer.Option(help="JOINT:FIRST:LAST:COUNT in degrees, such as 2:-60:60:9; repeatable"),
    ] = None
    tool: Annotated[
        int | None, typer.Option(help="node of the tool's point; default: the last of the points")
    ] = None
    band: Annotated[
        tuple[float, float] | None,
        typer.Option(help="lowest and highest frequency, Hz; default: of the fit", metavar="LOW HIGH"),
    ] = None
    lines: Annotated[int, typer.Option(help="frequencies over the band")] = 100
    modes: Annotated[int, typer.Option(min=1, help="how many modes")] = 6
    limit: Annotated[
        str | None, typer.Option(help="depth, deflection or frequency: its best and worst place")
    ] = None
    cutter: Annotated[
        Path | None, typer.Option(help="YAML file of a milling tool, for depths and for a workpiece")
    ] = None
    rpm: Annotated[
        list[float] | None,
        typer.Option(help="spindle speed of depths; repeatable; default: the highest of the tool"),
    ] = None
    feeds: Annotated[int, typer.Option(min=1, help="feed directions about the spindle, of depths")] = 1
    force: Annotated[str | None, typer.Option(help="FX,FY,FZ of deflections, N, along the base's axes")] = (
        None
    )
    workpiece: Annotated[
        str | None,
        typer.Option(help="places of the tip in place of postures, m: 1.2:1.8:7,-0.4:0.4:5,0.8:0.8:1"),
    ] = None
    turns: Annotated[int, typer.Option(min=1, help="angles about the spindle at each place")] = 1
    spindle: Annotated[
        str | None, typer.Option(help="X,Y,Z from spindle to tip at the workpiece; default: as in the fit")
    ] = None
    like: Annotated[
        list[Path] | None,
        typer.Option(help="result of another robot of the type, measured in other postures; repeatable"),
    ] = None
    out: Annotated[Path | None, typer.Option(help="result file; default: <model>_map.h5")] = None
    workers: Workers = None
    cluster: Cluster = None
    resume: KeepFinished = False
    report: Annotated[bool, typer.Option(help="write the HTML and PDF reports beside the map")] = True
    quiet: Quiet = False


@dataclass(frozen=True)
class StabilityOptions:
    """Of `identify stability`."""

    tool: Annotated[Path, typer.Option(help="YAML file of the tool and its cut, schema: identify-tool/1")]
    posture: Posture = None
    speeds: Annotated[int, typer.Option(min=2, help="spindle speeds over the tool's range")] = 61
    draws: Annotated[int, typer.Option(min=20, help="draws of what is uncertain, for the bands")] = 2000
    unit: Annotated[
        str | None, typer.Option(help="unit of FRFs of the tip, such as m/s^2/N, where the file has none")
    ] = None
    averages: Annotated[
        int | None, typer.Option(min=2, help="averages behind these FRFs, for their noise by coherence")
    ] = None
    out: Annotated[Path | None, typer.Option(help="result file; default: <model>_stability.h5")] = None
    report: Report = True
    quiet: Quiet = False


@dataclass(frozen=True)
class DeflectionOptions:
    """Of `identify deflection`."""

    force: Annotated[
        str | None, typer.Option(help="FX,FY,FZ on the tool, N, along the base's axes: 100,0,-50")
    ] = None
    path: Annotated[
        Path | None, typer.Option(help="CSV of a path: joint1_deg, ..., fx_n, fy_n, fz_n, and name if wanted")
    ] = None
    tool: Annotated[
        Path | None, typer.Option(help="YAML file of the tool: where its tip is, and with a cut its force")
    ] = None
    depth: Annotated[float | None, typer.Option(help="depth of a cut with the tool, mm")] = None
    feed_per_tooth: Annotated[float | None, typer.Option(help="feed of a cut with the tool, mm")] = None
    node: Annotated[
        int | None, typer.Option(help="node of the tip's point; default: the last of the points")
    ] = None
    posture: Posture = None
    draws: Annotated[int, typer.Option(min=20, help="draws of the parameters, for the intervals")] = 400
    out: Annotated[Path | None, typer.Option(help="result file; default: <model>_deflection.h5")] = None
    report: Report = True
    quiet: Quiet = False


@dataclass(frozen=True)
class ExportCommandOptions:
    """Of `identify export`."""

    to: Annotated[str, typer.Option(help="mjcf, urdf, mat, npz, statespace, uff or simscape: docs/export.md")]
    posture: Annotated[
        list[str] | None,
        typer.Option(
            help="joint angles in degrees, 0,30,-60,0,45,0, a measurement, or `all` of these; repeatable;"
            " default: the first"
        ),
    ] = None
    modes: Annotated[int | None, typer.Option(help="also a model with so many modes")] = None
    error: Annotated[
        float | None,
        typer.Option(help="also one with the fewest modes that leave this error of each FRF, such as 0.01"),
    ] = None
    band: Annotated[
        tuple[float, float] | None,
        typer.Option(help="where the model is to hold, Hz; default: of the fit", metavar="LOW HIGH"),
    ] = None
    out: Annotated[
        Path | None,
        typer.Option(
            help="file, or with several postures what their names follow; default: beside the result"
        ),
    ] = None
    quiet: Quiet = False


@dataclass(frozen=True)
class PlanCommandOptions:
    """Of `identify plan`."""

    postures: Annotated[int, typer.Option(min=1, help="how many postures the test has")] = 3
    impacts: Annotated[int, typer.Option(min=1, help="impacts (a point and a direction) in each")] = 3
    sensors: Annotated[int, typer.Option(min=1, help="triaxial sensors, at the same places in all")] = 6
    among: Annotated[int, typer.Option(min=1, help="random postures of which to choose")] = 40
    table: Annotated[
        Path | None, typer.Option(help="CSV of the postures of which to choose: joint1_deg, joint2_deg, ...")
    ] = None
    target: Annotated[
        list[str] | None,
        typer.Option(
            help="what is to be known best: a parameter, mode2.frequency, mode2.damping, or depth;"
            " repeatable; default: all parameters"
        ),
    ] = None
    cutter: Annotated[Path | None, typer.Option(help="YAML file of the milling tool of a depth")] = None
    at: Annotated[
        str | None,
        typer.Option(help="posture of a mode or depth, degrees: 0,30,-60,0,45,0; default: the first"),
    ] = None
    rival: Annotated[
        Path | None,
        typer.Option(help="a fit with another effect: the test that tells the two apart best"),
    ] = None
    anew: Annotated[bool, typer.Option("--anew", help="as if the data of the fit did not exist")] = False
    noise: Annotated[
        float | None, typer.Option(help="noise of an accelerance, m/s^2/N; default: that of the fit's")
    ] = None
    force_noise: Annotated[
        float | None,
        typer.Option(help="of the force, relative, such as 0.002; default: that of the fit's, else none"),
    ] = None
    resolution: Annotated[float | None, typer.Option(help="Hz between lines; default: as in the fit")] = None
    seed: Annotated[int, typer.Option(help="of the random postures and starts")] = 1
    out: Annotated[Path | None, typer.Option(help="result file; default: <model>_plan.h5")] = None
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
                default=_NEEDED if field.default is dataclasses.MISSING else field.default,
                annotation=hints[field.name],
            )
            for field in dataclasses.fields(kind)
        ),
    ]
    called.__name__, called.__doc__ = command.__name__, command.__doc__
    called.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    called.__annotations__ = {parameter.name: parameter.annotation for parameter in parameters}
    return called


def _said(value: Any) -> Any:
    """A repeatable option that was never given is none, not an empty list."""
    return None if value == [] else value

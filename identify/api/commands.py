"""identify from Python: the commands as functions, which the command line calls too.

Every function writes its result file, as the command does, and returns a `Result`.  Wrong input raises
`identify.InputError`, whose text says where, what was found, what was expected and what to do.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from identify.api.modes_options import ModesOptions
from identify.api.options import (
    BatchOptions,
    DeflectionOptions,
    DiscoverOptions,
    ExciteOptions,
    ExplainOptions,
    ExportCommandOptions,
    FitOptions,
    MapCommandOptions,
    PlanCommandOptions,
    SimulateOptions,
    StabilityOptions,
    columns_of,
    given,
    of_same_names,
)
from identify.api.robot_options import Inertias, InitOptions, PointsOptions, pairs_of, words_of
from identify.core.analyses import analysis_for, check_options
from identify.core.config import family_of
from identify.core.errors import InputError
from identify.core.registry import load
from identify.core.text import angles_of, typed
from identify.reports.outcome import Result, read_result

if TYPE_CHECKING:
    from identify.export.base import Exported
    from identify.measured.registration.place import Placing
    from identify.measured.source import Estimation

__all__ = [
    "Result",
    "batch",
    "deflection",
    "discover",
    "excite",
    "explain",
    "export_model",
    "fit",
    "map_postures",
    "modes",
    "plan",
    "points",
    "read_result",
    "run",
    "simulate",
    "stability",
]

_Path = Path | str


def fit(
    config: _Path,
    *,
    out: _Path | None = None,
    resume: bool = False,
    profile: Sequence[str] = (),
    report: bool = False,
    quiet: bool = True,
    **options: Any,
) -> Result:
    """Fit a study, of vibration, of motion or of single joints.

    out: result file, by default `reports/<name of the study>.h5`; resume: go on with an interrupted run;
    profile: parameters whose profile likelihood is wanted; report: also write page and PDF; quiet: show no
    progress; options: the others of `identify fit` by name, such as seed and starts, which replace those of
    the study, and write_back, a folder for the robot and points as they were found.
    """
    wanted = FitOptions(
        out=_path(out),
        report=report,
        resume=resume,
        profile=list(profile) or None,
        **_paths(options),
    )
    return _reported(run("fit", Path(config), wanted, quiet), report)


def discover(
    config: _Path,
    *,
    out: _Path | None = None,
    report: bool = False,
    quiet: bool = True,
    **options: Any,
) -> Result:
    """Find what is missing from the model of a study; writes the better study beside the result.

    options: those of `identify discover` by name, such as starts, workers and resume; as_stated: even where a
    mistake of the set-up explains the gap; time_s: after which nothing new is begun.
    """
    wanted = DiscoverOptions(out=_path(out), report=report, **_paths(options))
    return _reported(run("discover", Path(config), wanted, quiet), report)


def explain(
    config: _Path,
    *,
    out: _Path | None = None,
    workers: int | None = None,
    resume: bool = False,
    report: bool = False,
    quiet: bool = True,
) -> Result:
    """Name the effects behind recorded motion."""
    options = ExplainOptions(out=_path(out), workers=workers, report=report, resume=resume)
    return _reported(run("explain", Path(config), options, quiet), report)


def excite(
    config: _Path,
    *,
    out: _Path | None = None,
    draws: int | None = None,
    report: bool = False,
    quiet: bool = True,
) -> Result:
    """Find the periodic motion that tells the most within limits; draws: rehearsals of it."""
    return _reported(run("excite", Path(config), ExciteOptions(_path(out), draws, report), quiet), report)


def simulate(
    config: _Path,
    *,
    out: _Path | None = None,
    tables: _Path | None = None,
    values: _Path | None = None,
    report: bool = False,
) -> Result:
    """Simulate the records of a study of motion; tables: a folder for a CSV of every record; values: the
    result of a fit, whose numbers are taken in place of start values of the same names.
    """
    options = SimulateOptions(out=_path(out), tables=_path(tables), values=_path(values), report=report)
    return _reported(run("simulate", Path(config), options), report)


def batch(config: _Path, *, report: bool = False, quiet: bool = True, **options: Any) -> Result:
    """Fit many postures or studies; options: those of `identify batch` by name, such as workers=2."""
    return _reported(run("batch", Path(config), BatchOptions(**_paths(options)), quiet), report)


def modes(data: _Path | Sequence[_Path], *, report: bool = False, **options: Any) -> Result:
    """Modes of measured FRFs, in a file, in one for each setup, or of a study.

    options: those of `identify modes` by name, such as out="modes.h5", band=(3.0, 80.0), max_order=40.
    """
    files = [data] if isinstance(data, (str, Path)) else data
    return _reported(run_modes([Path(one) for one in files], ModesOptions(**_paths(options))), report)


def map_postures(
    model: _Path | Result,
    *,
    grid: Sequence[str] = (),
    rpm: Sequence[float] = (),
    like: _Path | Result | Sequence[_Path | Result] = (),
    report: bool = False,
    quiet: bool = True,
    **options: Any,
) -> Result:
    """A fitted model over postures; model: a result file or what `fit` returned; grid: axes such as
    "2:-60:60:9" (joint, first, last, how many; degrees); rpm: spindle speeds of depth limits; like: other
    robots of the type; options: those of `identify map` by name.
    """
    others = [_model(one) for one in ([like] if isinstance(like, str | Path | Result) else like)]
    wanted = MapCommandOptions(
        grid=list(grid) or None, rpm=list(rpm) or None, like=others or None, **_paths(options)
    )
    return _reported(run_map(_model(model), wanted, quiet), report)


def stability(model: _Path | Result, tool: _Path, *, report: bool = False, **options: Any) -> Result:
    """Depth limits of a cut on a fitted model, or on a tip by its FRFs or their modes; model: a result file,
    what `fit` or `modes` returned, or a file of FRFs; tool: its YAML file; options: those of `identify
    stability` by name, such as posture="0,30,-60,0,45,0".
    """
    wanted = StabilityOptions(tool=Path(tool), **_paths(options))
    return _reported(run_stability(_model(model), wanted), report)


def deflection(model: _Path | Result, *, report: bool = False, **options: Any) -> Result:
    """How far forces push the tool of a fitted model; options: those of `identify deflection` by name, such
    as force="100,0,-50" or path="path.csv".
    """
    return _reported(run_deflection(_model(model), DeflectionOptions(**_paths(options))), report)


def export_model(model: _Path | Result, to: str, **options: Any) -> list[Path]:
    """A fitted model for other programs; to: the format; options: those of `identify export` by name, such as
    posture=["all"] or error=0.01.  The files that were written.
    """
    return list(run_export(_model(model), ExportCommandOptions(to=to, **_paths(options))).written)


def plan(
    model: _Path | Result, *, target: Sequence[str] = (), report: bool = False, **options: Any
) -> Result:
    """The next test; model: a study, a result file or what `fit` returned; target: parameters that are to be
    known best; options: those of `identify plan` by name, such as postures=2.
    """
    wanted = PlanCommandOptions(target=list(target) or None, report=report, **_paths(options))
    return _reported(run_plan(_model(model), wanted), report)


def points(robot: _Path, data: Sequence[_Path] = (), **options: Any) -> Placing:
    """Where the nodes of a test are on a robot: writes a CSV of points, where the files of data have a
    geometry, and a page to look at them and to put others; options: those of `identify points` by name, such
    as posture="0,30,-60,0,45,0".
    """
    return run_points(
        Path(robot), [Path(one) for one in data], PointsOptions(**_paths({"quiet": True, **options}))
    )[0]


def run(command: str, config: Path, options: Any, quiet: bool = True) -> Result:
    """What a command means for a config of its kind (`identify.core.analyses`)."""
    from identify.reports.shown import working

    analysis = analysis_for(command, family_of(config), str(config))
    said, how = given(options), analysis.runs[command]
    check_options(analysis, command, said, str(config))
    arguments = {name: value for name, value in said.items() if name in how.options}
    if how.overrides:
        arguments["overrides"] = {name: value for name, value in said.items() if name in how.overrides}
    shown = load(how.progress)(quiet) if how.progress else working(quiet, f"working on {config.name}")
    with shown as progress:
        extra = {"progress": progress} if how.progress else {}
        result, written = load(how.function)(config, options.out, **arguments, **extra)
    return Result(result, (written,) if isinstance(written, Path) else tuple(written))


def has_shapes_alone(data: Path) -> bool:
    """Whether a file has modes and no FRFs to find them in."""
    from identify.measured.loaders import FORMAT_OF_SUFFIX
    from identify.measured.uff import blocks

    if not data.is_file() or FORMAT_OF_SUFFIX.get(data.suffix.lower()) != "uff":
        return False
    try:
        return blocks.has_shapes_alone(data)
    except InputError:
        return False


def run_modes(data: Sequence[Path], options: ModesOptions, quiet: bool = True) -> Result:
    """What `identify modes` does."""
    from identify.core.binary_input import prepare
    from identify.reports.shown import working

    options.check()
    prepare([path for path in (*data, options.scale_frf, options.scale_record) if path is not None])
    with working(quiet, f"finding the modes of {data[0].name}"):
        return _modes_of(data, options)


def _modes_of(data: Sequence[Path], options: ModesOptions) -> Result:
    """Modes of FRFs, or with `--output-only` of responses."""
    from identify.modes.said import file_options

    file = file_options(**options.file())
    if options.output_only:
        from identify.modes.output_only import Asked, run_output_only
        from identify.modes.said import operational_settings
        from identify.modes.scaling import ScaledBy

        wanted = Asked(
            file,
            options.modal(),
            operational_settings(**options.operational()),
            options.geometry,
            options.length_unit,
            options.choices,
            ScaledBy(**options.scaled_by()),
        )
        result, written = run_output_only(data, options.out, wanted)
        return Result(result, tuple(written))
    from identify.modes.job import Source
    from identify.modes.run import run_modes as analysed

    result, written = analysed(
        Source(list(data), file, _estimation(options), options.roved),
        options.out,
        modal=options.modal(),
        geometry=options.geometry,
        length_unit=options.length_unit,
        frfs=options.frfs,
        choices=options.choices,
    )
    return Result(result, tuple(written))


def _estimation(options: ModesOptions) -> Estimation | None:
    """How FRFs are estimated, where the files have time records."""
    from identify.measured.source import Estimation
    from identify.modes.said import checked

    said = options.estimation()
    return checked(Estimation, said) if said else None


def run_map(model: Path, options: MapCommandOptions, quiet: bool = True) -> Result:
    """What `identify map` does."""
    from identify.map.asked import MapOptions, parse_grid
    from identify.map.run import run_map as mapped
    from identify.reports.progress import batch_bar

    wanted = of_same_names(
        MapOptions,
        options,
        grid=tuple(parse_grid(text) for text in options.grid or ()),
        band_hz=options.band,
        rpm=tuple(options.rpm or ()),
        like=tuple(map(Path, options.like or ())),
    )
    with batch_bar(quiet) as progress:
        result, written = mapped(
            model,
            wanted,
            options.out,
            workers=options.workers,
            cluster=options.cluster,
            resume=options.resume,
            progress=progress,
        )
    return Result(result, tuple(written))


def run_stability(model: Path, options: StabilityOptions, quiet: bool = True) -> Result:
    """What `identify stability` does."""
    from identify.machining.run import run_stability as limited
    from identify.measured.frf_records import FrfFileOptions
    from identify.reports.shown import working

    with working(quiet, "finding depth limits"):
        result, written = limited(
            model,
            options.tool,
            options.out,
            options.posture,
            speeds=options.speeds,
            draws=options.draws,
            options=FrfFileOptions(unit=options.unit, averages=options.averages),
        )
    return Result(result, tuple(written))


def run_deflection(model: Path, options: DeflectionOptions, quiet: bool = True) -> Result:
    """What `identify deflection` does."""
    from identify.machining.run_deflection import Load
    from identify.machining.run_deflection import run_deflection as deflected
    from identify.reports.shown import working

    cut = {"depth_mm": options.depth, "feed_per_tooth_mm": options.feed_per_tooth}
    load = of_same_names(Load, options, **cut)
    with working(quiet, "finding deflections"):
        result, written = deflected(model, load, options.out, draws=options.draws)
    return Result(result, tuple(written))


def run_export(model: Path, options: ExportCommandOptions) -> Exported:
    """What `identify export` does."""
    from identify.export.run import Wanted
    from identify.export.run import run_export as exported

    wanted = Wanted(options.to, options.posture or (), options.modes, options.error, options.band)
    return exported(model, wanted, options.out)


def run_plan(model: Path, options: PlanCommandOptions, quiet: bool = True) -> Result:
    """What `identify plan` does."""
    from identify.core.atomic import write_text
    from identify.planning.known import places_of
    from identify.planning.run import PlanOptions
    from identify.planning.run import run_plan as planned
    from identify.reports.points.page import planned_page
    from identify.reports.shown import working

    target = tuple(options.target or ())
    wanted = of_same_names(PlanOptions, options, target=target, at_deg=angles_of(options.at))
    with working(quiet, "choosing the next test"):
        result, written = planned(model, wanted, options.out)
        page = written[0].with_name(f"{written[0].stem}_points.html")
        if options.report:
            write_text(page, planned_page(result, *places_of(model)))
            written.append(page)
    return Result(result, tuple(written))


def run_points(robot: Path, data: Sequence[Path], options: PointsOptions) -> tuple[Placing, list[Path]]:
    """What `identify points` does, and the files that it wrote."""
    from identify.measured.registration.place import Asked
    from identify.measured.registration.settings import RegistrationSettings
    from identify.reports.points.page import write_points
    from identify.robot.chain import Choice

    registration = RegistrationSettings(
        pairs=options.pairs,
        pair_error_m=options.pair_error,
        angle_error_deg=options.angle_error,
        length_unit=options.length_unit,
    )
    asked = Asked(
        angles_of(options.posture, "--posture"),
        registration,
        Choice(options.tip, pairs_of(options.lock, "--lock")),
        words_of(options.argument, "--argument"),
    )
    return write_points(robot, data, asked, options.out, options.page, options.quiet)


def run_init(robot: Path, data: Sequence[Path], options: InitOptions) -> Iterator[str]:
    """What `identify init` does, and what it says of it on the way."""
    from identify.measured.frf_records import FrfFileOptions
    from identify.robot.chain import Choice
    from identify.robot.mesh_body import Wanted
    from identify.vibration.starter import check_new, write_starter
    from identify.vibration.starter_robot import RobotOptions

    check_new(options.out)
    files = FrfFileOptions(columns=columns_of(options.columns), names=options.names)
    motors, held = pairs_of(options.motor, "--motor"), pairs_of(options.lock, "--lock")
    wanted = Wanted(options.mass_kg, options.base_kg, motors, options.inertias is Inertias.meshes)
    of_robot = RobotOptions(Choice(options.tip, held), words_of(options.argument, "--argument"), wanted)
    angles = angles_of(options.posture, "--posture")
    written = write_starter(robot, list(data), options.out, options.points, files, of_robot, angles)
    yield f"wrote {written.config}"
    yield from written.to_do
    yield f"next: identify check {typed([written.config])}"


def _model(model: _Path | Result) -> Path:
    """The file of a model, or of what `fit` returned."""
    return model.path if isinstance(model, Result) else Path(model)


def _reported(result: Result, report: bool) -> Result:
    if not report:
        return result
    # Reports bring all libraries that draw.
    from identify.reports.write import write_reports

    return Result(result.data, (*result.written, *write_reports(result.path)))


def _path(of: _Path | None) -> Path | None:
    return None if of is None else Path(of)


def _paths(options: dict[str, Any]) -> dict[str, Any]:
    """Options, with those that name files as paths; `postures` is a file or a number."""
    named = ("out", "geometry", "path", "tool", "table", "write_back", "pairs", "page")
    return {
        name: _path(value) if name in named or (isinstance(value, str) and name == "postures") else value
        for name, value in options.items()
    }

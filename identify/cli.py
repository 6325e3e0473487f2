"""The command line: parse, call, print; nothing else.  Every import of a command's machinery is inside the
command.
"""

from __future__ import annotations

import time
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

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
    Quiet,
    SimulateOptions,
    StabilityOptions,
    takes_options,
)
from identify.api.robot_options import InitOptions, PointsOptions, RobotFile
from identify.core.analyses import BY_NAME, OF_KIND, WITH_CONFIG, checker_of
from identify.core.errors import EXIT_FAILED_CHECK, EXIT_NOT_CONVERGED, InputError, InputErrors
from identify.core.text import typed
from identify.core.version import VERSION

if TYPE_CHECKING:
    from identify.reports.outcome import Result

app = typer.Typer(
    help="Fit elastic robot models to measured vibration, and say how far the fit can be trusted.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,  # twice as fast
)

Config = Annotated[Path, typer.Argument(help="a study, see `identify init` and `identify config`")]


@app.callback(invoke_without_command=True)
def version_option(
    version: Annotated[bool, typer.Option("--version", help="print the version and stop")] = False,
) -> None:
    """Options of identify itself."""
    if version:
        typer.echo(f"identify {VERSION}")
        raise typer.Exit


@app.command()
@takes_options
def fit(config: Config, options: FitOptions) -> None:
    """Fit a study: data in, parameters with intervals out.

    A study is of vibration, of motion or of single joints; its `schema:` says which.
    """
    _run("fit", config, options)


@app.command()
@takes_options
def simulate(
    config: Annotated[Path, typer.Argument(help="a study of motion, schema: identify-motion/1")],
    options: SimulateOptions,
) -> None:
    """Simulate the records of a study of motion.

    Drives, controllers, friction and elastic joints are those of the study.
    """
    _run("simulate", config, options)


@app.command()
@takes_options
def discover(config: Config, options: DiscoverOptions) -> None:
    """Find and name what is missing from the model of a study.

    Every effect that the data support is added, the gap (residual over noise; 1 is perfect) is shown to
    shrink, and the new config is written.

    Of a study of motion (schema identify-motion/1), from a catalogue: friction, gears, springs, bodies,
    controllers.  Of recorded motion (schema identify-explain/1), the same as `identify explain`.
    """
    _run("discover", config, options)


@app.command()
@takes_options
def explain(
    config: Annotated[Path, typer.Argument(help="a study of recorded motion, schema: identify-explain/1")],
    options: ExplainOptions,
) -> None:
    """Name the effects behind recorded motor torques and deflections.

    Tracking errors too.  Effects are fitted on one record and judged on another.  `identify discover` does
    the same with such a study.
    """
    _run("explain", config, options)


@app.command()
@takes_options
def modes(
    data: Annotated[
        list[Path],
        typer.Argument(
            help="FRFs, with --estimate forces and responses over time, with --output-only responses alone,"
            " in .uff, .csv, .h5 or .mat, in one file or a file for each setup; or a study, for all its FRF"
            " measurements"
        ),
    ],
    options: ModesOptions,
) -> None:
    """Find the modes of measured FRFs: frequencies, damping, shapes.

    Exit code 4 when there is none, or when they do not rebuild the FRFs. A universal file with mode shapes
    and no FRF is shown as it is.
    """
    from identify.core.asked import as_options
    from identify.core.collector import uncollected

    try:
        with uncollected(), as_options():
            from identify.api import commands as api

            found = api.run_modes(data, options, options.quiet)
    except InputError:
        if len(data) > 1 or not api.has_shapes_alone(data[0]):
            raise
        mac_(str(data[0]))
        typer.echo("mode shapes without FRFs, as they are; `identify mac` compares them with others")
        return
    try:
        _conclude(found, options)
    except typer.Exit:
        said = "no mode was found: see the rejected candidates in the report"
        if found.data.found:
            what = "half spectra" if options.output_only else "FRFs"
            said = (
                f"the modes do not rebuild the {what}: narrow the band with `--band` or raise `--max-order`"
            )
        typer.echo(said, err=True)
        raise


@app.command("mac")
def mac_(
    modes: Annotated[
        str, typer.Argument(help="modes: .h5 of `modes` (:NAME for one of several), .yaml, .csv, .unv")
    ],
    other: Annotated[str | None, typer.Argument(help="the modes to compare them with")] = None,
    by: Annotated[
        str | None,
        typer.Option(
            help="pair points by `node` number or `place`; default: by number where files share one"
        ),
    ] = None,
    within: Annotated[
        float | None, typer.Option(help="with --by place: how far apart, m, two points may be that are one")
    ] = None,
    out: Annotated[Path | None, typer.Option(help="the MAC matrix as a picture: .png, .svg or .pdf")] = None,
) -> None:
    """Show a set of modes, or compare two: frequency pairs, MAC, MACX, COMAC; needs no robot."""
    from identify.modes.compare_shapes import compare_modes
    from identify.reports.modes.mac import show, write_picture

    found = compare_modes(modes, other, by, within)
    show(found)
    if out is not None:
        write_picture(found, out)
        typer.echo(f"wrote {out}")


@app.command()
@takes_options
def batch(
    config: Annotated[Path, typer.Argument(help="a batch, schema: identify-batch/1")], options: BatchOptions
) -> None:
    """Fit many postures or studies; does a parameter vary?

    Tells whether a parameter depends on posture; exit code 4 when a fit failed.
    """
    _run("batch", config, options)


@app.command("map")
@takes_options
def map_(
    model: Annotated[Path, typer.Argument(help="result file of a fit")], options: MapCommandOptions
) -> None:
    """Map a fitted model over postures, with intervals.

    Frequencies, damping and FRFs of the tool, written as HDF5 and CSV.
    """
    from identify.api import commands as api

    _conclude(api.run_map(model, options, options.quiet), options)


@app.command()
@takes_options
def stability(
    model: Annotated[
        Path,
        typer.Argument(help="result file of a fit; or FRFs of the tool's tip, or a result of their modes"),
    ],
    options: StabilityOptions,
) -> None:
    """How deep a fitted robot, or a tip that was tapped, may cut: chatter limits over the spindle speed.

    From the receptances of the tool's tip, all nine, by three methods; and the limit of mode coupling.
    """
    from identify.api import commands as api

    _conclude(api.run_stability(model, options, options.quiet), options)


@app.command()
@takes_options
def deflection(
    model: Annotated[Path, typer.Argument(help="result file of a fit")], options: DeflectionOptions
) -> None:
    """How far forces push the tool, with intervals, and where to send it instead.

    Of a force, a path with forces, or the mean force of a cut; and the compliance ellipsoid.
    """
    from identify.api import commands as api

    _conclude(api.run_deflection(model, options, options.quiet), options)


@app.command()
@takes_options
def export(
    model: Annotated[Path, typer.Argument(help="result file of a fit or of a search for effects")],
    options: ExportCommandOptions,
) -> None:
    """Take a fitted model to other programs: matrices, universal files, MuJoCo, URDF, Simulink.

    What a format cannot say is said, or refused by name.
    """
    from identify.api import commands as api

    found = api.run_export(model, options)
    if not options.quiet:
        for note in found.notes:
            typer.echo(f"note: {note}")
        _say_written(found.written)


@app.command()
@takes_options
def plan(
    model: Annotated[Path, typer.Argument(help="a study with its first posture, or result file of a fit")],
    options: PlanCommandOptions,
) -> None:
    """Choose postures, impacts and sensors of the next test, and say what it promises.

    D-optimal for all parameters, I-optimal for targets; writes the test sheet and the study.
    """
    from identify.api import commands as api

    _conclude(api.run_plan(model, options, options.quiet), options)


@app.command()
@takes_options
def excite(
    config: Annotated[Path, typer.Argument(help="a study of excitation, schema: identify-excite/1")],
    options: ExciteOptions,
) -> None:
    """Find the motion that tells the most of a robot within its limits.

    Of base parameters, friction or transmission errors; promises intervals and rehearses them.
    """
    _run("excite", config, options)


@app.command()
def check(
    config: Config,
    quiet: Quiet = False,
    apply: Annotated[
        bool, typer.Option("--apply", help="write the study with its set-up corrected, beside this one")
    ] = False,
) -> None:
    """Examine a study of any kind and its measured data before it is run.

    Exit code 3 when a check fails.
    """
    from identify.core.config import family_of
    from identify.reports.kinds import print_findings
    from identify.reports.shown import working

    with working(quiet, "reading"):
        checked = checker_of(family_of(config))(config)
    if not quiet:
        print_findings(checked.findings, whole=not checked.refused)
    if checked.refused:
        raise InputErrors(list(checked.refused))
    if apply:
        if checked.correct is None:
            expected = "a mistake of the set-up that a change of the study puts right"
            raise InputError("--apply", "nothing to correct", expected, "leave `--apply` out")
        typer.echo("\n".join(f"wrote {path}" for path in checked.correct()))
        return
    if checked.failed:
        raise typer.Exit(EXIT_FAILED_CHECK)
    if not quiet:
        typer.echo(f"next: identify {checked.then} {typed([config])}")


@app.command()
@takes_options
def init(
    robot: RobotFile,
    data: Annotated[
        list[Path] | None,
        typer.Argument(help="measured FRFs or modal tables: files, or a folder or pattern for each posture"),
    ] = None,
    *,
    options: InitOptions,
) -> None:
    """Write a commented starter config for a robot and its data.

    With a mass, links without a body get one of their meshes, in a URDF beside the config.
    """
    from identify.api import commands as api

    for line in api.run_init(robot, data or [], options):
        typer.echo(line)


@app.command()
@takes_options
def points(
    robot: RobotFile,
    data: Annotated[
        list[Path] | None,
        typer.Argument(help="measured FRFs, or a file with the geometry of the test"),
    ] = None,
    *,
    options: PointsOptions,
) -> None:
    """Find where the nodes of a test are: lay its geometry on the robot, or click on a page.

    Writes points.csv from the geometry in universal files (datasets 15 or 2411) or a CSV of nodes, and a page
    to look at it and to put further nodes on the surfaces of the robot.  A study without points does the
    same when it is read.
    """
    from identify.api import commands as api
    from identify.reports.points.page import sentences

    placing, written = api.run_points(robot, data or [], options)
    if not options.quiet:
        typer.echo("\n".join(sentences(placing)))
        _say_written(written)


@app.command()
def config(
    kind: Annotated[
        str, typer.Option(help=f"of which kind of study: {', '.join(WITH_CONFIG)}")
    ] = WITH_CONFIG[0],
    motion: Annotated[bool, typer.Option("--motion", help="of a study of motion")] = False,
) -> None:
    """Print every key of a config with its default and meaning.

    The output is a JSON schema, which editors understand.
    """
    import json

    from identify.core.schema import config_schema

    name = "motion" if motion else kind
    if name not in WITH_CONFIG:
        raise InputError("--kind", repr(name), "one of " + ", ".join(WITH_CONFIG))
    typer.echo(json.dumps(config_schema(BY_NAME[name]), indent=2))


@app.command()
def report(
    files: Annotated[
        list[Path],
        typer.Argument(help="result file of a run; of several fits, to compare them", metavar="RUN.h5 ..."),
    ],
    export: Annotated[
        Path | None,
        typer.Option(help="also every figure as PNG and SVG, and the data as CSV, into this folder"),
    ] = None,
) -> None:
    """Write the HTML and PDF reports of a result again.

    From the result file alone; of several results, of their comparison.
    """
    from identify.core.binary_input import prepare

    prepare(files)  # it gets ready while the reports are imported
    from identify.reports.write import reports

    for path in reports(*files, export=export):
        _say_written([path])


@app.command()
def compare(
    files: Annotated[list[Path], typer.Argument(help="result files of runs", metavar="A.h5 B.h5 ...")],
    report: Annotated[
        bool, typer.Option("--report", help="also write an HTML and a PDF report beside the first")
    ] = False,
) -> None:
    """Set results side by side: cost, gap, parameters, modes."""
    from identify.reports.kinds import print_report
    from identify.results.comparison import compared

    print_report(compared(files))
    if report:
        from identify.reports.write import reports

        for path in reports(*files):
            _say_written([path])


def _run(command: str, config: Path, options: Any) -> None:
    """Do what the command means for a config of its kind, as `identify.api.commands` does."""
    from identify.api import commands as api

    _conclude(api.run(command, config, options, options.quiet), options, config)


def _conclude(found: Result, options: Any, config: Path | None = None) -> None:
    """Print the result, write the reports of its file, the page first, say what there is now, and what to do
    next.

    Exit code 4 where the result is not what was asked for.
    """
    from identify.reports.kinds import print_report
    from identify.reports.next_step import next_steps

    if not options.quiet:
        print_report(found.data)
        _say_written(found.written)
    if options.report:
        from identify.core.collector import uncollected

        with uncollected():
            from identify.reports.write import reports

            began = time.perf_counter()
            for path in reports(found.path):
                if not options.quiet:
                    _say_written([path], f" ({time.perf_counter() - began:.1f} s)")
                began = time.perf_counter()
    if not options.quiet:
        for step in next_steps(found, config):
            typer.echo(f"next: {step}")
    success = OF_KIND[found.data.KIND].success
    if success and not getattr(found.data, success):
        raise typer.Exit(EXIT_NOT_CONVERGED)


def _say_written(paths: Iterable[Path], in_time: str = "") -> None:
    for path in paths:
        typer.echo(f"wrote {path}{in_time}")

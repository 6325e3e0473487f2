"""The command line: parse, call, print; nothing else.  Every import of a command's machinery is inside the
command.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated, Any

import typer

from identify import __version__
from identify.core.errors import (
    EXIT_BAD_INPUT,
    EXIT_FAILED_CHECK,
    EXIT_INTERRUPTED,
    EXIT_NOT_CONVERGED,
    InputError,
    InputErrors,
)

app = typer.Typer(
    help="Fit elastic robot models to measured vibration, and say how far the fit can be trusted.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    add_completion=False,
)

Config = Annotated[Path, typer.Argument(help="a study, see `identify init` and `identify config`")]
Out = Annotated[Path | None, typer.Option(help="result file; default: reports/<name of the study>.h5")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="print nothing but errors")]


@app.callback(invoke_without_command=True)
def version_option(
    version: Annotated[bool, typer.Option("--version", help="print the version and stop")] = False,
) -> None:
    """Options of identify itself."""
    if version:
        typer.echo(f"identify {__version__}")
        raise typer.Exit


@app.command()
def fit(
    config: Config,
    out: Out = None,
    seed: Annotated[int | None, typer.Option(help="overrides `seed` of the study")] = None,
    starts: Annotated[int | None, typer.Option(help="overrides `starts` of the study")] = None,
    report: Annotated[bool, typer.Option(help="write the HTML and PDF reports beside the result")] = True,
    resume: Annotated[
        bool,
        typer.Option(
            "--resume", help="go on with an interrupted run; the result is that of an undisturbed one"
        ),
    ] = False,
    profile: Annotated[
        list[str] | None, typer.Option(help="also the profile likelihood of this parameter; repeatable")
    ] = None,
    quiet: Quiet = False,
) -> None:
    """Fit a study, of vibration, of motion or of single joints: data in, parameters with intervals out."""
    from identify.core.config import family_of
    from identify.reports.fit.terminal import print_result, progress_bar
    from identify.vibration.run import run_fit

    family = family_of(config)
    if family == "identify-joints":
        _fit_joints(config, out, report, quiet, refused=resume or bool(profile or seed or starts))
        return
    if family == "identify-motion":
        _fit_motion(
            config, out, {"seed": seed, "starts": starts}, report, quiet, resume=resume, refused=bool(profile)
        )
        return
    with progress_bar(quiet) as progress:
        result, path = run_fit(
            config, out, {"seed": seed, "starts": starts}, progress, resume=resume, profiled=profile or []
        )
    if not quiet:
        print_result(result)
    _finish([path], report, quiet)
    if not quiet and any("`identify discover " in sentence for sentence in result.verdict):
        typer.echo(f"next: identify discover {config}")
    if not result.converged:
        raise typer.Exit(EXIT_NOT_CONVERGED)


@app.command()
def simulate(
    config: Annotated[Path, typer.Argument(help="a study of motion, schema: identify-motion/1")],
    out: Out = None,
    tables: Annotated[Path | None, typer.Option(help="also a CSV of every record into this folder")] = None,
    report: Annotated[bool, typer.Option(help="write the HTML and PDF reports beside the result")] = True,
    quiet: Quiet = False,
) -> None:
    """Simulate the records of a study of motion: drives, controllers, friction, elastic joints."""
    from identify.motion.run import run_simulation
    from identify.reports.motion.terminal import print_motion

    result, written = run_simulation(config, out, tables)
    if not quiet:
        print_motion(result)
    _finish(written, report, quiet)


@app.command()
def discover(
    config: Config,
    out: Annotated[
        Path | None, typer.Option(help="result file; default: reports/<name of the study>_discovery.h5")
    ] = None,
    starts: Annotated[int | None, typer.Option(help="overrides `starts` of the study")] = None,
    workers: Annotated[int | None, typer.Option(min=1, help="processes; default: one per core")] = None,
    report: Annotated[bool, typer.Option(help="write the HTML and PDF reports beside the result")] = True,
    resume: Annotated[
        bool,
        typer.Option("--resume", help="go on with an interrupted run; what was tried is not tried again"),
    ] = False,
    quiet: Quiet = False,
) -> None:
    """Find what is missing from the model of a study, name it, add it, and show the gap shrink; writes the
    new config.

    Of recorded motion (schema identify-explain/1), the same as `identify explain`.
    """
    import os

    from identify.core.config import family_of
    from identify.discovery.run import run_discover
    from identify.reports.fit.terminal import print_discovery, story

    if family_of(config) == "identify-explain":
        if resume or starts or workers:
            found = "`--resume`, `--starts` or `--workers` with recorded motion"
            raise InputError(str(config), found, "a study of vibration", "leave the option out")
        explain(config, out, report, quiet)
        return
    with story(quiet) as told:
        result, written = run_discover(
            config, out, {"starts": starts}, told, workers=workers or os.cpu_count() or 1, resume=resume
        )
    if not quiet:
        print_discovery(result)
    _finish(written, report, quiet)


@app.command()
def explain(
    config: Annotated[Path, typer.Argument(help="a study of recorded motion, schema: identify-explain/1")],
    out: Out = None,
    report: Annotated[bool, typer.Option(help="write the HTML and PDF reports beside the result")] = True,
    quiet: Quiet = False,
) -> None:
    """Name the effects behind recorded motor torques, deflections and tracking errors; fitted on one record,
    judged on another.
    """
    from identify.explain.run import run_explain
    from identify.reports.explain.terminal import print_explained, story

    with story(quiet) as told:
        result, path = run_explain(config, out, told)
    if not quiet:
        print_explained(result)
    _finish([path], report, quiet)


@app.command()
def modes(
    data: Annotated[
        Path, typer.Argument(help="FRFs in .uff, .csv, .h5 or .mat; or a study, for all its FRF measurements")
    ],
    out: Annotated[
        Path | None, typer.Option(help="result file; default: reports/<name of the data>_modes.h5")
    ] = None,
    unit: Annotated[
        str | None, typer.Option(help="unit of the FRFs, such as m/s^2/N or g/N, where the file does not say")
    ] = None,
    quantity: Annotated[
        str | None, typer.Option(help="receptance, mobility or accelerance, where the file does not say")
    ] = None,
    averages: Annotated[int | None, typer.Option(help="averages behind each FRF")] = None,
    window_decay: Annotated[
        float | None, typer.Option(help="decay, 1/s, of an exponential window on force and response")
    ] = None,
    band: Annotated[tuple[float, float] | None, typer.Option(help="lowest and highest frequency, Hz")] = None,
    estimator: Annotated[str | None, typer.Option(help="plscf or lsce")] = None,
    direction: Annotated[str | None, typer.Option(help="only the responses along X, Y or Z")] = None,
    mode: Annotated[
        list[float] | None,
        typer.Option(help="choose by hand: the mode nearest to this frequency, Hz; repeatable"),
    ] = None,
    max_order: Annotated[
        int | None, typer.Option(help="largest model order of the stabilisation diagram")
    ] = None,
    geometry: Annotated[
        Path | None, typer.Option(help="universal file with the measurement points; default: the data file")
    ] = None,
    length_unit: Annotated[
        str | None, typer.Option(help="m, mm, cm, in or ft, where the geometry does not say")
    ] = None,
    report: Annotated[bool, typer.Option(help="write the HTML and PDF reports beside the result")] = True,
    quiet: Quiet = False,
) -> None:
    """Find the modes of measured FRFs: frequencies, damping and shapes; exit code 4 when there is none."""
    from identify.modes.run import file_options, run_modes
    from identify.reports.fit.terminal import print_modes

    file = file_options(unit=unit, quantity=quantity, averages=averages, window_decay_per_s=window_decay)
    given = {
        "band_hz": band,
        "estimator": estimator,
        "direction": direction,
        "modes_hz": mode or None,
        "max_order": max_order,
    }
    modal = {key: value for key, value in given.items() if value is not None}
    result, written = run_modes(data, out, file, modal, geometry, length_unit)
    if not quiet:
        print_modes(result)
    _finish(written, report, quiet)
    if not result.found:
        typer.echo("no mode was found: see the rejected candidates in the report", err=True)
        raise typer.Exit(EXIT_NOT_CONVERGED)


Workers = Annotated[
    int | None, typer.Option(min=1, help="local worker processes; default: one per processor")
]
Cluster = Annotated[
    str | None,
    typer.Option(help="address of a Dask scheduler, which then does the work; see docs/cluster.md"),
]
Resume = Annotated[
    bool, typer.Option("--resume", help="keep what is finished, go on with what was interrupted, do the rest")
]


@app.command()
def batch(
    config: Annotated[Path, typer.Argument(help="a batch, schema: identify-batch/1")],
    out: Out = None,
    workers: Workers = None,
    cluster: Cluster = None,
    resume: Resume = False,
    report: Annotated[bool, typer.Option(help="write the HTML and PDF reports beside the summary")] = True,
    quiet: Quiet = False,
) -> None:
    """Fit many postures or studies, and tell whether a parameter depends on posture; exit code 4 when a fit
    failed.
    """
    from identify.batch.run import run_batch
    from identify.reports.batch.terminal import batch_bar, print_batch

    with batch_bar(quiet) as watch:
        result, written = run_batch(config, out, workers=workers, cluster=cluster, resume=resume, watch=watch)
    if not quiet:
        print_batch(result)
    _finish(written, report, quiet)
    if result.failed:
        raise typer.Exit(EXIT_NOT_CONVERGED)


@app.command("map")
def map_(
    model: Annotated[Path, typer.Argument(help="result file of a fit")],
    postures: Annotated[
        Path | None, typer.Option(help="CSV of postures: joint1_deg, joint2_deg, ..., and name if wanted")
    ] = None,
    grid: Annotated[
        list[str] | None,
        typer.Option(help="JOINT:FIRST:LAST:COUNT in degrees, such as 2:-60:60:9; repeatable"),
    ] = None,
    tool: Annotated[
        int | None, typer.Option(help="node of the tool's point; default: the last of the points")
    ] = None,
    band: Annotated[
        tuple[float, float] | None, typer.Option(help="lowest and highest frequency, Hz; default: of the fit")
    ] = None,
    lines: Annotated[int, typer.Option(help="frequencies over the band")] = 100,
    modes: Annotated[int, typer.Option(min=1, help="how many modes")] = 6,
    out: Annotated[Path | None, typer.Option(help="result file; default: <model>_map.h5")] = None,
    workers: Workers = None,
    cluster: Cluster = None,
    resume: Resume = False,
    report: Annotated[bool, typer.Option(help="write the HTML and PDF reports beside the map")] = True,
    quiet: Quiet = False,
) -> None:
    """Map a fitted model over postures: frequencies, damping and FRFs of the tool, with intervals; HDF5 and
    CSV.
    """
    from identify.map.run import MapOptions, parse_grid, run_map
    from identify.reports.batch.terminal import batch_bar, print_said

    options = MapOptions(postures, tuple(parse_grid(text) for text in grid or ()), tool, band, lines, modes)
    with batch_bar(quiet) as watch:
        result, written = run_map(
            model, options, out, workers=workers, cluster=cluster, resume=resume, watch=watch
        )
    if not quiet:
        print_said(result.verdict, result.notes)
    _finish(written, report, quiet)


@app.command()
def check(config: Config, quiet: Quiet = False) -> None:
    """Examine the measured data of a study before a fit; exit code 3 when a check fails."""
    from identify.reports.fit.terminal import print_findings
    from identify.vibration.check import run_checks

    checked = run_checks(config)
    if not quiet:
        print_findings(checked.findings)
    if checked.refused:
        raise InputErrors(list(checked.refused))
    if checked.failed:
        raise typer.Exit(EXIT_FAILED_CHECK)


@app.command()
def init(
    robot: Annotated[Path, typer.Argument(help="URDF, or YAML with a Denavit-Hartenberg table")],
    data: Annotated[list[Path], typer.Argument(help="measured FRFs or modal tables")],
    out: Annotated[Path, typer.Option(help="config file to write")] = Path("config.yaml"),
    points: Annotated[
        Path | None, typer.Option(help="CSV of measurement points; default: points.csv beside the robot")
    ] = None,
) -> None:
    """Write a commented starter config for a robot and its data."""
    from identify.vibration.starter import write_starter

    typer.echo(
        f"wrote {write_starter(robot, data, out, points)}: fill in what is marked, then `identify check` and"
        " `identify fit` it"
    )


@app.command()
def config(motion: Annotated[bool, typer.Option("--motion", help="of a study of motion")] = False) -> None:
    """Print the schema of a config as JSON: every key with its default and meaning."""
    import json

    from identify.schema import motion_schema, study_schema

    typer.echo(json.dumps(motion_schema() if motion else study_schema(), indent=2))


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
    """Write the HTML and PDF reports of a result beside it, from the result file alone; of several results,
    of their comparison.
    """
    from identify.reports.write import write_reports

    typer.echo("\n".join(f"wrote {name}" for name in write_reports(*files, export=export)))


@app.command()
def compare(
    files: Annotated[list[Path], typer.Argument(help="result files of runs", metavar="A.h5 B.h5 ...")],
    report: Annotated[
        bool, typer.Option("--report", help="also write an HTML and a PDF report beside the first")
    ] = False,
) -> None:
    """Set results side by side: cost, gap, parameters, modes and errors."""
    from identify.reports.fit.terminal import print_comparison
    from identify.results.comparison import unique_labels
    from identify.results.file import read
    from identify.results.fit import FitResult
    from identify.results.side_by_side import compare as side_by_side

    print_comparison(side_by_side([read(path, FitResult) for path in files], unique_labels(files)))
    if report:
        from identify.reports.write import write_reports

        typer.echo("\n".join(f"wrote {name}" for name in write_reports(*files)))


def _fit_motion(
    config: Path,
    out: Path | None,
    overrides: dict[str, int | None],
    report: bool,
    quiet: bool,
    *,
    resume: bool,
    refused: bool,
) -> None:
    """Fit a study of motion."""
    from identify.motion.run import run_motion_fit
    from identify.reports.fit.terminal import progress_bar
    from identify.reports.motion.terminal import print_motion

    if refused:
        raise InputError(
            str(config), "`--profile` with a study of motion", "a study of vibration", "leave the option out"
        )
    with progress_bar(quiet) as progress:
        result, path = run_motion_fit(config, out, overrides, progress, resume=resume)
    if not quiet:
        print_motion(result)
    _finish([path], report, quiet)
    if not result.converged:
        raise typer.Exit(EXIT_NOT_CONVERGED)


def _fit_joints(config: Path, out: Path | None, report: bool, quiet: bool, *, refused: bool) -> None:
    """Identify the curves of a study of joints."""
    from identify.joints.run import run_joints
    from identify.reports.joints.terminal import print_joints

    if refused:
        found = "`--seed`, `--starts`, `--resume` or `--profile` with a study of joints"
        raise InputError(str(config), found, "a study of vibration or motion", "leave the option out")
    result, path = run_joints(config, out)
    if not quiet:
        print_joints(result)
    _finish([path], report, quiet)


def _finish(written: list[Path], report: bool, quiet: bool) -> None:
    """Write the reports of the result file, the first that was written, and say what there is now."""
    if report:
        from identify.reports.write import write_reports

        written = written + write_reports(written[0])
    if not quiet:
        typer.echo("\n".join(f"wrote {name}" for name in written))


def main() -> None:
    """Entry point: limits BLAS to one thread (small matrices), turns input errors into a sentence and exit
    code 2, Ctrl-C and a polite kill into one and exit code 130.
    """
    import os
    import warnings

    from identify.core.interruption import Interrupted, check, listening
    from identify.core.part_file import DamagedPart

    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(name, "1")
    show = warnings.showwarning

    def note(message: Warning | str, category: type[Warning], *where: Any, **other: Any) -> None:
        if issubclass(category, DamagedPart):
            typer.echo(f"note: {message}", err=True)
        else:
            show(message, category, *where, **other)

    warnings.showwarning = note
    ended = _sentence_on_interruption(sys.argv[1:2])
    try:
        with listening(ended):
            try:
                app()
            except SystemExit:
                check()  # a signal that came too late to be looked at is not swallowed
                raise
    except (InputError, InputErrors) as error:
        typer.echo("\n".join(f"error: {line}" for line in str(error).splitlines()), err=True)
        sys.exit(EXIT_BAD_INPUT)
    except Interrupted:
        typer.echo(ended, err=True)
        sys.exit(EXIT_INTERRUPTED)


def _sentence_on_interruption(words: list[str]) -> str:
    """What is said when a command was interrupted: how it is resumed, where it can be."""
    import inspect

    resumable = [
        (one.name or one.callback.__name__)
        for one in app.registered_commands
        if one.callback is not None and "resume" in inspect.signature(one.callback).parameters
    ]
    return (
        "interrupted; resume with `--resume`"
        if words[:1] in [[name] for name in resumable]
        else "interrupted"
    )

"""The command line: parse, call, print; nothing else.  Every import of a command's machinery is inside the command."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from identify import __version__
from identify.errors import EXIT_BAD_INPUT, EXIT_FAILED_CHECK, EXIT_INTERRUPTED, EXIT_NOT_CONVERGED, InputError, InputErrors

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
def version_option(version: Annotated[bool, typer.Option("--version", help="print the version and stop")] = False) -> None:
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
        bool, typer.Option("--resume", help="go on with an interrupted run; the result is that of an undisturbed one")
    ] = False,
    profile: Annotated[list[str] | None, typer.Option(help="also the profile likelihood of this parameter; repeatable")] = None,
    quiet: Quiet = False,
) -> None:
    """Fit a study: data in, parameters with intervals out."""
    from identify.run import run_fit
    from identify.terminal import print_result, progress_bar

    with progress_bar(quiet) as progress:
        result, path = run_fit(config, out, {"seed": seed, "starts": starts}, progress, resume=resume, profiled=profile or [])
    if not quiet:
        print_result(result)
    written = [path]
    if report:
        from identify.reports.write import write_reports

        written += write_reports(path)
    if not quiet:
        typer.echo("\n".join(f"wrote {name}" for name in written))
    if not result.converged:
        raise typer.Exit(EXIT_NOT_CONVERGED)


@app.command()
def check(config: Config, quiet: Quiet = False) -> None:
    """Examine the measured data of a study before a fit; exit code 3 when a check fails."""
    from identify.run import run_checks
    from identify.terminal import print_findings

    findings = run_checks(config)
    if not quiet:
        print_findings(findings)
    if any(finding.level == "fail" for found in findings.values() for finding in found):
        raise typer.Exit(EXIT_FAILED_CHECK)


@app.command()
def init(
    robot: Annotated[Path, typer.Argument(help="URDF, or YAML with a Denavit-Hartenberg table")],
    data: Annotated[list[Path], typer.Argument(help="measured FRFs or modal tables")],
    out: Annotated[Path, typer.Option(help="config file to write")] = Path("config.yaml"),
    points: Annotated[Path | None, typer.Option(help="CSV of measurement points; default: points.csv beside the robot")] = None,
) -> None:
    """Write a commented starter config for a robot and its data."""
    from identify.starter import write_starter

    typer.echo(f"wrote {write_starter(robot, data, out, points)}: fill in what is marked, then `identify check` and `identify fit` it")


@app.command()
def config() -> None:
    """Print the schema of a config as JSON: every key with its default and meaning."""
    import json

    from identify.schema import study_schema

    typer.echo(json.dumps(study_schema(), indent=2))


@app.command()
def report(result: Annotated[Path, typer.Argument(help="result file of a run")]) -> None:
    """Write the HTML and PDF reports of a result beside it, from the result file alone."""
    from identify.reports.write import write_reports

    typer.echo("\n".join(f"wrote {name}" for name in write_reports(result)))


@app.command()
def compare(files: Annotated[list[Path], typer.Argument(help="result files of runs", metavar="A.h5 B.h5 ...")]) -> None:
    """Set results side by side: cost, gap, parameters, modes and errors."""
    from identify.compare import compare as side_by_side
    from identify.results import read
    from identify.terminal import print_comparison

    print_comparison(side_by_side([read(path) for path in files], [path.stem for path in files]))


def main() -> None:
    """Entry point: limits BLAS to one thread (small matrices), turns input errors into a sentence and exit code 2."""
    import os
    import signal

    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(name, "1")
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # a polite kill ends a run as Ctrl-C does: saved and resumable
    try:
        app()
    except (InputError, InputErrors) as error:
        typer.echo("\n".join(f"error: {line}" for line in str(error).splitlines()), err=True)
        sys.exit(EXIT_BAD_INPUT)
    except KeyboardInterrupt:
        typer.echo("interrupted; go on with `--resume`", err=True)
        sys.exit(EXIT_INTERRUPTED)

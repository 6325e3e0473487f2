"""The command `identify`, also as `python -m identify`."""

from __future__ import annotations

import sys
from typing import Any

from identify.core.version import VERSION


def main() -> None:
    """Entry point: limits BLAS to one thread (small matrices), turns input errors, paths that the system does
    not take, and want of memory into a sentence and exit code 2, Ctrl-C and a polite kill into one and exit
    code 130.

    The version is printed without loading what parses a command line.
    """
    if sys.argv[1:] == ["--version"]:
        print(f"identify {VERSION}")
        return
    import typer

    from identify import cli
    from identify.core.errors import EXIT_BAD_INPUT, EXIT_INTERRUPTED, InputError, InputErrors
    from identify.core.interruption import Interrupted, check, listening

    _prepare()
    ended = _sentence_on_interruption(sys.argv[1:2])
    try:
        with listening(ended):
            try:
                cli.app()
            except SystemExit:
                check()  # a signal that came too late to be looked at is not swallowed
                raise
    except (InputError, InputErrors) as error:
        typer.echo("\n".join(f"error: {line}" for line in str(error).splitlines()), err=True)
        sys.exit(EXIT_BAD_INPUT)
    except OSError as error:
        if error.filename is None:  # such as of a pipe that was closed
            raise
        found = f"{error.filename}: {error.strerror}"
        typer.echo(f"error: {found}; expected a path that can be used; choose another.", err=True)
        sys.exit(EXIT_BAD_INPUT)
    except MemoryError as error:
        typer.echo(
            f"error: more memory than there is ({error}); ask for fewer starts, lines or steps.", err=True
        )
        sys.exit(EXIT_BAD_INPUT)
    except Interrupted:
        typer.echo(ended, err=True)
        sys.exit(EXIT_INTERRUPTED)


def _prepare() -> None:
    """What holds for the process: threads, libraries, warnings that are notes, and what a pipe takes."""
    import os
    import warnings

    import typer

    from identify.core.part_file import DamagedPart
    from identify.core.plugin import BrokenPlugin

    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(name, "1")
    os.environ.setdefault("MUJOCO_GL", "disable")  # no window is opened: its libraries are slow to load
    show = warnings.showwarning

    def note(message: Warning | str, category: type[Warning], *where: Any, **other: Any) -> None:
        if issubclass(category, (DamagedPart, BrokenPlugin)):
            typer.echo(f"note: {message}", err=True)
        else:
            show(message, category, *where, **other)

    warnings.showwarning = note
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):  # a pipe of another code page must not end a finished run
            stream.reconfigure(errors="replace")


def _sentence_on_interruption(words: list[str]) -> str:
    """What is said when a command was interrupted: how it is resumed, where it can be."""
    import inspect

    from identify.cli import app

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


if __name__ == "__main__":
    main()

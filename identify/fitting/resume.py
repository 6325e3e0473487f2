"""Runs that can be resumed: what makes two runs the same, what an interrupted one leaves on disk, and how it
is taken up again.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, TypeVar

from identify.core.atomic import ELSEWHERE, locked, remove_asides
from identify.core.config import ConfigFile, validated
from identify.core.errors import InputError
from identify.core.part_file import PartFile
from identify.results import file as result_file
from identify.results import tables
from identify.results.header import KeyedHeader

T = TypeVar("T", bound=KeyedHeader)
F = TypeVar("F", bound=ConfigFile[Any])


@contextmanager
def held(path: Path, *, replace: bool = False) -> Iterator[None]:
    """Hold the output `path` for a run, and tidy up after one that was killed.

    InputError where it cannot be written, nor the reports beside it, where another run holds it, or where
    something is there that is no result (unless replace), as an input may be.  What is there stays until it
    is replaced.
    """
    result_file.check_writable(path)
    for report in (path.with_suffix(suffix) for suffix in (".html", ".pdf")):
        if report.is_dir() or report == path:
            raise InputError(str(report), "is where a report will be written", "another place", ELSEWHERE)
    if path.exists() and not replace and not result_file.kind_of(path):
        raise InputError(
            str(path), "exists and is no result of identify", "a new file or a result", ELSEWHERE
        )
    with locked(path, f"wait for it, or {ELSEWHERE}"):
        remove_asides(path)
        yield


@contextmanager
def kept_aside(path: Path, key: str, *, resume: bool = False, replace: bool = False) -> Iterator[PartFile]:
    """The part file of a run of `key` that will write `path`; it stays where the run does not come to its
    end, whatever the reason, and is taken away where it does, or where it has not begun.

    resume: with what an interrupted run of that key has left; InputError where it is one of something else,
    unless that may be replaced.
    """
    aside = _aside(path)
    part = PartFile.read(aside) if resume else None
    if part is not None and part.key != key and not replace:
        raise _another(aside, "the interrupted run there")
    if part is None or part.key != key:
        part = PartFile(aside, key)
        part.remove()
    try:
        yield part
    except BaseException:
        if part.records:
            with suppress(InputError):
                part.flush()
        else:
            part.remove()  # refused before anything was worth keeping
        raise
    part.remove()


def resumable(
    path: Path,
    key: str,
    kind: type[T],
    compute: Callable[[PartFile], T],
    *,
    resume: bool = False,
    replace: bool = False,
) -> T:
    """What `compute` gives, a result of that kind with that key, written to `path`; while it runs, the part
    file that it is given keeps what `resume` needs.

    resume: a finished run of that key is read instead, an interrupted one gone on with; replace: where there
    is a run of something else, begin anew instead of refusing.
    """
    with held(path, replace=replace):
        if resume:
            done = finished(path, key, kind)
            if done is not None:
                PartFile(_aside(path), key).remove()  # killed between the result and this
                return done
        with kept_aside(path, f"{kind.KIND} {key}", resume=resume, replace=replace) as part:
            if resume and not part.records and not replace and result_file.kind_of(path):
                raise _another(path, "the run there")
            result = compute(part)
            result_file.write(result, path)
        return result


def run_key(p: tables.Provenance, file: ConfigFile[Any], more: Sequence[str] = ()) -> str:
    """What makes two runs the same: settings, input files, the versions that compute, and what more is asked
    of this one.
    """
    settings = ",".join(f"{name}={value}" for name, value in sorted(file.overrides.items()))
    parts = (p.config_sha256, settings, *p.input_sha256, p.identify, p.python, *p.packages, *more)
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()


def finished(path: Path, key: str, kind: type[T]) -> T | None:
    """The finished run of `key` at `path`, if there is one."""
    if not path.exists() or result_file.kind_of(path) != kind.KIND:
        return None
    done = result_file.read(path, kind)
    return done if done.key == key else None


def _aside(path: Path) -> Path:
    return path.with_name(f"{path.name}.part")


def _another(path: Path, what: str) -> InputError:
    """A run that is not resumed because it is one of something else."""
    fix = "run without `--resume`, or choose another file with `--out`"
    return InputError(str(path), f"{what} had another config, data or version", "the same study", fix)


def override(file: F, overrides: dict[str, Any]) -> F:
    """The study with keys replaced by those that are not None."""
    given = {key: value for key, value in overrides.items() if value is not None}
    if not given:
        return file
    study, fields = file.study, type(file.study).model_fields
    kept = {
        field.alias or name: getattr(study, name)
        for name, field in fields.items()
        if name in study.model_fields_set
    }
    changed = validated(Path("the command line"), {**kept, **given}, type(study))
    return file.model_copy(update={"study": changed, "overrides": given})

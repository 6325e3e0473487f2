"""Runs that can be resumed: what makes two runs the same, what an interrupted one leaves on disk, and how it
is taken up again.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from identify.core.config import ConfigFile
from identify.core.errors import InputError
from identify.fitting.journal import Journal
from identify.results import file as result_file
from identify.results import tables
from identify.results.header import KeyedHeader

T = TypeVar("T", bound=KeyedHeader)
F = TypeVar("F", bound=ConfigFile[Any])


def resumable(
    path: Path,
    key: str,
    kind: type[T],
    journal: Journal,
    compute: Callable[[], T],
    *,
    resume: bool = False,
    replace: bool = False,
) -> T:
    """What `compute` gives, a result of that kind with that key, written to `path`, which while it runs holds
    what `resume` needs.

    resume: a finished run of that key is read instead, an interrupted one gone on with; replace: see
    `fit_study`.
    """
    if resume:
        done = _finished(path, key, kind)
        if done is not None:
            return done
        journal.remembered = _remembered(path, key, replace)
    journal.save = lambda costs: result_file.write(result_file.unfinished(key, costs), path)
    result_file.check_writable(
        path
    )  # now, not after an hour; an older result stays until this run has something to save
    try:
        result = compute()
    except KeyboardInterrupt:
        journal.flush()
        raise
    result_file.write(result, path)
    return result


def run_key(p: tables.Provenance, file: ConfigFile[Any]) -> str:
    """What makes two runs the same: settings, input files, and the versions that compute."""
    settings = ",".join(f"{name}={value}" for name, value in sorted(file.overrides.items()))
    parts = (p.config_sha256, settings, *p.input_sha256, p.identify, p.python, *p.packages)
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()


def _remembered(path: Path, key: str, replace: bool) -> NDArray[np.float64]:
    """The costs of the interrupted run at `path`; InputError where it is one of something else, unless that
    may be replaced.
    """
    if not path.exists() or (replace and result_file.kind_of(path) != result_file.UNFINISHED):
        return np.zeros(0)
    kept = result_file.read(path, result_file.Unfinished)
    if kept.key != key and replace:
        return np.zeros(0)
    check_key(path, kept.key, key)
    return kept.costs


def check_key(path: Path, found: str, key: str) -> None:
    """Raise an InputError where the interrupted run at `path` is one of something else."""
    if found != key:
        different = "the interrupted run there had another config, data or version"
        raise InputError(
            str(path),
            different,
            "the same study",
            "run without `--resume`, or choose another file with `--out`",
        )


def _finished(path: Path, key: str, kind: type[T]) -> T | None:
    """The finished run of the same study at `path`, if there is one."""
    if not path.exists() or result_file.kind_of(path) != kind.KIND:
        return None
    done = result_file.read(path, kind)
    return done if done.key == key else None


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
    return file.model_copy(
        update={"study": type(study).model_validate({**kept, **given}), "overrides": given}
    )

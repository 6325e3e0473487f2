"""What the commands do, without the terminal: read a study, do the work, write the result."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, ClassVar, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from identify.core.errors import InputError
from identify.fitting.fit import Progress, fit
from identify.fitting.journal import Journal
from identify.measured.finding import Finding
from identify.measured.quality import check
from identify.results import fit as results
from identify.results.provenance import provenance, provenance_of, robot_inputs, sha256
from identify.robot.points import read_points
from identify.vibration.evaluate import evaluate
from identify.vibration.problem import load_problem, measurement_names, read_frfs
from identify.vibration.study import ConfigFile, StudyFile, read_study


class Keyed(Protocol):
    """The result of a run that can be resumed, with what tells it from other runs."""

    KIND: ClassVar[str]

    @property
    def key(self) -> str:
        """See `run_key`."""


T = TypeVar("T", bound=Keyed)
F = TypeVar("F", bound=ConfigFile[Any])


def run_fit(
    config: Path,
    out: Path | None,
    overrides: dict[str, Any],
    progress: Progress | None = None,
    *,
    resume: bool = False,
    profiled: Sequence[str] = (),
) -> tuple[results.Result, Path]:
    """Fit the study in `config`, write the result and return it with its path; overrides replace keys of the study.

    profiled: names of parameters whose profile likelihood is wanted.  While it runs, the file holds what `resume` needs;
    a finished run of the same study is not run again by it.
    """
    file = override(read_study(config), overrides)
    path = out or Path("reports") / f"{file.study.name}.h5"
    return fit_study(file, path, progress, resume=resume, profiled=profiled), path


def fit_study(
    file: StudyFile,
    path: Path,
    progress: Progress | None = None,
    *,
    resume: bool = False,
    replace: bool = False,
    profiled: Sequence[str] = (),
) -> results.Result:
    """The same for a study that has been read; replace: where `resume` finds a run of something else, begin anew instead of refusing."""
    progress = progress or Progress()
    with threadpool_limits(1):
        problem = load_problem(file)
        key = run_key(provenance_of(problem), file)

        def compute() -> results.Result:
            return evaluate(problem, fit(problem, progress), key, profiled)

        return resumable(path, key, results.Result, progress.journal, compute, resume=resume, replace=replace)


def resumable(
    path: Path, key: str, kind: type[T], journal: Journal, compute: Callable[[], T], *, resume: bool = False, replace: bool = False
) -> T:
    """What `compute` gives, a result of that kind with that key, written to `path`, which while it runs holds what `resume` needs.

    resume: a finished run of that key is read instead, an interrupted one gone on with; replace: see `fit_study`.
    """
    if resume:
        done = _finished(path, key, kind)
        if done is not None:
            return done
        journal.remembered = _remembered(path, key, replace)
    journal.save = lambda costs: results.write(results.unfinished(key, costs), path)
    results.check_writable(path)  # now, not after an hour; an older result stays until this run has something to save
    try:
        result = compute()
    except KeyboardInterrupt:
        journal.flush()
        raise
    results.write(result, path)
    return result


def finished_before(file: StudyFile, path: Path) -> results.Result | None:
    """The finished run of this very study, data and versions at `path`, told from the hashes of its input files, which are not parsed."""
    if any(m.repeats for m in file.study.measurements):
        return None  # their mean has no hash of its own
    try:
        measured = [(str(m.source), sha256(file.resolve(m.source))) for m in file.study.measurements]
        inputs = [*robot_inputs(file), *measured]
    except OSError:
        return None
    return _finished(path, run_key(provenance(file.path.name, file.text, inputs), file), results.Result)


def run_key(p: results.Provenance, file: ConfigFile[Any]) -> str:
    """What makes two runs the same: settings, input files, and the versions that compute."""
    settings = ",".join(f"{name}={value}" for name, value in sorted(file.overrides.items()))
    parts = (p.config_sha256, settings, *p.input_sha256, p.identify, p.python, *p.packages)
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()


def _remembered(path: Path, key: str, replace: bool) -> NDArray[np.float64]:
    """The costs of the interrupted run at `path`; InputError where it is one of something else, unless that may be replaced."""
    if not path.exists() or (replace and results.kind_of(path) != results.UNFINISHED):
        return np.zeros(0)
    kept = results.read(path, results.Unfinished)
    if kept.key != key and replace:
        return np.zeros(0)
    check_key(path, kept.key, key)
    return kept.costs


def check_key(path: Path, found: str, key: str) -> None:
    """Raise an InputError where the interrupted run at `path` is one of something else."""
    if found != key:
        different = "the interrupted run there had another config, data or version"
        raise InputError(str(path), different, "the same study", "run without `--resume`, or choose another file with `--out`")


def _finished(path: Path, key: str, kind: type[T]) -> T | None:
    """The finished run of the same study at `path`, if there is one."""
    if not path.exists() or results.kind_of(path) != kind.KIND:
        return None
    done = results.read(path, kind)
    return done if done.key == key else None


def run_checks(config: Path) -> dict[str, list[Finding]]:
    """The findings on every FRF measurement of a study, by its name."""
    file = read_study(config)
    names = {node: point.name for node, point in (read_points(file.resolve(file.study.points)) if file.study.points else {}).items()}
    measurements = zip(measurement_names(file.study.measurements), file.study.measurements, strict=True)
    return {
        name: check(read_frfs(file, settings), names, file.study.band_hz) for name, settings in measurements if settings.file is not None
    }


def override(file: F, overrides: dict[str, Any]) -> F:
    """The study with keys replaced by those that are not None."""
    given = {key: value for key, value in overrides.items() if value is not None}
    if not given:
        return file
    study, fields = file.study, type(file.study).model_fields
    kept = {field.alias or name: getattr(study, name) for name, field in fields.items() if name in study.model_fields_set}
    return file.model_copy(update={"study": type(study).model_validate({**kept, **given}), "overrides": given})

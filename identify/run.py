"""What the commands do, without the terminal: read a study, do the work, write the result."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from identify import results
from identify.errors import InputError
from identify.evaluate import evaluate
from identify.fit import Progress, fit
from identify.measured.finding import Finding
from identify.measured.quality import check
from identify.problem import Problem, load_problem, measurement_names, read_frfs
from identify.provenance import provenance_of
from identify.robot.points import read_points
from identify.study import Study, StudyFile, read_study


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
    file, progress = _override(read_study(config), overrides), progress or Progress()
    path = out or Path("reports") / f"{file.study.name}.h5"
    with threadpool_limits(1):
        problem = load_problem(file)
        key = _key(problem, overrides)
        if resume:
            done = _finished(path, key)
            if done is not None:
                return done, path
            progress.journal.remembered = _remembered(path, key)
        progress.journal.save = lambda costs: results.write(results.unfinished(key, costs), path)
        results.check_writable(path)  # now, not after an hour; an older result stays until this run has something to save
        try:
            found = fit(problem, progress)
        except KeyboardInterrupt:
            progress.journal.flush()
            raise
        result = evaluate(problem, found, key, profiled)
    results.write(result, path)
    return result, path


def _key(problem: Problem, overrides: dict[str, Any]) -> str:
    """What makes two runs the same: settings, input files, and the versions that compute."""
    p = provenance_of(problem)
    settings = ",".join(f"{name}={value}" for name, value in sorted(overrides.items()) if value is not None)
    parts = (p.config_sha256, settings, *p.input_sha256, p.identify, p.python, *p.packages)
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()


def _remembered(path: Path, key: str) -> NDArray[np.float64]:
    """The costs of the interrupted run at `path`; InputError where there is none, or one of something else."""
    if not path.exists():
        return np.zeros(0)
    kept = results.read(path, results.Unfinished)
    if kept.key != key:
        found = "the interrupted run there had another config, data or version"
        raise InputError(str(path), found, "the same study", "run without `--resume`, or choose another file with `--out`")
    return kept.costs


def _finished(path: Path, key: str) -> results.Result | None:
    """The finished run of the same study at `path`, if there is one."""
    if not path.exists() or results.kind_of(path) == results.UNFINISHED:
        return None
    done: results.Result = results.read(path)
    return done if done.key == key else None


def run_checks(config: Path) -> dict[str, list[Finding]]:
    """The findings on every FRF measurement of a study, by its name."""
    file = read_study(config)
    names = {node: point.name for node, point in (read_points(file.resolve(file.study.points)) if file.study.points else {}).items()}
    measurements = zip(measurement_names(file.study.measurements), file.study.measurements, strict=True)
    return {
        name: check(read_frfs(file, settings), names, file.study.band_hz) for name, settings in measurements if settings.file is not None
    }


def _override(file: StudyFile, overrides: dict[str, Any]) -> StudyFile:
    given = {key: value for key, value in overrides.items() if value is not None}
    if not given:
        return file
    study = Study.model_validate({**{name: getattr(file.study, name) for name in file.study.model_fields_set}, **given})
    return file.model_copy(update={"study": study})

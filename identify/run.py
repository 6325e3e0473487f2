"""What the commands do, without the terminal: read a study, do the work, write the result."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from threadpoolctl import threadpool_limits

from identify import results
from identify.costs.target import FrfTarget
from identify.evaluate import evaluate
from identify.fit import Progress, fit
from identify.measured.quality import Finding, check
from identify.problem import load_problem
from identify.study import Study, StudyFile, read_study


def run_fit(config: Path, out: Path | None, overrides: dict[str, Any], progress: Progress | None = None) -> tuple[results.Result, Path]:
    """Fit the study in `config`, write the result and return it with its path; overrides replace keys of the study."""
    file = _override(read_study(config), overrides)
    path = out or Path("reports") / f"{file.study.name}.h5"
    with threadpool_limits(1):
        problem = load_problem(file)
        result = evaluate(problem, fit(problem, progress))
    results.write(result, path)
    return result, path


def run_checks(config: Path) -> dict[str, list[Finding]]:
    """The findings on every FRF measurement of a study, by its name."""
    problem = load_problem(read_study(config))
    names = {node: point.name for node, point in problem.points.items()}
    return {m.name: check(m.target.data, names) for m in problem.measurements if isinstance(m.target, FrfTarget)}


def _override(file: StudyFile, overrides: dict[str, Any]) -> StudyFile:
    given = {key: value for key, value in overrides.items() if value is not None}
    if not given:
        return file
    study = Study.model_validate({**{name: getattr(file.study, name) for name in file.study.model_fields_set}, **given})
    return file.model_copy(update={"study": study})

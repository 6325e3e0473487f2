"""`identify discover` on a study of motion, without the terminal: read, search, write the result and the new
study.
"""

from __future__ import annotations

import math
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from identify.core.atomic import ELSEWHERE, write_text
from identify.core.errors import InputError
from identify.core.part_file import PartFile
from identify.core.threads import one_thread
from identify.core.thresholds import MISSING
from identify.fitting.fit import Progress
from identify.fitting.resume import override, resumable, run_key
from identify.fitting.selection.workbench import Story
from identify.motion.changed import with_numbers
from identify.motion.evaluate import evaluate_fit, provenance_of_motion
from identify.motion.missing.bench import MissingBench
from identify.motion.missing.new_config import study_text
from identify.motion.missing.noise import with_noise
from identify.motion.problem import MotionProblem, load_motion
from identify.motion.study import read_motion_study
from identify.motion.trajectory_fit import MotionFit, with_missing
from identify.results.file import check_alone
from identify.results.motion import MotionResult


def run_motion_discover(
    config: Path,
    out: Path | None,
    overrides: dict[str, Any],
    progress: Story,
    *,
    resume: bool = False,
    time_s: float | None = None,
) -> tuple[MotionResult, list[Path]]:
    """Find what is missing from the study of motion in `config`; the result and the paths written: result
    file, then the new study, if anything was found; time_s: after which no further turn is begun.
    """
    progress.until = math.inf if time_s is None else time.monotonic() + time_s
    file = override(read_motion_study(config), overrides)
    path = out or Path("reports") / f"{file.study.name}_discovery.h5"
    study = path.with_suffix(".yaml")
    if config.resolve() == study.resolve():
        raise InputError(str(config), "would be overwritten by the new study", fix=ELSEWHERE)
    check_alone(path, [study])
    with one_thread():
        problem, notes = with_noise(load_motion(file))
        asked = ("discover", *(() if time_s is None else (f"time {time_s}",)))
        key = run_key(provenance_of_motion(problem), file, asked)

        def compute(part: PartFile) -> MotionResult:
            began, at_work = time.perf_counter(), Progress()
            at_work.journal.part = part
            bench = MissingBench(problem, at_work)
            found = bench.finished(with_missing(bench, progress))
            result = _result(found, path.parent)
            ended = ("the time limit was reached before the search had ended",) if progress.late else ()
            told = (*notes, *ended, *result.notes)
            return replace(result, key=key, notes=told, seconds=time.perf_counter() - began)

        result = resumable(path, key, MotionResult, compute, resume=resume)
    if not result.study:
        return result, [path]
    write_text(study, result.study)
    return result, [path, study]


def _result(found: MotionFit, folder: Path) -> MotionResult:
    """The final model beside the first, both fitted."""
    result = evaluate_fit(_first(found), found)
    added = [trial for trial in found.trials[1:] if trial.kept]
    text = study_text(found.problem, found.fit.values, folder) if added else ""
    verdict = (*_verdict(found), *result.verdict[1 + bool(added) :])
    return replace(result, study=text, searched=True, verdict=verdict)


def _first(found: MotionFit) -> MotionProblem:
    assert found.first is not None
    problem = found.first.problem
    return with_numbers(problem, {}, problem.by_name(found.first.fit.values))


def _verdict(found: MotionFit) -> list[str]:
    """What was missing, and how the gap fell."""
    first, added = found.trials[0], [trial for trial in found.trials[1:] if trial.kept]
    judges = any(record.settings.use == "validate" for record in found.problem.records)
    where = (
        "records that were not fitted"
        if judges
        else "the fitted records themselves, as none is for validation"
    )
    if not added:
        left = (
            "is noise" if first.gap_judged <= MISSING else "remains unexplained: no known effect explains it"
        )
        return [f"The records show no missing effect. The gap of {first.gap_judged:.3g} {left}."]
    last = added[-1] if len(added) == 1 else max(added, key=lambda trial: trial.round)
    lines = [f"Missing: {trial.name} (log odds {trial.log_odds:.0f})." for trial in added]
    gap = found.fit.cost
    lines.append(
        f"With that the gap falls from {first.gap:.3g} to {gap:.3g} on fitted records, and from"
        f" {first.gap_judged:.3g} to {last.gap_judged:.3g} on {where}."
    )
    if last.gap_judged > MISSING:
        lines.append("Something else is missing, which no known effect explains.")
    assert np.isfinite(gap)
    return lines

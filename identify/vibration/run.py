"""What the commands do, without the terminal: read a study, do the work, write the result."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, TypedDict, Unpack

from identify.core.errors import InputError
from identify.core.part_file import PartFile
from identify.core.threads import one_thread
from identify.fitting.fit import Progress, fit
from identify.fitting.processes import several
from identify.fitting.resume import finished, override, resumable, run_key
from identify.results import fit as results
from identify.vibration.evaluate import evaluate
from identify.vibration.plan import fit_plan
from identify.vibration.problem import Problem, load_problem
from identify.vibration.profile import check_profiled
from identify.vibration.provenance import provenance_of
from identify.vibration.records import with_records
from identify.vibration.study import StudyFile, read_study
from identify.vibration.write_back import WriteBack

Advise = Callable[[Problem, float], Sequence[str]]
"""Sentences on a problem that was fitted and left this gap."""


class How(TypedDict, total=False):
    """How a fit is run: processes that run starts side by side; whether an interrupted run is taken up; what
    is said first of the problem and its gap.
    """

    workers: int | None
    resume: bool
    advise: Advise | None


def run_fit(
    config: Path,
    out: Path | None,
    overrides: dict[str, Any],
    progress: Progress | None = None,
    *,
    profile: Sequence[str] = (),
    write_back: Path | None = None,
    **how: Unpack[How],
) -> tuple[results.FitResult, list[Path]]:
    """Fit the study in `config`, write the result and return it with what was written, its path first;
    overrides replace keys of the study.

    profile: names of parameters whose profile likelihood is wanted; write_back: a folder for the robot and
    the points as they were found.  While it runs, the part file beside it keeps what `resume` needs; a
    finished run of the same study is not run again by it.
    """
    file = override(read_study(config), overrides)
    path = out or Path("reports") / f"{file.study.name}.h5"
    back = None if write_back is None else WriteBack(file, write_back)
    result = fit_study(file, path, progress, profiled=profile, **how)
    return result, [path, *(() if back is None else back.write(result))]


def fit_study(
    file: StudyFile,
    path: Path,
    progress: Progress | None = None,
    *,
    workers: int | None = None,
    resume: bool = False,
    replace: bool = False,
    profiled: Sequence[str] = (),
    advise: Advise | None = None,
) -> results.FitResult:
    """The same for a study that has been read; replace: where `resume` finds a run of something else, begin
    anew instead of refusing.
    """
    progress = progress or Progress()
    with one_thread():
        problem = load_problem(file)
        came_from = provenance_of(file)
        key = run_key(came_from, file, profiled)
        plan = fit_plan(problem)
        check_profiled(problem, profiled)

        def compute(part: PartFile) -> results.FitResult:
            progress.journal.part = part
            with several(min(workers or 1, plan.starts), __name__) as processes:
                fitted = fit(plan, progress, processes)
            settled, found = with_records(problem, fitted, progress.show)
            result = evaluate(settled, found, key, profiled)
            inputs = came_from.input_sha256  # as they were when they were read
            renamed = dataclasses.replace(result.provenance, input_sha256=inputs)
            said = () if advise is None else tuple(advise(settled, result.gap))
            return dataclasses.replace(result, provenance=renamed, verdict=(*said, *result.verdict))

        return resumable(path, key, results.FitResult, compute, resume=resume, replace=replace)


def finished_before(file: StudyFile, path: Path) -> results.FitResult | None:
    """The finished run of this very study, data and versions at `path`, recognised by the hashes of its input
    files, which are not parsed; None where it is damaged, or an input cannot be read.
    """
    try:
        return finished(path, run_key(provenance_of(file), file), results.FitResult)
    except (OSError, InputError):
        return None

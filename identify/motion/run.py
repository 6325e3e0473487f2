"""What `identify simulate`, and `identify fit` on a study of motion, do without the terminal."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from identify.core.atomic import check_writable, write_atomically
from identify.core.errors import InputError
from identify.core.part_file import PartFile
from identify.core.threads import one_thread
from identify.fitting.fit import Progress
from identify.fitting.resume import held, override, resumable, run_key
from identify.motion.changed import resolved, with_numbers
from identify.motion.evaluate import evaluate_fit, evaluate_simulation, provenance_of_motion
from identify.motion.problem import MotionProblem, load_motion
from identify.motion.study import read_motion_study
from identify.motion.trajectory_fit import fit_motion
from identify.results import file as result_file
from identify.results.motion import MotionResult, RecordResult

_OTHER_TABLES = "choose another folder with `--tables`"
_NOT_IN_NAMES = r'[/\\:*?"<>|\x00-\x1f]'
"""What names of files cannot have, here or on another system."""


def run_simulation(
    config: Path, out: Path | None, tables: Path | None = None, values: Path | None = None
) -> tuple[MotionResult, list[Path]]:
    """Simulate every record of a study of motion; the result and the files written: HDF5, and a CSV per
    record in the folder `tables`.

    values: the result of a fit, whose numbers are taken in place of start values of the same names.
    """
    file = read_motion_study(config)
    path = out or Path("reports") / f"{file.study.name}.h5"
    with one_thread():
        problem = load_motion(file)
        if values is not None:
            problem = _as_found(problem, values)
        if tables is not None:
            check_writable(tables / "table.csv", _OTHER_TABLES)
        with held(path):
            result = evaluate_simulation(problem)
            result_file.write(result, path)
    return result, [path, *write_tables(result, tables)]


def _as_found(problem: MotionProblem, values: Path) -> MotionProblem:
    """The same with the numbers of a fitted result; InputError where it has none of the problem's."""
    result = result_file.read(values, MotionResult)
    p = result.parameters
    known = {} if p is None else dict(zip(p.name, map(float, p.value), strict=True))
    names = {parameter.name for parameter in problem.parameters}
    if not names & set(known):
        raise InputError(
            f"{values}, --values",
            "no number that this study searches for",
            f"the result of a fit of some of {', '.join(sorted(names)) or 'none: it has no bounds'}",
        )
    started = with_numbers(problem, {}, {name: known[name] for name in names & set(known)})
    return resolved(started)


def run_motion_fit(
    config: Path,
    out: Path | None,
    overrides: dict[str, Any],
    progress: Progress | None = None,
    *,
    resume: bool = False,
) -> tuple[MotionResult, Path]:
    """Fit a study of motion; overrides replace keys of the study; interrupted and resumed as
    `identify.vibration.run.run_fit` is.
    """
    file = override(read_motion_study(config), overrides)
    path, progress = out or Path("reports") / f"{file.study.name}.h5", progress or Progress()
    with one_thread():
        problem = load_motion(file)
        key = run_key(provenance_of_motion(problem), file)

        def compute(part: PartFile) -> MotionResult:
            progress.journal.part = part
            return replace(evaluate_fit(problem, fit_motion(problem, progress)), key=key)

        return resumable(path, key, MotionResult, compute, resume=resume), path


def write_tables(result: MotionResult, folder: Path | None) -> list[Path]:
    """A CSV per record with every signal of every joint over time, units in the names of the columns; nothing
    where folder is None.
    """
    if folder is None:
        return []
    paths = [folder / f"{result.name}_{re.sub(_NOT_IN_NAMES, '_', name)}.csv" for name in result.records]
    for path, record in zip(paths, result.records.values(), strict=True):
        write_atomically(path, partial(_write_table, record=record), _OTHER_TABLES)
    return paths


def _write_table(path: Path, record: RecordResult) -> None:
    names, columns = ["time_s"], [record.time_s]
    for quantity, trace in record.signals.items():
        for joint, values in enumerate(trace.values.T, start=1):
            names.append(f"joint{joint}.{quantity}_{trace.unit.replace(' ', '_').replace('/', '_')}")
            columns.append(values)
    np.savetxt(path, np.column_stack(columns), fmt="%.9g", delimiter=",", header=",".join(names), comments="")

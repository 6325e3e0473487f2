"""`identify check` of a study of motion: all that a simulation or a fit would load is looked at."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from identify.core.errors import InputError
from identify.measured.finding import STUDY, Checked, Finding, kept
from identify.measured.quality_records import check_records
from identify.measured.quality_robot import check_robot
from identify.motion.plan import motion_plan
from identify.motion.problem import MotionProblem, fastest_mode, load_motion
from identify.motion.study import read_motion_study
from identify.motion.tool import far_tool

_MOST_BITS = 32


def run_checks(config: Path) -> Checked:
    """Load all that a simulation or a fit would load of a study and look at it.

    Raises InputError or InputErrors where the config itself cannot be read; other refusals are kept.
    """
    file, refused = read_motion_study(config), list[InputError]()
    problem = kept(lambda: load_motion(file), refused)
    if problem is None:
        return Checked({STUDY: []}, tuple(refused), "simulate")
    study, fitted = file.study, _is_fitted(problem)
    if fitted:
        kept(lambda: motion_plan(problem, study.optimizer, study.starts), refused)
    found = check_records([r.measured for r in problem.records if r.measured is not None])
    found[STUDY] += [*check_robot(problem.robot), *far_tool(problem), *_encoders(study.encoder_counts)]
    found[STUDY].append(_of_model(problem))
    return Checked(found, tuple(map(file.at_its_line, refused)), "fit" if fitted else "simulate")


def _encoders(counts: list[int] | None) -> Iterator[Finding]:
    """Counts that are likely to be bits, of which encoders have up to 32."""
    if counts and max(counts) <= _MOST_BITS:
        sentence = (
            f"Encoders of {min(counts)} counts a turn have steps of {360 / min(counts):.3g} degrees: are"
            f" these bits, of {2 ** min(counts)} counts?"
        )
        yield Finding("warn", "encoder-counts", (), sentence, min(counts))


def _is_fitted(problem: MotionProblem) -> bool:
    """Whether a fit would have something to find, and something to find it in."""
    recorded = any(r.measured is not None and r.settings.use == "fit" for r in problem.records)
    return recorded and any(parameter.free for parameter in problem.parameters)


def _of_model(problem: MotionProblem) -> Finding:
    free = sum(parameter.free for parameter in problem.parameters)
    mode = fastest_mode(problem) / (2 * np.pi)
    fastest = f"its fastest mode, {mode:.3g} Hz" if mode > 0 else "no mode: all of it is rigid"
    recorded = sum(record.measured is not None for record in problem.records)
    sentence = (
        f"{recorded} of {len(problem.records)} motions recorded; {free} numbers are free; the model has"
        f" {fastest}, and is simulated in steps of {1e3 * problem.step_s:.3g} ms."
    )
    return Finding("info", "model", (), sentence, mode)

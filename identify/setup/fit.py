"""`identify fit` of a study of vibration, which looks at the set-up where the gap is large."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from identify.core.errors import InputError
from identify.fitting.fit import Progress
from identify.results.fit import FitResult
from identify.setup.diagnosis import LARGE, look
from identify.setup.sentences import sentences
from identify.vibration.problem import Problem
from identify.vibration.run import run_fit as fitted


def run_fit(
    config: Path,
    out: Path | None,
    overrides: dict[str, Any],
    progress: Progress | None = None,
    *,
    resume: bool = False,
    profile: Sequence[str] = (),
    write_back: Path | None = None,
) -> tuple[FitResult, list[Path]]:
    """`identify.vibration.run.run_fit`, with what is wrong about the set-up said first."""
    options: dict[str, Any] = {"resume": resume, "profile": profile, "write_back": write_back}
    return fitted(config, out, overrides, progress, **options, advise=advise)


def advise(problem: Problem, gap: float) -> list[str]:
    """What is wrong about the set-up of a problem whose fit left this gap, in sentences."""
    if not gap > LARGE:
        return []
    found = look(problem, gap).diagnosis
    return [] if found is None else sentences(found, problem.file.path.name)


def check_set_up(problem: Problem) -> None:
    """Raise an InputError where a mistake of the set-up explains the gap: what would be found missing would
    only make up for it, and take minutes.
    """
    found = look(problem).diagnosis
    if found is not None:
        where, name = str(problem.file.path), problem.file.path.name
        mistakes = " and ".join(one.sentence for one in found.mistakes)
        gaps = f"gap {found.gap_before:.3g}, {found.gap_after:.3g} without"
        fix = f"correct it, as `identify check {name} --apply` does, or search with `--as-stated`"
        raise InputError(where, f"{mistakes} ({gaps})", "a set-up that is right, before effects", fix)

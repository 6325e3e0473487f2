"""`identify fit` of a study of vibration, which looks at the set-up where the gap is large."""

from __future__ import annotations

from functools import partial

from identify.core.errors import InputError
from identify.setup.diagnosis import LARGE, look
from identify.setup.sentences import sentences
from identify.vibration.far_places import impossible
from identify.vibration.problem import Problem
from identify.vibration.run import run_fit as fitted


def advise(problem: Problem, gap: float) -> list[str]:
    """What is wrong about the set-up of a problem whose fit left this gap, in sentences."""
    if not gap > LARGE or impossible(problem):
        return []
    found = look(problem, gap).diagnosis
    return [] if found is None else sentences(found, problem.file.path.name)


run_fit = partial(fitted, advise=advise)
"""`identify.vibration.run.run_fit`, with what is wrong about the set-up said first."""


def check_set_up(problem: Problem) -> None:
    """Raise an InputError where a mistake of the set-up explains the gap: what would be found missing would
    only compensate for it, and take minutes; and where something is farther away than the robot reaches.
    """
    if far := impossible(problem):
        raise InputError(
            str(problem.file.path), far[0].rstrip("."), "places on the robot", "correct it first"
        )
    found = look(problem).diagnosis
    if found is not None:
        where, name = str(problem.file.path), problem.file.path.name
        mistakes = " and ".join(one.sentence for one in found.mistakes)
        gaps = f"gap {found.gap_before:.3g}, {found.gap_after:.3g} without"
        fix = f"correct it, as `identify check {name} --apply` does, or search with `--as-stated`"
        raise InputError(where, f"{mistakes} ({gaps})", "a correct set-up before effects are searched", fix)

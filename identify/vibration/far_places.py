"""What a study of vibration puts farther from a link than its robot reaches."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from identify.measured.finding import Finding, as_notes
from identify.measured.quality_places import far_places, far_points
from identify.vibration.problem import Problem


def far_findings(problem: Problem) -> Iterator[Finding]:
    """Points and places of effects that cannot be, or hardly, where they are stated to be."""
    yield from far_points(problem.robot, problem.points)
    places = {}
    for number, effect in enumerate(problem.file.study.effects):
        link, at = getattr(effect, "link", None), getattr(effect, "at_m", None)
        if link is not None and isinstance(at, tuple):
            places[f"effects.{number}.at_m"] = (link, np.array(at))
    yield from far_places(problem.robot, places)


def impossible(problem: Problem) -> list[str]:
    """Sentences about what cannot be: beside it no fit says anything."""
    return [one.sentence for one in far_findings(problem) if one.level == "fail"]


def far_notes(problem: Problem) -> list[str]:
    """The same as notes of a result, with what is doubtful."""
    return as_notes(far_findings(problem))

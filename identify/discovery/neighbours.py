"""Effects of one kind that sit on the same link or joint, or right beside it; and forms of one that turn."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from identify.discovery.task import Trial
from identify.model.effects.base import Effect
from identify.model.effects.rigid_body import MOMENTS
from identify.vibration.problem import Problem, with_effects


def siblings(problem: Problem, effect: Effect, found: Sequence[Effect]) -> list[Effect]:
    """Of the candidates those of the kind and axes of a linear effect of the structure that sit where it does
    or right beside it.
    """
    own = _link_of(problem, effect)
    if own is None or effect.of_amplitude or effect.of_measurement:
        return []
    alike = [one for one in found if one.kind == effect.kind and _axes(one) & _axes(effect)]
    places = [(one, _link_of(problem, one)) for one in alike]
    return [one for one, place in places if place is not None and abs(place - own) <= 1]


def turning(effect: Effect) -> list[Effect]:
    """Its forms that begin in several valleys, because their directions turn."""
    return [form for form in effect.variants() if form.valleys > effect.valleys]


def _axes(effect: Effect) -> set[str]:
    """The axes that an effect names, or one name for all that name none."""
    return set(getattr(effect, "axes", ["any"]))


def _link_of(problem: Problem, effect: Effect) -> int | None:
    """Number of the link that an effect sits on, or of the only joint; None where it has neither."""
    names: list[str] = [one.name for one in problem.robot.links]
    link: Any = getattr(effect, "link", None)
    joints: Any = getattr(effect, "joints", None)
    if link in names:
        return names.index(link)
    return problem.robot.joint_number(joints[0], effect.kind) if joints and len(joints) == 1 else None


def moved(problem: Problem, trial: Trial, effect: Effect) -> dict[str, float]:
    """The values of a trial for another effect in place of its own, whose parameters start where those of
    its own ended; both have the same ones.

    The moments of a body start at nothing: they are about a place and axes of its link, and on another one
    they would be those of a body that lies far away.
    """
    known, [own] = trial.task.known, trial.task.new
    values = dict(trial.values)
    ended = {name: values.pop(name) for name in _names(problem, known, own)}
    starts = [0.0 if _is_moment(name) else value for name, value in ended.items()]
    return {**values, **dict(zip(_names(problem, known, effect), starts, strict=True))}


def _is_moment(name: str) -> bool:
    """Whether a parameter is a first or second moment of a body."""
    return name.rpartition(".")[2] in MOMENTS[1:]


def _names(problem: Problem, known: Sequence[Effect], effect: Effect) -> list[str]:
    """Of the parameters that an effect adds to known ones."""
    model = with_effects(problem, (*known, effect), {})
    return [model.parameters[n].name for n in model.measurements[0].system.effects[-1][1]]

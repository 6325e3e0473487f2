"""Effects of one kind that sit on the same link or joint, or right beside it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from identify.discovery.task import Trial
from identify.model.effects.base import Effect
from identify.model.effects.link_flexibility import LinkFlexibility
from identify.model.effects.rigid_body import MOMENTS
from identify.model.effects.springs import Springs
from identify.vibration.problem import Problem, with_effects


def neighbours(problem: Problem, effect: Effect) -> list[Effect]:
    """An effect of the structure, which the dense model does not have everywhere at once, along other axes of
    its link and on the links beside it.
    """
    own = _link_of(problem, effect)
    if own is None or effect.of_amplitude or effect.of_measurement:
        return []
    if isinstance(effect, Springs | LinkFlexibility):
        return []
    every = [(one, _link_of(problem, one)) for one in type(effect).instances(problem.robot, problem.points)]
    here = next((one for one, place in every if place == own and _axes(one) & _axes(effect)), None)
    if here is None:
        return []
    near = [one for one, place in every if place is not None and abs(place - own) <= 1]
    moves = [{key: value for key, value in one if value != getattr(here, key)} for one in near]
    return [one for move in moves if (one := effect.model_copy(update=move)) != effect]


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

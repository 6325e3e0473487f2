"""A problem of motion with more in it: numbers set free, springs released, other steps."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from identify.core.errors import InputError
from identify.model.system import build_site, list_parameters
from identify.motion.links import moving_arm
from identify.motion.numbers import JointNumber, number_table
from identify.motion.problem import FASTEST, MotionProblem, fastest_mode, sections_of
from identify.motion.study import Spring

_COARSE = 1.75
"""Step times angular frequency where models are only compared: stable, which it is below 2; modes as fast as
that only follow what pushes them.
"""
_WHOLE = 1e-6


def with_numbers(
    problem: MotionProblem, free: Mapping[str, JointNumber], values: Mapping[str, float]
) -> MotionProblem:
    """The same problem with further numbers (by `section.key`) set free; parameters named in `values` start
    there, others where they did.

    Raises InputError for a number that the study's sections do not have.
    """
    sections = sections_of(problem.file)
    freed = merged([problem.freed, free])
    for where, number in freed.items():
        section, _, key = where.rpartition(".")
        if section not in sections or key not in type(sections[section]).model_fields:
            known = [f"{name}.{key}" for name, one in sections.items() for key in type(one).model_fields]
            raise InputError("candidates", f"unknown number {where!r}", "one of " + ", ".join(known))
        sections[section] = sections[section].model_copy(update={key: number})
    table = number_table(sections, len(problem.robot.joints), len(problem.springs))
    before = {p.name: p.initial for p in problem.parameters if p.name.partition(".")[2] not in free}
    started = [p.at({**before, **values}.get(p.name, p.initial)) for p in problem.springs + table.parameters]
    springs, own = tuple(started[: len(problem.springs)]), tuple(started[len(problem.springs) :])
    return replace(problem, springs=springs, table=replace(table, parameters=own), freed=freed)


def with_effects(
    problem: MotionProblem, more: Sequence[Spring], values: Mapping[str, float]
) -> MotionProblem:
    """The same problem with further springs, and a step that resolves them; parameters named in `values`
    start there.
    """
    if not more:
        return with_numbers(problem, {}, values)
    effects, robot = [*problem.file.study.effects, *more], problem.robot
    site = build_site(robot, np.radians(problem.file.study.records[0].start_deg), effects)
    arm = moving_arm(robot, effects)
    springs = tuple(list_parameters(robot, site, effects))
    softer = replace(problem.with_study(effects=effects), arm=arm, springs=springs)
    return resolved(with_numbers(softer, {}, values))


def resolved(problem: MotionProblem) -> MotionProblem:
    """The same problem in steps that resolve its fastest mode at the start, if its own do not; whole parts of
    those it has, so that delays stay whole.
    """
    parts = int(np.ceil(max(1.0, problem.step_s * fastest_mode(problem) / FASTEST - 1e-9)))
    return replace(problem, step_s=problem.step_s / parts)


def coarse(problem: MotionProblem) -> MotionProblem:
    """The same problem in the longest steps in which its fastest mode at the start is stable, for comparing
    models with each other; its delay stays whole steps.
    """
    servo = problem.file.study.servo
    for parts in range(1, round(servo.period_s / problem.step_s)):
        step = servo.period_s / parts
        whole = abs(servo.delay_s / step - round(servo.delay_s / step)) < _WHOLE
        if whole and step * fastest_mode(problem, step) <= _COARSE:
            return replace(problem, step_s=step)
    return problem


def merged(numbers: Sequence[Mapping[str, JointNumber]]) -> dict[str, JointNumber]:
    """Numbers set free by several effects, one of them perhaps in some joints and another in others, between
    bounds that are wide enough for all.
    """
    found: dict[str, JointNumber] = {}
    for where, number in (item for one in numbers for item in one.items()):
        before, joints, bounds = found.get(where), number.joints, number.bounds
        if before is not None and before.joints is not None and joints is not None:
            joints = sorted({*before.joints, *joints})
        if before is not None and before.bounds is not None and bounds is not None:
            bounds = min(before.bounds[0], bounds[0]), max(before.bounds[1], bounds[1])
        found[where] = number.model_copy(update={"joints": joints, "bounds": bounds})
    return found

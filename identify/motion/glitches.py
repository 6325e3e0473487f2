"""Which joint's turning round makes which glitch of a circle (Kobe, Fig. 16): the model with the friction of
each joint and without.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from identify.core.arrays import Array, Index
from identify.motion.problem import MotionProblem
from identify.motion.recording import PreparedRecord
from identify.motion.tool import END, FEEDBACK, tool_paths
from identify.results.circular import CircularTest, circular_test
from identify.results.motion import Glitches

_FRICTION = ("friction.coulomb", "friction.viscous", "friction.stribeck")
_BEHIND = np.radians(30.0)
"""Of the circle, behind a reversal, where its glitch is looked for."""


def glitches(problem: MotionProblem, values: Array, record: PreparedRecord) -> Glitches | None:
    """Of a record whose tool is led round a circle, at parameter values (parameters,); None where no joint
    that turns round in the judged turn has friction.

    All models, one without the friction of each such joint, move side by side.
    """
    circle = record.settings.path
    if circle is None:
        return None
    period = problem.file.study.servo.period_s
    turn = circle.judged(period * np.arange(len(record.command.position), dtype=float))
    velocity, way = record.command.velocity[turn], -1.0 if circle.clockwise else 1.0
    back = velocity[1:] * velocity[:-1] < 0
    present = problem.table.arrays(values[None])
    rubs = np.any([present[key][0] != 0 for key in _FRICTION], axis=0)
    joints = np.flatnonzero(back.any(axis=0) & rubs)
    if not len(joints):
        return None
    every, lanes = _without(problem, values, joints)
    motion = every.run(lanes, [record])
    tests = []
    for coordinates in motion.coordinates:
        paths = tool_paths(every, record, coordinates[: len(turn)])
        tests.append({name: circular_test(circle.flat(paths[name])[turn]) for name in (FEEDBACK, END)})
    rows = [
        (joint + 1, tests[0][FEEDBACK].angle[at], *_added(tests[0], less, int(at), way))
        for joint, less in zip(joints.tolist(), tests[1:], strict=True)
        for at in np.flatnonzero(back[:, joint])
    ]
    joint, angle, feedback, end = np.array(rows).T
    return Glitches(joint.astype(np.intp), np.mod(angle, 2 * np.pi), feedback, end)


def _without(problem: MotionProblem, values: Array, less: Index) -> tuple[MotionProblem, Array]:
    """The problem with the friction of every joint as further parameters, and lanes (1 + m, parameters): as
    it is, and without that of each of m joints, from 0.
    """
    joints, table = np.arange(len(problem.robot.joints)), problem.table
    present = table.arrays(values[None])
    first = {key: len(values) + n * len(joints) for n, key in enumerate(_FRICTION)}
    columns = {key: np.array([joints, at + joints]) for key, at in first.items()}
    start = np.concatenate([values, *(present[key][0] for key in _FRICTION)])
    lanes = np.tile(start, (1 + len(less), 1))
    for at in first.values():
        lanes[1 + np.arange(len(less)), at + less] = 0.0
    return replace(problem, table=replace(table, columns={**table.columns, **columns})), lanes


def _added(
    whole: dict[str, CircularTest], less: dict[str, CircularTest], at: int, way: float
) -> tuple[float, float]:
    """The largest difference of the radial error behind a reversal, m, of feedback and end."""
    angle = whole[FEEDBACK].angle
    behind = np.mod(way * (angle - angle[at]), 2 * np.pi) < _BEHIND
    sizes = []
    for name in (FEEDBACK, END):
        added = (whole[name].error - less[name].error)[behind]
        sizes.append(float(added[np.argmax(np.abs(added))]))
    return sizes[0], sizes[1]

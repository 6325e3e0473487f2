"""How the circle of the Kobe study begins."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from identify.motion.missing.noise import with_noise
from identify.motion.problem import MotionProblem, load_motion
from identify.motion.study import read_motion_study
from identify.motion.tool_errors import ToolErrors
from identify.robot.engine_motion import MovingArm

CONFIG = Path(__file__).parents[2] / "configs/kobe_circle.yaml"


STILL = 600
"""Ticks that are left out: it stands still for 200 more."""


def first(ticks: int) -> MotionProblem:
    """The study with so many ticks of its record."""
    problem = with_noise(load_motion(read_motion_study(CONFIG)))[0]
    [record], tool = problem.records, problem.file.study.tool
    assert record.measured is not None and record.tool is not None and tool is not None
    period, time = problem.file.study.servo.period_s, record.measured.time_s
    begun = STILL * period
    seen = (time > begun - period / 2) & (time < begun + (ticks - 0.5) * period)
    signals = {name: rows[seen] for name, rows in record.measured.signals.items()}
    read = replace(record.measured, time_s=time[seen] - begun, signals=signals)
    keys = ("position", "velocity", "acceleration")
    command = replace(
        record.command, **{key: getattr(record.command, key)[STILL : STILL + ticks] for key in keys}
    )
    angles, place = command.position[:: ticks // len(read.time_s)], (tool.link, np.array(tool.at_m))
    errors = ToolErrors.of(MovingArm(problem.robot), angles, place, record.tool[seen], np.radians(0.03))
    short = replace(record, command=command, torque=record.torque[STILL : STILL + ticks], measured=read)
    return replace(problem, records=(replace(short, tool=record.tool[seen], tool_errors=errors),))

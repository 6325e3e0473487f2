"""Start values on other scales: what a drive is guessed to be, from what it carries, may be far off, and a
fit that begins there ends in a valley of its own.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from identify.core.arrays import Array
from identify.vibration.problem import Problem

_SCALES, SLOPES = tuple(np.linspace(-3.0, 3.0, 9)), (-1.0, 0.0, 1.0)
"""Logarithms of factors of all stiffnesses, and of the first against the last: drives of arms from 5 to 500
kg.
"""
_POWERS = {"stiffness": 1.0, "damping": 0.5}
"""Of a factor; dampers go by its root."""


def scaled_drives(problem: Problem, slopes: Sequence[float] = SLOPES) -> list[Array]:
    """The start values (parameters,) with stiffnesses and dampers a factor larger or smaller, which may rise
    or fall along the arm, by such logarithms.
    """
    whole, slope = np.zeros((2, len(problem.parameters)))
    joints = max(len(problem.robot.joints), 2)
    for number, parameter in enumerate(problem.parameters):
        power = _POWERS.get(parameter.name.rpartition(".")[2], 0.0) * (parameter.log and parameter.free)
        digits = parameter.name.partition(".")[0].removeprefix("joint")
        along = 2 * (int(digits) - 1) / (joints - 1) - 1 if digits.isdigit() else 0.0
        whole[number], slope[number] = power, power * along
    return [problem.initial * np.exp(one * whole + other * slope) for one in _SCALES for other in slopes]

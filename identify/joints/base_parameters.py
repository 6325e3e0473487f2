"""Rigid-body base parameters by least squares: torque of recorded motion against the columns of
`identify.joints.base_set`.
"""

from __future__ import annotations

from typing import Literal

import numpy as np

from identify.core.arrays import Array
from identify.joints.arm_motion import ArmMotion
from identify.joints.base_set import OF_MOTOR, UNITS, BaseSet, standard_names, standard_values
from identify.joints.data import JointTestData
from identify.joints.intervals import in_time, symmetric, table
from identify.results.joints import CurveResult
from identify.robot.description import Robot


class BaseParameters(ArmMotion):
    """What the torques of an arm tell of its bodies."""

    kind: Literal["base-parameters"]

    def identify(self, bench: JointTestData) -> CurveResult:
        """Base parameters, friction and offsets."""
        arm = self.regression(bench)
        chosen, values, weights = arm.chosen, arm.values, arm.weights
        rows_used = (arm.columns * weights[:, None])[arm.used]
        weighed = arm.columns * weights[None, :, None]
        _, half = in_time(weighed, arm.left(values) * weights, arm.used)
        found = [
            symmetric(
                chosen.names[n],
                UNITS[chosen.names[n].rsplit(".", 1)[1]],
                value,
                reach,
                expected=expected,
                meaning=meaning,
                positive=positive,
            )
            for n, value, reach, expected, meaning, positive in zip(
                *(chosen.kept, values, half, _expected(arm.robot, chosen), chosen.meanings),
                _positive(chosen),
                strict=True,
            )
        ]
        said = (
            f"{len(values)} base parameters, {arm.used.sum()} torques; condition of the columns"
            f" {_condition(rows_used):.3g}"
        )
        return CurveResult(
            "Rigid-body base parameters",
            self.kind,
            "N m",
            arm.rms(values),
            int(arm.used.sum()),
            table(found),
            arm.panels(values),
            (said, *arm.said(values)),
            arm.notes(values, bench.coupling is not None),
        )


def _expected(robot: Robot, chosen: BaseSet) -> Array:
    """What the robot's description says of the base parameters; NaN where friction, a rotor or a body that is
    not known is in them.
    """
    unknown = {link.name for link in robot.links if not (link.mass and np.any(link.inertia))}
    names = standard_names(robot)
    stated = np.where([name.rsplit(".", 1)[0] in unknown for name in names], np.nan, standard_values(robot))
    known = np.concatenate([stated, np.full(len(chosen.names), np.nan)])[: len(chosen.names)]
    return np.array([np.sum(row[row != 0] * known[row != 0]) for row in chosen.regrouping])


def _positive(chosen: BaseSet) -> list[bool]:
    """Which are inertias of rotors or friction, with nothing else in them."""
    alone = np.count_nonzero(chosen.regrouping, axis=1) == 1
    whats = [chosen.names[n].rsplit(".", 1)[1] for n in chosen.kept]
    return [bool(one) and what in OF_MOTOR for one, what in zip(alone, whats, strict=True)]


def _condition(rows: Array) -> float:
    """Largest over smallest singular value of columns of one length."""
    sizes = np.linalg.svd(rows / np.sqrt((rows**2).sum(axis=0)), compute_uv=False)
    return float(sizes[0] / sizes[-1])

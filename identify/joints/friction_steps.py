"""Friction from constant-velocity runs (Nagoya section 4.3): both ways at each velocity, so that whatever
depends on the angle cancels.

The mean torque over the angles that both ways share, forward less backward, over two, is the friction at that
velocity; half the sum is weight and whatever else does not know the direction, so a friction that differs
between the two ways is not seen.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from pydantic import Field

from identify.core.arrays import Array
from identify.core.errors import InputError
from identify.joints.base import JointCurve
from identify.joints.data import JointTestData
from identify.joints.friction_curve import Model, fit_friction, friction_at, friction_values
from identify.joints.intervals import independent, table
from identify.joints.phases import Phase, constant_phases
from identify.results.joints import CurveResult, Panel, Series


class FrictionConstantVelocity(JointCurve):
    """Runs back and forth at several velocities."""

    kind: Literal["friction-constant-velocity"]
    model: Model = Field("stribeck", description="`coulomb-viscous`, or `stribeck` for all of Eq. 11")
    tolerance: float = Field(
        0.1, gt=0, lt=0.5, description="share by which a velocity may change and still count as constant"
    )
    least_s: float = Field(0.1, gt=0, description="how long it must be constant")
    settle_s: float = Field(
        0.3, ge=0, description="left out at the beginning of each stretch, while the arm still swings"
    )

    def identify(self, bench: JointTestData) -> CurveResult:
        """F_c, F_v, F_s and v_s."""
        joint = bench.checked(self.joint, self.label)
        phases: list[Phase] = []
        for path in self.files:
            motion = bench.motion(path, ("motor_position", bench.torque_quantity()), [joint], self.label)
            phases += constant_phases(motion, joint, bench.slow, self.tolerance, self.least_s, self.settle_s)
        points = _points(phases, self.tolerance)
        wanted = 4 if self.model == "stribeck" else 2
        if len(points) <= wanted:
            found = (
                f"{len(points)} velocities that are driven both ways over the same angles, out of"
                f" {len(phases)} constant phases"
            )
            raise InputError(
                self.label, found, f"more than {wanted}, one per value", "record more, or raise `tolerance`"
            )
        return self._result(*points.T, phases=len(phases))

    def _result(self, velocity: Array, torque: Array, std: Array, *, phases: int) -> CurveResult:
        fitted = fit_friction(velocity, torque, self.model, np.zeros((len(velocity), 0)), 1 / std)
        _, half = independent(fitted.jacobian, fitted.residual)
        left = torque - friction_at(fitted, velocity)
        excess = float(np.sqrt((fitted.residual**2).sum() / (len(torque) - fitted.jacobian.shape[1])))
        said = (
            f"{phases} phases of constant velocity make {len(torque)} velocities driven both ways,"
            f" {np.degrees(velocity.min()):.3g} to "
        )
        said += f"{np.degrees(velocity.max()):.3g} deg/s"
        notes = (
            [
                f"the points scatter {excess:.2g} times as far as their own noise: something else acts beside"
                " the curve"
            ]
            if excess > 3
            else []
        )
        fine = np.linspace(velocity.min() / 2, velocity.max(), 300)
        series = {
            "measured": Series("points", velocity, torque),
            "identified": Series("line", fine, friction_at(fitted, fine)),
        }
        rms = float(np.sqrt(np.mean(left**2)))
        values = table(friction_values(fitted, half))
        panel = Panel("Velocity", "rad/s", "Friction", "N m", series)
        return CurveResult(
            f"Friction of joint {self.joint}",
            self.kind,
            "N m",
            rms,
            len(torque),
            values,
            {"curve": panel},
            (said,),
            tuple(notes),
        )


def _points(phases: list[Phase], tolerance: float) -> Array:
    """(velocities, 3): velocity, friction torque, and its standard deviation, of each velocity that is driven
    both ways.
    """
    ordered = sorted(phases, key=lambda phase: abs(phase.velocity))
    speeds = np.array([abs(phase.velocity) for phase in ordered])
    groups = np.split(
        np.arange(len(ordered)), np.flatnonzero(np.diff(speeds) > 2 * tolerance * speeds[1:]) + 1
    )
    rows = [_point([ordered[n] for n in group]) for group in groups if len(group)]
    return np.array([row for row in rows if row is not None]).reshape(-1, 3)


def _point(group: list[Phase]) -> tuple[float, float, float] | None:
    """Half the difference of the two ways over the angles they share, None where there are none."""
    lower, upper = max(phase.angle.min() for phase in group), min(phase.angle.max() for phase in group)
    ways = [
        [phase.mean(lower, upper) for phase in group if np.sign(phase.velocity) == side] for side in (1, -1)
    ]
    if not all(ways) or upper <= lower or not np.isfinite(ways[0] + ways[1]).all():
        return None
    means = [np.mean([mean for mean, _ in way]) for way in ways]
    variance = sum(np.mean([std**2 for _, std in way]) / len(way) for way in ways) / 4
    return (
        float(np.mean([abs(phase.velocity) for phase in group])),
        float(means[0] - means[1]) / 2,
        float(np.sqrt(variance)),
    )

"""Friction from sinusoidal motion of one joint, as Kobe's study took its motors' friction: Coulomb torque and
viscous coefficient.

A joint that moves alone needs I a + A cos q + B sin q + C beside its friction, whatever the robot: inertia
about its axis, weight and a constant.  At one small amplitude these are hardly told apart, but all are even
in the velocity and leave friction, which is odd, alone.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from pydantic import Field

from identify.core.arrays import Array
from identify.core.errors import InputError
from identify.core.separable import Separated
from identify.joints.base import JointCurve
from identify.joints.data import JointTestData
from identify.joints.friction_curve import Model, fit_friction, friction_at, friction_values
from identify.joints.intervals import over_time, table
from identify.measured.conditioning import ConditionedMotion
from identify.results.joints import CurveResult, Panel, Series

_LEAST_SAMPLES = 50


class FrictionSinusoidal(JointCurve):
    """Sinusoidal, or any other, motion of one joint to and fro."""

    kind: Literal["friction-sinusoidal"]
    model: Model = Field(
        "coulomb-viscous",
        description="`coulomb-viscous`, as in Kobe's study, or `stribeck` for all of Nagoya Eq. 11",
    )
    least_share: float = Field(
        0.05,
        gt=0,
        lt=1,
        description="samples below this share of the largest velocity are left out: presliding",
    )

    def identify(self, bench: JointTestData) -> CurveResult:
        """F_c and F_v, with F_s and v_s where asked for."""
        joint = bench.checked(self.joint, self.label)
        motions = [
            bench.motion(path, ("motor_position", bench.torque_quantity()), [joint], self.label)
            for path in self.files
        ]
        velocity, torque = (
            np.concatenate([getattr(m, name)[:, joint] for m in motions]) for name in ("velocity", "torque")
        )
        used = np.concatenate([m.inside for m in motions]) & (
            np.abs(velocity) > max(bench.slow, self.least_share * float(np.abs(velocity).max()))
        )
        if used.sum() < _LEAST_SAMPLES or not (velocity[used] > 0).any() or not (velocity[used] < 0).any():
            raise InputError(
                self.label,
                f"{used.sum()} samples in motion",
                "a joint that moves to and fro",
                "see `stationary_below_deg_per_s`",
            )
        other = np.concatenate([_even(m, joint) for m in motions])[used]
        fitted = fit_friction(velocity[used], torque[used], self.model, other, np.ones(used.sum()))
        _, half = over_time(fitted.jacobian, fitted.residual, used)
        carried = torque[used] - other @ fitted.coefficients[2 + len(fitted.shapes) :]
        return self._result(fitted, half, velocity[used], carried, motions)

    def _result(
        self,
        fitted: Separated,
        half: Array,
        velocity: Array,
        friction: Array,
        motions: list[ConditionedMotion],
    ) -> CurveResult:
        order = np.argsort(velocity)
        every = max(1, len(order) // 2000)
        fine = np.concatenate(
            [np.linspace(velocity.min(), -1e-9, 150), [np.nan], np.linspace(1e-9, velocity.max(), 150)]
        )
        series = {
            "measured": Series("points", velocity[order][::every], friction[order][::every]),
            "identified": Series("line", fine, friction_at(fitted, fine)),
        }
        rms = float(np.sqrt(np.mean(fitted.residual**2)))
        panel = Panel("Velocity", "rad/s", "Torque less weight and inertia", "N m", series)
        said = tuple(dict.fromkeys(sentence for motion in motions for sentence in motion.said))
        values = table(friction_values(fitted, half))
        return CurveResult(
            f"Friction of joint {self.joint}",
            self.kind,
            "N m",
            rms,
            len(velocity),
            values,
            {"curve": panel},
            said,
            (),
        )


def _even(motion: ConditionedMotion, joint: int) -> Array:
    """Columns (samples, 4) of inertia, weight and a constant."""
    angle = motion.position[:, joint]
    return np.column_stack([motion.acceleration[:, joint], np.cos(angle), np.sin(angle), np.ones(len(angle))])

"""The friction curve of Nagoya Eq. 11, F_c + F_s exp(-|v| / v_s) with the sign of v, and F_v v: its columns
and its values.

Friction from constant-velocity runs (Nagoya section 4.3): both ways at each velocity, so that whatever
depends on the angle cancels.

The mean torque over the angles that both ways share, forward less backward, over two, is the friction at that
velocity; half the sum is weight and whatever else does not know the direction, so a friction that differs
between the two ways is not seen.

Friction from sinusoidal motion of one joint, as Kobe's study took its motors' friction: Coulomb torque and
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
from identify.core.separable import Separated, separable
from identify.joints.base import JointCurve
from identify.joints.data import JointTestData
from identify.joints.intervals import Value, independent, over_time, symmetric, table
from identify.joints.phases import Phase, constant_phases
from identify.measured.conditioning import ConditionedMotion
from identify.model.laws.friction import EXPONENTIAL, friction_torque, stribeck_decay
from identify.results.joints import CurveResult, Panel, Series

Model = Literal["coulomb-viscous", "stribeck"]
_STARTS = 25


def friction_columns(velocity: Array, shapes: Array) -> Array:
    """Torque (n, 2 or 3) per unit of F_c, F_v and, where there is a shape ln v_s, F_s."""
    columns = [np.sign(velocity), velocity]
    if len(shapes):
        columns.append(np.sign(velocity) * stribeck_decay(velocity, np.exp(shapes[0]), EXPONENTIAL))
    return np.column_stack(columns)


def fit_friction(velocity: Array, torque: Array, model: Model, other: Array, weights: Array) -> Separated:
    """The friction at velocities (n,) beside other columns (n, m): coefficients F_c, F_v, (F_s), others;
    shape ln v_s.

    v_s is searched from half the slowest velocity to half the fastest; weights (n,) multiply rows.
    """
    speed = np.abs(velocity)
    limits = np.log([0.5 * speed.min(), 0.5 * speed.max()]) if model == "stribeck" else np.zeros((2, 0))
    lower, upper = (np.atleast_1d(limit) for limit in limits)
    starts = (
        [np.array([value]) for value in np.linspace(lower[0], upper[0], _STARTS)]
        if len(lower)
        else [np.zeros(0)]
    )

    def columns(shapes: Array) -> Array:
        return np.column_stack([friction_columns(velocity, shapes), other]) * weights[:, None]

    return separable(columns, torque * weights, starts, lower, upper)


def friction_values(fitted: Separated, half: Array) -> list[Value]:
    """F_c, F_v, F_s and v_s; half (p + s,): their half intervals, of ln v_s last.

    A velocity over which nothing dies out means nothing: not determined where F_s may be zero.
    """
    c = fitted.coefficients
    values = [
        symmetric("coulomb", "N m", c[0], half[0], meaning="F_c of Eq. 11"),
        symmetric("viscous", "N m s/rad", c[1], half[1], meaning="F_v of Eq. 11"),
    ]
    if len(fitted.shapes):
        values.append(symmetric("stribeck", "N m", c[2], half[2], meaning="F_s of Eq. 11"))
        reach = half[-1] if half[2] < abs(c[2]) else np.inf
        shape = fitted.shapes[0]
        low, high = (float(np.exp(shape + side * reach)) for side in (-1, 1))
        values.append(
            Value("stribeck_velocity", "rad/s", float(np.exp(shape)), low, high, meaning="v_s of Eq. 11")
        )
    return values


def friction_at(fitted: Separated, velocity: Array) -> Array:
    """The identified curve, N m, at velocities (n,)."""
    c = fitted.coefficients
    part = (c[2], np.exp(fitted.shapes[0])) if len(fitted.shapes) else (0.0, 1.0)
    return friction_torque(velocity, c[0], c[1], *part)


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

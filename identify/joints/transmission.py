"""Angular transmission error from slow motion (Nagoya Eq. 9): sum of A_i cos(i theta_m + phi_i) over the
motor angle theta_m.

Link less motor angle, at the joint, is the error, less what the gear winds up (Eq. 10), which is slow in the
angle: a polynomial takes it out, and a constant for each direction takes out lost motion.  Orders i are found
one after the other, the strongest first, as long as chance alone would not give as much; an order whose
interval has a whole number in it is taken as that number, as in the paper.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import scipy
from pydantic import Field

from identify.core.arrays import Array, Mask
from identify.core.correlated import effective_samples
from identify.core.errors import InputError
from identify.core.separable import Separated, eliminate, separable
from identify.joints.base import JointCurve
from identify.joints.data import JointTestData
from identify.joints.intervals import Value, over_time, symmetric, table
from identify.joints.phases import steady
from identify.model.laws.gear import harmonic
from identify.results.joints import CurveResult, Panel, Series

_CHANCE = 1e-3
_MOST = 6
_TURNS = 2.0


@dataclass(frozen=True)
class _SlowRun:
    """Motor angle (n,), rad at the motor; link less motor angle (n,) rad; what is slow (n, k); samples that
    count (n,).
    """

    angle: Array
    error: Array
    slow: Array
    used: Mask

    def columns(self, orders: Array) -> Array:
        """What is slow, then cosine and sine of each order, at the samples that count."""
        waves = [wave for order in orders for wave in harmonic(self.angle[self.used], order)]
        return np.column_stack([self.slow[self.used], *waves])

    def left(self, orders: Array) -> Array:
        """What is left with the best coefficients."""
        return eliminate(self.columns(orders), self.error[self.used]).residual


@dataclass(frozen=True)
class _Waves:
    """Orders (w,), numbers of the free ones, the fit (what is slow, cosine and sine of each, free orders),
    covariance, half intervals.
    """

    orders: Array
    free: list[int]
    fitted: Separated
    covariance: Array
    half: Array

    def reach(self, n: int) -> float:
        """Half the interval of an order, 0 where it is known."""
        return (
            float(self.half[len(self.half) - len(self.free) + self.free.index(n)]) if n in self.free else 0.0
        )

    def values(self, n: int) -> list[Value]:
        """Order, amplitude and phase of a wave; a phase that may be any angle is not determined."""
        first = len(self.half) - len(self.free) - 2 * (len(self.orders) - n)
        cosine, sine = self.fitted.coefficients[first : first + 2]
        size = max(float(np.hypot(cosine, sine)), 1e-300)
        matrix = self.covariance[first : first + 2, first : first + 2]
        quantile = float(np.max(self.half[first : first + 2] / np.sqrt(np.maximum(np.diag(matrix), 1e-300))))
        ways = np.array([cosine, sine]) / size, np.array([sine, -cosine]) / size**2
        along, around = (quantile * float(np.sqrt(way @ matrix @ way)) for way in ways)
        what = f"wave {n + 1}"
        return [
            symmetric(
                f"order.{n + 1}",
                "",
                self.orders[n],
                self.reach(n),
                meaning=f"waves per turn of the motor, {what}",
            ),
            symmetric(
                f"amplitude.{n + 1}", "rad", size, along, meaning=f"A of Eq. 9 at the gear output, {what}"
            ),
            symmetric(
                f"phase.{n + 1}",
                "rad",
                np.arctan2(-sine, cosine),
                around if around < np.pi else np.inf,
                plain=True,
                meaning=f"phi of Eq. 9, {what}",
            ),
        ]


class TransmissionError(JointCurve):
    """Slow motion of one joint, motor and link angle recorded."""

    kind: Literal["transmission-error"]
    orders: list[float] | None = Field(
        None, description="waves per turn of the motor that are known; default: found between the limits"
    )
    least_order: float = Field(
        0.5, gt=0, description="slowest wave that is looked for, per turn of the motor"
    )
    most_order: float = Field(8.5, gt=0, description="fastest wave that is looked for")
    tolerance: float = Field(
        0.2, gt=0, lt=1, description="share by which the velocity may change and still count as steady"
    )
    least_s: float = Field(0.3, gt=0, description="over how long it is looked at")
    trend: int = Field(
        4,
        ge=0,
        le=12,
        description="degree of the polynomial over the angle that takes out what the gear winds up",
    )

    def identify(self, bench: JointTestData) -> CurveResult:
        """Orders, amplitudes and phases."""
        joint = bench.checked(self.joint, self.label)
        run = self._read(bench, joint)
        turns = float(np.ptp(run.angle[run.used])) / (2 * np.pi)
        if turns < _TURNS:
            raise InputError(
                self.label,
                f"{turns:.2g} turns of the motor",
                f"at least {_TURNS:g}",
                "move the joint farther",
            )
        orders, free = (np.array(self.orders), []) if self.orders is not None else self._found(run, turns)
        first = _fitted(run, orders, free)
        orders = first.orders.copy()
        whole = [n for n in free if abs(orders[n] - round(orders[n])) <= first.reach(n)]
        orders[whole] = np.round(orders[whole])
        return self._result(run, _fitted(run, orders, [n for n in free if n not in whole]), turns)

    def _read(self, bench: JointTestData, joint: int) -> _SlowRun:
        parts: list[tuple[Array, Array, Array, Mask]] = []
        for path in self.files:
            motion = bench.motion(path, ("motor_position", "link_position"), [joint], self.label)
            assert motion.link_position is not None
            motor, velocity = motion.position[:, joint], motion.velocity[:, joint]
            still = steady(motion, joint, bench.slow, self.tolerance, self.least_s)
            parts.append((motor, motion.link_position[:, joint] - motor, velocity, still))
        motor, error, velocity, used = (np.concatenate(columns) for columns in zip(*parts, strict=True))
        if not used.any():
            raise InputError(
                self.label,
                "no steady motion",
                "a joint that moves slowly at constant velocity",
                "see `stationary_below_deg_per_s` and `tolerance`",
            )
        centred = (motor - motor[used].mean()) / max(float(np.ptp(motor[used])) / 2, 1e-12)
        ways = (
            [velocity > 0]
            if (velocity[used] > 0).all() or (velocity[used] < 0).all()
            else [velocity > 0, velocity < 0]
        )
        datum = [way.astype(float) for way in ways] if len(ways) > 1 else [np.ones(len(motor))]
        trend = [centred**power for power in range(1, self.trend + 1)]
        return _SlowRun(
            bench.gear_ratio[joint] * motor, error, np.column_stack([*datum, *trend]), used.astype(bool)
        )

    def _found(self, run: _SlowRun, turns: float) -> tuple[Array, list[int]]:
        """Orders that chance would not give, and their numbers, all free."""
        found: list[float] = []
        grid = np.arange(self.least_order, self.most_order, 0.2 / turns)
        tries = max(1.0, (self.most_order - self.least_order) * turns)
        while len(found) < _MOST:
            before = run.left(np.array(found))
            far = [order for order in grid if all(abs(order - other) > 1 / turns for other in found)]
            losses = [float((run.left(np.array([*found, order])) ** 2).sum()) for order in far]
            best = int(np.argmin(losses))
            after = run.left(np.array([*found, far[best]]))
            freedom = max(
                3.0,
                effective_samples(after, np.ones(len(after), dtype=bool))
                - run.slow.shape[1]
                - 3 * len(found)
                - 3,
            )
            gain = (float(before @ before) - losses[best]) / 3 / (losses[best] / freedom)
            if tries * scipy.special.fdtrc(3, freedom, gain) > _CHANCE:
                break
            found = _fitted(run, np.array([*found, far[best]]), list(range(len(found) + 1))).orders.tolist()
        return np.array(found), list(range(len(found)))

    def _result(self, run: _SlowRun, waves: _Waves, turns: float) -> CurveResult:
        values = [value for n in range(len(waves.orders)) for value in waves.values(n)]
        count = int(run.used.sum())
        said = [
            f"{turns:.3g} turns of the motor, {count} samples in motion; a polynomial of degree {self.trend}"
            " over the angle taken out"
        ]
        if len(waves.orders) > len(waves.free) and self.orders is None:
            said.append("orders whose interval has a whole number in it are taken as that number")
        notes = () if values else ("no wave stands out of the noise",)
        rms = float(np.sqrt(np.mean(waves.fitted.residual**2)))
        title, panels = f"Transmission error of joint {self.joint}", {"curve": _panel(run, waves)}
        return CurveResult(title, self.kind, "rad", rms, count, table(values), panels, tuple(said), notes)


def _fitted(run: _SlowRun, orders: Array, free: list[int]) -> _Waves:
    """Coefficients and free orders together."""
    turns = float(np.ptp(run.angle[run.used])) / (2 * np.pi)

    def placed(shapes: Array) -> Array:
        whole = orders.astype(float)
        whole[free] = shapes
        return whole

    start = orders[free].astype(float)
    fitted = separable(
        lambda shapes: run.columns(placed(shapes)),
        run.error[run.used],
        [start],
        start - 0.5 / turns,
        start + 0.5 / turns,
    )
    return _Waves(placed(fitted.shapes), free, fitted, *over_time(fitted.jacobian, fitted.residual, run.used))


def _panel(run: _SlowRun, waves: _Waves) -> Panel:
    slow = run.slow[run.used] @ waves.fitted.coefficients[: run.slow.shape[1]]
    turns, order = run.angle[run.used] / (2 * np.pi), np.argsort(run.angle[run.used])
    measured = run.error[run.used] - slow
    series = {
        "measured": Series("points", turns[order], measured[order]),
        "identified": Series("line", turns[order], (measured - waves.fitted.residual)[order]),
    }
    return Panel("Motor angle", "turns", "Link less motor angle", "rad", series)

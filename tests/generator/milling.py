"""Milling on a flexible structure, simulated in time: shares no code with identify.

    M q'' + C q' + K q = S' F,  every tooth in the cut pushing with  b (Kt, Kr, Ka) h
    h = n . (S q(t) - S q(t - T))

Run-out is off and teeth do not leave the cut, so that the motion is linear and its growth tells stability.
Velocity Verlet, second order; many cuts at once.  `limit` lets a cut run for seconds and looks how it grows;
`exact_limit` runs one tooth period from every state there is, so that the growth per period is an eigenvalue,
and takes the error of the step away by halving it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq


@dataclass(frozen=True)
class Arm:
    """M, C, K (n, n), and the tip's motion (3, n) along feed, normal and axis; push (n, 3): what forces do,
    where that is not tip'.
    """

    mass: np.ndarray
    damping: np.ndarray
    stiffness: np.ndarray
    tip: np.ndarray
    push: np.ndarray | None = None

    def accelerations(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Of forces (n, 3), velocities (n, n) and displacements (n, n)."""
        inverse = np.linalg.inv(self.mass)
        push = self.tip.T if self.push is None else self.push
        return inverse @ push, inverse @ self.damping, inverse @ self.stiffness


@dataclass(frozen=True)
class Cut:
    """A cut: teeth, angles of entry and exit, rad, from the normal of the feed, Kt, Kr, Ka, N/m^2; pitches
    (teeth,), rad, from each tooth to the one before it where uneven (for `growth` and `limit`).
    """

    teeth: int
    entry: float
    exit: float
    kt: float
    kr: float
    ka: float = 0.0
    pitches: tuple[float, ...] = ()

    def behind(self, steps: int) -> np.ndarray:
        """How many steps, so many to a turn, each tooth cuts behind the one before it."""
        pitches = np.array(self.pitches or (2 * np.pi / self.teeth,) * self.teeth)
        return np.round(pitches / (2 * np.pi) * steps).astype(int)


def growth(arm: Arm, cut: Cut, rpm: float, depths: np.ndarray, seconds: float, steps: int = 60) -> np.ndarray:
    """Growth rates (depths,), 1/s, of the tip's vibration, between the second and the last quarter; steps: of
    a tooth period, or its mean.
    """
    period = 60 / (cut.teeth * rpm)
    h, count = period / steps, int(np.ceil(seconds / period)) * steps
    to_force, slow, stiff = arm.accelerations()
    rng = np.random.default_rng(0)
    q = rng.normal(size=(len(depths), len(arm.mass))) * 1e-3 / np.sqrt(np.abs(np.diag(arm.stiffness)))
    v = np.zeros_like(q)
    turn = cut.teeth * steps
    behind = cut.behind(turn)
    assert behind.sum() == turn
    places = -np.cumsum(behind)
    past = np.zeros((turn, len(depths), 3))
    past[:] = q @ arm.tip.T
    accel = np.zeros_like(q)
    size = np.empty((count, len(depths)))
    pitch = 2 * np.pi / cut.teeth
    for k in range(count):
        q = q + h * v + h * h / 2 * accel
        now = q @ arm.tip.T
        past[k % turn] = now
        force = np.zeros_like(now)
        for place, late in zip(places, behind, strict=True):
            before = past[(k - late) % turn]
            begin = (k + place) % turn * pitch / steps
            low, high = max(begin, cut.entry), min(begin + pitch / steps, cut.exit)
            if high > low:  # for that part of the step
                s, c = np.sin((low + high) / 2), np.cos((low + high) / 2)
                chip = (now - before) @ np.array([s, c, 0.0]) * (high - low) * steps / pitch
                f = cut.kt * np.array([-c, s, 0.0]) - cut.kr * np.array([s, c, 0.0]) - cut.ka * np.eye(3)[2]
                force += (depths * chip)[:, None] * f
        new = force @ to_force.T - (v + h * accel) @ slow.T - q @ stiff.T
        v = v + h / 2 * (accel + new)
        accel = new
        size[k] = np.sqrt((now**2).sum(axis=1))
        if k % (8 * steps) == 0:  # only how it grows matters: kept within the range of numbers
            scale = np.maximum(np.abs(past).max(axis=(0, 2)), 1e-300)
            size[: k + 1] /= scale
            past /= scale[:, None]
            q, v, accel = q / scale[:, None], v / scale[:, None], accel / scale[:, None]
    quarter = count // 4
    early = np.log(np.sqrt(np.mean(size[quarter : 2 * quarter] ** 2, axis=0)))
    late = np.log(np.sqrt(np.mean(size[3 * quarter :] ** 2, axis=0)))
    return np.asarray((late - early) / (2.0 * quarter * h))


def limit(arm: Arm, cut: Cut, rpm: float, depths: np.ndarray, seconds: float, steps: int = 60) -> float:
    """The depth, m, at which the vibration begins to grow, between rising depths; NaN outside of them."""
    rates = growth(arm, cut, rpm, depths, seconds, steps)
    rising = np.flatnonzero(rates > 0)
    if not rising.size or rising[0] == 0:
        return float("nan")
    k = rising[0]
    part = rates[k - 1] / (rates[k - 1] - rates[k])
    return float(depths[k - 1] + part * (depths[k] - depths[k - 1]))


def multiplier(arm: Arm, cut: Cut, rpm: float, depth: float, steps: int) -> float:
    """Growth per tooth period at a depth, m: the largest size of the eigenvalues of what a period of so many
    steps does to displacements, velocities, accelerations and the past of the tip.
    """
    h, size = 60 / (cut.teeth * rpm) / steps, len(arm.mass)
    to_force, slow, stiff = arm.accelerations()
    whole = 3 * size + 2 * steps
    start = np.eye(whole)  # of all unit states at once, one a row
    q, v, accel = (start[:, n * size : (n + 1) * size] for n in range(3))
    past = start[:, 3 * size :].reshape(whole, steps, 2)
    pitch = 2 * np.pi / cut.teeth
    now_all = np.empty_like(past)
    for k in range(steps):
        q = q + h * v + h * h / 2 * accel
        now = q @ arm.tip[:2].T
        now_all[:, k] = now
        moved, force = now - past[:, k], np.zeros((whole, 3))
        for tooth in range(cut.teeth):
            begin = (k + tooth * steps) * pitch / steps
            low, high = max(begin, cut.entry), min(begin + pitch / steps, cut.exit)
            if high > low:
                s, c = np.sin((low + high) / 2), np.cos((low + high) / 2)
                chip = moved @ np.array([s, c]) * (high - low) * steps / pitch
                f = cut.kt * np.array([-c, s, 0.0]) - cut.kr * np.array([s, c, 0.0]) - cut.ka * np.eye(3)[2]
                force += depth * chip[:, None] * f
        new = force @ to_force.T - (v + h * accel) @ slow.T - q @ stiff.T
        v = v + h / 2 * (accel + new)
        accel = new
    end = np.concatenate([q, v, accel, now_all.reshape(whole, -1)], axis=1)
    return float(np.abs(np.linalg.eigvals(end)).max())


def exact_limit(
    arm: Arm, cut: Cut, rpm: float, near: float, steps: tuple[int, int] = (60, 120)
) -> tuple[float, float]:
    """The least depth, m, at which vibration grows, looked for from 0.5 to 2 times `near` in steps of 4 %,
    and how far the halved step moved it, relative; NaN where there is none.
    """

    def rate(depth: float, count: int) -> float:
        return float(np.log(multiplier(arm, cut, rpm, depth, count)))

    first = next((a for a in near * np.geomspace(0.5, 2.0, 36) if rate(a, steps[0]) > 0), None)
    if first is None or first == 0.5 * near:
        return float("nan"), float("nan")
    found = []
    for count in steps:
        low, high = first / 1.1, first * 1.06
        if not rate(low, count) < 0 < rate(high, count):
            return float("nan"), float("nan")
        found.append(float(brentq(rate, low, high, args=(count,), rtol=1e-5)))
    coarse, fine = found
    return fine + (fine - coarse) / 3, abs(fine / coarse - 1)

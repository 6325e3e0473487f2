"""Joint stiffness from static loads: Nagoya Eq. 8, tau = A_1 theta + A_3 theta^3, and the width of its
hysteresis.

Each row of the file is a pose at rest, in the order in which it was taken: motor and link angle of the joint,
and the torque that its gear carries, given, or from the weight of the robot and of disks at a place of a
link, as in Nagoya section 4.1.  Going up and going down the torque differs by the width: theta = theta_0 +
g(tau - s w / 2), with g the inverse of Eq. 8, s = 1 while the torque rises and -1 while it falls.  Rows less
than twice the width after a turn are between the branches and left out.  The error is in the angles.

The torque that weight puts on joints at rest: of the robot at its link angles, and of disks hung at a
place of a link.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Literal

import numpy as np
import scipy
from pydantic import Field, model_validator

from identify.core.arrays import Array
from identify.core.config import Settings
from identify.core.errors import InputError
from identify.joints.base import JointCurve
from identify.joints.data import JointTestData
from identify.joints.intervals import independent, symmetric, table
from identify.measured.record_files import RecordFile
from identify.measured.records import SignalSettings
from identify.model.laws.gear import GearSpring
from identify.results.joints import CurveResult, Panel, Series
from identify.robot.description import Link
from identify.robot.inverse_dynamics import RigidArm

_PASSES = 4
_LEAST = 5


class StiffnessStatic(JointCurve):
    """Static loads on one joint."""

    kind: Literal["stiffness-static"]
    torque: SignalSettings | None = Field(
        None, description="the torque that the gear carries, a column of the file"
    )
    weights: StaticWeights | None = Field(
        None, description="in its place: weight of the robot and of disks on it"
    )

    @model_validator(mode="after")
    def _one(self) -> StiffnessStatic:
        if (self.torque is None) == (self.weights is None):
            raise ValueError("give either `torque` or `weights`")
        return self

    def identify(self, bench: JointTestData) -> CurveResult:
        """A_1, A_3, the hysteresis and the zero of the angles."""
        joint = bench.checked(self.joint, self.label)
        runs = [self._read(bench, file, joint) for file in self.files]
        windup, torque, rising = (np.concatenate(parts) for parts in zip(*runs, strict=True))
        found, kept = _settled(windup, torque, rising, self.label)
        return _result(self, windup, torque, rising, found, kept)

    def _read(self, bench: JointTestData, path: object, joint: int) -> tuple[Array, Array, Array]:
        file = RecordFile(bench.folder / str(path))
        bench.inputs[str(path)] = file.sha256
        where = f"{file.path}, {self.label}"
        motor, link = (
            bench.column(file, bench.at(quantity, where), joint, where)
            for quantity in ("motor_position", "link_position")
        )
        if self.torque is not None:
            torque = bench.column(file, self.torque, joint, where)
        else:
            assert self.weights is not None
            torque = self.weights.torque(file, bench, where)[:, joint]
        if len(torque) < _LEAST:
            raise InputError(
                where, f"{len(torque)} loads", f"at least {_LEAST}, of which some more than once"
            )
        return motor - link, torque, _rising(torque)


def _rising(torque: Array) -> Array:
    """1 while the torque rises, -1 while it falls, as it was before while it rests (rows,)."""
    steps = np.sign(np.diff(torque))
    moving = np.flatnonzero(steps)
    if not len(moving):
        return np.ones(len(torque))
    last = np.maximum.accumulate(np.where(steps != 0, np.arange(len(steps)), moving[0]))
    return np.concatenate([[steps[moving[0]]], steps[last]])


def _since_turn(torque: Array, rising: Array) -> Array:
    """How far the torque has come since it last turned, or since the beginning (rows,), N m."""
    turns = np.concatenate([[0], np.flatnonzero(np.diff(rising)), [len(torque)]])
    since = np.zeros(len(torque))
    for turn, after in pairwise(turns):
        since[turn + (turn > 0) : after + 1] = np.abs(torque[turn + (turn > 0) : after + 1] - torque[turn])
    return since


def _predict(x: Array, torque: Array, rising: Array) -> tuple[Array, Array]:
    """Windup (rows,) by A_1, A_3, half the width and the zero, and its derivatives (rows, 4)."""
    load = torque - rising * x[2]
    one = np.ones(1)
    spring = GearSpring(one, x[0] * one, x[1] * one, 0 * one, ())
    theta = spring.windup(load)
    slope = x[0] + 3 * x[1] * theta**2
    return theta + x[3], np.column_stack(
        [-theta / slope, -(theta**3) / slope, -rising / slope, np.ones(len(torque))]
    )


def _fit(windup: Array, torque: Array, rising: Array, start: Array) -> Array:
    """The best A_1, A_3, half width and zero (4,) from a start."""
    size = np.array(
        [
            start[0],
            start[0] / max(float(np.abs(windup - start[3]).max()), 1e-12) ** 2,
            np.ptp(torque),
            np.ptp(windup),
        ]
    )
    scatter = max(float(np.std(windup)), 1e-300)
    found = scipy.optimize.least_squares(
        lambda x: (_predict(x * size, torque, rising)[0] - windup) / scatter,
        start / size,
        jac=lambda x: _predict(x * size, torque, rising)[1] * size / scatter,
        bounds=([1e-3, -0.2, -1.0, -np.inf], [1e3, 1e3, 1.0, np.inf]),
    )
    return np.asarray(found.x * size)


def _settled(windup: Array, torque: Array, rising: Array, where: str) -> tuple[Array, Array]:
    """The fit without the rows that are between the branches, which depend on the width found; and which rows
    are kept.
    """
    if np.ptp(torque) == 0 or np.ptp(windup) == 0:
        raise InputError(
            where, "loads, or angles, that are all alike", "loads that wind the joint up", "load it in steps"
        )
    slope, zero = np.polynomial.polynomial.polyfit(torque, windup, 1)[::-1]
    if slope <= 0:
        raise InputError(
            where,
            "motor minus link angle that falls with the torque",
            "one that rises",
            "turn the torque's sign",
        )
    since, kept = _since_turn(torque, rising), np.ones(len(torque), dtype=bool)
    found = np.array([1 / slope, 0.0, 0.0, zero])
    for _ in range(_PASSES):
        found = _fit(windup[kept], torque[kept], rising[kept], found)
        wanted = since >= 4 * abs(found[2])
        if (wanted == kept).all() or wanted.sum() < _LEAST:
            break
        kept = wanted
    return found, kept


def _result(
    curve: StiffnessStatic, windup: Array, torque: Array, rising: Array, found: Array, kept: Array
) -> CurveResult:
    predicted, jacobian = _predict(found, torque, rising)
    left = (windup - predicted)[kept]
    both = bool((rising[kept] > 0).any() and (rising[kept] < 0).any())
    columns = [0, 1, 2, 3] if both else [0, 1, 3]
    _, half = independent(jacobian[kept][:, columns], left)
    reach = np.full(4, np.inf)
    reach[columns] = half
    values = (
        symmetric("stiffness", "N m/rad", found[0], reach[0], meaning="A_1 of Eq. 8"),
        symmetric("cubic_stiffness", "N m/rad^3", found[1], reach[1], meaning="A_3 of Eq. 8"),
        symmetric(
            "hysteresis_width",
            "N m",
            2 * found[2],
            2 * reach[2],
            meaning="torque going up less torque going down",
        ),
        symmetric(
            "zero", "rad", found[3], reach[3], plain=True, meaning="motor minus link angle without load"
        ),
    )
    loads = f"{kept.sum()} of {len(torque)} loads used, {torque.min():.4g} to {torque.max():.4g} N m"
    notes = () if both else ("the torque only rises, or only falls, so nothing is known of hysteresis",)
    rms, title = float(np.sqrt(np.mean(left**2))), f"Stiffness of joint {curve.joint}"
    panels = {"curve": _panel(windup, torque, rising, found)}
    said = (
        loads
        if kept.all()
        else f"{loads}; the others are between the branches, just after a turn of the load",
    )
    return CurveResult(title, curve.kind, "rad", rms, int(kept.sum()), table(values), panels, said, notes)


def _panel(windup: Array, torque: Array, rising: Array, found: Array) -> Panel:
    fine = np.linspace(torque.min(), torque.max(), 200)
    ways = {"rising": 1.0, "falling": -1.0}
    measured = {
        f"measured, {n}": Series("points", (windup - found[3])[rising == s], torque[rising == s])
        for n, s in ways.items()
    }
    curves = {
        f"identified, {n}": Series("line", _predict(found, fine, s + 0 * fine)[0] - found[3], fine)
        for n, s in ways.items()
    }
    return Panel("Windup", "rad", "Torque", "N m", {**measured, **curves})


class StaticWeights(Settings):
    """Disks on a link, their mass a column of the file; the robot is that of the study, the posture its link
    angles.
    """

    at: str = Field(description="name of the column with the mass of the disks, kg")
    link: str = Field(description="link that carries them")
    centre_m: tuple[float, float, float] = Field(
        (0.0, 0.0, 0.0), description="where their centre is, in the link's frame"
    )

    def torque(self, file: RecordFile, bench: JointTestData, where: str) -> Array:
        """(rows, joints), N m, that the drives hold; InputError where the study has no robot or the robot no
        such link.
        """
        robot = bench.rigid(where)
        robot.link(self.link, f"{where}, key weights.link")
        angles = np.column_stack(
            [bench.column(file, bench.at("link_position", where), n, where) for n in range(bench.joints)]
        )
        mass = np.ravel(file.array(self.at))
        arm = RigidArm(robot, angles + bench.zero, np.zeros_like(angles), np.zeros_like(angles))
        return arm.torque + mass[:, None] * arm.added(
            self.link, Link("disks", 1.0, np.array(self.centre_m), np.zeros((3, 3)))
        )

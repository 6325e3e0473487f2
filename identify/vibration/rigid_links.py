"""Sensors on one link, which at low frequencies moves as a rigid body: each must move as the others say.

Readings y (n,) of n channels on a link are A m, with m its three translations and three rotations, so N^T y =
0 for the left null space N of A.  What careful work leaves of errors in place, direction and calibration is a
share of each sensor's own motion; the root mean square of N^T y in units of what that makes, in the direction
where it is largest, is the misfit of the link, and the channel without which it is gone is the one that is
wrong.  FRFs weigh as receptances, in
which low frequencies count most.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from identify.core.arrays import Array, Complex
from identify.measured.channel import Channel
from identify.measured.finding import Finding, listing
from identify.measured.frf_set import POWER, FrfSet
from identify.robot.points import Point
from identify.vibration.problem import Problem

_CAREFUL = 0.1
"""Error of a sensor's place, direction and calibration together, over its own motion."""
_SIGMAS = 2.0
_SAME = 1e-6
"""Of a number that is 0 but for rounding, over the largest."""


@dataclass(frozen=True)
class _Link:
    """Channels on one link: rows (n, 6) of its motion, readings (n, lines x inputs) as receptances, variance
    of their noise (n,) and mean square of their sensors' motion (n,).
    """

    name: str
    channels: tuple[Channel, ...]
    rows: Array
    readings: Complex
    noise: Array
    motion: Array

    def without(self, keep: Sequence[int]) -> _Link:
        """The same with some of the channels."""
        chosen = list(keep)
        return _Link(
            self.name,
            tuple(self.channels[i] for i in chosen),
            self.rows[chosen],
            self.readings[chosen],
            self.noise[chosen],
            self.motion[chosen],
        )

    def misfit(self) -> float:
        """How far the readings are from those of a rigid body, in units of careful work; 0 where they cannot
        be.
        """
        left, sizes, _ = np.linalg.svd(self.rows)
        null = left[:, int(np.sum(sizes > _SAME * sizes.max(initial=0.0))) :]
        if not null.shape[1] or not self.motion.any():
            return 0.0
        usual = np.linalg.cholesky((null.T * (_CAREFUL**2 * self.motion + self.noise)) @ null)
        found = np.linalg.solve(usual, null.T @ self.readings)
        return float(np.linalg.norm(found, 2) / np.sqrt(found.shape[1]))


def rigid_link_findings(problem: Problem) -> Iterator[tuple[str, Finding]]:
    """By the name of the measurement: links whose sensors do not move as one body, the worst first."""
    for measurement in problem.measurements:
        if isinstance(measurement.given.data, FrfSet):
            links = _links(problem, measurement.given.data)
            misfits = [(link.misfit(), link) for link in links]
            for misfit, link in sorted(misfits, key=lambda one: -one[0]):
                if misfit > _SIGMAS:
                    yield measurement.name, _finding(link, misfit)


def _finding(link: _Link, misfit: float) -> Finding:
    wrong, words = _suspects(link)
    sentence = (
        f"The sensors on {link.name} do not move as one rigid body at low frequencies, by"
        f" {misfit * _CAREFUL:.0%} of their motion: {words}; look for a wrong sign, gain, place"
        " or axis there."
    )
    return Finding("warn", "rigid-link", wrong, sentence, misfit)


def _suspects(link: _Link) -> tuple[tuple[Channel, ...], str]:
    """The channels without which a link would move as one body, or else the sensors."""
    all_of = range(len(link.channels))
    alone = [i for i in all_of if link.without([k for k in all_of if k != i]).misfit() <= _SIGMAS]
    nodes = dict.fromkeys(channel.node for channel in link.channels)
    if alone and len(alone) <= len(link.channels) / 2:
        wrong = tuple(link.channels[i] for i in alone)
        return wrong, f"without {' or '.join(map(str, wrong))} they would"
    if not alone:
        whole = [
            node
            for node in nodes
            if link.without([k for k in all_of if link.channels[k].node != node]).misfit() <= _SIGMAS
        ]
        if whole and len(whole) < len(nodes):
            wrong = tuple(channel for channel in link.channels if channel.node in whole)
            return wrong, f"without the sensor at {' or '.join(map(str, whole))} they would"
    return link.channels, f"which of the points {listing(list(nodes))} is wrong they cannot tell"


def _links(problem: Problem, data: FrfSet) -> list[_Link]:
    """The links with sensors on them, whether they can contradict each other or not."""
    members: dict[str, list[int]] = {}
    places: dict[int, tuple[str, Array, Array]] = {}
    for i, channel in enumerate(data.outputs):
        if 1 <= abs(channel.direction) <= 3 and channel.node in problem.points:
            places[i] = _place(problem, problem.points[channel.node], channel)
            members.setdefault(places[i][0], []).append(i)
    receptance = data.frf / data.s[:, None, None] ** POWER[data.quantity]
    noise = np.zeros(data.frf.shape) if data.noise is None else np.nan_to_num(data.noise)
    variance = 2 * (noise / np.abs(data.s[:, None, None]) ** POWER[data.quantity]) ** 2
    return [_link(name, some, places, data, receptance, variance) for name, some in members.items()]


def _link(
    name: str,
    members: list[int],
    places: dict[int, tuple[str, Array, Array]],
    data: FrfSet,
    receptance: Complex,
    variance: Array,
) -> _Link:
    inputs = np.flatnonzero(data.measured[members].all(axis=0))
    readings = np.moveaxis(receptance[:, members][:, :, inputs], 1, 0).reshape(len(members), -1)
    noise = np.moveaxis(variance[:, members][:, :, inputs], 1, 0).reshape(len(members), -1)
    centre = np.mean([places[i][1] for i in members], axis=0)
    arms = np.array([places[i][1] - centre for i in members])
    along = np.array([places[i][2] for i in members])
    reach = float(np.linalg.norm(arms, axis=1).max()) or 1.0
    own = np.mean(np.abs(readings) ** 2, axis=1) if readings.size else np.zeros(len(members))
    channels = tuple(data.outputs[i] for i in members)
    motion = np.array([own[[c.node == one.node for c in channels]].sum() for one in channels])
    rows = np.hstack([along, np.cross(arms, along) / reach])
    spread = noise.mean(axis=1) if noise.size else np.zeros(len(members))
    return _Link(name, channels, rows, readings, spread, motion)


def _place(problem: Problem, point: Point, channel: Channel) -> tuple[str, Array, Array]:
    """Link, position and direction of a channel in the link's frame."""
    link, position, along = point.link, point.position, channel.sign * point.axes[channel.axis]
    if link in problem.robot.frames:
        link, pose = problem.robot.frames[link]
        position, along = pose[:3, :3] @ position + pose[:3, 3], pose[:3, :3] @ along
    return link, position, along

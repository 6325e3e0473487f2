"""The side of a joint that its link is on: how it moves, and how far the gear is bent.

What a gear carries is what the links behind it need, for the motion of the links.  The motor's motion is
theirs only well below a resonance and against theirs above it, so where a link-side position was recorded,
that is taken.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import scipy

from identify.core.arrays import Array
from identify.measured.conditioning import ConditionedMotion, slow_part


@dataclass(frozen=True)
class LoadSide:
    """Position, velocity, acceleration of the links (samples, joints), rad, s: the motor's where no link-side
    position was recorded; deflection: motor less link, slow part alone, zero there; latency (joints,), s: by
    how much they were taken to be read late.
    """

    position: Array
    velocity: Array
    acceleration: Array
    deflection: Array
    latency: Array

    @property
    def read_late(self) -> Array:
        """Positions (samples, joints) as they were read, to first order in the latency: what a latency does
        beyond that, which bends the gear like a spring, is put right.
        """
        return self.position - self.latency * self.velocity


def load_side(motion: ConditionedMotion, latency: Array | None = None) -> LoadSide:
    """The load side of a conditioned motion; latency (joints,), s: how much later link-side positions were
    read than the motors'.

    Encoders count from zeros of their own, so that a link is on average where its motor is.
    """
    late = np.zeros(motion.position.shape[1]) if latency is None else latency
    histories = motion.link_position, motion.link_velocity, motion.link_acceleration
    if any(history is None for history in histories):
        still = np.zeros_like(motion.position)
        return LoadSide(motion.position, motion.velocity, motion.acceleration, still, late)
    position, velocity, acceleration = (_earlier(motion, history, late) for history in histories)
    known = np.isfinite(position).all(axis=0)
    bent = motion.position - position
    for start, end in _records(motion):
        here = slice(start, end)
        position[here] += bent[here][motion.inside[here]].mean(axis=0)
        apart = motion.position[here] - position[here]
        bent[here] = slow_part(apart, motion.lowpass_hz, motion.sample_rate_hz)
    return LoadSide(
        np.where(known, position, motion.position),
        np.where(known, velocity, motion.velocity),
        np.where(known, acceleration, motion.acceleration),
        np.where(known, bent, 0.0),
        late,
    )


def _records(motion: ConditionedMotion) -> list[tuple[int, int]]:
    return list(pairwise((*motion.starts, len(motion.time_s))))


def _earlier(motion: ConditionedMotion, history: Array | None, latency: Array) -> Array:
    """A history (samples, joints) read that much earlier, by cubic splines, held at the end of each
    record.
    """
    assert history is not None
    found = history.copy()
    for joint in np.flatnonzero(latency):
        for start, end in _records(motion):
            times = motion.time_s[start:end]
            spline = scipy.interpolate.make_interp_spline(times, history[start:end, joint], k=3)
            found[start:end, joint] = spline(np.clip(times + latency[joint], times[0], times[-1]))
    return found

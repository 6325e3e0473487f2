"""Wrist motors that turn with two joints: which samples they move in, and whether what is left of the torques
asks for such a coupling that the study does not state.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from identify.core.arrays import Array, Mask
from identify.core.correlated import log_likelihood_gain
from identify.core.separable import eliminate
from identify.joints.base_set import coupled, motor_columns
from identify.joints.data import JointTestData
from identify.measured.conditioning import ConditionedMotion

_WRIST = 3
"""First joint (from 0) of a wrist."""
_SURE, _PART = 10.0, 0.1
"""Gain in log likelihood, and part of the squares left at the two joints, from which a coupling is asked
for.
"""


def moving(motion: ConditionedMotion, rows: Sequence[int], bench: JointTestData) -> Mask:
    """Samples (samples, rows) at which a joint moves, and every coupled motor that acts on it."""
    used = motion.inside[:, None] & (np.abs(motion.velocity[:, rows]) > bench.slow)
    if bench.coupling is not None:
        for drive in coupled(bench.coupling):
            standing = np.abs(motion.velocity @ bench.coupling[drive]) <= bench.slow
            used &= ~(standing[:, None] & (bench.coupling[drive][list(rows)] != 0))
    return np.asarray(used)


def coupling_asked(
    motions: Sequence[ConditionedMotion],
    rows: Sequence[int],
    columns: Array,
    torque: Array,
    used: Mask,
    weights: Array,
) -> tuple[str, ...]:
    """A sentence on the coupling of two wrist joints that explains most of what is left, if one explains
    much; none otherwise.

    columns (samples, rows, p), torque and used (samples, rows) of all motions in a row; weights (rows,).
    """
    velocity, acceleration = (
        np.concatenate([getattr(m, what) for m in motions]) for what in ("velocity", "acceleration")
    )

    def left(wanted: Array) -> Array:
        found = eliminate((wanted * weights[:, None])[used], (torque * weights)[used])
        return np.where(used, torque - wanted @ found.coefficients, 0.0)

    before, best = left(columns), ("", _PART)
    for drive, other, share in _pairs(rows):
        matrix = np.eye(velocity.shape[1])
        matrix[drive, other] = share
        extra = motor_columns(drive, rows, matrix, velocity, acceleration)
        after = left(np.concatenate([columns, extra], axis=2))
        places = [rows.index(drive), rows.index(other)]
        part = 1 - float((after[:, places] ** 2).sum() / (before[:, places] ** 2).sum())
        gain = sum(log_likelihood_gain(before[:, n], after[:, n], used[:, n])[0] for n in places)
        if part > best[1] and gain > _SURE:
            best = _sentence(drive, other, share, part), part
    return (best[0],) if best[0] else ()


def _pairs(rows: Sequence[int]) -> Iterator[tuple[int, int, float]]:
    """Motor, the joint before it that it may turn with besides its own, and how far; either way round, both
    joints feel the same friction of the same sum.
    """
    wrist = [row for row in rows if row >= _WRIST]
    for drive in wrist:
        for other in wrist:
            if other < drive:
                yield from ((drive, other, share) for share in (-1.0, 1.0))


def _sentence(drive: int, other: int, share: float, part: float) -> str:
    return (
        f"if motor {drive + 1} also turns {share:+g} times with joint {other + 1}, its friction and inertia"
        f" take {100 * part:.0f} % of the squares left at joints {drive + 1} and {other + 1}: where the wrist"
        " is built so, state `coupling`; until then take no friction or inertia of the two as determined"
    )

"""A tracker that saw the tool in a frame and with a clock of its own: laid on where the drives say that the
tool was.

A circle looks the same turned about its axis, so that only its beginning and end tell a turn from an offset
in time: both are found together, the turn in closed form for each offset.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from identify.core.arrays import Array
from identify.core.closest_turn import closest_turn

_STEP = 0.5
"""Steps of the first search, in samples of the record."""


@dataclass(frozen=True)
class Registration:
    """Places of the tracker (samples, 3), m, in the base's axes and at the record's times; what was taken
    away: offset in time, s, by which its clock was ahead; angle of the turn, rad, and shift (3,), m, of its
    mean; left: RMS distance to the path of the drives, m.
    """

    places: Array
    offset_s: float
    angle: float
    shift: Array
    left: float

    def sentence(self, record: str) -> str:
        """What it took away, and what is left."""
        return (
            f"{record}: the tracker's frame and clock were aligned with the path of the drives by an offset"
            f" of {1e3 * self.offset_s:.2f} ms, a turn of {np.degrees(self.angle):.3g}° and a shift of"
            f" {np.linalg.norm(self.shift):.4g} m; {1e6 * self.left:.0f} µm (RMS) remain. Lag, rotation and"
            " sag of the arm itself are removed with them"
        )


def registered(seen: Array, time_s: Array, path: Array, most_s: float) -> Registration:
    """Places `seen` (samples, 3), m, at times (samples,), s, laid by a rigid motion and an offset in time of
    at most most_s either way on a path (samples, 3) at the same times.
    """

    def laid(offset: float) -> tuple[float, Array, Array]:
        at = np.stack([np.interp(time_s + offset, time_s, column) for column in seen.T], axis=1)
        turn, left = _turned(at, path)
        return left, at, turn

    step = _STEP * float(time_s[1] - time_s[0])
    offsets = step * np.arange(-np.ceil(most_s / step), np.ceil(most_s / step) + 1)
    first = min(offsets, key=lambda offset: laid(float(offset))[0])
    found = scipy.optimize.minimize_scalar(
        lambda offset: laid(offset)[0],
        bounds=(first - step, first + step),
        method="bounded",
        options={"xatol": 1e-3 * step},
    )
    offset = float(found.x)
    left, at, turn = laid(offset)
    places = (at - at.mean(axis=0)) @ turn.T + path.mean(axis=0)
    angle = float(np.arccos(np.clip((np.trace(turn) - 1) / 2, -1.0, 1.0)))
    return Registration(places, offset, angle, path.mean(axis=0) - at.mean(axis=0), left)


def _turned(seen: Array, path: Array) -> tuple[Array, float]:
    """The rotation (3, 3) that lays centred places on a centred path, and the RMS distance left, m."""
    a, b, turn = seen - seen.mean(axis=0), path - path.mean(axis=0), closest_turn(seen, path)
    return turn, float(np.sqrt(np.mean(np.sum((a @ turn.T - b) ** 2, axis=1))))

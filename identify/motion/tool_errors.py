"""What makes a tracker and a model disagree on where a tool is although the model is right: nobody knows its
axes, nor the angles at which encoders are zero, exactly, and an arm that sags turns both.

These errors are constant over a record, so that they move each place in a known way.  They are marginalised:
a residual r of noise s and errors of unit variance that move it by B is compared as (I + B B'/s^2)^(-1/2) r.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identify.core.arrays import Array
from identify.robot.engine_motion import MovingArm

_ANYWHERE_M = 1.0
"""Standard deviation of where a tracker stands."""
_ROUNDING = 1e-9


@dataclass(frozen=True)
class ToolErrors:
    """What a standard deviation of each error moves the places of a tool by: orthonormal directions (3
    samples, k) with sizes (k,), m; known (samples,): where the tool was seen.
    """

    directions: Array
    sizes: Array
    known: Array

    @classmethod
    def of(
        cls, rigid: MovingArm, angles: Array, tool: tuple[str, Array], seen: Array, std: float
    ) -> ToolErrors:
        """Of places `seen` (samples, 3), m, by the point of a frame of an arm at joint angles (samples,
        joints), whose zeros are known, as the tracker's axes, to std, rad.
        """
        known = np.isfinite(seen).all(axis=1)
        lever = seen[known] - seen[known].mean(axis=0)
        shifts = _ANYWHERE_M * np.tile(np.eye(3), (len(lever), 1))
        turns = std * np.cross(np.eye(3), lever[:, None]).swapaxes(1, 2).reshape(-1, 3)
        moved = [rigid.frame_motion(row, *tool)[2][:3] for row in angles[known]]
        zeros = std * np.array(moved).reshape(-1, angles.shape[1])
        directions, sizes, _ = np.linalg.svd(np.hstack([shifts, turns, zeros]), full_matrices=False)
        able = sizes > _ROUNDING * sizes.max(initial=0.0)
        return cls(directions[:, able], sizes[able], known)

    def beyond(self, difference: Array, noise: float) -> Array:
        """A difference of places (..., samples, 3) from those seen beside this noise, m, beyond these errors;
        NaN where nothing was seen.
        """
        rows = difference[..., self.known, :].reshape(*difference.shape[:-2], -1)
        share = 1 - noise / np.hypot(noise, self.sizes)
        left = np.full(difference.shape, np.nan)
        rows = rows - (rows @ self.directions * share) @ self.directions.T
        left[..., self.known, :] = rows.reshape(*rows.shape[:-1], -1, 3)
        return left

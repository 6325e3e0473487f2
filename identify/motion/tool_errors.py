"""What makes a tracker and a model disagree on where a tool is although the model is right: nobody knows its
axes, nor the angles at which encoders are zero, exactly, and an arm that sags turns both.

These errors are constant over a record, so that they move each place in a known way.  They are marginalised:
a residual r of noise s and errors of unit variance that move it by B is compared as (I + B B'/s^2)^(-1/2) r.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identify.core.arrays import Array, Mask
from identify.robot.engine_motion import MovingArm


@dataclass(frozen=True)
class ToolErrors:
    """What a standard deviation of each error moves the places of a tool by about their mean: orthonormal
    directions (3 samples, k) with sizes (k,), m; known (samples,): where the tool was seen.
    """

    directions: Array
    sizes: Array
    known: Mask

    @classmethod
    def of(
        cls, rigid: MovingArm, angles: Array, tool: tuple[str, Array], seen: Array, std: float
    ) -> ToolErrors:
        """Of places `seen` (samples, 3), m, by the point of a frame of an arm at joint angles (samples,
        joints), whose zeros are known, as the tracker's axes, to std, rad.
        """
        known = np.asarray(np.isfinite(seen).all(axis=1))
        turns = np.cross(np.eye(3), seen[known][:, None]).swapaxes(1, 2)
        zeros = np.array([rigid.frame_motion(row, *tool)[2][:3] for row in angles[known]])
        moved = std * np.concatenate([turns, zeros], axis=2)
        moved = (moved - moved.mean(axis=0)).reshape(-1, moved.shape[2])
        directions, sizes, _ = np.linalg.svd(moved, full_matrices=False)
        return cls(directions, sizes, known)

    def beyond(self, difference: Array, noise: float) -> Array:
        """A difference of places (..., samples, 3) from those seen beside this noise, m, beyond its mean and
        these errors; NaN where nothing was seen.
        """
        rows = difference[..., self.known, :]
        rows = (rows - rows.mean(axis=-2, keepdims=True)).reshape(*rows.shape[:-2], -1)
        whole = np.hypot(noise, self.sizes)
        share = 1 - noise / np.where(whole > 0, whole, 1.0)
        rows = rows - (rows @ self.directions * share) @ self.directions.T
        left = np.full(difference.shape, np.nan)
        left[..., self.known, :] = rows.reshape(*rows.shape[:-1], -1, 3)
        return left

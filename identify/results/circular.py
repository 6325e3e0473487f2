"""The circular test: how far a path is off its own mean circle (ISO 230-4; Kobe, Fig. 16)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from identify.core.arrays import Array


@dataclass(frozen=True)
class CircularTest:
    """A path beside the circle that fits it best by least squares: centre (2,) and radius, m; of each point
    (n,) the angle about the centre, rad, from the plane's first axis, and the radial error, m: its distance
    from the centre less the radius, outwards positive.
    """

    centre: Annotated[Array, "plane", "m"]
    radius: Annotated[float, "", "m"]
    angle: Annotated[Array, "angle", "rad"]
    error: Annotated[Array, "angle", "m"]

    @property
    def deviation(self) -> float:
        """From the innermost to the outermost point, m."""
        return float(np.ptp(self.error))

    @property
    def rms(self) -> float:
        """RMS of the radial error, m."""
        return float(np.sqrt(np.mean(self.error**2)))

    @property
    def quadrant_rms(self) -> Array:
        """The same in each quadrant (4,) about the centre, from the plane's first axis to the second; NaN
        where nothing is.
        """
        quadrant = (self.angle // (np.pi / 2)).astype(int) % 4
        squares = [self.error[quadrant == number] ** 2 for number in range(4)]
        return np.sqrt([np.mean(own) if len(own) else np.nan for own in squares])

    def enlarged(self, factor: float) -> Array:
        """The path about the origin with its radial error enlarged, m, (n, 2)."""
        around = np.column_stack([np.cos(self.angle), np.sin(self.angle)])
        return np.asarray((self.radius + factor * self.error)[:, None] * around)


def circular_test(path: Array) -> CircularTest:
    """The test of a path (n, 2), m, which goes about once around; its radius is the mean distance from the
    centre.
    """
    centre = path.mean(axis=0)
    for _ in range(20):
        off = path - centre
        distance = np.linalg.norm(off, axis=1)
        slopes = np.column_stack([off / distance[:, None], np.ones(len(path))])
        step = np.linalg.lstsq(slopes, distance, rcond=None)[0]
        centre = centre + step[:2]
        if np.linalg.norm(step[:2]) < 1e-13:
            break
    off = path - centre
    distance = np.linalg.norm(off, axis=1)
    radius = float(distance.mean())
    return CircularTest(centre, radius, np.arctan2(off[:, 1], off[:, 0]), distance - radius)

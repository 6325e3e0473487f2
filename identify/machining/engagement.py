"""How cutting forces follow the chip: directional factors of a milling tool, as functions on arrays.

A tooth at the angle phi from the normal y, turning towards the feed x, is at (sin phi, cos phi).  It cuts a
chip of thickness h = n . (r(t) - r(t - T)), and is pushed by a K h per tooth, a the axial depth of cut:

    n = (sin k sin phi, sin k cos phi, -cos k),  force = a f n' (r(t) - r(t - T)),
    f = Kt (-cos phi, sin phi, 0) + Kr (-sin k sin phi, -sin k cos phi, cos k)
        + Ka (-cos k sin phi, -cos k cos phi, -sin k)

with the lead angle k, 90 degrees for an end mill (Altintas 2001, J. Manuf. Sci. Eng. 123, Eqs. 1 to 6).
Teeth at uneven angles (variable pitch) cut what the tooth before left as long ago as its own pitch takes, and
the cut repeats with the turn, not with the tooth (Altintas, Engin and Budak 1999, J. Manuf. Sci. Eng. 121).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from identify.core.arrays import Array, Complex, Index
from identify.machining.materials import Coefficients

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(12)
_SLICES = 8
"""Slices of the depth over which a helix is averaged."""


@dataclass(frozen=True)
class Engagement:
    """Teeth in a cut: how many, entry and exit angle, rad, lead angle, rad, coefficients, and the helix as
    its lag angle per metre of depth, rad/m; pitches (teeth,), rad, from each tooth to the one before it,
    where they are not all alike.
    """

    teeth: int
    entry: float
    exit: float
    lead: float
    cutting: Coefficients
    lag_per_m: float = 0.0
    pitches: tuple[float, ...] = ()

    @property
    def repeats(self) -> int:
        """How often the cut repeats in a turn."""
        return 1 if self.pitches else self.teeth

    @property
    def pitch(self) -> float:
        """Angle between two teeth, rad."""
        return 2 * np.pi / self.teeth

    @cached_property
    def _sides(self) -> tuple[Array, Array]:
        """f and n as matrices (3, 3) times u = (sin phi, cos phi, 1)."""
        s, c = np.sin(self.lead), 0.0 if self.lead > np.pi / 2 - 1e-9 else np.cos(self.lead)
        k = self.cutting
        chip = np.diag([s, s, -c])
        along = k.axial * np.diag([-c, -c, -s])
        across = k.tangential * np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
        return across - k.radial * chip + along, chip

    def factors(self, phi: Array) -> Array:
        """f n' (..., 3, 3), N/m^2, of one tooth at angles phi (...,), rad, as if it were in the cut."""
        force, chip = self._sides
        u = np.stack([np.sin(phi), np.cos(phi), np.ones_like(phi)], axis=-1)
        return np.asarray((u @ force.T)[..., :, None] * (u @ chip.T)[..., None, :])

    def integral(self, low: Array, high: Array) -> Array:
        """(..., 3, 3): integral of `factors` over the part of [low, high] (...,), rad, that is in the cut.

        The angles lie within one turn of the cut.
        """
        force, chip = self._sides
        squares = _squares(np.clip(high, self.entry, self.exit)) - _squares(
            np.clip(low, self.entry, self.exit)
        )
        return np.asarray(force @ squares @ chip.T)

    @property
    def mean(self) -> Array:
        """(3, 3), N/m^2: all teeth, averaged over a turn; a helix does not change it."""
        whole = self.integral(np.array(self.entry), np.array(self.exit))
        return np.asarray(whole * self.teeth / (2 * np.pi))

    def harmonics(self, numbers: Index) -> Complex:
        """(..., 3, 3), N/m^2: Fourier coefficients of all teeth over the time in which the cut repeats, of
        those numbers (...,), without helix; of uneven teeth, as if all were where one of them is.
        """
        edges = np.linspace(self.entry, self.exit, 17)
        half = np.diff(edges)[:, None] / 2
        phi = ((edges[:-1] + edges[1:])[:, None] / 2 + half * _NODES).ravel()
        turned = (half * _WEIGHTS).ravel() * np.exp(-1j * self.repeats * numbers[..., None] * phi)
        whole = turned @ self.factors(phi).reshape(-1, 9) * (self.teeth / (2 * np.pi))
        return np.asarray(whole.reshape(*numbers.shape, 3, 3), dtype=complex)

    def along_helix(self, numbers: Index, depth: float) -> Complex:
        """(...,): what harmonics of those numbers are multiplied with at a depth, m: their mean over the lag
        of the edge, from 0 to that at the end of the depth.
        """
        half_lag = numbers * self.repeats * self.lag_per_m * depth / 2
        return np.asarray(np.exp(-1j * half_lag) * np.sinc(half_lag / np.pi), dtype=complex)

    def regenerated(self, orders: Index, part: Array) -> Complex:
        """(..., r, r): what the harmonics of the cut, from order to order (r,), are multiplied with where
        teeth cut what the ones before them left; part (...,): frequency over that at which the cut repeats.
        """
        if not self.pitches:
            late = 1 - np.exp(-2j * np.pi * part)
            return np.broadcast_to(late[..., None, None], (*part.shape, len(orders), len(orders)))
        pitches = np.array(self.pitches)
        apart = -np.subtract.outer(orders, orders)[..., None] * np.cumsum(pitches)
        late = 1 - np.exp(-1j * (part[..., None, None] + orders[:, None]) * pitches)
        return np.asarray(np.einsum("pqj,...qj->...pq", np.exp(1j * apart), late) / self.teeth)

    def steps(self, count: int, depth: float) -> Array:
        """(count, 3, 3), N/m^2: all teeth, averaged over each of so many equal steps of a tooth period, and
        over the depth, m, where there is a helix.
        """
        edges = np.linspace(0.0, self.pitch, count + 1)
        lag = self.lag_per_m * depth
        slices = np.array([0.0]) if lag == 0 else (np.arange(_SLICES) + 0.5) / _SLICES * lag
        around = self.pitch * np.arange(-1 - int(lag / self.pitch), self.teeth + 1)
        low = edges[:-1, None, None] + around[:, None] - slices
        whole = self.integral(low, low + self.pitch / count)
        return np.asarray(whole.sum(axis=1).mean(axis=1) / (self.pitch / count))


def _squares(phi: Array) -> Array:
    """(..., 3, 3): antiderivative of u u', u = (sin phi, cos phi, 1)."""
    sin, cos = np.sin(phi), np.cos(phi)
    rows = [
        [(phi - sin * cos) / 2, sin**2 / 2, -cos],
        [sin**2 / 2, (phi + sin * cos) / 2, sin],
        [-cos, sin, phi],
    ]
    return np.moveaxis(np.array(rows), (0, 1), (-2, -1))

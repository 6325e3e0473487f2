"""What carries the tool, as the cut feels it: matrices, and the receptance of the tip in the tool's axes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from identify.core.arrays import Array, Complex
from identify.machining.tool import ToolMode
from identify.model.frf import frf
from identify.model.modes import complex_modes

_DIRECTIONS = {"radial": (0, 1), "feed": (0,), "normal": (1,), "axial": (2,)}
_CLUSTER = np.tan(np.radians(np.linspace(-87, 87, 59)))
"""Places of lines around a mode, in half-widths of its peak."""


@dataclass(frozen=True)
class Structure:
    """M, C, K (..., n, n) and out (..., 3, n), the tip's displacement along feed, normal and axis per
    coordinate.

    K is complex where there is hysteretic damping.  Leading axes are those of draws.
    """

    mass: Array
    damping: Array
    stiffness: Array
    out: Array

    def with_modes(self, modes: Sequence[ToolMode]) -> Structure:
        """The same with modes of the tool in series: their receptances are added to the tip's."""
        found = self
        for mode in modes:
            for axis in _DIRECTIONS[mode.direction]:
                found = found._with(mode, axis)
        return found

    def _with(self, mode: ToolMode, axis: int) -> Structure:
        omega = 2 * np.pi * mode.frequency_hz
        mass = mode.stiffness_n_per_m / omega**2
        column = np.zeros((*self.out.shape[:-1], 1))
        column[..., axis, 0] = 1.0
        return Structure(
            _block(self.mass, mass),
            _block(self.damping, 2 * mode.damping_ratio * omega * mass),
            _block(self.stiffness, mode.stiffness_n_per_m),
            np.concatenate([self.out, column], axis=-1),
        )

    def receptance(self, line_hz: Array) -> Complex:
        """(..., lines, 3, 3), m/N, of the tip, along the tool's axes.

        Each system of draws has its own `out`, so that it is applied after a solve for all coordinates.
        """
        s = np.broadcast_to(2j * np.pi * line_hz, (*self.mass.shape[:-2], len(line_hz)))
        if self.out.ndim == 2:
            return frf(self.mass, self.damping, self.stiffness, s, self.out, self.out.T, 0)
        matrices = zip(self.mass, self.damping, self.stiffness, s, self.out, strict=True)
        return np.array([frf(m, c, k, line, out, out.T, 0) for m, c, k, line, out in matrices])

    @property
    def real(self) -> bool:
        """Whether there is no hysteretic damping, so that the matrices hold in time as well."""
        return not np.iscomplexobj(self.stiffness)

    def lines_hz(self, count: int) -> Array:
        """(lines,): frequencies that follow every resonance, from 0 to three times the highest mode; count:
        of the even ones (in the logarithm) between the modes.
        """
        modes = complex_modes(self.mass, self.damping, self.stiffness)
        hz, ratio = modes.frequency_hz[:, None], modes.damping_ratio[:, None]
        near = hz * (1 + ratio * _CLUSTER)
        even = np.geomspace(0.05 * hz.min(), 3 * hz.max(), count)
        every = np.concatenate([[0.0], even, near[(near > 0) & (near < 3 * hz.max())]])
        return np.unique(every)


def on_both_sides(at: Callable[[Complex], Complex], line_hz: Array) -> Complex:
    """What is known at s on the positive axis, at lines (l,) of any sign, Hz: conjugate at negative ones, as
    hysteresis turns with the sign.
    """
    return conjugated(at(np.asarray(2j * np.pi * np.abs(line_hz), dtype=complex)), line_hz)


def conjugated(found: Complex, line_hz: Array) -> Complex:
    """Values (l, ...) of positive lines, conjugate where a line (l,) is negative."""
    negative = (line_hz < 0).reshape(-1, *[1] * (found.ndim - 1))
    return np.where(negative, np.conj(found), found)


def _block(of: Array, value: float) -> Array:
    """Matrices (..., n, n) with one more coordinate, uncoupled."""
    made = np.zeros((*of.shape[:-2], of.shape[-2] + 1, of.shape[-1] + 1), dtype=of.dtype)
    made[..., :-1, :-1] = of
    made[..., -1, -1] = value
    return made

"""A model with fewer states: its lowest modes in real form, and what the others give at rest.

    y = C_r x + D_r u,   dx/dt = A_r x + B_r u

with A_r in blocks [[re, im], [-im, re]] of the kept eigenvalues, and D_r so that the static compliance is
that of the whole model.  The error is measured over the band, not bounded.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identify.core.arrays import Array, Complex
from identify.core.errors import InputError
from identify.export.linear import LinearModel, largest_error, lines_of


@dataclass(frozen=True)
class Reduced:
    """A, B, C, D of the model with fewer states; modes: how many were kept; error: the largest over band_hz,
    over the RMS of each FRF there.
    """

    a: Array
    b: Array
    c: Array
    d: Array
    modes: int
    error: float
    band_hz: tuple[float, float]

    def receptance(self, line_hz: Array) -> Complex:
        """(l, p, p), m/N."""
        return response(self.a, self.b, self.c, self.d, line_hz)

    @property
    def sentence(self) -> str:
        """What was done, and how far off it is."""
        return (
            f"reduced to {self.modes} modes ({len(self.a)} states): the largest error between"
            f" {self.band_hz[0]:.4g} and {self.band_hz[1]:.4g} Hz is {self.error:.2g} of each FRF's RMS"
        )


def response(a: Array, b: Array, c: Array, d: Array, line_hz: Array) -> Complex:
    """(l, p, q): C (s - A)^-1 B + D at lines (l,), Hz."""
    s = 2j * np.pi * line_hz
    inner = s[:, None, None] * np.eye(len(a)) - a
    return np.asarray(c @ np.linalg.solve(inner, np.broadcast_to(b, (len(s), *b.shape))) + d)


def reduced(model: LinearModel, band_hz: tuple[float, float], modes: int | None, error: float) -> Reduced:
    """The model with so many modes, or with the fewest whose error over the band is at most `error`;
    InputError where all modes leave more, or there are fewer.
    """
    there = len(model.modes.eigenvalues)
    if modes is not None and not 1 <= modes <= there:
        raise InputError("--modes", f"{modes}", f"1 to {there}, as many as the model has")
    line_hz = lines_of(band_hz)
    right = model.receptance(line_hz)
    found = None
    for count in [modes] if modes is not None else range(1, there + 1):
        found = _with(model, count, band_hz, line_hz, right)
        if modes is not None or found.error <= error:
            return found
    left = "no mode" if found is None else f"an error of {found.error:.2g} with all {there} modes"
    fix = "raise `--error`, or export the whole model"
    raise InputError("--error", f"{left} (the rest does not oscillate)", f"at most {error:g}", fix)


def _with(
    model: LinearModel, count: int, band_hz: tuple[float, float], line_hz: Array, right: Complex
) -> Reduced:
    poles, shapes = model.modes.eigenvalues[:count], model.modes.shapes[:count]
    a = np.zeros((2 * count, 2 * count))
    parts = shapes @ model.out.T  # (modes, channels); residues are their products, and the conjugates
    b, c = np.zeros((2 * count, len(model.out))), np.zeros((len(model.out), 2 * count))
    for r, (pole, part) in enumerate(zip(poles, parts, strict=True)):
        at = slice(2 * r, 2 * r + 2)
        a[at, at] = [[pole.real, pole.imag], [-pole.imag, pole.real]]
        b[at] = [part.real, -part.imag]
        c[:, at] = 2 * np.stack([part.real, part.imag], axis=1)
    whole = model.out @ np.linalg.solve(model.stiffness, model.out.T)
    d = whole + c @ np.linalg.solve(a, b)
    found = response(a, b, c, d, line_hz)
    return Reduced(a, b, c, d, count, largest_error(found, right), band_hz)

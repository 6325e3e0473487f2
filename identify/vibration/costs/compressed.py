"""The likelihood of FRFs compared in the model's coordinates, which are fewer than the sensors.

With outputs S (outputs, n) and noise W^-1, residuals W (S y - h) of motions y of n coordinates have the same
squares and derivatives as Q' W (S y - h) = R y - Q' W h, beside what no motion can change, where W S = Q R
line by line and input by input.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from identify.core.arrays import Array, Complex, Index, real_product
from identify.vibration.costs.information import weights
from identify.vibration.costs.target import FrfTarget


@dataclass(frozen=True)
class CompressedFrfs:
    """One set: |residual / noise|^2 of motions y (lines, n, inputs) is |R y - w|^2 + rest.

    target: the set with its coordinates as outputs; factor R (lines, inputs, n, n); wanted w (lines, inputs,
    n).
    """

    target: FrfTarget
    factor: Array
    wanted: Complex
    rest: float

    def squares(self, candidates: Array) -> Array:
        """(m,): sums of squares at values (m, parameters)."""
        moved = np.swapaxes(self.target.predict(candidates), -1, -2)[..., None]
        left = np.ascontiguousarray(real_product(self.factor, moved)[..., 0] - self.wanted)
        flat = left.view(float).reshape(len(candidates), -1)
        return np.asarray(np.einsum("mr,mr->m", flat, flat) + self.rest)

    def rows(self, values: Array, free: Index) -> tuple[Array, Array]:
        """Residuals (r,) and derivatives (r, free) with the same squares and products as those of all
        channels.
        """
        return self.compared(*self.target.gradient(values, free))

    def compared(self, h: Complex, gradient: Complex) -> tuple[Array, Array]:
        """The same of motions h (lines, n, inputs) and their derivatives (lines, n, inputs, free)."""
        every = np.concatenate([gradient, h[..., None]], axis=3)
        turned = real_product(self.factor, np.swapaxes(every, 1, 2)).reshape(-1, every.shape[3])
        turned[:, -1] -= self.wanted.ravel()
        real = np.concatenate([turned.real, turned.imag, np.zeros((1, every.shape[3]))])
        real[-1, -1] = np.sqrt(self.rest)
        return real[:, -1], real[:, :-1]


def compressed_frfs(target: FrfTarget) -> CompressedFrfs | None:
    """A set in coordinates; None where instruments do not read them as they are, they are not fewer than the
    outputs, or a noise is not a number.
    """
    size = target.out.shape[1]
    weight = weights(target)
    plain = target.plain and target.nuisances is None
    if not plain or size >= len(target.data.outputs) or not np.isfinite(weight).all():
        return None
    turned = np.swapaxes(weight, 1, 2)[..., None]
    measured = np.swapaxes(np.where(weight > 0, target.data.frf, 0.0), 1, 2)[..., None]
    basis, factor = np.linalg.qr(turned * target.out)
    wanted = np.asarray(np.swapaxes(basis, -1, -2) @ (turned * measured), dtype=complex)
    rest = float(np.sum(np.abs(turned * measured - basis @ wanted) ** 2))
    return CompressedFrfs(replace(target, out=np.eye(size)), factor, wanted[..., 0], rest)

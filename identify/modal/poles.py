"""From a denominator polynomial to poles, participation factors and shapes: what pLSCF and LSCE share.

Both describe the FRFs in the band by the right matrix fraction H(z) = B(z) A(z)^-1, A(z) = sum_b beta_b z^b,
z = exp(-j (omega - omega_0) T), with complex coefficients and T such that the band is one turn of the unit
circle.  The basis is then orthogonal on evenly spaced lines, so the conditioning does not depend on the order
or on the number of lines.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from identify.core.arrays import Array, Complex
from identify.modal.lines import is_even

_EVEN = 0.05
"""Part by which steps between evenly spaced lines may differ."""


@dataclass(frozen=True)
class PoleSet:
    """Poles of one order.  poles (k,), rad/s; participation (k, references) of unit length; shapes (k,
    responses).
    """

    order: int
    poles: Complex
    participation: Complex
    shapes: Complex


@dataclass(frozen=True)
class Band:
    """Lines as a turn of the unit circle: first angular frequency (rad/s) and sample time T (s) = 1 / (lines
    x spacing).
    """

    first: float
    time: float

    @classmethod
    def of(cls, frequency_hz: Array) -> Band:
        """The band of evenly spaced lines (L,), Hz."""
        lines = len(frequency_hz)
        return cls(2 * np.pi * frequency_hz[0], (lines - 1) / (lines * (frequency_hz[-1] - frequency_hz[0])))

    def poles(self, x: Complex) -> Complex:
        """Poles (rad/s) from discrete poles x = exp((lambda - j omega_0) T)."""
        turned = np.log(x) / self.time
        return np.asarray(turned.real + 1j * (np.mod(turned.imag, 2 * np.pi / self.time) + self.first))

    def places(self, frequency_hz: Array) -> Places | None:
        """Where lines (L,), Hz, are on the circle; None where they are evenly spaced."""
        if is_even(frequency_hz, _EVEN):
            return None
        share = np.gradient(frequency_hz)
        turn = (frequency_hz - self.first / (2 * np.pi)) * self.time
        return Places(turn, share / np.sum(share))


class Places(NamedTuple):
    """Lines that are not evenly spaced: turn (L,), where they are on the circle, 0 to 1; share (L,): of the
    circle, that each stands for, so that sums are nearly the integrals that evenly spaced lines give.
    """

    turn: Array
    share: Array


def moments(values: Complex, order: int, places: Places | None = None) -> Complex:
    """Fourier coefficients (1/L) sum_k values_k exp(2 pi j k m / L) for m = -order .. order: values (L, ...)
    -> (2 order + 1, ...); of lines that are not evenly spaced, with their shares.
    """
    degrees = np.arange(-order, order + 1)
    if places is None:
        return np.asarray(np.fft.ifft(values, axis=0)[degrees])
    waves = np.exp(2j * np.pi * np.outer(degrees, places.turn)) * places.share
    return np.asarray(np.tensordot(waves, values, axes=1))


def pole_set(beta: Complex, coefficients: Complex, band: Band, max_damping: float) -> PoleSet:
    """Decaying poles of A with their participation and shapes.

    beta (p + 1, references, references) with beta_0 the identity; coefficients: `moments` of the FRFs up to
    at least order p, (2 n + 1, responses, references).  Poles with a larger damping ratio than max_damping
    are left out.
    """
    p, refs = len(beta) - 1, beta.shape[1]
    companion = np.zeros((p * refs, p * refs), dtype=complex)
    companion[:refs] = -np.concatenate(list(beta[1:]), axis=1)
    companion[refs:, :-refs] = np.eye((p - 1) * refs)
    x = np.asarray(np.linalg.eigvals(companion), dtype=np.complex128)
    with np.errstate(divide="ignore"):
        poles = band.poles(x)
    kept = (poles.real < 0) & (-poles.real <= max_damping * np.abs(poles)) & np.isfinite(poles)
    right, left = _null_vectors(beta, x[kept])
    middle = len(coefficients) // 2
    shapes = _shapes(beta, x[kept], right, coefficients[middle - p : middle + p + 1])
    return PoleSet(p, poles[kept], left, shapes)


def _null_vectors(beta: Complex, x: Complex) -> tuple[Complex, Complex]:
    """Right and left null vectors of A at every pole, (k, references) each: A v = 0 and w^T A = 0.

    The residue of A^-1 is v w^T, so B v is the shape and w the participation.
    """
    value = np.zeros((len(x), *beta.shape[1:]), dtype=complex)
    for coefficient in beta:
        value = value * x[:, None, None] + coefficient
    u, _, vh = np.linalg.svd(value)
    return vh[:, -1].conj(), u[:, :, -1].conj()


def _shapes(beta: Complex, x: Complex, right: Complex, coefficients: Complex) -> Complex:
    """B(z) v at every pole, (k, responses): the numerator B is the least-squares one, the product H A cut to
    degrees 0 .. p.

    Scaled by x^p, which keeps the powers of strongly damped poles from overflowing.
    """
    p = len(beta) - 1
    u = np.einsum("bij,kj->bki", beta, right)
    weight = np.zeros((2 * p + 1, *u.shape[1:]), dtype=complex)
    x = x[:, None]
    # weight[m + p] is x^(p - m) sum x^-b u_b over 0 <= b <= p, -m <= b <= p - m: two running sums.
    running = np.zeros_like(u[0])
    for b in range(p + 1):
        running = x * running + u[b]
        weight[2 * p - b] = running
    backward = np.cumsum((u * x ** np.arange(p, -1, -1)[:, None, None])[:0:-1], axis=0)[::-1]
    weight[p - 1 :: -1] = backward * x ** np.arange(1, p + 1)[:, None, None]
    flat = weight.transpose(1, 0, 2).reshape(len(x), len(weight) * weight.shape[2])
    return np.asarray(flat @ coefficients.transpose(0, 2, 1).reshape(flat.shape[1], -1))

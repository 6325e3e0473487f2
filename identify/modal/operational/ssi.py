"""Covariance-driven stochastic subspace identification (SSI-cov): poles of many orders from correlations.

The block Hankel matrix of correlations factors into observability and controllability of the system; its
singular vectors give the first, whose shift the system matrix.  Source: Peeters and De Roeck, Reference-based
stochastic subspace identification, MSSP 13 (1999) 855-878; one decomposition serves all orders.

Correlations of responses over blocks of a record, and the half spectra that they give.

The correlation of responses to noise decays like a free vibration (James, Carne and Lauffer, Modal Analysis
10 (1995) 260-277), and so do errors of it, for they are made of the same modes: how much they scatter is
seen from block to block.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy

from identify.core.arrays import Array, Complex, Index
from identify.modal.operational.records import Records
from identify.modal.poles import PoleSet

_ROUNDING = 1e-7
"""Of the largest singular value, what rounding leaves of others."""
_END = 4.6
"""Of the exponential window on a half spectrum, e^-4.6 = 1 % at its last lag."""


@dataclass(frozen=True)
class Subspace:
    """Leading singular vectors of the Hankel matrix: left (rows x channels, k), right (k, references): the
    first block column; values (k,); size and power (channels,): see `Correlations`.
    """

    rate_hz: float
    left: Array
    right: Array
    values: Array
    size: Array
    power: Array

    def poles(self, order: int) -> PoleSet:
        """Oscillating poles of a model of so many states, of positive frequency; shapes are displacements."""
        channels = len(self.size)
        root = np.sqrt(self.values[:order])
        triangle, shifted = self._shift
        system = scipy.linalg.solve_triangular(
            triangle[:order, :order], shifted[:order, :order], check_finite=False
        )
        values, vectors = np.linalg.eig(system * root / root[:, None])
        kept = np.flatnonzero((values.imag > 0) & (np.abs(values) < 1))
        shapes = ((self.left[:channels, :order] * root) @ vectors[:, kept]).T
        participation = np.linalg.solve(vectors, root[:, None] * self.right[:order])[kept]
        poles = np.log(values[kept]) * self.rate_hz
        moved = self.size * shapes / poles[:, None] ** self.power
        return PoleSet(order, poles, _unit(participation), _unit(moved))

    @cached_property
    def _shift(self) -> tuple[Array, Array]:
        """Triangle R and Q^T B, (k, k) each, of the least squares A X = B for the shift X of the singular
        vectors: those of fewer are their upper left corners.
        """
        channels = len(self.size)
        q, triangle = scipy.linalg.qr(self.left[:-channels], mode="economic", check_finite=False)
        return triangle, q.T @ self.left[channels:]


def subspace(found: Correlations, correlation: Array, rows: int, order: int) -> Subspace:
    """Of correlations (lags, channels, references), the mean of those found or of some blocks of them, for
    models of up to so many states.
    """
    _, channels, references = correlation.shape
    lag = 1 + np.arange(rows + 1)[:, None] + np.arange(rows)
    hankel = correlation[lag].transpose(0, 2, 1, 3).reshape((rows + 1) * channels, rows * references)
    # Its eigenvalues are the squares of the singular values: far faster, and those beyond noise are not lost.
    size = rows * references
    squares, right = scipy.linalg.eigh(
        hankel.T @ hankel, subset_by_index=(size - order, size - 1), check_finite=False
    )
    values = np.sqrt(np.maximum(squares[::-1], _ROUNDING**2 * squares[-1]))
    right = right[:, ::-1]
    left = hankel @ right / values
    return Subspace(found.rate_hz, left, right[:references].T, values, found.size, found.power)


def _unit(rows: Complex) -> Complex:
    return np.asarray(rows / np.linalg.norm(rows, axis=1)[:, None])


@dataclass(frozen=True)
class Correlations:
    """blocks (blocks, lags, channels, references): E x(t + lag) y(t) of each block, channels and references
    of unit RMS; size (channels,) that RMS; references: positions among the channels; power (channels,): see
    `Records`.
    """

    rate_hz: float
    blocks: Array
    references: Index
    size: Array
    power: Array

    @property
    def mean(self) -> Array:
        """Of all blocks, (lags, channels, references)."""
        return np.asarray(self.blocks.mean(axis=0))

    def half_spectra(self, band_hz: tuple[float, float]) -> tuple[Array, Complex, float]:
        """Lines (L,), Hz, in a band, half spectra (L, channels, references) there, and the decay, 1/s, of
        the exponential window on them.

        Every second line is left out: with this window those between tell nothing of their own.
        """
        values = self.mean[:-1]
        seconds = len(values) / self.rate_hz
        decay = _END / seconds
        window = np.exp(-decay * np.arange(len(values)) / self.rate_hz)
        window[0] = 0.5
        lines = np.arange(2, len(values) // 2, 2)
        lines = lines[(lines / seconds >= band_hz[0]) & (lines / seconds <= band_hz[1])]
        spectra = np.fft.fft(values * window[:, None, None], axis=0)[lines] / self.rate_hz
        return lines / seconds, spectra, decay


def correlations(records: Records, references: Index, lags: int, blocks: int) -> Correlations:
    """Correlations up to a lag, of about so many blocks of equal length; products reach beyond their ends."""
    samples = sum(len(take) for take in records.takes)
    longest = max(len(take) for take in records.takes)
    length = max(lags, min(samples // blocks, longest - lags))
    size = records.size
    found = [
        _block(take[start : start + length + lags] / size, references, length, lags)
        for take in records.takes
        for start in range(0, len(take) - length - lags + 1, length)
    ]
    return Correlations(records.rate_hz, np.array(found), references, size, records.power)


def _block(values: Array, references: Index, length: int, lags: int) -> Array:
    """(lags + 1, channels, references)."""
    size = scipy.fft.next_fast_len(length + 2 * lags, real=True)
    all_of_them = np.fft.rfft(values, size, axis=0)
    own = np.fft.rfft(values[:length, references], size, axis=0).conj()
    pairs = [np.fft.irfft(all_of_them * own[:, [j]], size, axis=0)[: lags + 1] for j in range(own.shape[1])]
    return np.stack(pairs, axis=2) / length


def chosen_references(records: Records, most: int) -> Index:
    """Channels that together see most: the one farthest from the span of those before, one by one."""
    if len(records.channels) <= most:
        return np.arange(len(records.channels))
    stacked = np.concatenate(records.takes) / records.size
    covariance = stacked.T @ stacked
    order = scipy.linalg.qr(covariance, pivoting=True, mode="r")[1]
    return np.sort(order[:most])

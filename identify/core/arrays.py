"""Short names for arrays in signatures, whose shapes and units are said where a function is defined; and the
complex logarithm, vector products, and real products of complex matrices.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Index = NDArray[np.intp]
Mask = NDArray[np.bool_]
Texts = tuple[str, ...]


def logarithm(values: Complex) -> Complex:
    """The complex natural logarithm, part by part, which takes a quarter of the time of NumPy's."""
    found = np.empty_like(values)
    found.real, found.imag = np.log(np.abs(values)), np.angle(values)
    return found


def cross(one: Array, other: Array) -> Array:
    """one (..., 3) x other (..., 3), which for few vectors takes a fifth of the time of NumPy's."""
    a, b, c = one[..., 0], one[..., 1], one[..., 2]
    x, y, z = other[..., 0], other[..., 1], other[..., 2]
    return np.stack([b * z - c * y, c * x - a * z, a * y - b * x], axis=-1)


def cross_matrix(vector: Array) -> Array:
    """(..., 3, 3) of vectors (..., 3): `cross_matrix(a) @ b` is a x b."""
    x, y, z = vector[..., 0], vector[..., 1], vector[..., 2]
    none = np.zeros_like(x)
    return np.stack([none, -z, y, z, none, -x, -y, x, none], axis=-1).reshape(*vector.shape, 3)


def real_product(factor: Array, values: Complex) -> Complex:
    """factor (..., m, n) @ values (..., n, k) without making the real factor complex."""
    flat = np.ascontiguousarray(values, dtype=complex).view(float)
    return np.asarray((factor @ flat).view(complex))


def product_by_real(values: Complex, factor: Array) -> Complex:
    """values (..., m, n) @ factor (..., n, k) without making the real factor complex."""
    rows = values.shape[-2]
    stacked = np.concatenate([values.real, values.imag], axis=-2) @ factor
    found = np.empty((*stacked.shape[:-2], rows, stacked.shape[-1]), dtype=complex)
    found.real, found.imag = stacked[..., :rows, :], stacked[..., rows:, :]
    return found


def gram(one: Complex, other: Complex) -> Array:
    """Re sum conj(one) other' over all but the last axes, (p, q), of arrays (..., p) and (..., q)."""
    a, b = (values.reshape(-1, values.shape[-1]) for values in (one, other))
    return np.asarray((np.conj(a).T @ b).real)


def inverse_where_any(matrix: Array) -> Array:
    """The pseudoinverse of a symmetric matrix (n, n) that touches few of its coordinates."""
    touched, found = np.flatnonzero(matrix.any(axis=0)), np.zeros(matrix.shape)
    own = np.ix_(touched, touched)
    found[own] = np.linalg.pinv(matrix[own], hermitian=True)
    return found

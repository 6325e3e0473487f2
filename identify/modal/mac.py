"""MAC and its family: how alike are two sets of mode shapes, or two sets of FRFs.

Shapes are rows: `a` (m, channels) and `b` (n, channels), real or complex.  FRFs are `[frequency, ...]`. Every
criterion lies between 0 (nothing in common) and 1; something that is zero everywhere correlates with nothing
(0). The pairing of two modal tables is in `pairing.py`.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from identify.core.arrays import Array, Complex

Shapes = NDArray[Any]


def mac(a: Shapes, b: Shapes) -> Array:
    """Modal assurance criterion |a^H b|^2 / (a^H a  b^H b), (m, n).

    Blind to scale and phase, but not to conjugation: see `macx`.  Source: Allemang and Brown, IMAC 1 (1982);
    UMONS Eq. 3.
    """
    a, b = _shapes(a, b)
    return _ratio(np.abs(a.conj() @ b.T) ** 2, np.outer(_power(a), _power(b)))


def macx(a: Shapes, b: Shapes) -> Array:
    """MAC for complex shapes that does not change when either shape is conjugated, (m, n); equals `mac` for
    real shapes.

    (|a^H b| + |a^T b|)^2 / ((a^H a + |a^T a|)(b^H b + |b^T b|)).  Source: Vacher, Jacquier and Bucharles,
    ISMA (2010).
    """
    a, b = _shapes(a, b)
    top = (np.abs(a.conj() @ b.T) + np.abs(a @ b.T)) ** 2
    own = [_power(x) + np.abs(np.sum(x * x, axis=1)) for x in (a, b)]
    return _ratio(top, np.outer(*own))


def auto_mac(a: Shapes) -> Array:
    """`mac` of a set with itself, (m, m): high off the diagonal where the channels cannot tell two modes
    apart.
    """
    return mac(a, a)


def comac(a: Shapes, b: Shapes) -> Array:
    """Coordinate MAC over mode pairs: a and b (modes, channels), row r of a paired with row r of b;
    (channels,).

    (sum_r |a_rj b_rj|)^2 / (sum_r |a_rj|^2 sum_r |b_rj|^2), every shape first scaled to unit length so that
    the scaling of the modes does not enter.  Source: Lieven and Ewins, IMAC 6 (1988).
    """
    a, b = _shapes(a, b)
    if a.shape != b.shape:
        raise ValueError(f"comac compares paired modes; shapes {a.shape} and {b.shape} differ")
    size_a, size_b = (_ratio(np.abs(x), np.sqrt(_power(x))[:, None] * np.ones(x.shape[1])) for x in (a, b))
    return _ratio(np.sum(size_a * size_b, axis=0) ** 2, np.sum(size_a**2, axis=0) * np.sum(size_b**2, axis=0))


def mpc(a: Shapes) -> Array:
    """Modal phase collinearity, (m,): 1 for a shape whose channels all move in phase or in opposition, 0 for
    a travelling wave.

    ((Sxx - Syy)^2 + 4 Sxy^2) / (Sxx + Syy)^2 = |a^T a|^2 / (a^H a)^2, without removing the mean, so that it
    does not depend on the signs of the channels.  Source: Pappa, Elliott and Schenk, J. Guidance 16 (1993).
    """
    a = np.atleast_2d(a)
    return _ratio(np.abs(np.sum(a * a, axis=1)) ** 2, _power(a) ** 2)


def as_real(a: Shapes) -> Complex:
    """Shapes (m, channels), each turned to be as real as it can: the best line through its points of the
    complex plane is at half the phase of sum a^2.
    """
    return np.asarray(a * np.exp(-0.5j * np.angle(np.sum(a * a, axis=1)))[:, None])


def mpd(a: Shapes) -> Array:
    """Mean phase deviation, (m,), rad: amplitude-weighted mean angle between the channels and the line that
    fits them best.

    0 for a real shape; at most pi/2.  Source: Reynders, Houbrechts and De Roeck, MSSP 29 (2012).
    """
    a = np.atleast_2d(a)
    turned, size = as_real(a), np.abs(a)
    return _ratio(
        np.sum(size * np.arctan2(np.abs(turned.imag), np.abs(turned.real)), axis=1), np.sum(size, axis=1)
    )


def frac(a: Shapes, b: Shapes) -> Array:
    """Frequency response assurance criterion of each FRF over its lines: a and b [frequency, ...] -> (...).

    |sum a* b|^2 / (sum |a|^2 sum |b|^2).  Blind to level: never to be read alone.  Source: Heylen and Lammens
    (1996).
    """
    top, own_a, own_b = _products(*_same(a, b), axis=0)
    return _ratio(top**2, own_a * own_b)


def _shapes(a: Shapes, b: Shapes) -> tuple[Shapes, Shapes]:
    a, b = np.atleast_2d(a), np.atleast_2d(b)
    if a.shape[1] != b.shape[1]:
        raise ValueError(
            f"the shapes have {a.shape[1]} and {b.shape[1]} channels; compare them on their common channels"
        )
    return a, b


def _same(a: Shapes, b: Shapes) -> tuple[Shapes, Shapes]:
    if a.shape != b.shape:
        raise ValueError(f"FRF arrays of shape {a.shape} and {b.shape} cannot be compared line by line")
    return a, b


def _power(a: Shapes) -> Array:
    return np.asarray(np.sum(np.abs(a) ** 2, axis=1), dtype=np.float64)


def _products(a: Shapes, b: Shapes, axis: int) -> tuple[Array, Array, Array]:
    own = [np.sum(np.abs(x) ** 2, axis=axis) for x in (a, b)]
    return np.abs(np.sum(a.conj() * b, axis=axis)), own[0], own[1]


def _ratio(top: Array, bottom: Array) -> Array:
    """top / bottom, 0 where the bottom is 0."""
    top, bottom = np.asarray(top, dtype=np.float64), np.asarray(bottom, dtype=np.float64)
    return np.divide(top, bottom, out=np.zeros(np.shape(top)), where=bottom > 0)

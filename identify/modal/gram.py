"""Normal equations of a modal model, from scalar functions of frequency instead of its design matrix.

Every column of the design matrix is f(s) u + conj(f)(s) conj(u): a scalar function f of the line (a pole's
1 / (s - lambda), its square, a residual term), its mirror at the conjugate pole, and a vector u over the
references.  So all inner products of columns are those of the scalar functions times those of the vectors:
with n functions and L lines they cost n^2 L, however many references and responses there are.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identify.core.arrays import Array, Complex, Index


@dataclass(frozen=True)
class Columns:
    """Real columns f u + mirror: function (n,), which scalar function; vector (n, references)."""

    function: Index
    vector: Complex

    def __getitem__(self, rows: Index | slice) -> Columns:
        return Columns(self.function[rows], self.vector[rows])


@dataclass(frozen=True)
class Moments:
    """Inner products over the lines: same (n, n) of functions with each other, across (n, n) of functions
    with mirrors, data (n, references, responses) of functions with what was measured; energy of the data.
    """

    same: Complex
    across: Complex
    data: Complex
    energy: float

    @classmethod
    def of(cls, functions: Complex, mirrors: Complex, y: Complex) -> Moments:
        """Of functions and mirrors (L, n) with weighted FRFs y (L, references, responses)."""
        same, across = products(functions, mirrors, functions, mirrors)
        return cls(same, across, right(functions, mirrors, y), float(np.sum(np.abs(y) ** 2)))

    def gram(self, a: Columns, b: Columns) -> Array:
        """Real inner products of columns, (len a, len b)."""
        return gram(self.same, self.across, a, b)

    def right(self, a: Columns) -> Array:
        """Real inner products of columns with the data, (len a, responses)."""
        return np.asarray(np.einsum("cj,cjo->co", a.vector.conj(), self.data[a.function]).real)


def products(f: Complex, f_mirrors: Complex, g: Complex, g_mirrors: Complex) -> tuple[Complex, Complex]:
    """Inner products of functions f (L, n) with functions g (L, k) and with their mirrors, (n, k) each."""
    same = f.conj().T @ g + (f_mirrors.conj().T @ g_mirrors).conj()
    across = f.conj().T @ g_mirrors + (g.conj().T @ f_mirrors).T
    return same, across


def right(f: Complex, mirrors: Complex, y: Complex) -> Complex:
    """Inner products of functions (L, n) with data (L, references, responses): (n, references, responses)."""
    flat = y.reshape(len(y), -1)
    data = f.conj().T @ flat + (mirrors.conj().T @ flat).conj()
    return np.asarray(data.reshape(-1, *y.shape[1:]))


def gram(same: Complex, across: Complex, a: Columns, b: Columns) -> Array:
    """Real inner products of columns, (len a, len b), from those of their functions."""
    where = np.ix_(a.function, b.function)
    value = same[where] * (a.vector.conj() @ b.vector.T) + across[where] * (
        a.vector.conj() @ b.vector.conj().T
    )
    return np.asarray(value.real)


def rebuilt(functions: Complex, mirrors: Complex, columns: Columns, solution: Array) -> Complex:
    """What the columns give with a solution (len columns, responses): (L, references, responses)."""
    shape = functions.shape[1], columns.vector.shape[1], solution.shape[1]
    factor = np.zeros(shape, dtype=np.complex128)
    np.add.at(factor, columns.function, columns.vector[:, :, None] * solution[:, None, :])
    flat = factor.reshape(len(factor), -1)
    value = functions @ flat + mirrors @ flat.conj()
    return np.asarray(value.reshape(len(functions), *shape[1:]))

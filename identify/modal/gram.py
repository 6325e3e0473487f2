"""Normal equations of a modal model, from scalar functions of frequency instead of its design matrix.

Every column of the design matrix is f(s) u + conj(f)(s) conj(u): a scalar function f of the line (a pole's
1 / (s - lambda), its square, a residual term), its mirror at the conjugate pole, and a vector u over the
references.  So all inner products of columns are those of the scalar functions times those of the vectors:
with n functions and L lines they cost n^2 L, however many references and responses there are.  All products
over lines are real ones, real parts stacked above imaginary parts: complex ones would cost twice as much.
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
class Functions:
    """Scalar functions of the line and their mirrors as real columns, (2 lines, 2 n): real rows, then
    imaginary rows; what a real vector gives with every function, then what an imaginary one gives.
    """

    columns: Array

    @classmethod
    def of(cls, direct: Complex, mirror: Complex) -> Functions:
        """Of functions (L, n) and mirrors (L, n)."""
        lines, n = direct.shape
        columns = np.empty((2 * lines, 2 * n))
        np.add(direct.real, mirror.real, out=columns[:lines, :n])
        np.subtract(mirror.imag, direct.imag, out=columns[:lines, n:])
        np.add(direct.imag, mirror.imag, out=columns[lines:, :n])
        np.subtract(direct.real, mirror.real, out=columns[lines:, n:])
        return cls(columns)

    def __len__(self) -> int:
        return int(self.columns.shape[1]) // 2

    def __getitem__(self, rows: slice) -> Functions:
        return Functions(np.hstack([half[:, rows] for half in np.hsplit(self.columns, 2)]))


@dataclass(frozen=True)
class Moments:
    """Inner products over the lines: same (n, n) of functions with each other, across (n, n) of functions
    with mirrors, data (n, references, responses) of functions with what was measured; energy of the data.
    """

    same: Complex
    across: Complex
    data: Complex
    energy: float

    def gram(self, a: Columns, b: Columns) -> Array:
        """Real inner products of columns, (len a, len b)."""
        return gram(self.same, self.across, a, b)

    def right(self, a: Columns) -> Array:
        """Real inner products of columns with the data, (len a, responses)."""
        return np.asarray(np.einsum("cj,cjo->co", a.vector.conj(), self.data[a.function]).real)


def products(f: Functions, g: Functions) -> tuple[Complex, Complex]:
    """Inner products of n functions with k others and with their mirrors, (n, k) each."""
    n, k = len(f), len(g)
    real = f.columns.T @ g.columns
    a, b, c, d = real[:n, :k], real[:n, k:], real[n:, :k], real[n:, k:]
    same, across = (a + d + 1j * (c - b)) / 2, (a - d + 1j * (b + c)) / 2
    return np.asarray(same, dtype=np.complex128), np.asarray(across, dtype=np.complex128)


def right(f: Functions, stacked: Array) -> Complex:
    """Inner products of n functions with data (2 L, FRFs), real rows above imaginary ones: (n, FRFs)."""
    real = f.columns.T @ stacked
    return np.asarray(real[: len(f)] + 1j * real[len(f) :])


def gram(same: Complex, across: Complex, a: Columns, b: Columns) -> Array:
    """Real inner products of columns, (len a, len b), from those of their functions."""
    where = np.ix_(a.function, b.function)
    value = same[where] * (a.vector.conj() @ b.vector.T) + across[where] * (
        a.vector.conj() @ b.vector.conj().T
    )
    return np.asarray(value.real)


def written_out(f: Functions, columns: Columns) -> Array:
    """The columns themselves, (2 L, references, n): real rows, then imaginary ones."""
    real, imaginary = f.columns[:, columns.function], f.columns[:, len(f) + columns.function]
    parts = [real * v.real + imaginary * v.imag for v in columns.vector.T]
    return np.asarray(np.stack(parts, axis=1))


def rebuilt(f: Functions, columns: Columns, solution: Array) -> Array:
    """What the columns give with a solution (len columns, responses): (2 L, references x responses), real
    rows above imaginary ones.
    """
    parts = np.concatenate([columns.vector.real, columns.vector.imag])[:, :, None]
    values = parts * np.tile(solution, (2, 1))[:, None, :]
    # Every function has columns, and they stand in its order.
    first = np.searchsorted(columns.function, np.arange(len(f)))
    factor = np.add.reduceat(values, np.concatenate([first, first + len(columns.function)]))
    return np.asarray(f.columns @ factor.reshape(2 * len(f), -1))

"""Modal masses by the mass-change method: records without and with masses that were added to the structure.

A mode of the structure with a mass matrix dM on it, omega_2 and psi_2, is a free vibration of the structure
without it under the inertia of dM.  With the modes j of the latter, omega_j, psi_j and modal masses m_j:

    psi_2 = sum_j psi_j (1 / m_j) omega_2^2 (psi_j^T dM psi_2) / (omega_j^2 - omega_2^2)

at every channel: linear in 1 / m_j, whatever the scale of psi_2, with no pairs of modes, for any size of mass
(Bernal, A receptance-based formulation for modal scaling using mass perturbations, MSSP 25 (2011) 621-629).
All modes with the mass tell of all modes without it.  With one pair and psi_2 = psi_1 it is the usual formula
(Parloo, Verboven, Guillaume and Van Overmeire, MSSP 16 (2002) 757-767).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from identify.core.arrays import Array, Index
from identify.core.text import count
from identify.modal.mac import as_real
from identify.modal.operational.analysis import OperationalModes
from identify.modal.operational.masses import MassesByMode, ModalMasses
from identify.modal.pairing import common_channels

_AXES = 3
"""Largest direction that is a translation."""
_ROUNDS = 8
"""Of weights from modal masses and modal masses from weights."""
_BEYOND = (0.03, 0.1, 0.3, 1.0, 3.0)
"""Flexibility of modes that are not known that is tried, see `_Equations.beyond`."""
_POOR = 2.0
"""Squared errors over those expected, from which on a mode is sought that does not belong."""
_NEAREST = 0.05
"""How near, in squared frequency, the first of them may be to a mode with the mass."""
_APART = 1e-9
"""Relative distance of squared frequencies below which it is rounding."""


@dataclass(frozen=True)
class _Modes:
    """Of a record at the channels both have: omega (m,), rad/s, real shapes (m, channels), and deviations."""

    omega: Array
    omega_std: Array
    shapes: Array
    shapes_std: Array

    @classmethod
    def of(cls, found: OperationalModes, rows: Index, sign: Array | float) -> _Modes:
        """At some channels, with their signs."""
        scatter, turned = found.scatter, as_real(found.shapes[:, rows] * sign)
        # Half of a complex error is real; what is left imaginary beyond the other half is an error as well.
        std = np.maximum(scatter.shapes[:, rows] / np.sqrt(2), np.abs(turned.imag))
        return cls(2 * np.pi * found.frequency_hz, 2 * np.pi * scatter.frequency_hz, turned.real, std)

    def without(self, mode: int) -> _Modes:
        """All but one."""
        each = self.omega, self.omega_std, self.shapes, self.shapes_std
        return _Modes(*(np.delete(values, mode, axis=0) for values in each))


@dataclass(frozen=True)
class _Equations:
    """light, heavy: modes without and with the mass, kg, of every channel; above: rad/s, from where on modes
    are not known.
    """

    light: _Modes
    heavy: _Modes
    mass: Array
    above: float

    def without(self, mode: int) -> _Equations:
        """Those of all modes with the mass but one."""
        return replace(self, heavy=self.heavy.without(mode))

    @property
    def apart(self) -> Array:
        """omega_j^2 - omega_2^2, (light, heavy)."""
        square = self.light.omega[:, None] ** 2
        least = _APART * square
        found = square - self.heavy.omega**2
        return np.asarray(np.where(np.abs(found) < least, least, found))

    @property
    def forced(self) -> Array:
        """What a mode of unit modal mass answers to the inertia of the mass, (light, heavy)."""
        inertia = (self.light.shapes * self.mass) @ self.heavy.shapes.T
        return np.asarray(inertia * self.heavy.omega**2 / self.apart)

    @property
    def columns(self) -> Array:
        """Of the unknown 1 / m_j, (heavy x channels, light)."""
        parts = self.forced.T[:, None, :] * self.light.shapes.T
        return np.asarray(parts.reshape(-1, len(self.light.omega)))

    def covariance(self, inverse: Array) -> Array:
        """Of the equations' errors with these 1 / m_j, (heavy x channels)^2: errors of frequencies and shapes
        to first order.
        """
        light, heavy, apart = self.light, self.heavy, self.apart
        modes, channels = heavy.shapes.shape
        whole = np.zeros((modes * channels, modes * channels))
        answers = inverse[:, None, None] * self.forced[:, :, None] * light.shapes[:, None]
        for j, answer in enumerate(answers):
            moved = (answer * (2 * light.omega[j] / apart[j])[:, None]).ravel() * light.omega_std[j]
            whole += np.outer(moved, moved)
            # Of a shape: where it is seen, and where the mass pushes it.
            push = (heavy.omega**2 / apart[j])[:, None] * self.mass * heavy.shapes
            of_shape = inverse[j] * (
                self.forced[j][:, None, None] * np.eye(channels)
                + light.shapes[j][None, :, None] * push[:, None, :]
            )
            of_shape = of_shape.reshape(modes * channels, channels) * light.shapes_std[j]
            whole += of_shape @ of_shape.T
        for k in range(modes):
            own = slice(k * channels, (k + 1) * channels)
            rise = 2 / heavy.omega[k] + 2 * heavy.omega[k] / apart[:, k]
            moved = answers[:, k].T @ rise * heavy.omega_std[k]
            receptance = (light.shapes.T * (inverse * heavy.omega[k] ** 2 / apart[:, k])) @ light.shapes
            of_shape = (np.eye(channels) - receptance * self.mass) * heavy.shapes_std[k]
            whole[own, own] += np.outer(moved, moved) + of_shape @ of_shape.T
        return whole

    def beyond(self, inverse: Array) -> Array:
        """Covariance of what the flexibility of modes that are not known adds, were it as large as that of
        those known would be at the end of the band.
        """
        modes, channels = self.heavy.shapes.shape
        size = np.abs(self.light.shapes)
        flexible = (size.T * np.abs(inverse)) @ size / self.above**2
        nearer = np.maximum(1 - (self.heavy.omega / self.above) ** 2, _NEAREST)
        push = (self.heavy.omega**2 / nearer)[:, None] * self.mass * self.heavy.shapes
        alike = np.einsum("km,cm,lm->ckl", push, flexible**2, push)
        whole = np.zeros((modes, channels, modes, channels))
        at = np.arange(channels)
        whole[:, at, :, at] = alike
        return whole.reshape(modes * channels, -1)


def by_added_mass(
    found: OperationalModes, heavier: OperationalModes, added_kg: Mapping[int, float]
) -> ModalMasses:
    """Modal masses by a record with masses, kg, added at nodes that both records have.

    A mass moves along the axes of its node that were recorded, and is taken as still along others.
    """
    own, its, sign = common_channels(found.table, heavier.table)
    channels = [found.table.channels[i] for i in own]
    mass = np.array([added_kg.get(c.node, 0.0) * (abs(c.direction) <= _AXES) for c in channels])
    modes, several = len(found.frequency_hz), len(heavier.frequency_hz)
    does = "does" if several == 1 else "do"
    few = f"{count(several, 'mode')} with the mass at {count(len(own), 'channel')} {does} not determine"
    few = f"{few} {modes} modal masses"
    by_mode = MassesByMode(modes, few)
    if not modes or modes > several * len(own):
        return by_mode.masses
    above = 2 * np.pi * max(found.records.band_hz[1], float(np.max(found.frequency_hz)))
    equations = _Equations(_Modes.of(found, own, 1.0), _Modes.of(heavier, its, sign), mass, above)
    answer, hz = _agreeing(equations)
    for r in range(modes):
        by_mode.add(r, float(hz[answer.partner[r]]), float(answer.inverse[r]), float(answer.std[r]))
    return by_mode.masses


@dataclass(frozen=True)
class _Answer:
    """inverse: 1 / m of every mode, std: its deviation, 1/kg; partner: the mode with the mass that tells most
    of it; misfit: of the equations, about 1; likelihood: its logarithm.
    """

    inverse: Array
    std: Array
    partner: Index
    misfit: float
    likelihood: float


def _agreeing(equations: _Equations) -> tuple[_Answer, Array]:
    """Without modes with the mass, one by one, that do not go with the others: of which the record without it
    lacks the mode. Also frequencies, Hz, of those that are left.
    """
    answer = _solved(equations)
    while answer.misfit > _POOR and _is_enough(equations.without(0)):
        tried = [equations.without(k) for k in range(len(equations.heavy.omega))]
        answers = [_solved(one) for one in tried]
        best = int(np.argmin([one.misfit for one in answers]))
        if answers[best].misfit > answer.misfit:
            break
        equations, answer = tried[best], answers[best]
    return answer, equations.heavy.omega / (2 * np.pi)


def _is_enough(equations: _Equations) -> bool:
    return equations.heavy.shapes.size > len(equations.light.omega)


def _solved(equations: _Equations) -> _Answer:
    """Weighted least squares with the errors' covariance, which takes 1 / m in turn, and with as much beyond
    the band as makes the equations likeliest.
    """
    wanted = equations.heavy.shapes.ravel()
    start = np.asarray(np.linalg.lstsq(equations.columns, wanted, rcond=None)[0], dtype=np.float64)
    found = [_weighted(equations, start, share) for share in _BEYOND]
    return max(found, key=lambda one: one.likelihood)


def _weighted(equations: _Equations, inverse: Array, share: float) -> _Answer:
    """With a share of what may be beyond the band."""
    columns, heavy = equations.columns, equations.heavy
    wanted = heavy.shapes.ravel()
    for _ in range(_ROUNDS):
        covariance = equations.covariance(inverse) + share**2 * equations.beyond(inverse)
        size = np.sqrt(np.diag(covariance))
        size = np.maximum(size, 1e-9 * size.max())
        near = covariance / np.outer(size, size) + 1e-10 * np.eye(len(size))
        factor = np.linalg.cholesky(near)
        weighted, right = (np.linalg.solve(factor, (v.T / size).T) for v in (columns, wanted))
        inverse = np.linalg.lstsq(weighted, right, rcond=None)[0]
    left = float(np.sum((right - weighted @ inverse) ** 2))
    misfit = left / max(len(wanted) - len(inverse), 1)
    std = np.sqrt(max(1.0, misfit) * np.diag(np.linalg.pinv(weighted.T @ weighted, hermitian=True)))
    shares = np.sum(weighted.reshape(*heavy.shapes.shape, -1) ** 2, axis=1)
    likelihood = -left / 2 - float(np.sum(np.log(np.diag(factor) * size)))
    return _Answer(inverse, std, np.argmax(shares, axis=0), misfit, likelihood)

"""Modal masses by the mass-change method: records without and with masses that were added to the structure.

A mass matrix dM moves a mode from omega_1 to omega_2 and its shape from psi_1 to psi_2, where

    1 / m = (omega_1^2 - omega_2^2) / (omega_2^2 psi_1^T dM psi_2)

is exact if psi_2 is psi_1 and other shapes.  With psi_2 = psi_1 it is the usual formula (Parloo, Verboven,
Guillaume and Van Overmeire, MSSP 16 (2002) 757-767; Brincker and Andersen, IMAC XXI (2003)), which is off by
as much as the frequency moves and more; how much of psi_1 is in psi_2 is told by all shapes together (Bernal,
Journal of Engineering Mechanics 130 (2004) 1083-1088).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from identify.core.arrays import Array, Complex, Index
from identify.core.thresholds import SIGMAS_95
from identify.modal.mac import mac
from identify.modal.operational.analysis import OperationalModes
from identify.modal.operational.masses import ModalMasses, Told
from identify.modal.pairing import PairSettings, common_channels, pair

_SAME = PairSettings(max_frequency_error=0.5, min_mac=0.7)
"""How far a mode may move, and its shape turn, until it is the same mode no longer."""
_AXES = 3
"""Largest direction that is a translation."""
_ALIKE = 0.99
"""MAC below which a shape with and without the mass is not taken as the same, up to its size."""


@dataclass(frozen=True)
class _Mode:
    """A mode in both records: hz and hz_std (2,); shapes and their deviations (2, channels), of unit largest
    component without the mass, and of the same size with it; size_std: relative deviation of that size.
    """

    hz: Array
    hz_std: Array
    shapes: Complex
    shapes_std: Array
    size_std: float


def by_added_mass(
    found: OperationalModes, heavier: OperationalModes, added_kg: Mapping[int, float]
) -> ModalMasses:
    """Modal masses by a record with masses, kg, added at nodes that both records have.

    A mass moves along the axes of its node that were recorded, and is taken as still along others.
    """
    own, its, sign = common_channels(found.table, heavier.table)
    channels = [found.table.channels[i] for i in own]
    mass = np.array([added_kg.get(c.node, 0.0) * (abs(c.direction) <= _AXES) for c in channels])
    light, heavy = _Shapes.of(found, own, 1.0), _Shapes.of(heavier, its, sign)
    pairs = pair(found.table, heavier.table, _SAME)
    told = Told(len(found.frequency_hz), "no mode with the added mass is like it")
    for r, k in zip(pairs.a, pairs.b, strict=True):
        mode = _both(light, heavy, int(r), int(k))
        if mode is None:
            few = f"{len(own)} channels do not tell which other modes are in its shape with the added mass"
            told.refuse(int(r), float(heavy.hz[k]), few)
        else:
            _tell(told, int(r), mode, mass)
    return told.masses


@dataclass(frozen=True)
class _Shapes:
    """Modes of a record at the channels both have: hz (m,), shapes and deviations (m, channels)."""

    hz: Array
    hz_std: Array
    shapes: Complex
    std: Array

    @classmethod
    def of(cls, found: OperationalModes, rows: Index, sign: Array | float) -> _Shapes:
        """At some channels, with their signs."""
        scatter = found.scatter
        return cls(
            found.frequency_hz, scatter.frequency_hz, found.shapes[:, rows] * sign, scatter.shapes[:, rows]
        )


def _both(light: _Shapes, heavy: _Shapes, r: int, k: int) -> _Mode | None:
    """A mode in both records; None where its shape changes and the channels do not tell how much of it is
    left.
    """
    modes, channels = light.shapes.shape
    many = channels >= modes
    used = np.arange(modes) if many else np.array([r])
    if not many and mac(light.shapes[[r]], heavy.shapes[[k]])[0, 0] < _ALIKE:
        return None
    inverse = np.linalg.pinv(light.shapes[used].T)
    parts = inverse @ heavy.shapes[k]
    at = int(np.flatnonzero(used == r)[0])
    noise = heavy.std[k] ** 2 + np.abs(parts) ** 2 @ light.std[used] ** 2
    size_std = float(np.sqrt(np.abs(inverse[at]) ** 2 @ noise)) / abs(parts[at])
    hz, hz_std = np.array([light.hz[r], heavy.hz[k]]), np.array([light.hz_std[r], heavy.hz_std[k]])
    # Alone, a shape is the same to first order of the change of the frequency.
    size_std = size_std if many else float(np.hypot(size_std, 1 - hz[1] / hz[0]))
    shapes = np.stack([light.shapes[r], heavy.shapes[k] / parts[at]])
    return _Mode(hz, hz_std, shapes, np.stack([light.std[r], heavy.std[k] / abs(parts[at])]), size_std)


def _tell(told: Told, r: int, mode: _Mode, mass: Array) -> None:
    (light, heavy), (first, second) = 2 * np.pi * mode.hz, mode.shapes
    whole = complex(np.sum(mass * first * second))
    product = abs(whole)  # whatever the phase that the shapes were given
    change, rise = light**2 / heavy**2 - 1, mode.hz[1] - mode.hz[0]
    if rise > SIGMAS_95 * np.linalg.norm(mode.hz_std):
        risen = f"it rose by {rise:.2g} Hz with the added mass: something else changed"
        told.refuse(r, float(mode.hz[1]), risen)
    elif whole.real <= 0:
        told.refuse(r, float(mode.hz[1]), "the added mass does not move with it")
    else:
        change_std = 2 * light**2 / heavy**2 * np.linalg.norm(mode.hz_std / mode.hz)
        moved = np.linalg.norm(mass * np.abs(mode.shapes[::-1]) * mode.shapes_std) / product
        std = np.hypot(change_std, change * np.hypot(moved, mode.size_std)) / product
        told.add(r, float(mode.hz[1]), change / product, float(std))

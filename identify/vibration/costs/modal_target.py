"""Measured modes side by side with the model that has them, and all data that a cost compares."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from identify.core.arrays import Array, Index
from identify.measured.modal_table import ModalTable
from identify.model.modes import (
    ComplexModes,
    eigenvalue_change,
    eigenvalue_gradient,
    frequency_and_damping_change,
)
from identify.model.system import System
from identify.vibration.costs.target import FrfTarget, together
from identify.vibration.nuisances.placed import Placed, state
from identify.vibration.nuisances.sensitivity import structural_changes


@dataclass(frozen=True, eq=False)
class ModalTarget:
    """One measured modal table and the system whose modes it lists; out (channels, n) where the table has
    shapes.  nuisances: what is uncertain; their values may follow those of the parameters.
    """

    name: str
    data: ModalTable
    system: System
    out: Array | None = None
    nuisances: Placed | None = None

    def at(self, values: Array) -> tuple[System, Array]:
        """The system at values (unknowns,), and the values of the parameters."""
        size = len(self.system.parameters)
        if self.nuisances is None or not values[size:].any():
            return self.system, values[:size]
        there = state(self.nuisances, values[size:])
        return self.system.with_more(there.mass, there.stiffness), values[:size]

    def slopes(self, modes: ComplexModes, values: Array, free: Index) -> tuple[Array, Array]:
        """Derivatives (m, free) of frequency_hz and damping_ratio of the modes at values (unknowns,)."""
        size = len(self.system.parameters)
        change = np.zeros((len(modes.eigenvalues), len(values)), dtype=complex)
        change[:, :size] = eigenvalue_gradient(modes, self.system.factors, size)
        if self.nuisances is not None and np.any(free >= size):
            there = state(self.nuisances, values[size:])
            mass, stiffness, numbers = structural_changes(self.nuisances, there)
            change[:, size + numbers] += eigenvalue_change(modes, mass, stiffness)
        return frequency_and_damping_change(modes, change[:, free])


@dataclass(frozen=True)
class Targets:
    """All data that a cost compares; the impacts on nonlinear systems are simulated together.

    nuisances: numbers of the unknowns that are nuisance parameters, which cost their squares; priors: of
    parameters that do, in units of their standard deviations, which stand beside.
    """

    frf: tuple[FrfTarget, ...] = ()
    modal: tuple[ModalTarget, ...] = ()
    nuisances: tuple[int, ...] = ()
    priors: tuple[tuple[int, float], ...] = ()

    @property
    def stated(self) -> tuple[tuple[int, float], ...]:
        """Numbers of all unknowns that cost their squares, and their standard deviations."""
        return (*((number, 1.0) for number in self.nuisances), *self.priors)

    @property
    def simulated(self) -> bool:
        """Whether impacts of any of them are simulated."""
        return any(target.simulated is not None for target in self.frf)

    def __post_init__(self) -> None:
        if self.simulated:
            simulator = together(self.frf)
            frf = tuple(replace(target, simulator=simulator) for target in self.frf)
            object.__setattr__(self, "frf", frf)

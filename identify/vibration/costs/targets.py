"""All data that a cost compares."""

from __future__ import annotations

from dataclasses import dataclass, replace

from identify.vibration.costs.modal_target import ModalTarget
from identify.vibration.costs.target import FrfTarget, together


@dataclass(frozen=True)
class Targets:
    """All data that a cost compares; the impacts on nonlinear systems are simulated together.

    nuisances: numbers of the unknowns that are nuisance parameters, which cost their squares.
    """

    frf: tuple[FrfTarget, ...] = ()
    modal: tuple[ModalTarget, ...] = ()
    nuisances: tuple[int, ...] = ()

    @property
    def simulated(self) -> bool:
        """Whether impacts of any of them are simulated."""
        return any(target.simulated is not None for target in self.frf)

    def __post_init__(self) -> None:
        if self.simulated:
            simulator = together(self.frf)
            frf = tuple(replace(target, simulator=simulator) for target in self.frf)
            object.__setattr__(self, "frf", frf)

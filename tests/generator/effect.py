"""What can be hidden in a test: three families by where they act, and how they tell the truth about
themselves.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from tests.generator.rigid import Array
from tests.generator.tree import Tree

if TYPE_CHECKING:
    from tests.generator.chain import Chain


@dataclass(frozen=True)
class Effect(ABC):
    """One hidden effect; its fields are its true parameters in SI units."""

    kind: ClassVar[str]

    @property
    @abstractmethod
    def sentence(self) -> str:
        """The effect in a few words."""

    def truth(self) -> dict[str, Any]:
        """Kind and parameters for the truth file."""
        return {"kind": self.kind, **{key: np.array(value).tolist() for key, value in asdict(self).items()}}


class StructureEffect(Effect):
    """Changes the mechanism."""

    @abstractmethod
    def build(self, tree: Tree) -> None:
        """Change the tree in place."""


class TorqueEffect(Effect):
    """A further torque on the drive of one joint, beside its spring and damper, that is not linear in the
    motion; it may remember where it has been.
    """

    joint: int

    def start(self) -> Array:
        """What it remembers at rest; nothing, unless it says so."""
        return np.zeros(0)

    @abstractmethod
    def torque(self, angle: float, rate: float, memory: Array) -> float:
        """Torque (N m) at a deflection (rad) from rest and its rate (rad/s)."""

    def after(self, angle: float, memory: Array) -> Array:
        """What it remembers when a time step has ended at a deflection (rad)."""
        return memory


class MeasurementEffect(Effect):
    """Something wrong between the structure and the file."""

    @abstractmethod
    def alter(self, chain: Chain) -> Chain:
        """The measurement chain with the fault."""

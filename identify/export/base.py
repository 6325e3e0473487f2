"""What an export format is, and the registry of them, which third parties join by `identify.exports`."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from pathlib import Path
from typing import ClassVar

from identify.core.registry import Registry
from identify.export.linear import LinearModel
from identify.export.reduced import Reduced

FORMATS = Registry(
    "export format",
    "identify.exports",
    {
        "fmu": "identify.export.fmu:Fmu",
        "mat": "identify.export.arrays:Mat",
        "mjcf": "identify.export.mjcf:Mjcf",
        "npz": "identify.export.arrays:Npz",
        "simscape": "identify.export.simscape:Simscape",
        "statespace": "identify.export.arrays:StateSpace",
        "uff": "identify.export.uff:UniversalFiles",
        "urdf": "identify.export.urdf:Urdf",
    },
    "identify.export.base:Format",
)


@dataclass(frozen=True)
class Job:
    """A model at a posture to be written, and where; reduced: the same with fewer states, where asked for;
    band_hz: where it is meant to hold.
    """

    model: LinearModel
    path: Path
    band_hz: tuple[float, float]
    reduced: Reduced | None = None


@dataclass(frozen=True)
class Exported:
    """The files that were written, and in sentences what they cannot say or say otherwise."""

    written: list[Path] = field(default_factory=list)
    notes: tuple[str, ...] = ()


class Format(ABC):
    """One format: `suffix` of its main file."""

    suffix: ClassVar[str] = ""
    reduces: ClassVar[bool] = False
    """Whether it holds a model with fewer states."""

    def paths(self, path: Path) -> list[Path]:
        """All files that it writes for the main one."""
        return [path]

    @abstractmethod
    def write(self, job: Job) -> Exported:
        """Write the files; InputError for what it cannot say at all, by name."""

"""What every result has that is reported, whatever its kind."""

from __future__ import annotations

from typing import Protocol

from identify.core.arrays import Texts
from identify.results.tables import Provenance


class Reported(Protocol):
    """A result with a kind and a name, a verdict, a run time and its provenance."""

    @property
    def kind(self) -> str:
        """Which kind of result it is: `fit`, `modes`."""

    @property
    def name(self) -> str:
        """What it is a result of."""

    @property
    def verdict(self) -> Texts:
        """What was found, in sentences."""

    @property
    def notes(self) -> Texts:
        """What a reader must be warned of, in sentences."""

    @property
    def seconds(self) -> float:
        """How long it took, s."""

    @property
    def provenance(self) -> Provenance:
        """Versions, config, inputs, settings."""

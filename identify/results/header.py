"""What every result says of itself, whatever its kind."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from identify.core.arrays import Texts
from identify.results.file import LAYOUT
from identify.results.tables import Provenance


@dataclass(frozen=True, kw_only=True)
class Header:
    """What stands first in every result: of which kind and of what it is, what was found (verdict) and what a
    reader must be warned of (notes), in sentences, how many seconds it took, and where it comes from.
    """

    KIND: ClassVar[str]
    layout: int = LAYOUT
    kind: str = ""
    name: str
    verdict: Annotated[Texts, "verdict_sentence"]
    notes: Annotated[Texts, "note"]
    seconds: float
    provenance: Provenance

    def __post_init__(self) -> None:
        """A result made here is of its class's kind; one that was read says so itself."""
        object.__setattr__(self, "kind", self.kind or self.KIND)


@dataclass(frozen=True, kw_only=True)
class KeyedHeader(Header):
    """That of a run that can be resumed; key: what tells it from other runs (`identify.fitting.resume`)."""

    key: str

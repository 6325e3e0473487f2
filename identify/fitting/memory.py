"""Finished pieces of work by key, for analyses that try many things: what was done once is not done again,
also after a restart.

The journal of a fit makes it resumable: every cost, and the gradients that are expensive, in the order in
which they were computed.

Optimizers are deterministic given their seed, so a run that is interrupted at any moment is resumed by
running it again with the costs it had already: they are replayed in microseconds, and what follows is bit for
bit what would have followed.
"""

from __future__ import annotations

import hashlib
import json
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from identify.core.arrays import Array
from identify.core.part_file import DamagedPart, PartFile


class Memory:
    """Values by key, both as JSON has them; kept in the part file of a run, or only here."""

    def __init__(self, part: PartFile | None = None) -> None:
        self._part = part
        self._known: dict[str, Any] = dict(json.loads(record) for record in (part.records if part else ()))

    def __contains__(self, key: object) -> bool:
        return key in self._known

    def __len__(self) -> int:
        return len(self._known)

    def __getitem__(self, key: str) -> Any:
        return self._known[key]

    def __setitem__(self, key: str, value: Any) -> None:
        self._known[key] = value
        if self._part is not None:
            self._part.append(json.dumps([key, value]).encode())

    def recall(self, key: str, compute: Callable[[], Any]) -> Any:
        """The value of a key, computed if it is not there yet."""
        if key not in self:
            self[key] = compute()
        return self[key]


def digest(*parts: Any) -> str:
    """Key of what is computed from these parts, which JSON can hold."""
    return hashlib.sha256(json.dumps(parts).encode()).hexdigest()


@dataclass
class Journal:
    """Numbers in order, a record for every computation; part: where they are kept, None for a run that
    cannot be resumed; position: how many records this run has passed, replayed: how many were not computed;
    made: those that were, where another process wants them for its own journal.
    """

    part: PartFile | None = None
    position: int = 0
    replayed: int = 0
    made: list[bytes] | None = None

    @property
    def exhausted(self) -> bool:
        """Whether nothing is left to replay."""
        return self.part is None or self.position >= len(self.part.records)

    def replay(self, count: int) -> Array | None:
        """The next `count` remembered numbers; None where the run has not been there yet.

        A record of another length, or with NaN, which no cost is, was not written by this run: it and all
        after it are forgotten, with a warning.
        """
        if self.part is None or self.exhausted:
            return None
        record = self.part.records[self.position]
        numbers = np.frombuffer(record) if len(record) == 8 * count else np.full(1, np.nan)
        if np.isnan(numbers).any():
            number = self.position + 1
            said = f"{self.part.path}: record {number} is not of this run; it and all later ones are ignored"
            warnings.warn(said, DamagedPart, stacklevel=2)
            self.part.keep(self.position)
            return None
        self.position, self.replayed = self.position + 1, self.replayed + 1
        return numbers.copy()

    def record(self, numbers: Array) -> None:
        """Remember numbers that were computed."""
        self.take([numbers.astype(float).tobytes()])

    def take(self, records: Sequence[bytes]) -> None:
        """Remember records that were computed, here or for this run in another process."""
        if self.made is not None:
            self.made += records
        if self.part is not None:
            for record in records:
                self.part.append(record)
            self.position += len(records)

"""Finished pieces of work by key, for analyses that try many things: what was done once is not done again,
also after a restart.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from typing import Any

from identify.core.part_file import PartFile


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

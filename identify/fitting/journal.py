"""What makes a run resumable: every cost, and the gradients that are dear, in the order in which they were
computed.

Optimizers are deterministic given their seed, so a run that is interrupted at any moment is resumed by
running it again with the costs it had already: they are replayed in microseconds, and what follows is bit for
bit what would have followed.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from identify.core.arrays import Array

_EVERY_S = 1.0


@dataclass
class Journal:
    """Costs in order.  remembered (n,): those of an interrupted run; save is called with all costs every few
    seconds.
    """

    remembered: Array = field(default_factory=lambda: np.zeros(0))
    save: Callable[[Array], None] | None = None
    position: int = 0
    new: list[Array] = field(default_factory=list)
    saved: float = field(default_factory=time.monotonic)

    def replay(self, count: int) -> Array | None:
        """The next `count` remembered costs; None where there are not that many left."""
        if self.position + count > len(self.remembered):
            self.remembered = self.remembered[: self.position]
            return None
        self.position += count
        return self.remembered[self.position - count : self.position].copy()

    def record(self, costs: Array) -> None:
        """Remember costs that were computed, and save now and then."""
        self.new.append(costs.copy())
        if self.save is not None and time.monotonic() - self.saved > _EVERY_S:
            self.flush()

    def flush(self) -> None:
        """Save now."""
        if self.save is not None:
            self.save(self.costs())
        self.saved = time.monotonic()

    def costs(self) -> Array:
        """All costs so far, (n,)."""
        return np.concatenate([self.remembered, *self.new])

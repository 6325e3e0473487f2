"""What the terminal says of nodes on a robot."""

from __future__ import annotations

from collections.abc import Iterator

from identify.core.text import count
from identify.measured.registration.place import Placing, summary


def sentences(placing: Placing) -> Iterator[str]:
    """How many nodes are placed, what is to be looked at, and what is left to do."""
    found = placing.registration
    if found is None:
        yield f"{count(len(placing.nodes), 'node')} to be put on {placing.robot.name}: open the page"
        yield from (f"note: {note}" for note in placing.notes)
        return
    yield summary(placing)
    yield from (f"note: {note}" for note in placing.notes)
    yield from (f"look at node {node}: {text}" for node, text in placing.doubts.items())

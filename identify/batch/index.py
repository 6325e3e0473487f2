"""The index of a batch: a JSON file that says at any moment what is done, under way, failed and waiting, one
job a line.

It is written whole.  Because it grows with the batch, it is written at once only while that is cheap: at most
a twentieth of the time goes into it, and never more than the last seconds are missing from it.  Results do
not depend on it.
"""

from __future__ import annotations

import json
import time
from collections import Counter
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Literal

from identify.core.atomic import write_text

SCHEMA = "identify-index/1"
State = Literal["waiting", "running", "done", "failed"]
_SHARE = 20.0
_LEAST_S = 0.2


@dataclass
class Entry:
    """One job: its state, how often it was begun, its result file, seconds of work, why it failed last.

    kept: it was finished before.
    """

    state: State = "waiting"
    attempts: int = 0
    result: str = ""
    seconds: float = 0.0
    error: str = ""
    kept: bool = False


@dataclass
class BatchIndex:
    """All jobs of a batch by name, in their order; about: keys that stand above them."""

    path: Path
    about: dict[str, Any]
    jobs: dict[str, Entry] = field(default_factory=dict)
    state: str = "running"
    began: float = field(default_factory=time.monotonic)
    _next: float = 0.0

    def counts(self) -> dict[str, int]:
        """How many jobs are in each state."""
        found = Counter(entry.state for entry in self.jobs.values())
        return {state: found.get(state, 0) for state in ("waiting", "running", "done", "failed")}

    def changed(self) -> None:
        """Write the file if it is time; raises InputError where it cannot be written."""
        if time.monotonic() >= self._next:
            self.write()

    def write(self) -> None:
        """Write the file now."""
        before = time.monotonic()
        write_text(self.path, self._text(), "make room and resume with `--resume`")
        after = time.monotonic()
        self._next = after + max(_LEAST_S, _SHARE * (after - before))

    def _text(self) -> str:
        written, seconds = (
            datetime.now(UTC).isoformat(timespec="seconds"),
            round(time.monotonic() - self.began, 1),
        )
        head = {
            "schema": SCHEMA,
            **self.about,
            "state": self.state,
            "written": written,
            "seconds": seconds,
            "counts": self.counts(),
        }
        lines = [f"  {json.dumps(key)}: {json.dumps(value)}" for key, value in head.items()]
        rows = [f"    {json.dumps(name)}: {json.dumps(vars(entry))}" for name, entry in self.jobs.items()]
        return "{\n" + ",\n".join(lines) + ',\n  "jobs": {\n' + ",\n".join(rows) + "\n  }\n}\n"

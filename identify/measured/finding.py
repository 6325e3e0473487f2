"""What a quality check found: how bad, where, and a sentence that an engineer would say."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from identify.measured.channel import Channel

Level = Literal["fail", "warn", "info"]


@dataclass(frozen=True)
class Finding:
    """level `fail`: do not fit before this is fixed; `warn`: look at it; `info`: know it.  value is the
    number the sentence rests on.
    """

    level: Level
    check: str
    channels: tuple[Channel, ...]
    sentence: str
    value: float | None = None


def listing(channels: list[Channel] | list[int], most: int = 6) -> str:
    """Names joined by commas, the rest counted."""
    more = f" and {len(channels) - most} more" if len(channels) > most else ""
    return ", ".join(str(channel) for channel in channels[:most]) + more

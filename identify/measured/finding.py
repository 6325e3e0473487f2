"""What a quality check found: how bad, where, and a sentence that an engineer would say."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, TypeVar

from identify.core.errors import InputError, InputErrors
from identify.measured.channel import Channel

Level = Literal["fail", "warn", "info"]
STUDY = "study"
"""The name under which findings on the study as a whole are listed."""
T = TypeVar("T")


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


@dataclass(frozen=True)
class Checked:
    """What `identify check` found of a study: findings by measurement or record, those on the study itself
    under `STUDY`; refused: what the command that comes next would refuse; then: the words of that command,
    which the config follows; correct: writes what puts a mistake right that is named, beside what there is.
    """

    findings: Mapping[str, Sequence[Finding]]
    refused: tuple[InputError, ...] = ()
    then: str = "fit"
    correct: Callable[[], Sequence[Path]] | None = None

    @property
    def failed(self) -> bool:
        """Whether the data should not be used as they are."""
        return any(finding.level == "fail" for found in self.findings.values() for finding in found)


def worst_first(findings: Iterable[Finding]) -> list[Finding]:
    """The findings in the order in which they are reported: by level, else as they come."""
    levels: tuple[Level, ...] = ("fail", "warn", "info")
    return sorted(findings, key=lambda finding: levels.index(finding.level))


def kept(read: Callable[[], T], refused: list[InputError]) -> T | None:
    """What is read, or None with the refusal kept."""
    try:
        return read()
    except InputErrors as errors:
        refused.extend(errors.errors)
    except InputError as error:
        refused.append(error)
    return None


def as_notes(findings: Iterable[Finding]) -> list[str]:
    """Findings as notes of a result."""
    return [f"{one.sentence[:1].lower()}{one.sentence[1:]}" for one in findings]


def listing(channels: list[Channel] | list[int], most: int = 6) -> str:
    """Names joined by commas, the rest counted."""
    more = f" and {len(channels) - most} more" if len(channels) > most else ""
    return ", ".join(str(channel) for channel in channels[:most]) + more

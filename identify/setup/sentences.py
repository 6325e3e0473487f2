"""A diagnosis in sentences."""

from __future__ import annotations

from identify.core.text import capital, listed
from identify.setup.diagnosis import Diagnosis, Mistake
from identify.setup.edits import in_words

_SURE = 0.9999


def sentences(found: Diagnosis, config: str) -> list[str]:
    """One for each mistake, and what puts all right."""
    named = [_sentence(one) for one in found.mistakes]
    return [*named, *(_instead(found, one) for one in found.instead), _remedy(found, config)]


def _instead(found: Diagnosis, others: tuple[Mistake, ...]) -> str:
    """Other mistakes that explain the data as well, as far as they differ."""
    new = [one.sentence for one in others if one not in found.mistakes]
    gone = [one.sentence for one in found.mistakes if one not in others]
    text = f"It may equally be that {listed(new)}"
    if gone:
        text += f", and not that {listed(gone)}"
    return f"{text}; only an inspection of the test can decide."


def _sentence(one: Mistake) -> str:
    text = f"{capital(one.sentence)}"
    if one.otherwise:
        text += (
            f"; {listed(list(one.otherwise))} would explain it as well, and only an inspection of the test"
            " can decide"
        )
    return f"{text}."


def _remedy(found: Diagnosis, config: str) -> str:
    sure = "more than 99.99 %" if found.probability > _SURE else f"{found.probability:.1%}"
    brings = "that brings" if len(found.mistakes) == 1 else "together they bring"
    soft = "With compliance of every bearing, the base and the links, " if found.softened else ""
    return (
        f"{capital(soft + brings)} the gap from"
        f" {found.gap_before:.3g} to {found.gap_after:.3g} (probability {sure}): change"
        f" {in_words(found.edits)}, or let `identify check {config} --apply` write the corrected study."
    )

"""What results that rest on a fit say of it."""

from __future__ import annotations

from identify.core.thresholds import MISSING
from identify.results.fit import FitResult


def of_fit(fit: FitResult) -> list[str]:
    """The fit's own notes."""
    return [f"of the fit: {note}" for note in fit.notes]


def of_gap(gap: float, consequence: str) -> list[str]:
    """A note where the fit's gap says that something is missing, and what follows; empty otherwise."""
    if gap <= MISSING:
        return []
    return [
        f"the fit's gap is {gap:.3g}: something is missing from the model, {consequence}; see"
        " `identify discover`"
    ]

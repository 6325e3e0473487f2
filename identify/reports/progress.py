"""What a run shows in the terminal while it goes on."""

from __future__ import annotations

from identify.reports.batch.terminal import batch_bar
from identify.reports.fit.terminal import progress_bar, story

__all__ = ["batch_bar", "progress_bar", "story"]

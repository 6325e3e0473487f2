"""Print what a run found, whichever kind of result it is."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from identify.reports.batch.terminal import print_batch, print_said
from identify.reports.explain.terminal import print_explained
from identify.reports.fit.terminal import print_discovery, print_modes, print_result
from identify.reports.joints.terminal import print_joints
from identify.reports.motion.terminal import print_motion

_PRINT: dict[str, Callable[[Any], None]] = {
    "batch": print_batch,
    "discovery": print_discovery,
    "explained": print_explained,
    "fit": print_result,
    "joints": print_joints,
    "modes": print_modes,
    "motion": print_motion,
}


def print_report(result: Any) -> None:
    """Verdict, notes, and the tables that a terminal has room for."""
    if result.KIND in _PRINT:
        _PRINT[result.KIND](result)
    else:
        print_said(result.verdict, result.notes)

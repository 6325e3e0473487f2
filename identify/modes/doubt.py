"""What is doubtful of the modes of an analysis, and of the analysis, in words."""

from __future__ import annotations

import numpy as np

from identify.core.arrays import Array
from identify.core.text import listed
from identify.core.thresholds import SIGMAS_95
from identify.measured.modal_tables import ModalTable
from identify.modal.alone import Disagreement
from identify.modal.settings import ModalSettings


def doubts(
    table: ModalTable, collinearity: Array, deviation_deg: Array, settings: ModalSettings
) -> tuple[str, ...]:
    """Why each mode is doubtful, empty where it is not: a frequency whose 95 % interval is wider than the
    resonance, a damping whose interval holds 0, a shape more complex than the settings let candidates be.

    collinearity, deviation_deg (m,): MPC and MPD of the final shapes.
    """
    assert table.frequency_std_hz is not None and table.damping_std is not None
    reasons = {
        "frequency": SIGMAS_95 * table.frequency_std_hz > table.damping_ratio * table.frequency_hz,
        "damping": SIGMAS_95 * table.damping_std > np.abs(table.damping_ratio),
        "shape": (collinearity < settings.min_mpc) | (deviation_deg > settings.max_mpd_deg),
    }
    return tuple(", ".join(name for name, rows in reasons.items() if rows[r]) for r in range(len(table)))


def doubt_sentence(frequency_hz: Array, doubt: tuple[str, ...]) -> str:
    """Which modes are doubtful, and in what."""
    listing = [f"{f:.4g} Hz ({why})" for f, why in zip(frequency_hz, doubt, strict=False) if why]
    if not listing:
        return ""
    return f"Doubtful: {listed(listing)}."


def disagreement_note(name: str, found: Disagreement, modes: int) -> str:
    """That FRFs do not share their poles, with the frequencies that they give alone."""
    places = [
        f"{low:.4g} to {high:.4g} Hz ({100 * (high / low - 1):.2g} %, each to ± {SIGMAS_95 * std:.1g} Hz)"
        for low, high, std in zip(found.low_hz, found.high_hz, found.std_hz, strict=True)
    ]
    several = f", and together {modes} where each shows {found.modes}" if modes > found.modes else ""
    return (
        f"{name}: the FRFs do not share their poles: one by one they show modes at {listed(places)}{several}."
        " The structure changed between them, as with an accelerometer that was moved: give `--roved`, or a"
        " file for each place, to remove the effect of its mass"
    )

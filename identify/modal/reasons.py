"""Why a cluster of poles is no mode: a code with numbers, and the sentence and the few words that are made of
them here alone.
"""

from __future__ import annotations

from enum import StrEnum
from typing import Self

from identify.core.coded import Coded


class Why(StrEnum):
    """The criterion that a candidate failed: its code, the sentence that takes the numbers, and what several
    were turned down for, as behind their number.
    """

    sentence: str
    short: str

    def __new__(cls, code: str, sentence: str = "", short: str = "") -> Self:
        """A code that knows its words."""
        made = str.__new__(cls, code)
        made._value_, made.sentence, made.short = code, sentence, short
        return made

    RARE = "rare", "appears in {:.0%} of the orders", "in too few orders"
    FREQUENCY_SCATTERS = (
        "frequency scatters",
        "frequency scatters by {:.2%} over orders",
        "with a scattering frequency",
    )
    DAMPING_SCATTERS = "damping scatters", "damping scatters by {:.0%} over orders", "with scattering damping"
    DAMPED = "damped", "damping ratio {:.1%} is not structural", "with too much damping"
    COMPLEX = "complex", "shape is complex: MPC {:.2f}", "with a complex shape"
    COMPLEX_DEVIATION = "complex deviation", "shape is complex: MPD {:.0f} deg", "with a complex shape"
    COMPLEX_REFINED = (
        "complex refined",
        "refined shape is complex: MPC {:.2f}, MPD {:.0f} deg",
        "with a complex shape",
    )
    DUPLICATE = "duplicate", "duplicate of {:.4g} Hz (MAC {:.2f})", "as duplicate"
    IDLE = "idle", "explains only {:.1%} of the response around it", "that the FRFs do not need"
    IDLE_BY_NOISE = (
        "idle by noise",
        "explains only {:.0%} of what a mode must explain beyond noise",
        "that the FRFs do not need",
    )
    LEFT = "left", "not a resonance: it went to {:.4g} Hz with {:.1%} damping", "that wander off when refined"
    MOVED = (
        "moved",
        "not a resonance of its own: refinement moves it to {:.4g} Hz, damping {:.2%}",
        "that wander off when refined",
    )
    BEYOND = "beyond", "a resonance beyond the band, at {:.4g} Hz", "beyond the band"
    FLANK = "flank", "only a flank of it, of {:.4g} Hz, is in the band", "beyond the band"
    SLIM = "slim", "narrower than a line", "narrower than a line"
    BARRED = "barred", "a resonance that was dropped by hand, or narrower than a line", "where none may be"
    HARMONIC = "harmonic", "a harmonic: a tone at {:.4g} Hz, no resonance", "as harmonics of what turns"
    BLOCKS = "blocks", "differs from block to block by {:.2g} Hz", "that differ from block to block"
    FEW_SETUPS = "few setups", "shown by {} of {} setups", "that too few setups show"
    NOT_CHOSEN = "not chosen", "not chosen in modes_hz", "by hand"
    DROPPED = "dropped", "dropped by hand", "by hand"


RESIDUAL = "; kept as a residual"
"""What became of a pole that still is fitted."""


def because(why: Why, *numbers: float, more: str = "") -> Coded:
    """A reason with its numbers; more: what stands behind the sentence."""
    return Coded(why.sentence.format(*numbers) + more, why)


def in_short(why: str) -> str:
    """What several candidates were turned down for, as behind their number; why: a code, also of a file."""
    return next((one.short for one in Why if one == why), "for other reasons")

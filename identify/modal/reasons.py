"""Why a cluster of poles is no mode: a code with numbers, and the sentence and the few words that are made of
them here alone.
"""

from __future__ import annotations

from enum import StrEnum

from identify.core.coded import Coded


class Why(StrEnum):
    """The criterion that a candidate failed."""

    RARE = "rare"
    FREQUENCY_SCATTERS = "frequency scatters"
    DAMPING_SCATTERS = "damping scatters"
    DAMPED = "damped"
    COMPLEX = "complex"
    COMPLEX_DEVIATION = "complex deviation"
    COMPLEX_REFINED = "complex refined"
    DUPLICATE = "duplicate"
    IDLE = "idle"
    IDLE_BY_NOISE = "idle by noise"
    LEFT = "left"
    MOVED = "moved"
    BEYOND = "beyond"
    FLANK = "flank"
    SLIM = "slim"
    BARRED = "barred"
    HARMONIC = "harmonic"
    BLOCKS = "blocks"
    FEW_SETUPS = "few setups"
    NOT_CHOSEN = "not chosen"
    DROPPED = "dropped"


_SENTENCES = {
    Why.RARE: "appears in {:.0%} of the orders",
    Why.FREQUENCY_SCATTERS: "frequency scatters by {:.2%} over orders",
    Why.DAMPING_SCATTERS: "damping scatters by {:.0%} over orders",
    Why.DAMPED: "damping ratio {:.1%} is not structural",
    Why.COMPLEX: "shape is complex: MPC {:.2f}",
    Why.COMPLEX_DEVIATION: "shape is complex: MPD {:.0f} deg",
    Why.COMPLEX_REFINED: "refined shape is complex: MPC {:.2f}, MPD {:.0f} deg",
    Why.DUPLICATE: "duplicate of {:.4g} Hz (MAC {:.2f})",
    Why.IDLE: "explains only {:.1%} of the response around it",
    Why.IDLE_BY_NOISE: "explains only {:.0%} of what a mode must explain beyond noise",
    Why.LEFT: "not a resonance: it went to {:.4g} Hz with {:.1%} damping",
    Why.MOVED: "not a resonance of its own: refinement moves it to {:.4g} Hz, damping {:.2%}",
    Why.BEYOND: "a resonance beyond the band, at {:.4g} Hz",
    Why.FLANK: "only a flank of it, of {:.4g} Hz, is in the band",
    Why.SLIM: "narrower than a line",
    Why.BARRED: "a resonance that was dropped by hand, or narrower than a line",
    Why.HARMONIC: "a harmonic: a tone at {:.4g} Hz, no resonance",
    Why.BLOCKS: "differs from block to block by {:.2g} Hz",
    Why.FEW_SETUPS: "shown by {} of {} setups",
    Why.NOT_CHOSEN: "not chosen in modes_hz",
    Why.DROPPED: "dropped by hand",
}
_COMPLEX, _IDLE, _WANDERED = (
    "with a complex shape",
    "that the FRFs do not need",
    "that wander off when refined",
)
_IN_SHORT: dict[str, str] = {
    Why.RARE: "in too few orders",
    Why.FREQUENCY_SCATTERS: "with a scattering frequency",
    Why.DAMPING_SCATTERS: "with scattering damping",
    Why.DAMPED: "with too much damping",
    Why.COMPLEX: _COMPLEX,
    Why.COMPLEX_DEVIATION: _COMPLEX,
    Why.COMPLEX_REFINED: _COMPLEX,
    Why.DUPLICATE: "as duplicate",
    Why.IDLE: _IDLE,
    Why.IDLE_BY_NOISE: _IDLE,
    Why.LEFT: _WANDERED,
    Why.MOVED: _WANDERED,
    Why.BEYOND: "beyond the band",
    Why.FLANK: "beyond the band",
    Why.SLIM: "narrower than a line",
    Why.BARRED: "where none may be",
    Why.HARMONIC: "as harmonics of what turns",
    Why.BLOCKS: "that differ from block to block",
    Why.FEW_SETUPS: "that too few setups show",
    Why.NOT_CHOSEN: "by hand",
    Why.DROPPED: "by hand",
}
RESIDUAL = "; kept as a residual"
"""What became of a pole that still is fitted."""


def because(why: Why, *numbers: float, more: str = "") -> Coded:
    """A reason with its numbers; more: what stands behind the sentence."""
    return Coded(_SENTENCES[why].format(*numbers) + more, why)


def in_short(why: str) -> str:
    """What several candidates were turned down for, as behind their number; why: a code, also of a file."""
    return _IN_SHORT.get(why, "for other reasons")

"""A table of modes: frequency, damping and, where known, shapes at channels; measured or computed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.measured.channel import Channel


@dataclass(frozen=True)
class ModalTable:
    """frequency_hz (m,): |lambda|/2 pi, rising; damping_ratio (m,): -Re lambda/|lambda| (0.04, not 4 %), NaN
    where unknown; shapes (m, channels) complex, or None; *_std are standard deviations, or None;
    modal_mass_kg (m,): of the shapes as they are, where it was told apart from them, NaN where unknown;
    notes: sentences on what of the file was not read.
    """

    frequency_hz: NDArray[np.float64]
    damping_ratio: NDArray[np.float64]
    channels: tuple[Channel, ...] = ()
    shapes: NDArray[np.complex128] | None = None
    frequency_std_hz: NDArray[np.float64] | None = None
    damping_std: NDArray[np.float64] | None = None
    modal_mass_kg: NDArray[np.float64] | None = None
    modal_mass_std_kg: NDArray[np.float64] | None = None
    source: str = ""
    sha256: str = ""
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        modes = len(self.frequency_hz)
        if self.damping_ratio.shape != (modes,):
            raise ValueError(f"damping_ratio has shape {self.damping_ratio.shape}, expected ({modes},)")
        if self.shapes is not None and self.shapes.shape != (modes, len(self.channels)):
            raise ValueError(
                f"shapes have shape {self.shapes.shape}, expected ({modes}, {len(self.channels)})"
            )
        if np.any(np.diff(self.frequency_hz) < 0):
            raise ValueError("frequency_hz must rise")

    def __len__(self) -> int:
        return len(self.frequency_hz)

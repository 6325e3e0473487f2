"""Measured dynamic stiffnesses as a result keeps them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from identify.core.arrays import Array, Complex, Texts


@dataclass(frozen=True)
class CurveTable:
    """The dynamic stiffness of a place by line (l) and entry (m), measured without a law.

    place, effect: sentences; unit of the entries along one coordinate; gap that the place leaves without a
    law; value (l, m) and standard deviations of real and imaginary part; law (l, m): what the added effect
    says, NaN where there is none; sets (p): measurements, with agreement (p,), RMS difference from the pooled
    curve over its standard deviation, and whether they were fitted; laws (n): simple laws, likeliest first,
    with the gap that each leaves and log odds (of the first over the second, of the others over the first);
    peak_n: strength of the impacts, NaN where all are alike; site: the place whatever the strength, none in
    older files; axis: how its direction was found to differ;
    errors_held: whether nuisance parameters were held as they were fitted.
    """

    place: str
    effect: str
    unit: str
    gap: float
    entries: Annotated[Texts, "entries"]
    frequency_hz: Annotated[Array, "frequency_hz"]
    value: Annotated[Complex, "frequency_hz entries", "$unit"]
    std_real: Annotated[Array, "frequency_hz entries", "$unit"]
    std_imag: Annotated[Array, "frequency_hz entries", "$unit"]
    law: Annotated[Complex, "frequency_hz entries", "$unit"]
    sets: Annotated[Texts, "sets"]
    agreement: Annotated[Array, "sets"]
    fitted: Annotated[NDArray[np.bool_], "sets"]
    laws: Annotated[Texts, "laws"]
    law_gap: Annotated[Array, "laws"]
    law_log_odds: Annotated[Array, "laws"]
    peak_n: float = float("nan")
    axis: str = ""
    errors_held: bool = False
    site: str = ""


@dataclass(frozen=True)
class PlaceTable:
    """Places that a step looked at (n), best first: sentence, gap that is left with one unknown per line (by
    the numbers left to explain it), and how many real numbers that took.
    """

    sentence: Annotated[Texts, "sentence"]
    gap: Annotated[Array, "sentence"]
    unknowns: Annotated[NDArray[np.int_], "sentence"]

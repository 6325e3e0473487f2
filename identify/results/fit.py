"""The result of a fit: the classes below are the groups of its HDF5 file (layout and writer:
`identify.results.file`).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from identify.core.arrays import Array, Complex, Mask, Texts
from identify.results.header import KeyedHeader
from identify.results.tables import Geometry, Modes, ParameterTable, StartTable


@dataclass(frozen=True)
class ModePairs:
    """Measured modes beside the model's: rows of each, MAC of the pair (NaN without shapes), and the whole
    MAC matrix (measured, model).

    measured_shapes (measured modes, points, 3), base axes, NaN where a point was not measured; origin: where
    they come from.
    """

    measured_frequency_hz: Annotated[Array, "measured_mode"]
    measured_damping_ratio: Annotated[Array, "measured_mode"]
    measured: Annotated[NDArray[np.int_], "pair"]
    model: Annotated[NDArray[np.int_], "pair"]
    mac: Annotated[Array, "pair"]
    mac_matrix: Annotated[Array | None, "measured_mode model_mode"]
    measured_shapes: Annotated[Complex | None, "measured_mode point axis"]
    origin: str


HALF_SPECTRUM = "half spectrum"
"""The quantity of what stands in place of FRFs where no force was measured."""


class Noun(NamedTuple):
    """A word for one and for several."""

    one: str
    several: str


FRF = Noun("FRF", "FRFs")


@dataclass(frozen=True, kw_only=True)
class FrfComparison:
    """FRFs (lines, pairs): measured, predicted at the start (None: no such model) and as fitted, noise (std
    of real or imaginary part); per pair the errors.

    gap: RMS residual over noise; relative: |difference| / |measured| over the band; frac: see
    identify.modal.mac; area as in Kobe Eq. 10 over the area below the measurement.
    """

    quantity: str
    unit: str
    window_decay_per_s: float
    frequency_hz: Annotated[Array, "frequency_hz"]
    output: Annotated[Texts, "pair"]
    input: Annotated[Texts, "pair"]
    measured: Annotated[Complex, "frequency_hz pair", "$unit"]
    initial: Annotated[Complex | None, "frequency_hz pair", "$unit"] = None
    fitted: Annotated[Complex, "frequency_hz pair", "$unit"]
    band_95: Annotated[Array | None, "frequency_hz pair", "$unit"] = None
    noise: Annotated[Array | None, "frequency_hz pair", "$unit"] = None
    coherence: Annotated[Array | None, "frequency_hz pair"] = None
    gap: Annotated[Array | None, "pair"] = None
    relative_error: Annotated[Array, "pair"]
    frac: Annotated[Array, "pair"]
    area_error: Annotated[Array, "pair"]

    @cached_property
    def moved(self) -> Mask:
        """(pairs,): which of them the model moves."""
        return np.asarray(np.any(self.fitted, axis=0))

    @property
    def noun(self) -> Noun:
        """What is compared, in words."""
        return Noun(HALF_SPECTRUM, "half spectra") if self.quantity == HALF_SPECTRUM else FRF


@dataclass(frozen=True)
class MeasurementResult:
    """One measurement: what it was, and how the model does on it."""

    name: str
    use: str
    file: str
    sha256: str
    posture_deg: Annotated[Array, "joint"]
    gap: float
    geometry: Geometry
    modes: Modes
    frf: FrfComparison | None
    pairs: ModePairs | None


@dataclass(frozen=True)
class PublishedValues:
    """What a publication found: values in the order of the parameters (p), NaN where it says nothing, and its
    modes.
    """

    source: str
    value: Annotated[Array, "parameter", "see parameters/unit"]
    frequency_hz: Annotated[Array, "mode"]
    damping_ratio: Annotated[Array, "mode"]


@dataclass(frozen=True)
class ProfileCurve:
    """Profile likelihood of a parameter: its values (n,), the rise of chi-square (n,), and where it crosses
    3.84 (95 %), NaN if nowhere.
    """

    values: Annotated[Array, "values", "see parameters/unit"]
    rise: Annotated[Array, "values"]
    low: Annotated[float, "", "see parameters/unit"]
    high: Annotated[float, "", "see parameters/unit"]


@dataclass(frozen=True)
class StatedUncertainty:
    """What was stated, and how far the data say that it is off: a row for each of e errors.

    kind: what it is an error of, such as `masses`; place, change: where, and which of its numbers; stated
    (e,):
    its standard deviation in `unit` (1: relative); shift, spread (e,): the fitted error and its standard
    deviation after the fit, over the stated one.  sentences: what stands out, in words.  kinds (k,), and the
    part of the variance of each parameter (p, k) that comes from them, the rest from noise; NaN where fixed.
    root (f + e, f + e): its product with its transpose is the covariance of the free parameters on their
    search scale, then of the errors over what was stated; None in files of before 0.2.
    """

    kind: Annotated[Texts, "error"]
    place: Annotated[Texts, "error"]
    change: Annotated[Texts, "error"]
    unit: Annotated[Texts, "error"]
    stated: Annotated[Array, "error", "$unit"]
    shift: Annotated[Array, "error"]
    spread: Annotated[Array, "error"]
    sentences: Annotated[Texts, "statement"]
    kinds: Annotated[Texts, "kinds"]
    parts: Annotated[Array, "parameter kinds"]
    root: Annotated[Array | None, "unknown unknown_again"] = None


@dataclass(frozen=True)
class Description:
    """The texts of the files that describe the robot (its name says what it is) and the points, so that a
    result can be used alone.
    """

    robot_name: str
    robot: str
    points: str


@dataclass(frozen=True, kw_only=True)
class FitResult(KeyedHeader):
    """A whole run.  verdict and notes are sentences; history as in `identify.fitting.fit.Fit`; effects are
    the sentences of the model's effects.
    """

    KIND: ClassVar[str] = "fit"
    seed: int
    effects: Annotated[Texts, "effect"]
    cost_kind: str
    cost: float
    gap: float
    gap_validation: float
    converged: bool
    parameters: ParameterTable
    correlation: Annotated[Array, "free free_again"]
    singular_values: Annotated[Array, "combination"]
    directions: Annotated[Array, "combination free"]
    inseparable: Annotated[Texts, "inseparable_pair"]
    starts: StartTable
    history: Annotated[Array, "progress progress_column", "see documentation"]
    measurements: dict[str, MeasurementResult]
    published: PublishedValues | None
    profiles: dict[str, ProfileCurve]
    description: Description | None = None
    uncertainty: StatedUncertainty | None = None

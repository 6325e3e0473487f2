"""The result of `identify modes` as it is kept in its HDF5 file (layout and writer:
`identify.results.file`).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, ClassVar

import numpy as np
from numpy.typing import NDArray

from identify.core.arrays import Array, Complex, Texts
from identify.results.fit import FRF, FrfComparison, Noun
from identify.results.header import Header
from identify.results.tables import Geometry

MARKS = ("kept by hand", "dropped by hand", "below the threshold")
"""What choices do to a cluster of poles: `--keep`, `--drop`, and `--threshold`, what a mode must explain."""
FAILED_REBUILD = 0.5
"""Error of the rebuilt FRFs (RMS over all) beyond which an analysis has failed."""


@dataclass(frozen=True)
class ModeTable:
    """Modes (m), by frequency: damping ratios without the exponential window, seen_*: as it showed them;
    *_std: standard deviations, over orders and noise.

    mpc (m,); mpd_deg (m,); channels of the shapes (m, channels); participation (m, references); auto_mac (m,
    m); doubt (m,): what of a mode is doubtful, "" where nothing is, empty in results that are older.
    """

    frequency_hz: Annotated[Array, "frequency_hz"]
    frequency_std_hz: Annotated[Array, "frequency_hz"]
    damping_ratio: Annotated[Array, "frequency_hz"]
    damping_std: Annotated[Array, "frequency_hz"]
    seen_frequency_hz: Annotated[Array, "frequency_hz"]
    seen_damping_ratio: Annotated[Array, "frequency_hz"]
    mpc: Annotated[Array, "frequency_hz"]
    mpd_deg: Annotated[Array, "frequency_hz"]
    channels: Annotated[Texts, "channels"]
    shapes: Annotated[Complex, "frequency_hz channels"]
    references: Annotated[Texts, "references"]
    participation: Annotated[Complex, "frequency_hz references"]
    auto_mac: Annotated[Array, "frequency_hz mode_again"]
    doubt: Annotated[Texts, "frequency_hz"] = ()


@dataclass(frozen=True)
class RejectedPoles:
    """Clusters of poles that are no modes (c), by frequency, and why: sentence, and code, empty in results
    that are older; presence: part of the orders they appear in.
    """

    frequency_hz: Annotated[Array, "frequency_hz"]
    damping_ratio: Annotated[Array, "frequency_hz"]
    presence: Annotated[Array, "frequency_hz"]
    mpc: Annotated[Array, "frequency_hz"]
    mpd_deg: Annotated[Array, "frequency_hz"]
    reason: Annotated[Texts, "frequency_hz"]
    why: Annotated[Texts, "frequency_hz"] = ()


@dataclass(frozen=True)
class StabilisationDiagram:
    """Poles of all orders (n,), and the mode indicator over the lines.

    stable (n,): in a cluster that is present in enough orders; indicator (lines, references): CMIF, unit of
    the FRFs, largest first; mark (n,): position in MARKS of what a choice did to the pole's cluster, -1 for
    nothing; empty in results that are older.
    """

    order: Annotated[NDArray[np.int_], "pole"]
    frequency_hz: Annotated[Array, "pole"]
    damping_ratio: Annotated[Array, "pole"]
    stable: Annotated[NDArray[np.bool_], "pole"]
    line_hz: Annotated[Array, "line_hz"]
    indicator: Annotated[Array, "line_hz reference", "see ../frf/unit"]
    mark: Annotated[NDArray[np.int_], "pole"] = field(default_factory=lambda: np.zeros(0, dtype=int))

    def marked(self) -> list[tuple[str, NDArray[np.bool_]]]:
        """What choices did, and to which poles (n,); only what they did to some."""
        poles = [(name, self.mark == k) for k, name in enumerate(MARKS)]
        return [(name, rows) for name, rows in poles if rows.any()]


@dataclass(frozen=True)
class Reciprocity:
    """Channels measured both ways (r): correlation over the lines, level H_ab / H_ba (negative: wrong sign),
    error relative to both.
    """

    a: Annotated[Texts, "channels"]
    b: Annotated[Texts, "channels"]
    frac: Annotated[Array, "channels"]
    level: Annotated[Array, "channels"]
    error: Annotated[Array, "channels"]


@dataclass(frozen=True)
class Tones:
    """Tones in records of responses (t,): multiple: of the stated speed, at speed_hz, 0 where none was
    stated; kurtosis of the complex amplitude, 1 for a tone, 2 for noise; share of the power of all channels.
    """

    frequency_hz: Annotated[Array, "frequency_hz"]
    width_hz: Annotated[Array, "frequency_hz"]
    kurtosis: Annotated[Array, "frequency_hz"]
    share: Annotated[Array, "frequency_hz"]
    multiple: Annotated[NDArray[np.int_], "frequency_hz"]
    speed_hz: Annotated[Array, "frequency_hz"]


@dataclass(frozen=True)
class ShapeScaling:
    """Modal masses (m,), kg, of shapes whose largest component is 1, NaN where reason (m,) says why it is not
    known, and their standard deviations.

    method: "FRFs" or "added mass", of the file source; partner_hz (m,): the mode's frequency there, NaN where
    it has none; masses added_kg (k,) at nodes added_node (k,).
    """

    method: str
    source: str
    modal_mass_kg: Annotated[Array, "mode"]
    modal_mass_std_kg: Annotated[Array, "mode"]
    partner_hz: Annotated[Array, "mode"]
    reason: Annotated[Texts, "mode"]
    added_node: Annotated[NDArray[np.int_], "added"]
    added_kg: Annotated[Array, "added"]


@dataclass(frozen=True)
class OutputOnly:
    """What is particular to modes from responses alone: seconds of records in all, blocks that were left out
    one by one, shape_std (m, channels), tones that were taken out; teeth of the cutter, 0 where not stated;
    scaling: None where nothing was given to scale shapes by.
    """

    seconds: float
    blocks: int
    shape_std: Annotated[Array, "mode channel"]
    tones: Tones
    teeth: int
    scaling: ShapeScaling | None = None


@dataclass(frozen=True)
class SetupPoles:
    """Modes (m,) of a measurement in several setups (k,): frequency_hz without moved sensors; own_hz,
    own_damping_ratio (m, k): in each setup, NaN where it does not show the mode; expected_hz (m, k): with the
    mass of its sensors, NaN where no sensor was moved.

    agree: whether poles do; together: whether all FRFs were analysed at once; unexplained: part of the
    differences that the mass of moved sensors leaves, median of modes; sensor_kg: of a moved sensor, NaN
    where it is not known, and its standard deviation.
    """

    setup: Annotated[Texts, "setup"]
    frequency_hz: Annotated[Array, "frequency_hz"]
    own_hz: Annotated[Array, "frequency_hz setup"]
    own_damping_ratio: Annotated[Array, "frequency_hz setup"]
    expected_hz: Annotated[Array, "frequency_hz setup"]
    agree: bool
    together: bool
    unexplained: float
    sensor_kg: float
    sensor_std_kg: float


@dataclass(frozen=True)
class AnalysedMeasurement:
    """One measurement: its modes and all that tells how good they are.

    output_only: None where forces were measured; where not, frf has half spectra, whose inputs are reference
    responses, and shapes have a largest component of 1.
    posture_deg is empty where no robot is known; total_error: RMS over all FRFs of measured minus rebuilt,
    over measured; frf: `fitted` are the FRFs rebuilt from the modes; geometry and shapes (m, points, 3), in
    its axes, NaN at points that were not measured; parts: of the band, that were analysed apart; setups: None
    where all was measured at once.
    """

    name: str
    file: str
    sha256: str
    posture_deg: Annotated[Array, "joint"]
    estimator: str
    highest_order: int
    total_error: float
    modes: ModeTable
    rejected: RejectedPoles
    diagram: StabilisationDiagram
    reciprocity: Reciprocity
    frf: FrfComparison
    geometry: Geometry | None
    shapes: Annotated[Complex | None, "mode point axis"]
    parts: int = 1
    output_only: OutputOnly | None = None
    setups: SetupPoles | None = None


@dataclass(frozen=True, kw_only=True)
class ModesResult(Header):
    """A whole run of `identify modes`; verdict and notes are sentences."""

    KIND: ClassVar[str] = "modes"
    measurements: dict[str, AnalysedMeasurement]

    @property
    def found(self) -> int:
        """Modes of all measurements together."""
        return sum(len(m.modes.frequency_hz) for m in self.measurements.values())

    @property
    def noun(self) -> Noun:
        """What was analysed, in words: FRFs, or half spectra where no force was measured."""
        return next(iter(self.measurements.values())).frf.noun if self.measurements else FRF

    @property
    def rebuilt(self) -> bool:
        """Whether there are modes, and they give back the FRFs of every measurement."""
        return self.found > 0 and all(m.total_error < FAILED_REBUILD for m in self.measurements.values())

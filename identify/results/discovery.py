"""The result of a discovery as it is kept in its HDF5 file (layout and writer: `identify.results.file`)."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, ClassVar

import numpy as np
from numpy.typing import NDArray

from identify.core import binary_input
from identify.core.arrays import Array, Texts
from identify.core.errors import InputError
from identify.results import file
from identify.results.curves import CurveTable, PlaceTable
from identify.results.fit import FitResult
from identify.results.header import KeyedHeader

_NO_PLACES = PlaceTable((), np.zeros(0), np.zeros(0, dtype=int))


@dataclass(frozen=True)
class MarkTable:
    """Where added effects sit at the posture of the first measurement (n), in the base's axes: sentence of
    the effect, place (n, 3), m, and direction (n, 3), NaN where it has none.
    """

    sentence: Annotated[Texts, "mark"]
    at_m: Annotated[Array, "mark axis"]
    along: Annotated[Array, "mark axis"]


_NO_MARKS = MarkTable((), np.zeros((0, 3)), np.zeros((0, 3)))
_FORMERLY = {"log_odds": ("evidence", 0.5)}
"""Files of old hold a difference of an information criterion, which is twice the log odds."""


@dataclass(frozen=True)
class OptionTable:
    """What was tried in a step (n), best first; gap after refitting on fitted and on other data (NaN: not
    looked at).

    parameters: how many it adds; log_odds: for it over the model without it, NaN where a look at few
    lines was enough; verdict: a phrase.
    """

    FORMERLY: ClassVar[dict[str, tuple[str, float]]] = _FORMERLY
    sentence: Annotated[Texts, "sentence"]
    kind: Annotated[Texts, "sentence"]
    gap: Annotated[Array, "sentence"]
    gap_validation: Annotated[Array, "sentence"]
    parameters: Annotated[NDArray[np.int_], "sentence"]
    log_odds: Annotated[Array, "sentence"]
    verdict: Annotated[Texts, "sentence"]


@dataclass(frozen=True)
class PartTable:
    """The gap by part of the fitted data (n): kind (`band`, `point`, ...), name, gap, share of all that is
    above noise; frequency of a band's lower end or a mode, NaN of others, none in older files.
    """

    kind: Annotated[Texts, "part"]
    name: Annotated[Texts, "part"]
    gap: Annotated[Array, "part"]
    share: Annotated[Array, "part"]
    frequency_hz: Annotated[Array, "part"] = field(default_factory=lambda: np.zeros(0))


@dataclass(frozen=True)
class GapByBand:
    """RMS residual over noise (measurements, bands, channels), NaN where nothing was measured; bands_hz
    (bands + 1,).
    """

    measurements: Annotated[Texts, "measurements"]
    bands_hz: Annotated[Array, "edge"]
    channels: Annotated[Texts, "channels"]
    gap: Annotated[Array, "measurements band channels"]


@dataclass(frozen=True)
class StepResult:
    """One turn of the loop: the model it began with (effects beyond the study's), where that disagreed, what
    was tried, what was decided.

    best: sentence of the best candidate, empty where none was supported; kept: whether it is in the final
    model; alike: what the data cannot tell from it; advice: the measurement that would.
    """

    model: Annotated[Texts, "effect"]
    gap: float
    gap_validation: float
    where: str
    parts: PartTable
    options: OptionTable
    best: str
    kept: bool
    alike: Annotated[Texts, "rival"]
    advice: str
    decision: str
    places: PlaceTable = _NO_PLACES


@dataclass(frozen=True)
class AddedEffects:
    """The effects added (n), the most important first: sentence, kind, entry of the config (JSON), name with
    its numbers, gaps after adding it.

    parameters: the names of its parameters, with commas between them; probability: that it is there, and
    neither nothing nor one of its rivals in its place; gap_without: if it alone is taken away, nothing
    refitted, on few lines of the fitted data, or on data not fitted where a gap stays.
    """

    FORMERLY: ClassVar[dict[str, tuple[str, float]]] = _FORMERLY
    sentence: Annotated[Texts, "sentence"]
    kind: Annotated[Texts, "sentence"]
    config: Annotated[Texts, "sentence"]
    named: Annotated[Texts, "sentence"]
    parameters: Annotated[Texts, "sentence"]
    log_odds: Annotated[Array, "sentence"]
    gap: Annotated[Array, "sentence"]
    gap_validation: Annotated[Array, "sentence"]
    probability: Annotated[Array, "sentence"] = field(default_factory=lambda: np.zeros(0))
    gap_without: Annotated[Array, "sentence"] = field(default_factory=lambda: np.zeros(0))


@dataclass(frozen=True, kw_only=True)
class DiscoveryResult(KeyedHeader):
    """A whole run of `identify discover`; before and after: the study's model and the final one, as fits.

    elsewhere: which data were not fitted and judged with; map_before, map_after: the gap by band and channel;
    curves: dynamic stiffnesses as measured; marks: where the added effects sit; written: name of the new
    config, empty where there is none.
    """

    KIND: ClassVar[str] = "discovery"
    elsewhere: str
    added: AddedEffects
    steps: dict[str, StepResult]
    map_before: GapByBand
    map_after: GapByBand
    before: FitResult
    after: FitResult
    curves: dict[str, CurveTable] = field(default_factory=dict)
    marks: MarkTable = _NO_MARKS
    written: str = ""


def fit_of(path: Path) -> FitResult:
    """The fit in a file, or the final model of a discovery; InputError for a file that is neither.

    A fit beside a discovery of the same study has one more note: that a better model is there.
    """
    if file.kind_of(path) == DiscoveryResult.KIND:
        return file.read(path, DiscoveryResult).after
    fit = file.read(path, FitResult)
    beside = path.with_name(f"{path.stem}_discovery.h5")
    found = _found(beside, fit)
    if not found:
        return fit
    lacks = f"`identify discover` found what is missing from this model ({'; '.join(found)})"
    return replace(fit, notes=(*fit.notes, f"{lacks}: {beside} has the model with it"))


def _found(path: Path, fit: FitResult) -> Texts:
    """What a discovery of the study of a fit added, if that is what a file holds."""
    study = "provenance/config_sha256"
    try:
        held = binary_input.read_hdf5(path, ["kind", study, "added/sentence"]).members
    except InputError:
        return ()
    same = held.get("kind") == DiscoveryResult.KIND and held.get(study) == fit.provenance.config_sha256
    added = held.get("added/sentence")
    return added if same and isinstance(added, tuple) else ()

"""What a measurement of a study is read from: a file of FRFs, several repeats of it, or time histories to
estimate FRFs from.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator

from identify.core.errors import InputError
from identify.measured.chirp import Chirp, frf_from_chirp
from identify.measured.estimators import Method, frf_from_impacts, frf_from_random
from identify.measured.frf_records import FrfFileOptions
from identify.measured.frf_set import FrfSet
from identify.measured.held import unheld
from identify.measured.hits import Hits, beside, cut
from identify.measured.loaders import load_frf_set, load_time_history
from identify.measured.local_polynomial import frf_local_polynomial
from identify.measured.log_file import in_blocks, read_log
from identify.measured.noise import mean_of_repeats, noise_std_from_repeats
from identify.measured.periodic import frf_from_periods
from identify.measured.time_history import TimeHistory
from identify.measured.units import Kind


class Estimation(BaseModel):
    """How FRFs are estimated from time histories; an exponential window is `window_decay_per_s` of the
    measurement.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)
    excitation: Literal["impacts", "random", "broadband", "chirp"] = Field(
        "impacts",
        description=(
            "`impacts`: a block per hit; `random`: continuous records, averaged; `broadband`: continuous"
            " records by the local polynomial method, or by their period, with their noise; `chirp`: a"
            " rotating offset mass"
        ),
    )
    method: Method = Field("h1", description="h1: noise on responses; h2: on forces; hv: on both")
    force_window_s: float | None = Field(
        None, gt=0, description="impacts: the force is zero behind this time"
    )
    hits: Hits | None = Field(
        None, description="impacts: how one long record is cut; default: a block per hit in the file"
    )
    segment_s: float = Field(2.0, gt=0, description="random: length of the segments, s")
    overlap: float = Field(0.5, ge=0, lt=1, description="random: share by which segments overlap")
    order: int = Field(2, ge=1, le=6, description="broadband: order of the local polynomials")
    held: bool = Field(
        False,
        description="broadband: forces or torques are constant from sample to sample, as a controller"
        " commands them",
    )
    period_s: float | None = Field(
        None, gt=0, description="broadband: period of an excitation that repeats itself, s"
    )
    signals: dict[str, str] | None = Field(
        None,
        min_length=1,
        description="broadband, impacts with `hits`: where the signals of a log stand:"
        " {'joint2:motor [N m]': name}; names as in records of motion, with [:,1] for a column; `time_s` for"
        " the times",
    )
    sample_rate_hz: float | None = Field(
        None,
        gt=0,
        description="with `signals`: samples a second of a log without times, or to which it is interpolated",
    )
    chirp: Chirp | None = Field(
        None, description="chirp: the offset mass, its channels and where the force is taken from"
    )
    units: dict[Kind, str] = Field(
        {}, description="units that the file leaves open, such as {acceleration: g, force: N}"
    )

    @model_validator(mode="after")
    def _chirp_is_described(self) -> Estimation:
        if (self.excitation == "chirp") != (self.chirp is not None):
            raise ValueError("`excitation: chirp` and the key `chirp` go together")
        return self

    @model_validator(mode="after")
    def _of_its_excitation(self) -> Estimation:
        """Keys of another excitation, which would do nothing, are refused."""
        own = {
            "impacts": {"method", "force_window_s", "hits", "signals", "sample_rate_hz"},
            "random": {"method", "segment_s", "overlap"},
            "broadband": {"order", "held", "period_s", "signals", "sample_rate_hz"},
            "chirp": {"chirp"},
        }
        idle = sorted(self.model_fields_set - own[self.excitation] - {"excitation", "units"})
        if idle:
            raise ValueError(f"`{idle[0]}` has no meaning with `excitation: {self.excitation}`: leave it out")
        if self.period_s is not None and "order" in self.model_fields_set:
            raise ValueError("`order` has no meaning with `period_s`: leave it out")
        if self.excitation == "impacts" and self.signals is not None and self.hits is None:
            raise ValueError("`signals` of impacts are those of one long record: say by `hits` how it is cut")
        if self.sample_rate_hz is not None and self.signals is None:
            raise ValueError("`sample_rate_hz` has no meaning without `signals`: leave it out")
        return self


def read_source(
    paths: Sequence[Path | Sequence[Path]], options: FrfFileOptions, estimation: Estimation | None
) -> FrfSet:
    """The FRFs of one measurement; of several repeats of it, the mean, with its noise from their scatter, or
    of continuous records one estimate by all.  paths: of each repeat its file, folder or pattern, or a list
    of them.  InputError as the loaders.
    """
    if estimation is not None and estimation.excitation == "broadband":
        history = in_blocks([read_history(_single(path), options, estimation) for path in paths])
        if estimation.period_s is not None:
            found = frf_from_periods(history, estimation.period_s)
        else:
            found = frf_local_polynomial(history, estimation.order)
        return unheld(found, history.sample_rate_hz) if estimation.held else found
    if len(paths) == 1:
        return _read_one(paths[0], options, estimation)
    sets = [_read_one(path, options, estimation) for path in paths]
    return replace(mean_of_repeats(sets), noise=noise_std_from_repeats(sets))


def _read_one(path: Path | Sequence[Path], options: FrfFileOptions, estimation: Estimation | None) -> FrfSet:
    if estimation is None:
        return load_frf_set(path, options)
    history = read_history(_single(path), options, estimation)
    if estimation.chirp is not None:
        return frf_from_chirp(history, estimation.chirp)
    if estimation.excitation == "random":
        return frf_from_random(history, estimation.segment_s, estimation.overlap, estimation.method)
    told = estimation.method, estimation.force_window_s, options.window_decay_per_s or 0.0
    if estimation.hits is None:
        return frf_from_impacts(history, *told)
    return beside([frf_from_impacts(one, *told) for one in cut(history, estimation.hits)])


def _single(path: Path | Sequence[Path]) -> Path:
    """The only file of a measurement; InputError where there are several."""
    if not isinstance(path, Path):
        raise InputError(str(path[0]), "several files beside `estimate`", "one file with all blocks")
    return path


def read_history(path: Path, options: FrfFileOptions, estimation: Estimation) -> TimeHistory:
    """The time records that FRFs are estimated from; InputError as `load_time_history` and `read_log`."""
    if estimation.signals is not None:
        return read_log(path, estimation.signals, estimation.sample_rate_hz)
    return load_time_history(path, dict(estimation.units), options.format)

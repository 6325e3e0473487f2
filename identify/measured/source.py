"""What a measurement of a study is read from: a file of FRFs, several repeats of it, or time histories to
estimate FRFs from.

FRFs from samples of a force or torque that is held from one sample to the next, as controllers command it.

Held over T, a force drives H through (1 - e^-sT) / (sT), and what it has about multiples of the sample rate
moves the structure too, where samples fold it back.  Up there a motor feels its own inertia J alone: of
1 / (J s^2), 1 / (J s) and 1 / J the samples' answer is known exactly, and so are the images in it,

    T^2 (z + 1) / (2 J (z - 1)^2),   T / (J (z - 1)),   1 / J,   z = e^sT,

less what is driven.  What is not at the motor itself moves far less at such frequencies: it has no images.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np
from pydantic import Field, model_validator

from identify.core.arrays import Array, Complex
from identify.core.config import Settings
from identify.core.errors import InputError
from identify.measured.chirp import Chirp, frf_from_chirp
from identify.measured.estimators import Method, frf_from_impacts, frf_from_random
from identify.measured.frf_records import FrfFileOptions
from identify.measured.frf_set import POWER, FrfSet, Quantity
from identify.measured.hits import Hits, beside, cut
from identify.measured.loaders import load_frf_set, load_time_history
from identify.measured.log_file import in_blocks, read_log
from identify.measured.noise import mean_of_repeats, noise_std_from_repeats
from identify.measured.periodic import frf_from_periods, frf_local_polynomial
from identify.measured.time_history import TimeHistory
from identify.measured.units import Kind

_SURE, _PART = 0.1, 10
"""Relative noise up to which a line tells the inertia; of these lines, the highest tenth does."""


class Estimation(Settings):
    """How FRFs are estimated from time histories; an exponential window is `window_decay_per_s` of the
    measurement.
    """

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


def unheld(frf_set: FrfSet, rate_hz: float) -> FrfSet:
    """The set without what the hold between samples, so many a second, made of it."""
    st = frf_set.s / rate_hz
    through = (1 - np.exp(-st)) / st
    images = _of_inertia(st, frf_set.quantity) - through
    frf = frf_set.frf.copy()
    for i, output in enumerate(frf_set.outputs):
        for j, force in enumerate(frf_set.inputs):
            if output.motor is not None and output.motor == force.motor:
                sign = output.sign * force.sign
                rest = frf_set.s ** (POWER[frf_set.quantity] - 2)
                noise = None if frf_set.noise is None else frf_set.noise[:, i, j]
                inverse = _inverse_inertia(
                    sign * frf[:, i, j] / (images + through) / rest, noise, frf[:, i, j]
                )
                frf[:, i, j] -= sign * inverse * images * rest
    size = np.abs(through)[:, None, None]
    noise = None if frf_set.noise is None else frf_set.noise / size
    return replace(frf_set, frf=frf / through[:, None, None], noise=noise)


def _of_inertia(st: Complex, quantity: Quantity) -> Complex:
    """(lines,): the samples' answer of an inertia over its own."""
    z = np.exp(st)
    if quantity == "receptance":
        return np.asarray(st**2 * (z + 1) / (2 * (z - 1) ** 2))
    return np.asarray(st / (z - 1)) if quantity == "mobility" else np.ones_like(st)


def _inverse_inertia(scaled: Complex, noise: Array | None, measured: Complex) -> float:
    """1 / J by FRFs over those of a unit inertia (lines,), where they are highest and sure; 0 of none."""
    sure = np.ones(len(scaled), dtype=bool) if noise is None else noise < _SURE * np.abs(measured)
    values = scaled.real[sure]
    return max(0.0, float(np.median(values[-max(1, len(values) // _PART) :]))) if values.size else 0.0

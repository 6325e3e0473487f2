"""What every FRF file comes down to: one record per output and input, and how records and options become an
`FrfSet`.

Readers (`uff`, `delimited`, `array_files`) only say what is in a file; whatever all formats have in common is
checked here, once: units asked for where a file is silent and refused where file and option disagree, doubled
pairs, NaN, channel names.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import isclose
from typing import Annotated, Any, TypeVar

import numpy as np
from pydantic import BeforeValidator, Field

from identify.core.arrays import Array, Complex
from identify.core.asked import key
from identify.core.config import Settings
from identify.core.errors import InputError
from identify.measured.causality import is_conjugated
from identify.measured.channel import Channel
from identify.measured.frf_set import FrfSet, Quantity
from identify.measured.units import FrfUnit, parse_frf_unit

_Number = TypeVar("_Number", int, float)
_MOST, _LARGEST = 1e9, 1e30
"""Most averages, and highest frequency (Hz), of any measurement; largest FRF in SI units, 1 over it the
smallest."""


TEXT = ("columns", "names", "frequency_start_hz", "frequency_step_hz")
"""Options of files that do not say themselves what is in them."""


class WindowEnd(Settings):
    """An exponential window as analysers state it: what it leaves at the end of the records."""

    percent: float = Field(gt=0, lt=100, description="of what stands at the beginning")
    at_s: float = Field(gt=0, description="length of the records, s")

    @property
    def decay_per_s(self) -> float:
        """sigma of exp(-sigma t)."""
        return float(-np.log(self.percent / 100) / self.at_s)


def _decay(data: Any) -> Any:
    return WindowEnd.model_validate(data).decay_per_s if isinstance(data, dict) else data


class FrfFileOptions(Settings):
    """What the user says about an FRF file; None or empty means: as the file says."""

    format: str | None = Field(
        None, description="file format: uff, csv, hdf5, mat; without it the suffix decides"
    )
    quantity: Quantity | None = Field(None, description="receptance, mobility or accelerance")
    unit: str | None = Field(
        None, description="unit of the FRFs, such as m/s^2/N or g/N, where the file does not say"
    )
    averages: int | None = Field(None, ge=1, description="averages behind each FRF and coherence")
    window_decay_per_s: Annotated[float | None, BeforeValidator(_decay)] = Field(
        None,
        ge=0,
        description="decay sigma of exp(-sigma t) put on force and response; or {percent: 1, at_s: 2}: what"
        " the window leaves at the end of records of that length",
    )
    record_s: float | None = Field(
        None,
        gt=0,
        description="length of the records of impacts, s; default: one over the spacing of their lines, or"
        " the multiple of it that fits the data",
    )
    outputs: list[str] | None = Field(
        None, description="output channels in the order of an array file that does not name them"
    )
    inputs: list[str] | None = Field(
        None, description="input channels in the order of an array file that does not name them"
    )
    variables: dict[str, str] = Field(
        {}, description="where an array file keeps frequency_hz, frf, coherence or a pair such as 12:+Z/1:+X"
    )
    columns: list[str] | None = Field(
        None,
        min_length=1,
        description="names of the columns of a text file without a header line, or in place of it:"
        " frequency_hz, `12:+Z/1:+X real`, ... imag, magnitude, phase_deg, coherence; `-`: not read",
    )
    names: str | None = Field(
        None,
        description="how the name of each file tells the channels of its FRF: FRF_{output}_{input}, or pieces"
        " of them such as P{output_node}{output_direction}",
    )
    frequency_start_hz: float | None = Field(
        None, ge=0, description="first frequency of a file without a column of them, Hz; default: 0"
    )
    frequency_step_hz: float | None = Field(None, gt=0, description="step of its frequencies, Hz")
    channels: dict[str, str] = Field(
        {}, description="new names for channels of the file, such as {'14:+X': '12:-Z'}"
    )


@dataclass(frozen=True)
class FrfRecord:
    """One measured FRF as it stands in a file: values (L,) in `unit`, coherence (L,) or None.

    unit is None where the file does not say it for this pair; quantity may be known without it (type codes);
    where names the place.
    """

    output: Channel
    input: Channel
    values: Complex
    where: str
    unit: FrfUnit | None = None
    quantity: Quantity | None = None
    coherence: Array | None = None

    def lines(self, some: slice) -> FrfRecord:
        """The record on some of its lines."""
        coherence = None if self.coherence is None else self.coherence[some]
        return replace(self, values=self.values[some], coherence=coherence)


@dataclass(frozen=True)
class FrfRecords:
    """The FRFs of one file on their common frequency_hz (L,); unit, averages, window decay and length of
    record where the file states them for all.

    unit is that of a translation over a force; a rotation is then in rad, a moment in N m, and only SI may be
    meant.  notes: sentences on what of the file was not read.
    """

    frequency_hz: Array
    records: list[FrfRecord]
    unit: FrfUnit | None = None
    averages: int | None = None
    window_decay_per_s: float | None = None
    record_s: float | None = None
    notes: tuple[str, ...] = ()


def to_frf_set(file: FrfRecords, options: FrfFileOptions, source: str, sha256: str) -> FrfSet:
    """The FrfSet in SI units, outputs and inputs in the order of the file; InputError wherever data or
    options do not hold together.
    """
    if not file.records:
        raise InputError(source, "no FRF in the file", "at least one FRF")
    file = _without_dc(file)
    _check_frequency(file.frequency_hz, source)
    _check_stated(file, source)
    records = _rename(file.records, options, source)
    quantity, factors = _units(replace(file, records=records), options, source)
    pairs = _pairs(records, factors)
    outputs, inputs = list(dict.fromkeys(i for i, _ in pairs)), list(dict.fromkeys(j for _, j in pairs))
    shape = (len(file.frequency_hz), len(outputs), len(inputs))
    frf, coherence = np.full(shape, np.nan, complex), np.full(shape, np.nan)
    for (output, input_), record in pairs.items():
        at = (slice(None), outputs.index(output), inputs.index(input_))
        frf[at] = record.values
        if record.coherence is not None:
            coherence[at] = _checked_coherence(record)
    _check_complex(frf, source)
    frf, notes = _forward(file.frequency_hz, frf)
    return FrfSet(
        frequency_hz=file.frequency_hz,
        frf=frf,
        outputs=tuple(outputs),
        inputs=tuple(inputs),
        quantity=quantity,
        coherence=None if np.isnan(coherence).all() else coherence,
        averages=_agreed("averages", file.averages, options.averages, source),
        window_decay_per_s=_agreed(
            "window_decay_per_s", file.window_decay_per_s, options.window_decay_per_s, source
        )
        or 0.0,
        record_s=_agreed("record_s", file.record_s, options.record_s, source),
        source=source,
        sha256=sha256,
        notes=(*file.notes, *notes),
    )


def _check_complex(frf: Complex, source: str) -> None:
    """Raise an InputError for FRFs that are all real: of magnitudes alone there are no modes."""
    known = frf[~np.isnan(frf)]
    if len(frf) > 1 and known.real.any() and not known.imag.any():
        raise InputError(source, "FRFs that are real: magnitudes alone?", "complex values", "export them so")


def _forward(frequency_hz: Array, frf: Complex) -> tuple[Complex, tuple[str, ...]]:
    """The FRFs with the phase that a structure has, and what is to be said where they had the other one."""
    pairs = frf[frequency_hz > 0].reshape(np.count_nonzero(frequency_hz > 0), -1)
    if not is_conjugated(frequency_hz[frequency_hz > 0], pairs[:, np.isfinite(pairs).all(axis=0)]):
        return frf, ()
    said = (
        "the phases turn the wrong way, as of the complex conjugate (e^-jwt): the responses would come before"
        " the force; all phases were turned"
    )
    return frf.conj(), (said,)


def check_named(options: FrfFileOptions, source: str) -> None:
    """Refuse what is said of arrays beside a file that names what it has."""
    if options.variables:
        found = "names of arrays (`variables`, `--variable`) beside a file that has none"
        raise InputError(source, found, "a .mat or .h5 file", "leave them out")


def _check_stated(file: FrfRecords, source: str) -> None:
    """Raise an InputError for a window decay, a length or a number of averages that a config could not say
    either.
    """
    decay, averages, record = file.window_decay_per_s, file.averages, file.record_s
    if decay is not None and not 0 <= decay < np.inf:
        raise InputError(f"{source}, window_decay_per_s", f"{decay:g}", "a finite number of 0 or more, 1/s")
    if record is not None and not 0 < record < np.inf:
        raise InputError(f"{source}, record_s", f"{record:g}", "a finite number above 0, s")
    if averages is not None and not 1 <= averages < _MOST:
        raise InputError(f"{source}, averages", f"{averages}", "a whole number of 1 or more")


def _without_dc(file: FrfRecords) -> FrfRecords:
    """The records without the line at 0 Hz, and a note, where one of them is no number there: as a receptance
    is that was made from an acceleration.
    """
    at_zero = [v[:1] for r in file.records for v in (r.values, r.coherence) if v is not None]
    if file.frequency_hz[:1].any() or all(np.isfinite(value).all() for value in at_zero):
        return file
    records = [record.lines(slice(1, None)) for record in file.records]
    notes = (*file.notes, "the line at 0 Hz was left out: not all FRFs are numbers there")
    return replace(file, frequency_hz=file.frequency_hz[1:], records=records, notes=notes)


def _check_frequency(frequency_hz: Array, source: str) -> None:
    """At least one line; finite, rising, not negative."""
    if len(frequency_hz) == 0:
        raise InputError(source, "no frequency line", "at least one")
    if not np.isfinite(frequency_hz).all() or frequency_hz[0] < 0 or np.any(np.diff(frequency_hz) <= 0):
        raise InputError(
            source, "frequencies that are negative, not finite or not rising", "rising frequencies in Hz"
        )
    if frequency_hz[-1] > _MOST:
        raise InputError(source, f"frequencies up to {frequency_hz[-1]:g} Hz", f"at most {_MOST:g} Hz")


def _rename(records: list[FrfRecord], options: FrfFileOptions, source: str) -> list[FrfRecord]:
    """Records under the channel names that the user gave."""
    where = f"{source}, key channels"
    names = {Channel.parse(old, where): Channel.parse(new, where) for old, new in options.channels.items()}
    known = {channel for record in records for channel in (record.output, record.input)}
    for channel in names:
        if channel not in known:
            raise InputError(
                where,
                f"channel {channel} is not in the file",
                "one of " + ", ".join(str(c) for c in sorted(known)),
            )
    return [
        replace(r, output=names.get(r.output, r.output), input=names.get(r.input, r.input)) for r in records
    ]


def _units(file: FrfRecords, options: FrfFileOptions, source: str) -> tuple[Quantity, list[float]]:
    """The one quantity of all records, and each record's factor to SI."""
    asked = None if options.unit is None else parse_frf_unit(options.unit, f"{source}, key unit")
    if asked is not None and file.unit is not None and not _same(asked, file.unit):
        raise _disagreement(source, file.unit, asked)
    units = [_unit(record, file.unit or asked, options) for record in file.records]
    quantities = {unit.quantity: record.where for record, unit in zip(file.records, units, strict=True)}
    if len(quantities) > 1:
        found = " and ".join(f"{quantity} ({where})" for quantity, where in quantities.items())
        raise InputError(
            source,
            f"FRFs of different quantities: {found}",
            "one quantity in a set",
            "export them as one quantity",
        )
    return units[0].quantity, [unit.factor for unit in units]


def _unit(record: FrfRecord, asked: FrfUnit | None, options: FrfFileOptions) -> FrfUnit:
    """The unit of one record, from the file or else from the option; InputError where they disagree or
    neither speaks.
    """
    turns = (abs(record.output.direction) > 3, abs(record.input.direction) > 3)
    unit = record.unit
    if unit is None:
        said = f"the file gives no unit for its {record.quantity or 'FRFs'}"
        if asked is None:
            raise InputError(record.where, said, "a unit", f"add {key('unit', 'm/s^2/N')}")
        if any(turns) and asked.factor != 1:
            found = f"{said} and {record.output}/{record.input} is rotational"
            raise InputError(record.where, found, "unit labels in the file, or SI units throughout")
        unit = replace(asked, rotation=turns[0], moment=turns[1])
    elif (unit.rotation, unit.moment) != turns:
        found = f"a unit of {_words(unit.rotation, unit.moment)} at {record.output}/{record.input}"
        raise InputError(
            record.where, found, f"one of {_words(*turns)}", "correct the direction or the unit in the file"
        )
    elif asked is not None and (asked.rotation, asked.moment) == turns and not _same(asked, unit):
        raise _disagreement(record.where, unit, asked)
    _check_quantity(record, unit, options)
    return unit


def _check_quantity(record: FrfRecord, unit: FrfUnit, options: FrfFileOptions) -> None:
    """Raise an InputError where file or option name another quantity than the unit."""
    for says, quantity in (
        ("the file's type codes say", record.quantity),
        (f"{key('quantity')} says", options.quantity),
    ):
        if quantity is not None and quantity != unit.quantity:
            raise InputError(
                record.where,
                f"{says} {quantity}, the unit says {unit.quantity}",
                "no disagreement",
                "correct the wrong one",
            )


def _disagreement(where: str, stated: FrfUnit, asked: FrfUnit) -> InputError:
    """File and key unit mean different things."""
    found = (
        f"the file says {stated.quantity} with factor {stated.factor:g} to SI, {key('unit')} says"
        f" {asked.quantity} with {asked.factor:g}"
    )
    return InputError(where, found, "no disagreement", f"remove {key('unit')} or correct it")


def _same(a: FrfUnit, b: FrfUnit) -> bool:
    """Whether two units mean the same."""
    return a.quantity == b.quantity and isclose(a.factor, b.factor, rel_tol=1e-6)


def _words(rotation: bool, moment: bool) -> str:
    """Response over excitation in words."""
    return f"{'rotation' if rotation else 'translation'} over {'moment' if moment else 'force'}"


def _pairs(records: list[FrfRecord], factors: list[float]) -> dict[tuple[Channel, Channel], FrfRecord]:
    """Records in SI by (output, input); a pair that comes twice must be the same twice."""
    pairs: dict[tuple[Channel, Channel], FrfRecord] = {}
    for record, factor in zip(records, factors, strict=True):
        if not np.isfinite(record.values).all():
            line = int(np.argmin(np.isfinite(record.values))) + 1
            raise InputError(
                record.where,
                f"FRF {record.output}/{record.input} is not finite in line {line}",
                "numbers",
                "export it again",
            )
        scaled = replace(record, values=factor * record.values)
        largest = float(np.abs(record.values).max(initial=0.0)) * factor
        if largest and not 1 / _LARGEST < largest < _LARGEST:
            found = f"FRF {record.output}/{record.input} of at most {largest:g} in SI units"
            raise InputError(
                record.where, found, f"between {1 / _LARGEST:g} and {_LARGEST:g}", "check its unit"
            )
        first = pairs.setdefault((record.output, record.input), scaled)
        if first is not scaled and not _identical(first, scaled):
            found = (
                f"FRF {record.output}/{record.input} stands there again with other values than in"
                f" {first.where}"
            )
            raise InputError(
                record.where,
                found,
                "each pair once",
                "rename a channel with the key channels of a study, or remove one of them",
            )
    return pairs


def _identical(a: FrfRecord, b: FrfRecord) -> bool:
    """Same values and same coherence."""
    same = a.coherence is b.coherence or (
        a.coherence is not None and b.coherence is not None and np.array_equal(a.coherence, b.coherence)
    )
    return same and np.array_equal(a.values, b.values)


def _checked_coherence(record: FrfRecord) -> Array:
    """The coherence, which lies between 0 and 1 but for rounding."""
    coherence = record.coherence
    assert coherence is not None
    bad = ~((coherence >= -1e-6) & (coherence <= 1 + 1e-6))
    if bad.any():
        found = (
            f"coherence {coherence[bad][0]:g} of {record.output}/{record.input} at line"
            f" {int(np.argmax(bad)) + 1}"
        )
        raise InputError(record.where, found, "0 to 1", "export the data again")
    return np.clip(coherence, 0.0, 1.0)


def _agreed(name: str, stated: _Number | None, asked: _Number | None, source: str) -> _Number | None:
    """The value that file and option agree on, or that either gives alone."""
    if stated is not None and asked is not None and not isclose(stated, asked, rel_tol=1e-6):
        found = f"the file says {name} = {stated:g}, {key(name)} says {asked:g}"
        raise InputError(source, found, "no disagreement", f"remove {key(name)} or correct it")
    return asked if stated is None else stated

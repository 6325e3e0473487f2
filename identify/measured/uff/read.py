"""Universal files (58, 58b) read as FRFs with their coherences, or as time histories.

Function type 4 is an FRF, 6 its coherence, 1 a time response; other functions and datasets are passed
over, and `FrfRecords.notes` says so.  Axis-unit labels say the unit, which the type code must not contradict;
where there is no label, dataset 164 says the units, and where there is none either, the user is asked.
"""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import replace
from math import pi
from pathlib import Path

import numpy as np

from identify.core.arrays import Array
from identify.core.errors import InputError
from identify.core.text import count
from identify.measured.channel import Channel
from identify.measured.common_lines import common_axis, common_lines
from identify.measured.frf_records import FrfFileOptions, FrfRecord, FrfRecords, check_named
from identify.measured.frf_set import Quantity
from identify.measured.time_history import Signal, Units, asked_unit, sample_rate
from identify.measured.uff.records import Axis, Record58, UffFile, read_records
from identify.measured.units import (
    QUANTITY_OF_KIND,
    Foreign,
    FrfUnit,
    Kind,
    SignalUnit,
    parse_frf_unit,
    parse_signal_unit,
    ratio,
)

_TIME, _FRF, _COHERENCE = 1, 4, 6
_KIND_OF_CODE: dict[int, Kind] = {
    8: "displacement",
    9: "force",
    11: "velocity",
    12: "acceleration",
    13: "force",
}
_OTHER_CODES = {2: "stress", 3: "strain", 5: "temperature", 6: "heat flux", 15: "pressure"}
_FUNCTIONS = {0: "general", 1: "time response", 2: "auto spectrum", 3: "cross spectrum", 9: "power spectrum"}
_ELSEWHERE = (15, 18, 55, 82, 151, 164, 2411, 2412, 2414, 2420)
"""Datasets of headers, units, geometry and shapes, which other commands read."""
_HERTZ = {"": 1.0, "hz": 1.0, "khz": 1e3, "1/s": 1.0, "rad/s": 1 / (2 * pi), "rpm": 1 / 60}
_SECONDS = {"": 1.0, "s": 1.0, "sec": 1.0, "ms": 1e-3}


def read_frf(path: Path, options: FrfFileOptions) -> FrfRecords:
    """The FRFs and coherences of a universal file; InputError as `read_records`, where axes differ, and where
    an FRF is not complex.

    Functions between a motion and a force at places of the structure; others, such as those of a microphone,
    are left out with a note, and lines that not all have, too.
    """
    check_named(options, str(path))
    file = read_records(path)
    if not any(record.function == _FRF for record in file.records):
        types = sorted({record.function for record in file.records})
        raise InputError(
            str(path), f"no FRF among the function types {types} of its datasets 58", "function type 4"
        )
    own, foreign = _own(file)
    frequency_hz, slices, notes = common_lines(
        [(record.where, _abscissa(record, 18, _HERTZ, "frequency")) for record in own]
    )
    own = [
        replace(record, x=record.x[some], values=record.values[some])
        for record, some in zip(own, slices, strict=True)
    ]
    coherences = _coherences(own)
    records = [_frf_record(record, file, coherences) for record in own if record.function == _FRF]
    return FrfRecords(frequency_hz, records, notes=(*foreign, *notes, *_left_out(file, own)))


def _own(file: UffFile) -> tuple[list[Record58], tuple[str, ...]]:
    """The FRFs and coherences of motion over force at places of a structure, and a sentence on each FRF that
    is something else; InputError where all are.
    """
    own: list[Record58] = []
    foreign: list[Foreign] = []
    for record in file.records:
        try:
            if record.function == _FRF:
                _unit(record, file)
            if record.function in (_FRF, _COHERENCE) and record.response and record.reference:
                own.append(record)
        except Foreign as error:
            foreign.append(error)
    if not any(record.function == _FRF for record in own):
        raise foreign[0]
    return own, tuple(f"{error.where.split(', ', 1)[-1]} was left out: {error.found}" for error in foreign)


def _left_out(file: UffFile, own: list[Record58]) -> tuple[str, ...]:
    """What of a file is no FRF and was passed over, in sentences."""
    functions = Counter(r.function for r in file.records if r.function not in (_FRF, _COHERENCE))
    datasets = Counter(number for number in file.others if number not in _ELSEWHERE)
    said = [
        f"{count(many, 'function')} of type {kind} ({_FUNCTIONS.get(kind, 'other')}) was not read:"
        " neither an FRF (4) nor a coherence (6)"
        for kind, many in functions.items()
    ]
    said += [f"{count(many, 'dataset')} of type {kind} was not read" for kind, many in datasets.items()]
    pairs = {r.ends for r in own if r.function == _FRF}
    alone = [r for r in own if r.function == _COHERENCE and r.ends not in pairs]
    said += [f"the coherence {r.response}/{r.reference} has no FRF and was not read" for r in alone]
    return tuple(said)


def read_time(path: Path, units: Units) -> tuple[float, list[Signal]]:
    """Sample rate (Hz) and time responses (function type 1) of a universal file; a signal that comes again is
    the next block.

    units says what files without labels leave open; InputError where it is silent too.
    """
    file = read_records(path)
    chosen = [record for record in file.records if record.function == _TIME]
    if not chosen:
        types = sorted({record.function for record in file.records})
        raise InputError(
            str(path),
            f"no time response among the function types {types} of its datasets 58",
            "function type 1",
        )
    time_s = common_axis(
        ((record.where, _abscissa(record, 17, _SECONDS, "time")) for record in chosen),
        "time",
        "export records of the same length, or leave this one out",
    )
    return sample_rate(time_s, str(path)), [_signal(record, file, units) for record in chosen]


def _abscissa(record: Record58, code: int, factors: dict[str, float], what: str) -> Array:
    """The abscissa in Hz or s, by its label or else its type code."""
    label = record.abscissa.unit.lower()
    if label not in factors or (not label and record.abscissa.code != code):
        found = (
            f"an abscissa with type code {record.abscissa.code} and unit {record.abscissa.unit or 'NONE'!r}"
        )
        raise InputError(
            record.where, found, f"{what} (code {code}) in one of " + ", ".join(filter(None, factors))
        )
    return factors[label] * record.x


def _coherences(records: list[Record58]) -> dict[tuple[Channel, Channel], Array]:
    """Coherence by (response, reference); one that comes twice must be the same twice."""
    coherences: dict[tuple[Channel, Channel], Array] = {}
    for record in records:
        if record.function == _COHERENCE:
            if np.any(record.values.imag):
                raise InputError(
                    record.where,
                    "a coherence with imaginary part",
                    "a real function",
                    "export the file again",
                )
            pair = (record.response, record.reference)
            values = coherences.setdefault(pair, record.values.real)
            if not np.array_equal(values, record.values.real):
                raise InputError(
                    record.where,
                    f"coherence {pair[0]}/{pair[1]} stands there again with other values",
                    "each pair once",
                )
    return coherences


def _frf_record(
    record: Record58, file: UffFile, coherences: dict[tuple[Channel, Channel], Array]
) -> FrfRecord:
    """One FRF with its unit and coherence, where it has them."""
    if not np.iscomplexobj(record.values):
        raise InputError(
            record.where,
            f"FRF {record.response}/{record.reference} is real",
            "a complex function",
            "export the file again",
        )
    unit, quantity = _unit(record, file)
    return FrfRecord(
        output=record.response,
        input=record.reference,
        values=record.values.astype(complex),
        where=record.where,
        unit=unit,
        quantity=quantity,
        coherence=coherences.get((record.response, record.reference)),
    )


def _unit(record: Record58, file: UffFile) -> tuple[FrfUnit | None, Quantity | None]:
    """Unit of an FRF, or what of its quantity is known without."""
    ordinate, denominator = record.ordinate, record.denominator
    if _is_ratio(ordinate.unit):
        own = re.escape(denominator.unit.strip("() "))
        if own and not re.search(rf"(?<![A-Za-z]){own}$", ordinate.unit.strip("() ")):
            found = f"unit {ordinate.unit!r} with the denominator {denominator.unit!r}"
            raise InputError(
                record.where, found, "a ratio and nothing, or a motion and a force", "export the file again"
            )
        unit = parse_frf_unit(ordinate.unit, record.where)
        _check_code(ordinate, unit.quantity, record.where)
        return unit, None
    response = _signal_unit(ordinate, record.response, file, record.where)
    force = _signal_unit(denominator, record.reference, file, record.where)
    if response is not None and ordinate.unit and response.kind in QUANTITY_OF_KIND:
        _check_code(ordinate, QUANTITY_OF_KIND[response.kind], record.where)
    if response is not None and force is not None:
        return ratio(response, force, record.where), None
    return None, QUANTITY_OF_KIND.get(
        response.kind if response is not None else _KIND_OF_CODE.get(ordinate.code, "force")
    )


def _check_code(ordinate: Axis, quantity: Quantity, where: str) -> None:
    """Raise an InputError where the type code of an ordinate says another motion than its unit."""
    said = QUANTITY_OF_KIND.get(_KIND_OF_CODE.get(ordinate.code, "force"))
    if said is not None and said != quantity:
        found = f"type code {ordinate.code} ({said}) with the unit {ordinate.unit!r} ({quantity})"
        raise InputError(where, found, "no disagreement", "correct the wrong one in the file")


def _is_ratio(label: str) -> bool:
    """Whether an ordinate label stands for numerator and denominator at once, such as g/N."""
    try:
        parse_frf_unit(label, "")
    except InputError:
        return False
    return True


def _signal_unit(axis: Axis, channel: Channel, file: UffFile, where: str) -> SignalUnit | None:
    """Unit from the label, else from type code and dataset 164, else None."""
    if axis.unit:
        return parse_signal_unit(axis.unit, where)
    kind = _KIND_OF_CODE.get(axis.code)
    if axis.code in _OTHER_CODES:
        found = f"type code {axis.code} ({_OTHER_CODES[axis.code]}), which is neither a motion nor a force"
        raise Foreign(where, found, "an FRF of a motion over a force")
    if kind is None or file.length is None or file.force is None:
        return None
    rotation = abs(channel.direction) > 3
    if kind == "force":
        return SignalUnit(kind, rotation, file.force * (file.length if rotation else 1.0))
    return SignalUnit(kind, rotation, 1.0 if rotation else file.length)


def _signal(record: Record58, file: UffFile, units: Units) -> Signal:
    """One block of one signal."""
    if np.iscomplexobj(record.values):
        raise InputError(
            record.where,
            f"time response {record.response} is complex",
            "a real function",
            "export the file again",
        )
    unit = _signal_unit(record.ordinate, record.response, file, record.where)
    if unit is None:
        unit = asked_unit(_KIND_OF_CODE.get(record.ordinate.code), units, record.where)
    return Signal(record.response, unit, record.values.real, record.where)

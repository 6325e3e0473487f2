"""Response records of a structure that works, from universal files (58), CSV, HDF5 and MATLAB.

Universal files and CSV are time histories as everywhere (`uff.read`, `delimited`).  Files of arrays keep
`responses` (samples, channels), `time_s` or `sample_rate_hz`, `outputs` (channels such as `12:+Z`) and
`unit`, one for all or one each, under these names or where `variables` says.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from identify.core.binary_input import read_hdf5, read_mat
from identify.core.errors import InputError
from identify.core.files import sha256_of
from identify.measured import mat
from identify.measured.array_files import Arrays, path_in
from identify.measured.channel import Channel
from identify.measured.frf_records import FrfFileOptions
from identify.measured.loaders import FORMAT_OF_SUFFIX, load_time_history
from identify.measured.time_history import Signal, TimeHistory, sample_rate, to_time_history
from identify.measured.units import SignalUnit, parse_signal_unit

NAMES = ("responses", "time_s", "sample_rate_hz", "outputs", "unit")


def load_responses(path: Path, file: FrfFileOptions) -> TimeHistory:
    """The signals of a file in SI units.

    file: of it unit, where the file does not say it, and for arrays variables and outputs.  InputError for an
    unknown format or unit, missing arrays, and options that do not apply.
    """
    form = file.format or FORMAT_OF_SUFFIX.get(path.suffix.lower())
    if form in ("hdf5", "mat"):
        return _of_arrays(path, form, file)
    for key in ("variables", "outputs"):
        if getattr(file, key):
            raise InputError(key, f"given for {path}", "only for files of arrays (.h5, .mat)", "leave it out")
    if file.unit is None:
        return load_time_history(path, format=file.format)
    if form == "csv":
        found, fix = f"the unit {file.unit} for columns that say theirs", "leave `--unit` out"
        raise InputError(str(path), found, "one of them", fix)
    return load_time_history(path, {parse_signal_unit(file.unit, "unit").kind: file.unit}, file.format)


def _of_arrays(path: Path, form: str, file: FrfFileOptions) -> TimeHistory:
    sha256 = sha256_of(path, "a measured file")
    unknown = sorted(set(file.variables) - set(NAMES))
    if unknown:
        raise InputError(f"{path}, key variables", f"unknown name {unknown[0]!r}", ", ".join(NAMES))
    whole, between = (read_mat, ".") if form == "mat" else (read_hdf5, "/")
    arrays = Arrays(_lookup(path, form, file), file, str(path), partial(whole, path), between)
    responses = _needed(arrays, "responses", "(samples, channels)")
    names = arrays.texts("outputs") or file.outputs
    if names is None:
        fix = "name them in the order of the columns: `--outputs 1:+Z,2:+Z`"
        raise InputError(str(path), "no outputs", "channels such as 12:+Z", fix)
    if responses.ndim != 2 or responses.shape[1] != len(names):
        fix = "bring it into this order, or correct `--outputs`"
        expected = f"(samples, {len(names)}), a column for each of {', '.join(names[:6])}"
        raise InputError(f"{path}, responses", f"shape {responses.shape}", expected, fix)
    rate = _rate(arrays, len(responses))
    signals = [
        Signal(Channel.parse(name, f"{path}, outputs"), unit, column.astype(float), f"{path}, {name}")
        for name, unit, column in zip(names, _units(arrays, len(names)), responses.T, strict=True)
    ]
    return to_time_history(rate, signals, str(path), sha256)


def _lookup(path: Path, form: str, file: FrfFileOptions) -> Any:
    if form == "mat":
        content = read_mat(path)
        return lambda name: mat.variable(content, name)
    return read_hdf5(path, [path_in(file.variables.get(name, name)) for name in NAMES]).value


def _needed(arrays: Arrays, name: str, what: str) -> NDArray[Any]:
    found = arrays.numbers(name)
    if found is None:
        fix = f"say where it is: `--variable {name}=data.{name[0]}`"
        raise InputError(arrays.where, f"no {name}", f"an array {what} under this name", fix)
    if found.dtype.kind == "c":
        raise InputError(f"{arrays.where}, {name}", "complex values", "real numbers")
    return found


def _rate(arrays: Arrays, samples: int) -> float:
    rate = arrays.number("sample_rate_hz")
    if rate is not None:
        if rate <= 0:
            raise InputError(f"{arrays.where}, sample_rate_hz", f"{rate:g}", "more than 0")
        return rate
    fix = "say where one of them is, such as `--variable time_s=t`"
    if arrays.value("time_s") is None:
        raise InputError(arrays.where, "neither time_s nor sample_rate_hz", "one of them", fix)
    time_s = _needed(arrays, "time_s", "(samples,)").ravel().astype(float)
    if len(time_s) != samples:
        raise InputError(f"{arrays.where}, time_s", f"{len(time_s)} times for {samples} samples", "as many")
    return sample_rate(time_s, f"{arrays.where}, time_s")


def _units(arrays: Arrays, count: int) -> list[SignalUnit]:
    """One for each column."""
    stated, asked = arrays.texts("unit"), arrays.options.unit
    if stated is None and asked is None:
        raise InputError(arrays.where, "no unit", "the unit of the responses", "say it: `--unit m/s^2`")
    if stated is not None and asked is not None and stated != [asked]:
        found = f"the unit {', '.join(dict.fromkeys(stated))}, and `--unit {asked}`"
        raise InputError(f"{arrays.where}, unit", found, "no disagreement", "leave `--unit` out")
    texts = stated or [asked or ""]
    if len(texts) not in (1, count):
        raise InputError(f"{arrays.where}, unit", f"{len(texts)} units", f"one, or {count}")
    units = [parse_signal_unit(text, f"{arrays.where}, unit") for text in texts]
    return units * count if len(units) == 1 else units

"""FRFs kept as named arrays, the common part of `hdf5` and `mat`.

Names, which `variables` may map to others: frequency_hz (L,), or frequency_start_hz and frequency_step_hz;
frf (L, outputs, inputs) complex, or frf_real and frf_imag; coherence (like frf); outputs and inputs (channels
such as `12:+Z`); quantity, unit, averages, window_decay_per_s, record_s.  Instead of frf, single pairs may be
mapped, such as `{"frequency_hz": "H1_2[:,0]", "12:+Z/1:+X": "H1_2[:,1]", "12:+Z/1:+X coherence":
"C1_2[:,1]"}`; `[1,:]` is a row.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from identify.core.arrays import Array, Complex
from identify.core.asked import key
from identify.core.errors import InputError
from identify.core.tree import Group
from identify.measured.array_contents import described, suggested
from identify.measured.channel import Channel
from identify.measured.frf_records import FrfFileOptions, FrfRecord, FrfRecords
from identify.measured.frf_set import Quantity
from identify.measured.units import FrfUnit, parse_frf_unit

_ARRAYS = ("frequency_hz", "frf", "frf_real", "frf_imag", "coherence", "outputs", "inputs")
_AXIS = ("frequency_start_hz", "frequency_step_hz")
NAMES = (*_ARRAYS, *_AXIS, "quantity", "unit", "averages", "window_decay_per_s", "record_s")
"""The names that a file may use as they are."""

_PATH = re.compile(r"([^\[\]]+)(?:\[(?::,\s*(\d+)|(\d+),\s*:)\])?")
_QUANTITIES: tuple[Quantity, ...] = ("receptance", "mobility", "accelerance")


def paths_of(options: FrfFileOptions) -> list[str]:
    """Where in a file the names that can be asked for stand."""
    said = [options.variables.get(name, name) for name in NAMES] + list(options.variables.values())
    return [path_in(asked) for asked in dict.fromkeys(said) if _PATH.fullmatch(asked)]


def path_in(asked: str) -> str:
    """Where in a file an array stands that is asked for, maybe by a column or row of it."""
    match = _PATH.fullmatch(asked)
    return asked if match is None else match[1].strip()


class Arrays:
    """Looks up names in a file: `get(path)` returns the value there, or None; whole() everything in it, with
    `between` between the names of groups, for errors.
    """

    def __init__(
        self,
        get: Callable[[str], Any],
        options: FrfFileOptions,
        where: str,
        whole: Callable[[], Group],
        between: str,
    ) -> None:
        self.get, self.options, self.where = get, options, where
        self.whole, self.between = whole, between

    def lacking(self, found: str, expected: str, example: str) -> InputError:
        """That something is not in the file, with what is, and how to name it."""
        content = self.whole()
        keys = suggested(content, self.between) or example
        fix = f"say where it is, as `variables: {keys}` in a study or `--variable NAME=PLACE`"
        return InputError(self.where, f"{found}; {described(content, self.between)}", expected, fix)

    def value(self, name: str) -> Any:
        """What the file keeps under the name, or where `variables` says; None where there is nothing and
        nothing was said.
        """
        asked = self.options.variables.get(name)
        match = _PATH.fullmatch(asked or name)
        value = None if match is None else self.get(match[1].strip())
        if asked is not None and value is None:
            found = (
                f"{name} should be at {asked!r}, where nothing is; {described(self.whole(), self.between)}"
            )
            raise InputError(f"{self.where}, key variables", found, "a variable of the file")
        if match is not None and (match[2] or match[3]):
            axis, number = (1, int(match[2])) if match[2] else (0, int(match[3]))
            array = np.asarray(value)
            if array.ndim != 2 or number >= array.shape[axis]:
                raise InputError(
                    f"{self.where}, {asked}",
                    f"an array of shape {array.shape}",
                    f"two dimensions and a {('row', 'column')[axis]} {number}",
                )
            return array.take(number, axis)
        return value

    def numbers(self, name: str) -> NDArray[Any] | None:
        """A real or complex array, or None; InputError where it is something else."""
        value = self.value(name)
        if value is None:
            return None
        array = np.asarray(value)
        if array.dtype.kind not in "fiuc":
            raise InputError(f"{self.where}, {name}", f"values of type {array.dtype}", "numbers")
        return array

    def number(self, name: str) -> float | None:
        """A single number, or None."""
        array = self.numbers(name)
        if array is None:
            return None
        if array.size != 1 or array.dtype.kind == "c":
            raise InputError(f"{self.where}, {name}", f"an array of shape {array.shape}", "one real number")
        if not np.isfinite(array).all():
            raise InputError(f"{self.where}, {name}", f"{array.reshape(())}", "a finite number")
        return float(array.reshape(()))

    def texts(self, name: str) -> list[str] | None:
        """A list of texts, or None."""
        value = self.value(name)
        if value is None:
            return None
        return [str(item).strip() for item in np.ravel(np.asarray(value, dtype=object)).tolist()]


def read_arrays(arrays: Arrays) -> FrfRecords:
    """FRF records from named arrays; InputError where names, shapes or channels do not fit together."""
    _check_names(arrays)
    frequency_hz = _frequency(arrays)
    pairs = [
        name for name in arrays.options.variables if name not in NAMES and not name.endswith(" coherence")
    ]
    records = [_mapped(arrays, pair, len(frequency_hz)) for pair in pairs] or _cube(arrays, len(frequency_hz))
    averages = arrays.number("averages")
    if averages is not None and averages != int(averages):
        raise InputError(f"{arrays.where}, averages", f"{averages:g}", "a whole number")
    return FrfRecords(
        frequency_hz=frequency_hz,
        records=records,
        unit=_unit(arrays),
        averages=None if averages is None else int(averages),
        window_decay_per_s=arrays.number("window_decay_per_s"),
        record_s=arrays.number("record_s"),
    )


def _frequency(arrays: Arrays) -> Array:
    """The frequencies (L,), Hz, or as many from start and step as the FRFs have lines."""
    frequency = arrays.numbers("frequency_hz")
    options = arrays.options
    start, step = (
        arrays.number(name) if said is None else said
        for name, said in zip(_AXIS, (options.frequency_start_hz, options.frequency_step_hz), strict=True)
    )
    if frequency is None and step is not None:
        return np.asarray((start or 0.0) + step * np.arange(_lines(arrays)), dtype=np.float64)
    if frequency is None or np.any(frequency.imag):
        expected = "the frequencies in Hz, or frequency_start_hz and frequency_step_hz"
        raise arrays.lacking("no real frequency_hz", expected, "{frequency_hz: f, frf: H}")
    return np.asarray(frequency.real, dtype=np.float64).ravel()


def _lines(arrays: Arrays) -> int:
    """Of the first FRFs that there are: of a cube its first axis, of a pair all its values."""
    for pair in (name for name in arrays.options.variables if "/" in name):
        values = arrays.numbers(pair)
        return 0 if values is None else values.size
    for name in ("frf", "frf_real"):
        cube = arrays.numbers(name)
        if cube is not None:
            return len(cube) if cube.ndim else 1
    raise arrays.lacking("no frf", "FRFs under this name", "{frf: H}")


def _check_names(arrays: Arrays) -> None:
    """Refuse keys of `variables` that mean nothing."""
    for name in arrays.options.variables:
        pair = re.fullmatch(r"(\S+)/(\S+?)(?: coherence)?", name)
        if name not in NAMES and pair is None:
            expected = ", ".join(NAMES) + " or a pair such as 12:+Z/1:+X"
            raise InputError(f"{arrays.where}, key variables", f"unknown name {name!r}", expected)


def _unit(arrays: Arrays) -> FrfUnit | None:
    """The unit that the file states, which must agree with the quantity that it states."""
    unit_text, quantity = (arrays.texts(name) for name in ("unit", "quantity"))
    if quantity is not None and (len(quantity) != 1 or quantity[0] not in _QUANTITIES):
        raise InputError(f"{arrays.where}, quantity", f"{quantity}", "one of " + ", ".join(_QUANTITIES))
    if unit_text is None:
        return None
    unit = parse_frf_unit("".join(unit_text), f"{arrays.where}, unit")
    if quantity is not None and unit.quantity != quantity[0]:
        raise InputError(
            arrays.where,
            f"quantity {quantity[0]} with unit {unit_text[0]}",
            "no disagreement",
            "correct the file",
        )
    return unit


def _mapped(arrays: Arrays, pair: str, lines: int) -> FrfRecord:
    """One pair that `variables` names."""
    where = f"{arrays.where}, {pair}"
    output, input_ = (Channel.parse(text, where) for text in pair.split("/"))
    values, coherence = arrays.numbers(pair), None
    if f"{pair} coherence" in arrays.options.variables:
        coherence = arrays.numbers(f"{pair} coherence")
    for what, array in (("values", values), ("coherence", coherence)):
        if array is not None and array.size != lines:
            raise InputError(where, f"{what} of shape {array.shape}", f"{lines}, one for each frequency")
    assert values is not None
    own = None if coherence is None else _real(coherence, where)
    return FrfRecord(output, input_, values.astype(complex).ravel(), where, coherence=own)


def _cube(arrays: Arrays, lines: int) -> list[FrfRecord]:
    """All pairs of the array frf; a pair that is NaN throughout was not measured."""
    frf = arrays.numbers("frf")
    parts = [arrays.numbers(name) for name in ("frf_real", "frf_imag")]
    if frf is None and parts[0] is not None and parts[1] is not None and parts[0].shape == parts[1].shape:
        frf = parts[0] + 1j * parts[1]
    if frf is None:
        raise arrays.lacking("no frf, and no frf_real and frf_imag", "FRFs under these names", "{frf: H}")
    outputs, inputs = (
        _channels(arrays, "outputs", arrays.options.outputs),
        _channels(arrays, "inputs", arrays.options.inputs),
    )
    shape = (lines, len(outputs), len(inputs))
    cube = _shaped(frf, shape, f"{arrays.where}, frf")
    coherence = arrays.numbers("coherence")
    coherences = None if coherence is None else _shaped(coherence, shape, f"{arrays.where}, coherence")
    records = []
    for i, output in enumerate(outputs):
        for j, input_ in enumerate(inputs):
            where = f"{arrays.where}, {output}/{input_}"
            if not np.isnan(cube[:, i, j]).all():
                own = (
                    None
                    if coherences is None or np.isnan(coherences[:, i, j]).all()
                    else _real(coherences[:, i, j], where)
                )
                records.append(FrfRecord(output, input_, cube[:, i, j].astype(complex), where, coherence=own))
    return records


def _shaped(array: NDArray[Any], shape: tuple[int, int, int], where: str) -> NDArray[Any]:
    """The array as (lines, outputs, inputs), where only axes of length 1 may be missing; no other order is
    guessed.
    """
    if array.shape != shape and [n for n in array.shape if n > 1] != [n for n in shape if n > 1]:
        raise InputError(
            where,
            f"shape {array.shape}",
            f"(lines, outputs, inputs) = {shape}",
            "bring its axes into this order",
        )
    return array.reshape(shape)


def _real(coherence: NDArray[Any], where: str) -> Array:
    """Coherence as real numbers."""
    if np.any(coherence.imag):
        raise InputError(where, "a coherence with imaginary part", "real numbers")
    real: Complex | Array = coherence.real.astype(np.float64)
    return np.asarray(real, dtype=np.float64).ravel()


def _channels(arrays: Arrays, name: str, asked: list[str] | None) -> list[Channel]:
    """The channels that file or option name; InputError where neither does, where one comes twice, or where
    one is asked for in vain.

    Where the file names its channels, those of the option are a choice among them, which the caller makes.
    """
    texts = arrays.texts(name)
    if texts is None and asked is None:
        raise InputError(
            arrays.where,
            f"no {name}",
            "channels such as 12:+Z",
            f"name them with {key(name)}, in the order of frf",
        )
    channels = [Channel.parse(text, f"{arrays.where}, {name}") for text in texts or asked or []]
    if texts is not None and not {Channel.parse(text, f"key {name}") for text in asked or []} <= set(
        channels
    ):
        found = "a channel that the file does not name"
        raise InputError(
            f"{arrays.where}, key {name}",
            found,
            "some of its own",
            "rename channels with the key channels of a study",
        )
    if len(set(channels)) < len(channels):
        raise InputError(f"{arrays.where}, {name}", "a channel that comes twice", "each once")
    return channels

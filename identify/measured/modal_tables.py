"""Modal tables read from and written to YAML and CSV.

YAML: `modes:`, a list of `{frequency_hz, damping_ratio | damping_percent, shape: {"12:+Z": 0.3+0.1j},
frequency_std_hz, damping_std_ratio | damping_std_percent, modal_mass_kg, modal_mass_std_kg}`, of which only
frequency_hz must be there; a modal mass is that of the shape as it stands.  CSV:
one line a mode with the same columns and `mode`, a number; shapes in a second file with the columns
`mode,channel,real,imag`.

A table of modes: frequency, damping and, where known, shapes at channels; measured or computed.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from ruamel.yaml.comments import CommentedSeq

from identify.core.arrays import Array
from identify.core.errors import InputError
from identify.core.files import MEBIBYTE, sha256_of
from identify.core.text_input import csv_text
from identify.core.yaml_input import read_yaml_file
from identify.measured.channel import Channel
from identify.measured.delimited import DelimitedTable, read_table


@dataclass(frozen=True)
class ModalTable:
    """frequency_hz (m,): |lambda|/2 pi, rising; damping_ratio (m,): -Re lambda/|lambda| (0.04, not 4 %), NaN
    where unknown; shapes (m, channels) complex, or None; *_std are standard deviations, or None;
    modal_mass_kg (m,): of the shapes as they are, where it was told apart from them, NaN where unknown;
    notes: sentences on what of the file was not read.
    """

    frequency_hz: NDArray[np.float64]
    damping_ratio: NDArray[np.float64]
    channels: tuple[Channel, ...] = ()
    shapes: NDArray[np.complex128] | None = None
    frequency_std_hz: NDArray[np.float64] | None = None
    damping_std: NDArray[np.float64] | None = None
    modal_mass_kg: NDArray[np.float64] | None = None
    modal_mass_std_kg: NDArray[np.float64] | None = None
    source: str = ""
    sha256: str = ""
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        modes = len(self.frequency_hz)
        if self.damping_ratio.shape != (modes,):
            raise ValueError(f"damping_ratio has shape {self.damping_ratio.shape}, expected ({modes},)")
        if self.shapes is not None and self.shapes.shape != (modes, len(self.channels)):
            raise ValueError(
                f"shapes have shape {self.shapes.shape}, expected ({modes}, {len(self.channels)})"
            )
        if np.any(np.diff(self.frequency_hz) < 0):
            raise ValueError("frequency_hz must rise")

    def __len__(self) -> int:
        return len(self.frequency_hz)


_LARGEST = 8 * MEBIBYTE
_SCALES = {"damping_ratio": 1.0, "damping_percent": 0.01}
_STD_SCALES = {"damping_std_ratio": 1.0, "damping_std_percent": 0.01}
_MASSES = ("modal_mass_kg", "modal_mass_std_kg")
_KEYS = ("frequency_hz", *_SCALES, "frequency_std_hz", *_STD_SCALES, *_MASSES)


def read_modal_table(path: Path, shapes: Path | None = None) -> ModalTable:
    """A modal table from .yaml, .yml or .csv, sorted by frequency; shapes is the second file of a CSV table.

    InputError with file and line for a missing or broken file, unknown keys, values that are no numbers or
    out of range, modes without frequency, damping given twice, and shapes that not all modes have at all
    channels.
    """
    suffix = path.suffix.lower()
    if suffix not in (".yaml", ".yml", ".csv"):
        raise InputError(str(path), f"suffix {path.suffix!r}", "a modal table in .yaml, .yml or .csv")
    sha256 = sha256_of(path, "a modal table")
    modes = _csv_modes(path, shapes) if suffix == ".csv" else _yaml_modes(path)
    return parse_modes(modes, str(path), sha256)


def parse_modes(modes: list[tuple[str, Mapping[str, Any]]], source: str, sha256: str = "") -> ModalTable:
    """A modal table from (where, keys and values) of each mode; InputError as `read_modal_table`."""
    if not modes:
        raise InputError(source, "no mode", "at least one")
    for where, mode in modes:
        unknown = [key for key in mode if key not in (*_KEYS, "shape")]
        if unknown:
            raise InputError(where, f"unknown key {unknown[0]!r}", "one of " + ", ".join((*_KEYS, "shape")))
    frequency = _column(modes, {"frequency_hz": 1.0}, "a frequency above 0", np.nextafter(0, 1))
    for (where, _), value in zip(modes, frequency, strict=True):
        if np.isnan(value):
            raise InputError(where, "no frequency_hz", "a frequency in Hz")
    order = np.argsort(frequency, kind="stable")
    channels, shapes = _shapes(modes)
    damping_std = _column(modes, _STD_SCALES, "a standard deviation of 0 or more", 0.0)
    frequency_std = _column(modes, {"frequency_std_hz": 1.0}, "a standard deviation of 0 or more", 0.0)
    masses = [_column(modes, {key: 1.0}, "a mass of 0 kg or more", 0.0) for key in _MASSES]
    mass, mass_std = (None if np.isnan(column).all() else column[order] for column in masses)
    return ModalTable(
        frequency_hz=frequency[order],
        damping_ratio=_column(modes, _SCALES, "a damping ratio between -1 and 1 (100 %)", -1.0, 1.0)[order],
        channels=channels,
        shapes=None if shapes is None else shapes[order],
        frequency_std_hz=None if np.isnan(frequency_std).all() else frequency_std[order],
        damping_std=None if np.isnan(damping_std).all() else damping_std[order],
        modal_mass_kg=mass,
        modal_mass_std_kg=mass_std,
        source=source,
        sha256=sha256,
    )


def write_modal_table(path: Path, table: ModalTable, shapes: Path | None = None) -> None:
    """Write a modal table as .yaml, .yml or .csv, with every digit; shapes go into the YAML file or, with
    CSV, into the file `shapes`.
    """
    modes = [_mode(table, index) for index in range(len(table))]
    if path.suffix.lower() == ".csv":
        columns = list(dict.fromkeys(key for mode in modes for key in mode if key != "shape"))
        rows = [
            [number, *(mode.get(key, "") for key in columns)] for number, mode in enumerate(modes, start=1)
        ]
        _write_csv(path, ["mode", *columns], rows)
        if shapes is not None and table.shapes is not None:
            lines = [
                [number, str(channel), value.real, value.imag]
                for number, shape in enumerate(table.shapes.tolist(), start=1)
                for channel, value in zip(table.channels, shape, strict=True)
            ]
            _write_csv(shapes, ["mode", "channel", "real", "imag"], lines)
        return
    path.write_text(_yaml_text(modes), encoding="utf-8")


def _yaml_text(modes: list[dict[str, Any]]) -> str:
    """The modes as YAML, key by key: a general writer takes seconds for thousands of numbers."""
    if not modes:
        return "modes: []\n"
    lines = ["modes:"]
    for mode in modes:
        keys = [f"{key}: {value!r}" for key, value in mode.items() if key != "shape"]
        lines += [("  " if number else "- ") + text for number, text in enumerate(keys)]
        if "shape" in mode:
            lines.append("  shape:")
            lines += [f"    '{channel}': '{value}'" for channel, value in mode["shape"].items()]
    return "\n".join(lines) + "\n"


def _mode(table: ModalTable, index: int) -> dict[str, Any]:
    """Keys and values of one mode; what is not known is left out."""
    values = {
        "frequency_hz": table.frequency_hz,
        "damping_ratio": table.damping_ratio,
        "frequency_std_hz": table.frequency_std_hz,
        "damping_std_ratio": table.damping_std,
        "modal_mass_kg": table.modal_mass_kg,
        "modal_mass_std_kg": table.modal_mass_std_kg,
    }
    mode: dict[str, Any] = {
        key: float(array[index])
        for key, array in values.items()
        if array is not None and not np.isnan(array[index])
    }
    if table.shapes is not None:
        pairs = zip(table.channels, table.shapes[index].tolist(), strict=True)
        mode["shape"] = {str(channel): repr(value).strip("()") for channel, value in pairs}
    return mode


def _write_csv(path: Path, header: list[str], rows: list[list[Any]]) -> None:
    """A CSV file with every digit of its numbers."""
    path.write_text(csv_text([header, *rows]), encoding="utf-8")


def _yaml_modes(path: Path) -> list[tuple[str, Mapping[str, Any]]]:
    """The modes of a YAML file with their lines."""
    content = read_yaml_file(path, "a modal table in YAML", _LARGEST)
    if (
        not isinstance(content, Mapping)
        or set(content) != {"modes"}
        or not isinstance(content["modes"], CommentedSeq)
    ):
        raise InputError(
            str(path), "no list under the key modes, or other keys beside it", "modes: and a list of modes"
        )
    modes = []
    for index, mode in enumerate(content["modes"]):
        where = f"{path}, line {content['modes'].lc.item(index)[0] + 1}"
        if not isinstance(mode, Mapping):
            raise InputError(where, f"mode {mode!r}", "keys such as frequency_hz: 12.05")
        modes.append((where, mode))
    return modes


def _csv_modes(path: Path, shapes: Path | None) -> list[tuple[str, Mapping[str, Any]]]:
    """The modes of a CSV file and its shapes with their lines."""
    table = read_table(path)
    if "mode" not in table.header or "frequency_hz" not in table.header:
        raise InputError(
            str(path),
            "the columns " + ", ".join(table.header),
            "mode, frequency_hz and others such as damping_percent",
        )
    modes: dict[str, tuple[str, dict[str, Any]]] = {}
    for row, line in zip(table.rows, table.lines, strict=True):
        cells = {key: cell for key, cell in zip(table.header, row, strict=True) if cell}
        number = cells.pop("mode", "")
        if number in modes or not number:
            raise InputError(f"{path}, line {line}", f"mode {number!r}", "a number for each mode, each once")
        modes[number] = (f"{path}, line {line}", cells)
    if shapes is not None:
        _add_shapes(read_table(shapes), modes)
    return list(modes.values())


def _add_shapes(table: DelimitedTable, modes: Mapping[str, tuple[str, dict[str, Any]]]) -> None:
    """Put the shapes of a second file into the modes."""
    if table.header != ["mode", "channel", "real", "imag"]:
        raise InputError(table.name, "the columns " + ", ".join(table.header), "mode,channel,real,imag")
    values = table.numbers(2) + 1j * table.numbers(3)
    for row, line, value in zip(table.rows, table.lines, values.tolist(), strict=True):
        where = f"{table.name}, line {line}"
        if row[0] not in modes:
            raise InputError(
                where,
                f"mode {row[0]!r}, which the table of modes does not have",
                "one of " + ", ".join(modes),
            )
        shape = modes[row[0]][1].setdefault("shape", {})
        if row[1] in shape:
            raise InputError(where, f"channel {row[1]} of mode {row[0]} a second time", "each once")
        shape[row[1]] = value


def _column(
    modes: list[tuple[str, Mapping[str, Any]]],
    scales: Mapping[str, float],
    expected: str,
    low: float,
    high: float = np.inf,
) -> Array:
    """One quantity of all modes, NaN where not given, under any of its keys, of which a mode has at most
    one.
    """
    column = np.full(len(modes), np.nan)
    for index, (where, mode) in enumerate(modes):
        given = [key for key in scales if key in mode]
        if len(given) > 1:
            raise InputError(where, "both " + " and ".join(given), "one of them")
        for key in given:
            column[index] = scales[key] * _number(mode[key], f"{where}, {key}")
            if not low <= column[index] <= high:
                raise InputError(where, f"{key}: {mode[key]}", expected)
    return column


def _number(value: Any, where: str) -> float:
    """A finite number."""
    try:
        number = (
            float(value) if isinstance(value, (int, float, str)) and not isinstance(value, bool) else np.nan
        )
    except ValueError:
        number = np.nan
    if not np.isfinite(number):
        raise InputError(where, f"{value!r}", "a finite number")
    return number


def _shapes(
    modes: list[tuple[str, Mapping[str, Any]]],
) -> tuple[tuple[Channel, ...], np.ndarray[Any, np.dtype[np.complex128]] | None]:
    """Channels in the order of the first mode, and shapes (modes, channels), or nothing where no mode has
    one.
    """
    shaped = [(where, mode["shape"]) for where, mode in modes if "shape" in mode]
    if not shaped:
        return (), None
    rows = []
    for where, shape in shaped:
        if not isinstance(shape, Mapping) or not shape:
            raise InputError(where, f"shape {shape!r}", "values by channel such as {12:+Z: 0.3+0.1j}")
        rows.append(
            {
                Channel.parse(str(name), where): _complex(value, f"{where}, {name}")
                for name, value in shape.items()
            }
        )
        if len(rows[-1]) < len(shape) or set(rows[-1]) != set(rows[0]):
            raise InputError(
                where,
                "a shape with other channels than the first one, or a channel twice",
                "the same channels for all modes",
            )
    if len(shaped) < len(modes):
        missing = next(where for where, mode in modes if "shape" not in mode)
        raise InputError(
            missing, "a mode without shape beside modes with shape", "shapes for all modes or for none"
        )
    return tuple(rows[0]), np.array([[row[channel] for channel in rows[0]] for row in rows], dtype=complex)


def _complex(value: Any, where: str) -> complex:
    """A finite complex number, as a number or as text such as 0.3+0.1j."""
    try:
        number = complex(value.replace(" ", "") if isinstance(value, str) else value)
    except (TypeError, ValueError):
        number = complex(np.nan)
    if not np.isfinite(number):
        raise InputError(where, f"{value!r}", "a complex number such as 0.3+0.1j")
    return number

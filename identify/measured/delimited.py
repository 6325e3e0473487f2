"""Text files: FRFs in a long or a wide layout, and time histories.

Cells are separated as `text_input.read_csv` finds them; `# unit: m/s^2/N`, `# averages: 4` and `#
window_decay_per_s: 0.69` and so on may stand before the header line, other lines that begin with # are
comments.

- long: `frequency_hz,output,input,real,imag[,coherence]`, one line per frequency and pair, channels written
`12:+Z`;
  coherence may be empty for a whole pair;
- wide: `frequency_hz` and for each pair `12:+Z/1:+X real` and `12:+Z/1:+X imag`, or `... magnitude` and `...
phase_deg`,
  and optionally `... coherence`; a column may lack its pair where the options name one of each; frequencies
  may be given by start and step; the key `columns` names the columns of a file that does not;
- time history: `time_s` and for each signal `12:+Z [m/s^2]` or `1:+X [N]`; a first column `block` numbers the
hits.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from math import isfinite
from pathlib import Path

import numpy as np

from identify.core.arrays import Array, Complex
from identify.core.errors import InputError
from identify.core.text_input import is_number, read_csv
from identify.measured.channel import Channel
from identify.measured.common_lines import common_axis, common_lines
from identify.measured.frf_records import FrfFileOptions, FrfRecord, FrfRecords, check_named
from identify.measured.time_history import Signal, Units, sample_rate
from identify.measured.units import parse_frf_unit, parse_signal_unit

_LEAST_PHASE = 1.0
"""Degrees that phases with any resonance in them go beyond, even in radians."""
_LONG = ["frequency_hz", "output", "input", "real", "imag"]
_NOTE = re.compile(
    r"#\s*(unit|averages|window_decay_per_s|record_s|frequency_start_hz|frequency_step_hz)\s*:\s*(.+?)[\s,;]*$"
)
_PARTS = "real|imag|magnitude|phase_deg|coherence"
_PAIR = re.compile(rf"(\S+)\s*/\s*(\S+)\s+({_PARTS})")
_UNUSED = "-"
"""What the key `columns` calls a column that is not read."""
SIGNAL = re.compile(r"(\S+)\s*\[(.+)\]")


_NAME_COLUMNS = (
    "name them: `columns: [frequency_hz, 12:+Z/1:+X real, 12:+Z/1:+X imag]` in a study, or `--columns`"
)


@dataclass(frozen=True)
class DelimitedTable:
    """Header, cells with their line numbers, and the `# key: value` notes of a CSV file."""

    name: str
    header: list[str]
    rows: list[list[str]]
    lines: list[int]
    notes: dict[str, str]

    def numbers(
        self, column: int, rows: list[int] | None = None, empty: frozenset[int] = frozenset()
    ) -> Array:
        """One column, all of it or some rows, as finite numbers; InputError naming the line of the first cell
        that is none, NaN where that is so in the rows `empty`.
        """
        chosen = range(len(self.rows)) if rows is None else rows
        values = np.empty(len(chosen))
        for i, row in enumerate(chosen):
            cell = self.rows[row][column]
            try:
                values[i] = float(cell)
            except ValueError:
                values[i] = np.nan
            if not isfinite(values[i]) and row in empty:
                values[i] = np.nan
            elif not isfinite(values[i]):
                found = f"{cell!r} in column {self.header[column]!r}"
                fix = "where commas are decimal, separate cells by semicolons" if "," in cell else ""
                raise InputError(
                    f"{self.name}, line {self.lines[row]}", found, "a finite number with a decimal point", fix
                )
        return values

    def at_zero(self) -> frozenset[int]:
        """Rows at 0 Hz, where an FRF may be no number; the frequencies are the first column."""
        return frozenset(np.flatnonzero(self.numbers(0) == 0).tolist())

    def note(self, key: str, convert: Callable[[str], float]) -> float | None:
        """The number noted under key, or None; InputError where it is none."""
        try:
            return convert(self.notes[key]) if key in self.notes else None
        except ValueError as error:
            raise InputError(self.name, f"# {key}: {self.notes[key]}", "a number") from error


def read_table(path: Path, columns: list[str] | None = None) -> DelimitedTable:
    """A text file, whose columns are named by its header or in place of that by `columns`.

    InputError for an empty file, a row with too few or too many cells, and columns that nobody names.
    """
    notes: dict[str, str] = {}
    rows: list[list[str]] = []
    lines: list[int] = []
    for number, line, cells in read_csv(path, "a CSV file"):
        if note := _NOTE.match(line):
            if note[2] != notes.setdefault(note[1], note[2]):
                found = f"# {note[1]}: {note[2]}, after # {note[1]}: {notes[note[1]]}"
                raise InputError(f"{path}, line {number}", found, "one of them", "remove the wrong one")
        elif any(cells):
            rows.append(cells)
            lines.append(number)
    rows, lines = _with_header(path, columns, rows, lines)
    if len(rows) < 2:
        found = "a header line alone" if rows else "no line"
        raise InputError(str(path), found, "a header line and at least one line of numbers")
    for row, line_number in zip(rows, lines, strict=True):
        if len(row) != len(rows[0]):
            found = f"{len(row)} cells, {len(rows[0])} in the header"
            raise InputError(
                f"{path}, line {line_number}",
                found,
                "as many cells as columns",
                "separate by commas with a decimal point, or by semicolons",
            )
    rows = _without_idle(rows)
    if not rows[0]:
        raise InputError(f"{path}, line {lines[0]}", "no column but unused ones", "columns that have names")
    header = [cell if ":" in cell else cell.lower() for cell in rows[0]]
    if len(set(header)) < len(header):
        raise InputError(f"{path}, line {lines[0]}", "a column name that comes twice", "each column once")
    return DelimitedTable(str(path), header, rows[1:], lines[1:], notes)


def _with_header(
    path: Path, columns: list[str] | None, rows: list[list[str]], lines: list[int]
) -> tuple[list[list[str]], list[int]]:
    """Rows and their lines with the key `columns` in front, in place of a header line where there is one;
    InputError where neither names the columns, or the key names more or fewer.
    """
    bare = bool(rows) and all(map(is_number, filter(None, rows[0])))
    if columns is None:
        if bare:
            found = f"numbers in the first line, and no names of the {len(rows[0])} columns"
            raise InputError(f"{path}, line {lines[0]}", found, "a header line", _NAME_COLUMNS)
        return rows, lines
    if rows and len(rows[0]) != len(columns):
        found = f"{len(rows[0])} cells, {len(columns)} names in the key columns"
        raise InputError(f"{path}, line {lines[0]}", found, "a name for each column", "`-` for one not used")
    first = 0 if bare or not rows else 1
    return [columns, *rows[first:]], [0, *lines[first:]]


def _without_idle(rows: list[list[str]]) -> list[list[str]]:
    """Without columns called `-`, and without one that has no name and is empty, as behind a last separator,
    or counts the lines, as programs write it in front.
    """
    counted = [str(n) for n in range(len(rows) - 1)]
    keep = []
    for column, name in enumerate(rows[0]):
        cells = [row[column] for row in rows[1:]]
        idle = not name and (not any(cells) or cells == counted)
        if name != _UNUSED and not idle:
            keep.append(column)
    return rows if len(keep) == len(rows[0]) else [[row[column] for column in keep] for row in rows]


def read_frf(path: Path, options: FrfFileOptions) -> FrfRecords:
    """FRFs in the long or the wide layout, whichever the header says; InputError with the line of whatever
    does not fit.
    """
    check_named(options, str(path))
    table = _with_frequencies(read_table(path, options.columns), options)
    if table.header[:5] == _LONG and table.header[5:] in ([], ["coherence"]):
        frequency_hz, records, notes = _long(table)
    elif table.header[0] == "frequency_hz" and len(table.header) > 1:
        frequency_hz, records, notes = _wide(table, _only_pair(options))
    else:
        expected = f"{','.join(_LONG)}[,coherence], or frequency_hz and columns such as 12:+Z/1:+X real"
        raise InputError(str(path), f"the columns {', '.join(table.header[:6])}", expected, _NAME_COLUMNS)
    averages = table.note("averages", int)
    return FrfRecords(
        frequency_hz=frequency_hz,
        records=records,
        unit=parse_frf_unit(table.notes["unit"], f"{path}, # unit") if "unit" in table.notes else None,
        averages=None if averages is None else int(averages),
        window_decay_per_s=table.note("window_decay_per_s", float),
        record_s=table.note("record_s", float),
        notes=notes,
    )


def _only_pair(options: FrfFileOptions) -> str:
    """The pair that the options name, where they name one, as a column says it; else empty."""
    outputs, inputs = options.outputs or [], options.inputs or []
    return f"{outputs[0]}/{inputs[0]} " if len(outputs) == len(inputs) == 1 else ""


def _with_frequencies(table: DelimitedTable, options: FrfFileOptions) -> DelimitedTable:
    """The table with a first column of frequencies, where start and step say them in its place."""
    asked = (options.frequency_start_hz, options.frequency_step_hz)
    start, step = (
        noted if given is None else given
        for given, noted in zip(
            asked,
            (table.note(f"frequency_{what}_hz", float) for what in ("start", "step")),
            strict=True,
        )
    )
    if step is None:
        if options.frequency_start_hz is not None:
            raise InputError(table.name, "a first frequency and no step", "both", "add frequency_step_hz")
        return table
    if "frequency_hz" in table.header:
        found = "a step of the frequencies beside a column frequency_hz"
        raise InputError(table.name, found, "one of them", "leave frequency_step_hz out")
    if table.header[:2] == ["output", "input"]:
        raise InputError(table.name, "a step of the frequencies in the long layout", "a column frequency_hz")
    frequency = ((start or 0.0) + step * np.arange(len(table.rows))).tolist()
    rows = [[repr(one), *row] for one, row in zip(frequency, table.rows, strict=True)]
    return replace(table, header=["frequency_hz", *table.header], rows=rows)


def read_time(path: Path, units: Units) -> tuple[float, list[Signal]]:
    """Sample rate (Hz) and signals of a time history; every column states its unit in brackets."""
    del units  # a CSV file states its units itself
    table = read_table(path)
    first = 1 if table.header[0] == "block" else 0
    names = table.header[first + 1 :]
    if not names or table.header[first] != "time_s":
        raise InputError(
            str(path),
            f"the columns {', '.join(table.header[:6])}",
            "time_s and signals such as 12:+Z [m/s^2]",
        )
    blocks: dict[str, list[int]] = {}
    for index, row in enumerate(table.rows):
        blocks.setdefault(row[0] if first else "", []).append(index)
    time_s = common_axis(
        ((f"{path}, block {name or 1}", table.numbers(first, rows)) for name, rows in blocks.items()),
        "time",
        "write every block with as many samples, or leave this one out",
    )
    signals: list[Signal] = []
    for column, name in enumerate(names, start=first + 1):
        where = f"{path}, column {name!r}"
        match = SIGNAL.fullmatch(name)
        if match is None:
            raise InputError(
                where, "no channel with its unit", "such as 12:+Z [m/s^2]", "add the unit in brackets"
            )
        channel, unit = Channel.parse(match[1], where), parse_signal_unit(match[2], where)
        signals.extend(Signal(channel, unit, table.numbers(column, rows), where) for rows in blocks.values())
    return sample_rate(time_s, str(path)), signals


def _long(table: DelimitedTable) -> tuple[Array, list[FrfRecord], tuple[str, ...]]:
    """Frequencies and records of the long layout, and what was left out; the lines may stand in any order."""
    frequency, empty = table.numbers(0), table.at_zero()
    real, imag = (table.numbers(column, empty=empty) for column in (3, 4))
    groups: dict[tuple[str, str], list[int]] = {}
    for index, row in enumerate(table.rows):
        groups.setdefault((row[1], row[2]), []).append(index)
    axes, records = [], []
    for (output, input_), members in groups.items():
        where = f"{table.name}, line {table.lines[members[0]]}"
        order = [members[i] for i in np.argsort(frequency[members], kind="stable")]
        same = np.flatnonzero(np.diff(frequency[order]) == 0)
        if len(same):
            twice = table.lines[order[same[0] + 1]]
            raise InputError(
                f"{table.name}, line {twice}",
                f"a frequency of {output}/{input_} that comes twice",
                "each once",
            )
        axes.append((where, frequency[order]))
        channels = (Channel.parse(output, where), Channel.parse(input_, where))
        has_coherence = len(table.header) == 6 and any(table.rows[i][5] for i in members)
        coherence = table.numbers(5, order, empty) if has_coherence else None
        records.append(FrfRecord(*channels, real[order] + 1j * imag[order], where, coherence=coherence))
    frequency_hz, slices, notes = common_lines(axes)
    return frequency_hz, [record.lines(some) for record, some in zip(records, slices, strict=True)], notes


def _wide(table: DelimitedTable, only: str = "") -> tuple[Array, list[FrfRecord], tuple[str, ...]]:
    """Frequencies and records of the wide layout, and what is doubtful; only: the pair of columns that name
    none, as they would say it.
    """
    parts: dict[tuple[Channel, Channel], dict[str, Array]] = {}
    empty = table.at_zero()
    for column, name in enumerate(table.header[1:], start=1):
        match = _PAIR.fullmatch(only + name) or _PAIR.fullmatch(name)
        where = f"{table.name}, column {name!r}"
        if match is None:
            part = name in _PARTS.split("|")
            raise InputError(
                where,
                "no pair" if part else "no pair and part",
                "such as 12:+Z/1:+X real (or imag, magnitude, phase_deg, coherence)",
                "name it by `outputs: [12:+Z]` and `inputs: [1:+X]`, or by `names`" if part else "",
            )
        pair = (Channel.parse(match[1], where), Channel.parse(match[2], where))
        if match[3] in parts.setdefault(pair, {}):
            raise InputError(where, f"{match[3]} of {pair[0]}/{pair[1]} a second time", "each once")
        parts[pair][match[3]] = table.numbers(column, empty=empty)
    records = []
    for (output, input_), columns in parts.items():
        where = f"{table.name}, columns {output}/{input_}"
        values = _complex(columns, where)
        records.append(FrfRecord(output, input_, values, where, coherence=columns.get("coherence")))
    phases = np.array([columns["phase_deg"] for columns in parts.values() if "phase_deg" in columns])
    return table.numbers(0), records, _radians(phases)


def _radians(phases: Array) -> tuple[str, ...]:
    """What is to be said of phases (pairs, lines) in degrees that stay within a turn of radians."""
    largest = float(np.abs(phases).max(initial=0.0))
    if not _LEAST_PHASE < largest <= 2.001 * np.pi:
        return ()
    return (f"no phase_deg is beyond {largest:.3g}: are the phases radians? They were taken as degrees",)


def _complex(columns: dict[str, Array], where: str) -> Complex:
    """Values from real and imag, or from magnitude and phase_deg."""
    names = set(columns) - {"coherence"}
    if names == {"real", "imag"}:
        return columns["real"] + 1j * columns["imag"]
    if names == {"magnitude", "phase_deg"}:
        if (columns["magnitude"] < 0).any():
            raise InputError(where, "a magnitude below 0", "magnitudes, not decibels", "export them linear")
        return np.asarray(
            columns["magnitude"] * np.exp(1j * np.deg2rad(columns["phase_deg"])), dtype=np.complex128
        )
    raise InputError(
        where,
        "the parts " + (" and ".join(sorted(names)) or "coherence alone"),
        "real and imag, or magnitude and phase_deg",
    )

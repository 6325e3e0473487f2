"""The FRFs of one measurement in several files: which files, whose channels their names may tell, and their
records as those of one file.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from dataclasses import replace
from hashlib import sha256
from pathlib import Path

from identify.core.errors import InputError
from identify.core.text import count
from identify.measured.channel import Channel
from identify.measured.common_lines import common_lines
from identify.measured.frf_records import FrfFileOptions, FrfRecords

_DIRECTION = r"[+-]?(?:S|R?[XYZ])"
_PIECES = {
    **{side: rf"(?P<{side}>\d+[:_. ]?{_DIRECTION})" for side in ("output", "input")},
    **{f"{side}_node": rf"(?P<{side}_node>\d+)" for side in ("output", "input")},
    **{f"{side}_direction": rf"(?P<{side}_direction>{_DIRECTION})" for side in ("output", "input")},
    "any": ".*?",
}
_PLACEHOLDER = re.compile(r"\{(\w+)\}|(\*)")


def is_pattern(path: Path) -> bool:
    """Whether the last part of a path is a pattern of names of files."""
    return any(mark in path.name for mark in "*?")


def name_of(paths: Sequence[Path]) -> str:
    """What a measurement is called that is in these files, or in the folder or pattern of files."""
    first, pattern = paths[0], is_pattern(paths[0])
    if len(paths) == 1 and not pattern:
        return first.stem
    return first.parent.name or ("measurement" if pattern else first.stem)


def files_of(path: Path, suffixes: Collection[str]) -> list[Path]:
    """The files that a path stands for, in the order of the numbers in their names: those in a folder with
    one of the suffixes, those that a pattern in its last part matches, or itself.  InputError for none.
    """
    if path.is_dir():
        found = [one for one in path.iterdir() if one.suffix.lower() in suffixes and one.is_file()]
        nothing, expected = "a folder without any file of FRFs", "files that end in " + ", ".join(suffixes)
    elif is_pattern(path):
        found = list(path.parent.glob(path.name))
        nothing, expected = "no file is called so", "at least one that the pattern matches"
    else:
        return [path]
    if not found:
        raise InputError(str(path), nothing, expected, "check the path")
    return sorted(found, key=_natural)


def _natural(path: Path) -> list[tuple[int, str]]:
    """By numbers where there are some: P2 before P10."""
    return [(int(part), "") if part.isdigit() else (-1, part) for part in re.split(r"(\d+)", path.name)]


def options_for(path: Path, options: FrfFileOptions) -> FrfFileOptions:
    """The options of one file, with the channels that its name tells; InputError where it tells none."""
    if options.names is None:
        return options
    where = f"{path}, key names"
    match = _template(options.names, where).fullmatch(path.stem)
    if match is None:
        fix = "write {output}, {input} or pieces of them where they stand in the name, * for what varies"
        raise InputError(where, f"{path.stem!r} is not of the form {options.names!r}", "a name of it", fix)
    told = match.groupdict()
    outputs, inputs = (
        _told(told, side, given, where)
        for side, given in (("output", options.outputs), ("input", options.inputs))
    )
    return options.model_copy(update={"outputs": outputs, "inputs": inputs})


def _told(told: dict[str, str], side: str, given: list[str] | None, where: str) -> list[str] | None:
    text = told.get(side) or told.get(f"{side}_node", "") + told.get(f"{side}_direction", "")
    if not text:
        return given
    match = re.fullmatch(rf"(\d+)[:_. ]?({_DIRECTION})", text, re.IGNORECASE)
    if match is None:
        raise InputError(where, f"only {text!r} of the {side}", "its node and its direction")
    return [str(Channel.parse(f"{match[1]}:{match[2]}", where))]


def _template(text: str, where: str) -> re.Pattern[str]:
    """A form of names as a regular expression."""
    parts, end = [], 0
    stem = Path(text).stem if Path(text).suffix.lower() and not text.endswith("}") else text
    for mark in _PLACEHOLDER.finditer(stem):
        name = mark[1] or "any"
        if name not in _PIECES:
            known = ", ".join(f"{{{one}}}" for one in _PIECES if one != "any")
            raise InputError(where, f"{{{name}}}", f"one of {known}, or *")
        parts += [re.escape(stem[end : mark.start()]), _PIECES[name]]
        end = mark.end()
    try:
        return re.compile("".join([*parts, re.escape(stem[end:])]), re.IGNORECASE)
    except re.error as error:
        raise InputError(where, f"{text!r} ({error})", "each placeholder once") from error


def together(source: str, files: Sequence[tuple[Path, FrfRecords]]) -> FrfRecords:
    """The records of several files as those of one, on the lines that all have; InputError where they do not
    agree in their unit, window or length of records.  Of different numbers of averages the least counts.
    """
    axes = [(str(path), one.frequency_hz) for path, one in files]
    frequency_hz, slices, notes = common_lines(axes)
    records = [
        record.lines(some) for (_, one), some in zip(files, slices, strict=True) for record in one.records
    ]
    averages = {one.averages for _, one in files if one.averages is not None}
    if len(averages) > 1:
        notes = (*notes, f"files have {min(averages)} to {max(averages)} averages: the least was taken")
    units = {one.unit for _, one in files}
    if len(units) > 1:
        found = f"{count(len(units), 'unit')} in {count(len(files), 'file')}"
        raise InputError(source, found, "one for all", "export them alike, or state `unit` where none is")
    merged = FrfRecords(
        frequency_hz=frequency_hz,
        records=records,
        unit=units.pop(),
        averages=min(averages) if averages else None,
        window_decay_per_s=_agreed(source, files, "window_decay_per_s"),
        record_s=_agreed(source, files, "record_s"),
    )
    said = dict.fromkeys(note for _, one in files for note in one.notes)
    return replace(merged, notes=(*said, *notes))


def _agreed(source: str, files: Sequence[tuple[Path, FrfRecords]], key: str) -> float | None:
    values = {value: path for path, one in files if (value := getattr(one, key)) is not None}
    if len(values) > 1:
        found = " and ".join(f"{value:g} in {path.name}" for value, path in list(values.items())[:2])
        raise InputError(source, f"{key} = {found}", "one for all files of a measurement")
    return next(iter(values), None)


def sha256_of_all(digests: Sequence[str]) -> str:
    """Of several files one, by theirs; that of one file is its own."""
    return digests[0] if len(digests) == 1 else sha256("".join(digests).encode()).hexdigest()

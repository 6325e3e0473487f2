"""A report: one list of sections, which the kit renders as an HTML page, as a PDF and in the terminal.

A section is a title over parts: texts, tables, figures, and what only a page has, such as moving shapes.
Every part says once what it shows; where it is shown (`On`) and how is the kit's business (`page`,
`document`, `terminal`).

The last two sections are the same everywhere: what was asked, setting by setting, with the source of each
value, and where a result comes from.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Flag, auto
from typing import TYPE_CHECKING, Any, TypeAlias

from identify.reports.kit.cells import Curves, Table, number, words
from identify.results.header import Header
from identify.results.setting_table import DEFAULT
from identify.results.tables import Provenance

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Row = tuple[str, str, str]
_COLUMNS = (words("Setting"), words("Value"), words("Source"))


def given_table(provenance: Provenance) -> Table | None:
    """The settings that a config or the command line gave; None where sources were not kept, or nothing was
    given.
    """
    rows = [row for row in _rows(provenance) if row[2] != DEFAULT]
    return Table.of("Settings that were given", _COLUMNS, rows) if rows else None


def default_table(provenance: Provenance) -> Table | None:
    """The settings nobody gave, with the values that were used; a star stands for every entry of a list with
    the same value.
    """
    rows = [row[:2] for row in _together([row for row in _rows(provenance) if row[2] == DEFAULT])]
    return Table.of("Defaults that were used", _COLUMNS[:2], rows) if rows else None


def _rows(provenance: Provenance) -> list[Row]:
    s = provenance.settings
    return [] if s is None else list(zip(s.key, s.value, s.source, strict=True))


def _together(rows: list[Row]) -> Iterable[Row]:
    """Rows that differ in the number of a list's entry alone as one, in the place of the first."""
    starred = [(re.sub(r"\.\d+(?=\.|$)", ".*", key), value) for key, value, _ in rows]
    for row, star in zip(rows, starred, strict=True):
        alike = [other[0] for other in starred if other[0] == star[0]]
        same = starred.count(star) == len(alike) > 1
        if not same:
            yield row
        elif starred.index(star) == rows.index(row):
            yield (*star, row[2])


def provenance_table(result: Header) -> Table:
    """Versions, times, seed and hashes."""
    p = result.provenance
    number_of_chance = getattr(result, "seed", None)
    seed = [] if number_of_chance is None else [("Seed", str(number_of_chance))]
    study = [(f"Study {p.config_path}", f"sha256 {p.config_sha256}")] if p.config_path else []
    rows = [
        ("Written", p.written),
        ("Run time", f"{number(result.seconds, 3)} s"),
        *seed,
        ("identify", p.identify),
        ("Python", f"{p.python}, {p.platform}"),
        ("Packages", ", ".join(p.packages)),
        *study,
        *((name, f"sha256 {digest}") for name, digest in zip(p.input_files, p.input_sha256, strict=True)),
    ]
    return Table.of("Provenance", (words("What"), words("Value")), rows)


class On(Flag):
    """Where a part is shown."""

    PAGE = auto()
    PRINT = auto()
    TERMINAL = auto()


PAGE, PRINT, TERMINAL = On.PAGE, On.PRINT, On.TERMINAL
WRITTEN = PAGE | PRINT
EVERYWHERE = WRITTEN | TERMINAL


@dataclass(frozen=True)
class Text:
    """A paragraph; look: its class on the page, such as `note`."""

    text: str
    look: str = ""
    on: On = WRITTEN


@dataclass(frozen=True)
class Bullets:
    """Sentences, one a line."""

    items: Sequence[str]
    on: On = WRITTEN


@dataclass(frozen=True)
class Heading:
    """A heading inside a section; level: 3 or 4, as in HTML."""

    text: str
    level: int = 3
    look: str = ""
    on: On = WRITTEN


@dataclass(frozen=True)
class Code:
    """A text as it was written, such as a config."""

    text: str
    on: On = WRITTEN


@dataclass(frozen=True)
class Tabular:
    """A table.

    heading: whether its title stands above it; sort: a name, where a click on a heading of the page sorts it;
    limit: rows after which the page scrolls; rows: how many the PDF prints (all are exported); terminal: the
    headings of the columns that a terminal has room for, none: all.
    """

    table: Table
    heading: bool = False
    sort: str = ""
    limit: int = 0
    rows: int | None = None
    terminal: tuple[str, ...] = ()
    on: On = WRITTEN


@dataclass(frozen=True)
class Drawing:
    """A figure: on the page the plot of that id, which a script draws from the section's data; in the PDF
    (and as export) what `figure` makes, with its caption and the numbers behind it.

    Without an id it is not on the page, without a figure not in the PDF; note: a sentence below the plot;
    page, scripts: what the page draws from, and the files that draw it.
    """

    id: str = ""
    figure: Callable[[], Figure] | None = None
    caption: str = ""
    data: Callable[[], Sequence[Table | Curves]] = tuple
    note: str = ""
    look: str = ""
    page: Mapping[str, Any] = field(default_factory=dict)
    scripts: tuple[str, ...] = ()

    @property
    def on(self) -> On:
        """Where there is something to show."""
        return (PAGE if self.id else On(0)) | (PRINT if self.figure else On(0))


@dataclass(frozen=True)
class Pickers:
    """Choices above a plot of the page: (label, id, options as (value, text), if not from a script)."""

    choices: tuple[tuple[str, str, tuple[tuple[str, str], ...]], ...]
    on: On = PAGE


@dataclass(frozen=True)
class Widget:
    """A piece of the page that moves or is picked from: a macro of `parts.html.j2` with its arguments, and
    what its script draws from.
    """

    name: str
    args: Mapping[str, Any]
    page: Mapping[str, Any] = field(default_factory=dict)
    on: On = PAGE


@dataclass(frozen=True)
class Box:
    """Parts in a box of the page, of that look; as they come elsewhere."""

    look: str
    parts: Parts
    on: On = EVERYWHERE


@dataclass(frozen=True)
class Fold:
    """Parts that the page folds away under a summary; as they come elsewhere."""

    summary: str
    parts: Parts
    open: bool = False
    on: On = EVERYWHERE


Part: TypeAlias = Text | Bullets | Heading | Code | Tabular | Drawing | Pickers | Widget | Box | Fold
Parts: TypeAlias = Sequence[Part | None]
"""None: what a result does not have."""


def given(table: Table | None, **look: Any) -> Tabular | None:
    """A table that a result may have, under its title."""
    return None if table is None else Tabular(table, heading=True, **look)


def note(text: str) -> Text:
    """A remark on the page alone; the PDF has it in the caption of a figure."""
    return Text(text, "note", PAGE)


@dataclass(frozen=True)
class Section:
    """A section: anchor and title, its parts (left out where it has none), and the label of its link on the
    page (default: the title).
    """

    anchor: str
    title: str
    parts: Parts
    label: str = ""


Tiles: TypeAlias = tuple[tuple[str, str, str], ...]
"""The few numbers that are read first: what, value, what it means."""


@dataclass(frozen=True)
class Report:
    """What is said of a result: tiles, the opening below them, and sections.

    Verdict and notes are the result's own, and stand above all.
    """

    tiles: Tiles
    opening: Parts
    sections: Sequence[Section]

    def shown(self, on: On) -> list[Part]:
        """All parts that are shown there, in order."""
        return visible([*self.opening, *(part for section in self.sections for part in section.parts)], on)


GAP = "Gap: RMS difference of model and measurement, over the measurement's own noise; 1 is perfect."
"""Stands on every page and in every PDF that has a gap."""


def speaks_of_gap(report: Report) -> bool:
    """Whether a tile or a table has a gap."""
    tables = [part.table for part in report.shown(PRINT) if isinstance(part, Tabular)]
    heads = [column.heading for table in tables for column in table.columns]
    return any(text.lower().startswith("gap") for text in [*heads, *(tile[0] for tile in report.tiles)])


def visible(parts: Parts, on: On) -> list[Part]:
    """The parts that are shown there; but on the page, boxes and folds are opened."""
    found: list[Part] = []
    for part in parts:
        if part is None or not part.on & on:
            continue
        if isinstance(part, Box | Fold):
            inside = visible(part.parts, on)
            title = [Heading(part.summary)] if isinstance(part, Fold) else []
            found += [] if not inside else [part] if on is PAGE else [*title, *inside]
        else:
            found.append(part)
    return found


def drawn(parts: Parts) -> Iterator[Drawing | Widget]:
    """What the scripts of the page draw, in boxes and folds, too."""
    for part in visible(parts, PAGE):
        if isinstance(part, Box | Fold):
            yield from drawn(part.parts)
        elif isinstance(part, Drawing | Widget):
            yield part


def origin(result: Header, label: str = "Study", asked: Parts | None = None) -> list[Section]:
    """The last two sections: what was asked, with the source of each value, and provenance.

    asked: what stands there in place of the config and its settings.
    """
    own = _settings(result.provenance) if asked is None else asked
    provenance = Section("provenance", "Provenance", [Tabular(provenance_table(result))])
    return [Section("asked", "What was asked", own, label), provenance]


def _settings(provenance: Provenance) -> Parts:
    defaults = default_table(provenance)
    return [
        Code(provenance.config) if provenance.config else None,
        given(given_table(provenance), sort="given", limit=20),
        Fold(defaults.title, [Tabular(defaults)]) if defaults else None,
    ]

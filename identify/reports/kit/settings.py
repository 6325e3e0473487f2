"""What was asked, setting by setting, with the source of each value; and where a result comes from."""

from __future__ import annotations

import re
from collections.abc import Iterable

from identify.reports.kit.cells import Table, number, words
from identify.results.header import Header
from identify.results.setting_table import DEFAULT
from identify.results.tables import Provenance

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

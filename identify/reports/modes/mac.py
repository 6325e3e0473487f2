"""What `identify mac` shows: both sets of modes, their pairs, MAC and COMAC, as tables and as a picture."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np
from rich.console import Console

from identify.core.arrays import Array
from identify.core.atomic import write_atomically
from identify.core.errors import InputError
from identify.measured.modal_table import ModalTable
from identify.modes.compare_shapes import ShapeComparison
from identify.reports.kit import figures
from identify.reports.kit import plotting as mpl
from identify.reports.kit.cells import Column, Table, number, percent, signed, words
from identify.reports.kit.terminal import print_table

_PICTURES = (".png", ".svg", ".pdf")


def show(found: ShapeComparison) -> None:
    """Print the tables and the notes."""
    console = Console()
    for table in tables(found):
        print_table(console, table)
        if table.note:
            console.print(table.note, highlight=False)
    for note in found.notes:
        console.print(f"note: {note}", highlight=False, markup=False)


def tables(found: ShapeComparison) -> list[Table]:
    """Modes of each file; pairs, with what is left over; channels from the worst."""
    own = [_modes(found.name_a, found.a, found.rigid_a)]
    if found.a is found.b:
        return own
    shown = [*own, _modes(found.name_b, found.b, found.rigid_b), _pairs(found)]
    return shown if found.comac is None else [*shown, _channels(found)]


def _modes(name: str, table: ModalTable, rigid: Array) -> Table:
    damped = table.frequency_hz * np.sqrt(1 - np.nan_to_num(table.damping_ratio) ** 2)
    told = bool(np.isfinite(rigid).any())
    columns = (Column("Mode"), Column("Undamped", "Hz"), Column("Damped", "Hz"), Column("Damping ratio", "%"))
    values = zip(table.frequency_hz, damped, table.damping_ratio, rigid, strict=True)
    rows = tuple(
        (str(n + 1), number(f, 5), number(d, 5), percent(z), *([percent(part)] if told else []))
        for n, (f, d, z, part) in enumerate(values)
    )
    note = "Rigid: part of the squared motion that moves all points as one body." if told else ""
    return Table(f"Modes of {name}", (*columns, *([Column("Rigid", "%")] if told else [])), rows, note)


def _pairs(found: ShapeComparison) -> Table:
    pairs = found.pairs
    rows = [
        (
            number(found.a.frequency_hz[i], 5),
            number(found.b.frequency_hz[j], 5),
            signed(100 * pairs.frequency_error[n]),
            signed(100 * pairs.damping_error[n]),
            number(np.nan if found.mac is None else found.mac[i, j], 3),
            number(pairs.mac[n], 3),
        )
        for n, (i, j) in enumerate(zip(pairs.a, pairs.b, strict=True))
    ]
    left = [
        f"only in {name}: {', '.join(number(f) for f in table.frequency_hz[rest])} Hz"
        for name, table, rest in (
            (found.name_a, found.a, pairs.unpaired_a),
            (found.name_b, found.b, pairs.unpaired_b),
        )
        if len(rest)
    ]
    common = f"{len(pairs.channels)} channels in common" if pairs.channels else "no shapes in common"
    columns = (
        Column(found.name_a, "Hz"),
        Column(found.name_b, "Hz"),
        Column("Frequency", "%"),
        Column("Damping", "%"),
        Column("MAC"),
        Column("MACX"),
    )
    note = "; ".join([common, *left])
    return Table("Pairs: what the second differs by from the first", columns, tuple(rows), note)


def _channels(found: ShapeComparison) -> Table:
    assert found.comac is not None
    order = np.argsort(found.comac)
    rows = tuple((str(found.pairs.channels[i]), number(found.comac[i], 3)) for i in order[:10])
    note = f"the least of {len(order)}" if len(order) > 10 else ""
    return Table("COMAC over the pairs", (words("Channel"), Column("COMAC")), rows, note)


def picture(found: ShapeComparison) -> mpl.Figure:
    """The MAC matrix; InputError where shapes are missing."""
    if found.mac is None:
        raise InputError(found.name_b, "no shapes that both have", "shapes at common channels")
    drawn = figures.Mac(
        "MAC",
        found.mac,
        found.a.frequency_hz,
        found.b.frequency_hz,
        f"{found.name_a} (Hz)",
        f"{found.name_b} (Hz)",
    )
    return figures.mac([drawn])


def write_picture(found: ShapeComparison, path: Path) -> None:
    """The MAC matrix as .png, .svg or .pdf; InputError for another suffix, or where it cannot be written."""
    if path.suffix.lower() not in _PICTURES:
        raise InputError(str(path), f"suffix {path.suffix!r}", "one of " + ", ".join(_PICTURES))
    with figures.style():
        save = partial(picture(found).savefig, format=path.suffix[1:].lower(), dpi=200)
        write_atomically(path, save)

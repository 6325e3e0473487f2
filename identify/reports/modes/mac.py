"""What `identify mac` shows: both sets of modes, their pairs, MAC and COMAC, as tables and as a picture."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np
from rich.console import Console

from identify.core.arrays import Array
from identify.core.atomic import write_atomically
from identify.core.errors import InputError
from identify.measured.modal_tables import ModalTable
from identify.modes.compare_shapes import ShapeComparison
from identify.reports.kit import plotting as mpl
from identify.reports.kit.cells import Column, Table, digits, number, percent, signed, whole, words
from identify.reports.kit.figures import style
from identify.reports.kit.terminal import print_table
from identify.reports.shared.figures import Mac, mac

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
    hz, five = table.frequency_hz, digits(5)
    known = bool(np.isfinite(rigid).any())
    columns = [
        Column("Mode", "", range(1, len(hz) + 1), whole),
        Column("Undamped", "Hz", hz, five),
        Column("Damped", "Hz", hz * np.sqrt(1 - np.nan_to_num(table.damping_ratio) ** 2), five),
        Column("Damping ratio", "%", table.damping_ratio, percent),
        *([Column("Rigid", "%", rigid, percent)] if known else []),
    ]
    note = "Rigid: part of the squared motion that moves all points as one body." if known else ""
    return Table(f"Modes of {name}", columns, note)


def _pairs(found: ShapeComparison) -> Table:
    pairs = found.pairs
    left = [
        f"only in {name}: {', '.join(number(f) for f in table.frequency_hz[rest])} Hz"
        for name, table, rest in (
            (found.name_a, found.a, pairs.unpaired_a),
            (found.name_b, found.b, pairs.unpaired_b),
        )
        if len(rest)
    ]
    common = f"{len(pairs.channels)} channels in common" if pairs.channels else "no shapes in common"
    linear = np.full(len(pairs.a), np.nan) if found.mac is None else found.mac[pairs.a, pairs.b]
    columns = [
        Column(found.name_a, "Hz", found.a.frequency_hz[pairs.a], digits(5)),
        Column(found.name_b, "Hz", found.b.frequency_hz[pairs.b], digits(5)),
        Column("Frequency", "%", 100 * pairs.frequency_error, signed),
        Column("Damping", "%", 100 * pairs.damping_error, signed),
        Column("MAC", "", linear, digits(3)),
        Column("MACX", "", pairs.mac, digits(3)),
    ]
    return Table("Pairs: difference of the second from the first", columns, "; ".join([common, *left]))


def _channels(found: ShapeComparison) -> Table:
    assert found.comac is not None
    order = np.argsort(found.comac)
    columns = [
        words("Channel", [found.pairs.channels[i] for i in order[:10]]),
        Column("COMAC", "", found.comac[order[:10]], digits(3)),
    ]
    return Table("COMAC over the pairs", columns, f"the least of {len(order)}" if len(order) > 10 else "")


def picture(found: ShapeComparison) -> mpl.Figure:
    """The MAC matrix; InputError where shapes are missing."""
    if found.mac is None:
        raise InputError(found.name_b, "no shapes that both have", "shapes at common channels")
    hz, sides = (found.a.frequency_hz, found.b.frequency_hz), (found.name_a, found.name_b)
    return mac([Mac("MAC", found.mac, *hz, *sides)])


def write_picture(found: ShapeComparison, path: Path) -> None:
    """The MAC matrix as .png, .svg or .pdf; InputError for another suffix, or where it cannot be written."""
    if path.suffix.lower() not in _PICTURES:
        raise InputError(str(path), f"suffix {path.suffix!r}", "one of " + ", ".join(_PICTURES))
    with style():
        save = partial(picture(found).savefig, format=path.suffix[1:].lower(), dpi=200)
        write_atomically(path, save)

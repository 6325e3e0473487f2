"""Two sets of modes side by side, from any files and without a robot: pairs, MAC, COMAC.

A set of modes is a result of `identify modes`, a modal table (.yaml, .csv) or a universal file with datasets
55 or 2414.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from identify.core.arrays import Array
from identify.core.errors import InputError
from identify.measured.channel import Channel
from identify.measured.finding import listing
from identify.measured.loaders import FORMAT_OF_SUFFIX
from identify.measured.modal_table import ModalTable
from identify.measured.modal_tables import read_modal_table
from identify.measured.uff.geometry import channel_axes
from identify.measured.uff.shapes import read_shapes
from identify.modal.mac import auto_mac, comac, mac
from identify.modal.pairing import Pairing, common_channels, pair
from identify.modal.turned import Axes, in_one_frame
from identify.results import file as result_file
from identify.results.modes import AnalysedMeasurement, ModesResult, ModeTable


@dataclass(frozen=True)
class ShapeComparison:
    """Modes of two files.  pairs: with the MAC that does not change where a shape is conjugated (MACX); mac
    (m, n): the plain one on the common channels, None where shapes are missing; comac (channels,) over the
    pairs; name_*: the files' names;
    notes: sentences on what was left out or turned.
    """

    name_a: str
    name_b: str
    a: ModalTable
    b: ModalTable
    pairs: Pairing
    mac: Array | None
    comac: Array | None
    notes: tuple[str, ...] = ()


def read_modes(path: Path, measurement: str | None = None) -> ModalTable:
    """The modes in a file of any kind; measurement: which one of a result with several.

    InputError for a file that holds no modes, or several sets of them and no word which.
    """
    suffix = path.suffix.lower()
    if suffix in result_file.SUFFIXES:
        return _table(_of_result(path, measurement).modes, str(path))
    if FORMAT_OF_SUFFIX.get(suffix) == "uff":
        return read_shapes(path)
    return read_modal_table(path)


def _of_result(path: Path, measurement: str | None) -> AnalysedMeasurement:
    found = result_file.read(path, ModesResult).measurements
    if measurement is None and len(found) > 1:
        raise InputError(
            str(path), f"{len(found)} measurements", "one", f"add `:NAME`, of {', '.join(found)}, to the file"
        )
    if measurement is not None and measurement not in found:
        raise InputError(str(path), f"no measurement {measurement!r}", "one of " + ", ".join(found))
    return found[measurement or next(iter(found))]


def _table(modes: ModeTable, source: str) -> ModalTable:
    return ModalTable(
        frequency_hz=modes.frequency_hz,
        damping_ratio=modes.damping_ratio,
        channels=tuple(Channel.parse(name, source) for name in modes.channels),
        shapes=modes.shapes,
        frequency_std_hz=modes.frequency_std_hz,
        damping_std=modes.damping_std,
        source=source,
    )


def _named(text: str) -> tuple[Path, str | None]:
    """The file and the measurement of `FILE` or `FILE:MEASUREMENT`."""
    path, colon, measurement = text.rpartition(":")
    if colon and not Path(text).exists() and Path(path).suffix:
        return Path(path), measurement
    return Path(text), None


def _axes(text: str, table: ModalTable) -> Axes:
    """Which way the channels of the modes of a file look, as far as the file says it."""
    path, measurement = _named(text)
    if path.suffix.lower() in result_file.SUFFIXES:
        geometry = _of_result(path, measurement).geometry
        if geometry is None or geometry.axes is None:
            return {}
        return dict(zip(geometry.nodes.tolist(), geometry.axes, strict=True))
    if FORMAT_OF_SUFFIX.get(path.suffix.lower()) == "uff":
        return channel_axes(path, {channel.node for channel in table.channels})
    return {}


def compare_modes(first: str, second: str | None = None) -> ShapeComparison:
    """Modes of two files paired, each `FILE` or `FILE:MEASUREMENT`; of one with itself without a second.

    Shapes are compared along the same directions where both files say which way their channels look.
    """
    a = read_modes(*_named(first))
    notes = _notes(a)
    if second is None:
        b = a
    else:
        b = read_modes(*_named(second))
        notes += _notes(b)
        a, b, turned = in_one_frame(a, _axes(first, a), b, _axes(second, b))
        notes += _said(turned)
    pairs = pair(a, b)
    return ShapeComparison(
        name_a=Path(first).name,
        name_b=Path(second or first).name,
        a=a,
        b=b,
        pairs=pairs,
        mac=_mac(a, b),
        comac=_comac(a, b, pairs),
        notes=notes,
    )


def _notes(table: ModalTable) -> tuple[str, ...]:
    return tuple(f"{table.source}: {note}" for note in table.notes)


def _said(turned: list[int]) -> tuple[str, ...]:
    if not turned:
        return ()
    where = f"node{'s' * (len(turned) > 1)} {listing(turned)}"
    return (f"the channels of the two files look in different directions at {where}: shapes were turned",)


def _mac(a: ModalTable, b: ModalTable) -> Array | None:
    if a.shapes is None or b.shapes is None:
        return None
    if a is b:
        return auto_mac(a.shapes)
    in_a, in_b, sign = common_channels(a, b)
    return mac(a.shapes[:, in_a], b.shapes[:, in_b] * sign) if len(in_a) else None


def _comac(a: ModalTable, b: ModalTable, pairs: Pairing) -> Array | None:
    if pairs.mac_matrix is None or not len(pairs):
        return None
    assert a.shapes is not None and b.shapes is not None
    in_a, in_b, sign = common_channels(a, b)
    one, other = a.shapes[np.ix_(pairs.a, in_a)], b.shapes[np.ix_(pairs.b, in_b)] * sign
    still = ~np.any(one, axis=0) & ~np.any(other, axis=0)  # at which nothing can be compared
    return np.asarray(np.where(still, np.nan, comac(one, other)))

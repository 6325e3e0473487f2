"""Two sets of modes side by side, from any files and without a robot: pairs, MAC, COMAC.

A set of modes is a result of `identify modes`, a modal table (.yaml, .csv) or a universal file with datasets
55 or 2414.
"""

from __future__ import annotations

import contextlib
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from identify.core.arrays import Array
from identify.core.errors import InputError
from identify.core.text import count
from identify.measured.channel import Channel
from identify.measured.finding import listing
from identify.measured.geometry import MeasuredGeometry
from identify.measured.loaders import FORMAT_OF_SUFFIX
from identify.measured.modal_tables import ModalTable, read_modal_table
from identify.measured.uff.geometry import channel_axes, has_geometry, read_geometry
from identify.measured.uff.shapes import read_shapes
from identify.modal.mac import auto_mac, comac, mac
from identify.modal.pairing import Pairing, common_channels, pair
from identify.modal.turned import Axes, contained, in_one_frame, rigid_part, rigid_rows
from identify.modes.places import Placed, by_place, elsewhere
from identify.results import file as result_file
from identify.results.modes import AnalysedMeasurement, ModesResult, ModeTable


@dataclass(frozen=True)
class ShapeComparison:
    """Modes of two files.  pairs: with the MAC that does not change where a shape is conjugated (MACX); mac
    (m, n): the plain one on the common channels, None where shapes are missing; comac (channels,) over the
    pairs; name_*: the files' names;
    rigid_a (m,), rigid_b (n,): rigid part of each mode, NaN where points are not known; notes: sentences on
    what was paired, left out or turned, and on rigid modes.
    """

    name_a: str
    name_b: str
    a: ModalTable
    b: ModalTable
    pairs: Pairing
    mac: Array | None
    comac: Array | None
    rigid_a: Array
    rigid_b: Array
    notes: tuple[str, ...] = ()


def read_modes(path: Path, measurement: str | None = None) -> ModalTable:
    """The modes in a file of any kind; measurement: which one of a result with several.

    InputError for a file that holds no modes, or several sets of them and no word which.
    """
    suffix = path.suffix.lower()
    if suffix in result_file.SUFFIXES:
        return _table(_of_result(path, measurement).modes, str(path))
    if FORMAT_OF_SUFFIX.get(suffix) == "uff":
        return read_shapes(path, rigid_too=True)
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


def _placed(text: str) -> Placed:
    """The modes of a file with where its points are, as far as it says that."""
    path, measurement = _named(text)
    table = read_modes(path, measurement)
    geometry, suffix = None, path.suffix.lower()
    if suffix in result_file.SUFFIXES:
        drawn = _of_result(path, measurement).geometry
        if drawn is not None and drawn.axes is not None:
            geometry = MeasuredGeometry(tuple(drawn.nodes.tolist()), drawn.points, drawn.axes)
    elif FORMAT_OF_SUFFIX.get(suffix) == "uff" and has_geometry(path):
        with contextlib.suppress(
            InputError
        ):  # as of systems that are no Cartesian ones: places are not known
            geometry = read_geometry(path, or_else="m")
    return Placed(table, geometry, _axes(text, table))


def compare_modes(
    first: str, second: str | None = None, by: str | None = None, within_m: float | None = None
) -> ShapeComparison:
    """Modes of two files paired, each `FILE` or `FILE:MEASUREMENT`; of one with itself without a second.

    Shapes are compared along the same directions where both files say which way their channels look.  by:
    "node" or "place" pairs points by number or by where they are, within_m of each other; by default by
    number where the files have one in common.  InputError for another word, and places that are not known.
    """
    if by not in (None, "node", "place"):
        raise InputError("--by", repr(by), "node or place")
    if within_m is not None and (by != "place" or not within_m > 0):
        raise InputError(
            "--within", f"{within_m:g} beside --by {by}", "a distance above 0, m, with --by place"
        )
    one = _placed(first)
    if second is None:
        return _compared(one, one, (first, first), _notes(one.table))
    other = _placed(second)
    if by == "place" or (by is None and _only_by_place(one, other)):
        other, said = by_place(one, other, within_m)
    else:
        said = elsewhere(one, other)
    a, b, turned = in_one_frame(one.table, one.axes, other.table, other.axes)
    notes = (*_notes(one.table), *_notes(other.table), *([said] if said else []), *_said(turned))
    return _compared(replace(one, table=a), replace(other, table=b), (first, second), notes)


def _only_by_place(a: Placed, b: Placed) -> bool:
    """Whether no node has a number in common, but places are known."""
    common = {c.node for c in a.table.channels} & {c.node for c in b.table.channels}
    return not common and bool(a.nodes and b.nodes)


def _compared(one: Placed, other: Placed, names: tuple[str, str], notes: tuple[str, ...]) -> ShapeComparison:
    """The comparison of tables whose channels are the same."""
    parts = rigid_part(one.table, one.geometry), rigid_part(other.table, other.geometry)
    if one is not other:
        notes = (*notes, *_rigid(one.table, other.table, parts))
    a, rigid_a, left_a = _above_zero(one.table, parts[0])
    b, rigid_b, left_b = (a, rigid_a, ()) if one is other else _above_zero(other.table, parts[1])
    pairs = pair(a, b)
    return ShapeComparison(
        name_a=Path(names[0]).name,
        name_b=Path(names[1]).name,
        a=a,
        b=b,
        pairs=pairs,
        mac=_mac(a, b),
        comac=_comac(a, b, pairs),
        rigid_a=rigid_a,
        rigid_b=rigid_b,
        notes=(*notes, *left_a, *left_b),
    )


def _above_zero(table: ModalTable, part: Array) -> tuple[ModalTable, Array, tuple[str, ...]]:
    """The modes above 0 Hz with their rigid parts, and a sentence on those at 0 Hz."""
    above = table.frequency_hz > 0
    rigid = int(np.sum(~above))
    if not rigid:
        return table, part, ()
    table = replace(
        table,
        frequency_hz=table.frequency_hz[above],
        damping_ratio=table.damping_ratio[above],
        shapes=None if table.shapes is None else table.shapes[above],
        frequency_std_hz=None if table.frequency_std_hz is None else table.frequency_std_hz[above],
        damping_std=None if table.damping_std is None else table.damping_std[above],
        modal_mass_kg=None,
        modal_mass_std_kg=None,
    )
    what = f"{count(rigid, 'mode')} at 0 Hz (rigid motion) {'is' if rigid == 1 else 'are'} not listed"
    return table, part[above], (f"{table.source}: {what}",)


def _rigid(a: ModalTable, b: ModalTable, parts: tuple[Array, Array]) -> tuple[str, ...]:
    """A sentence on rigid modes of two files: what of the motion of the first's those of the second hold."""
    rows = [rigid_rows(table, part) for table, part in zip((a, b), parts, strict=True)]
    in_a, in_b, sign = common_channels(a, b)
    if not all(map(len, rows)) or a.shapes is None or b.shapes is None or len(in_a) <= len(rows[1]):
        return ()
    inside = contained(a.shapes[np.ix_(rows[0], in_a)], b.shapes[np.ix_(rows[1], in_b)] * sign)
    least = int(np.argmin(inside))
    own, others = count(len(rows[0]), "mode"), len(rows[1])
    return (
        f"rigid modes as a space: of the {own} of {Path(a.source).name} the {others} of {Path(b.source).name}"
        f" hold {100 * inside[least]:.4g} % of the squared motion or more, least of that at"
        f" {a.frequency_hz[rows[0][least]]:.4g} Hz",
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

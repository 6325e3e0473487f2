"""Mode shapes in and out: universal datasets 55 and 2414 read as a modal table, 55 written with the geometry
(15, 18, 82).

Formats: SDRC universal datasets 55 (1987) and 2414 (3-Oct-1994), analysis types 2 (normal mode), 3 and 7
(complex eigenvalue). The format has a place for every direction of a node, measured or not: a component that
is exactly 0 in every mode is taken as not measured.  Channels are positive here; one measured against its
axis is written with its sign turned.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from identify.core.arrays import Complex
from identify.core.errors import InputError
from identify.core.files import sha256_of
from identify.core.text import count
from identify.measured.channel import Channel
from identify.measured.geometry import MeasuredGeometry
from identify.measured.modal_tables import ModalTable
from identify.measured.uff.blocks import Block, blocks
from identify.measured.uff.geometry import geometry_text, reals_text

_NORMAL, _COMPLEX = (2,), (3, 7)
_VALUES = {(1, 1): 1, (2, 3): 3, (3, 6): 6}
_POWER = {8: 0, 11: 1, 12: 2}
_EXPORT = "export the shapes again (dataset 55 or 2414)"


@dataclass(frozen=True)
class _Mode:
    """One dataset: pole (rad/s; damping NaN in its real part where the file has none) and values by node,
    (values of a node,).
    """

    frequency_hz: float
    damping_ratio: float
    values: dict[int, Complex]
    where: str


def read_shapes(path: Path, *, rigid_too: bool = False) -> ModalTable:
    """The modes of a universal file, by frequency, with their shapes; damping NaN where the file gives none.

    Shapes stored as velocity or acceleration become displacement; rigid motion, which a free structure has at
    0 Hz, is left out, and `notes` says so; rigid_too: it is not.  InputError for a file without modes, for
    modes at different nodes, and for anything out of its columns, with the line.
    """
    modes, rigid = _modes(path, rigid_too)
    size = _directions(modes)
    nodes = sorted(modes[0].values)
    shapes = np.array([[mode.values[node] for node in nodes] for mode in modes]).reshape(len(modes), -1)
    channels = [Channel(node, 0 if size == 1 else k + 1) for node in nodes for k in range(size)]
    measured = np.flatnonzero(np.any(shapes != 0, axis=0))
    return ModalTable(
        frequency_hz=np.array([mode.frequency_hz for mode in modes]),
        damping_ratio=np.array([mode.damping_ratio for mode in modes]),
        channels=tuple(channels[i] for i in measured),
        shapes=shapes[:, measured],
        source=str(path),
        sha256=sha256_of(path, "a universal file"),
        notes=(f"{count(rigid, 'mode')} at 0 Hz (rigid motion) {'was' if rigid == 1 else 'were'} left out",)
        if rigid
        else (),
    )


def _modes(path: Path, rigid_too: bool) -> tuple[list[_Mode], int]:
    """The modes of a file, by frequency, and how many of rigid motion were left out; InputError for none."""
    read = [_mode(block) for block in blocks(path) if block.number in (55, 2414)]
    found = [mode for mode in read if mode is not None]
    modes = [mode for mode in found if mode.frequency_hz > 0 or rigid_too]
    rigid = len(found) - len(modes)
    if found and not modes:
        raise InputError(str(path), f"{count(rigid, 'mode')} at 0 Hz alone", "modes above 0 Hz")
    if not modes:
        raise InputError(str(path), "no mode shapes", "datasets 55 or 2414 with analysis type 2, 3 or 7")
    return sorted(modes, key=lambda mode: mode.frequency_hz), rigid


def _directions(modes: Sequence[_Mode]) -> int:
    """Values of a node; InputError for modes at different nodes, or of different directions."""
    first = modes[0].values
    size = len(next(iter(first.values())))
    for mode in modes:
        if mode.values.keys() != first.keys() or any(len(value) != size for value in mode.values.values()):
            found = "a shape at other nodes or with other directions than the first"
            raise InputError(mode.where, found, "the same for all modes", _EXPORT)
    return size


def _mode(block: Block) -> _Mode | None:
    """A dataset as a mode, or nothing where it is not one (static, transient, on elements, ...)."""
    if block.number == 2414:
        block.integers(1)
        block.line()
        if block.integers(1)[0] != 1:
            return None
    for _ in range(5):
        block.line()
    where = block.where
    _, analysis, characteristic, quantity, kind, per_node = block.integers(6)[:6]
    if analysis not in (*_NORMAL, *_COMPLEX):
        return None
    size = _VALUES.get((characteristic, per_node))
    if size is None or kind not in (2, 4, 5, 6):
        found = f"data characteristic {characteristic} with {per_node} values a node of type {kind}"
        raise InputError(where, found, "1 scalar, 3 or 6 translations and rotations, type 2 or 5", _EXPORT)
    frequency, damping, pole = _pole55(block, analysis) if block.number == 55 else _pole2414(block, analysis)
    if not frequency >= 0:
        raise InputError(where, f"a mode at {frequency:g} Hz", "a frequency of 0 or more", _EXPORT)
    # What moves at 0 Hz has no velocity to be turned into a displacement, and is left out.
    factor = pole ** -_POWER.get(quantity, 0) if frequency > 0 else 1.0
    return _Mode(
        frequency,
        damping,
        {node: factor * v for node, v in _values(block, size, kind in (5, 6)).items()},
        where,
    )


def _pole55(block: Block, analysis: int) -> tuple[float, float, complex]:
    """Frequency, damping ratio and pole from records 7 and 8."""
    _, reals = block.integers(2)[:2]
    values = block.reals(reals)
    if len(values) < (3 if analysis in _NORMAL else 2):
        raise InputError(
            block.where,
            f"{len(values)} numbers in record 8",
            "frequency, mass and damping, or an eigenvalue",
            _EXPORT,
        )
    if analysis in _NORMAL:
        return _normal(values[0], values[2], values[3] if len(values) > 3 else 0.0)
    return _eigenvalue(complex(values[0], values[1]))


def _pole2414(block: Block, analysis: int) -> tuple[float, float, complex]:
    """The same from records 10 to 13, where everything has its place."""
    block.integers(8)
    block.integers(1)
    first, second = block.reals(6), block.reals(6)
    if analysis in _NORMAL:
        return _normal(first[1], first[4], first[5])
    return _eigenvalue(complex(second[0], second[1]))


def _normal(frequency: float, viscous: float, hysteretic: float) -> tuple[float, float, complex]:
    """No mode has no damping, so 0 means that it is not known; a loss factor is twice a damping ratio at
    resonance.
    """
    damping = viscous or hysteretic / 2 or np.nan
    return float(frequency), float(damping), 2j * np.pi * float(frequency)


def _eigenvalue(pole: complex) -> tuple[float, float, complex]:
    pole = complex(pole.real, abs(pole.imag))
    size = abs(pole)
    return size / (2 * np.pi), -pole.real / size if size > 0 else np.nan, pole


def _values(block: Block, size: int, is_complex: bool) -> dict[int, Complex]:
    """Node number I10 and its values 6E13.5, real and imaginary part in turn, until the dataset ends."""
    values: dict[int, Complex] = {}
    while not block.done:
        node = block.integers(1)[0]
        numbers = block.reals(size * (1 + is_complex))
        if node in values:
            raise InputError(block.where, f"node {node} a second time", "each node once", _EXPORT)
        values[node] = numbers[0::2] + 1j * numbers[1::2] if is_complex else numbers.astype(complex)
    return values


def write_shapes(path: Path, table: ModalTable, geometry: MeasuredGeometry | None = None) -> None:
    """Write shapes after their geometry; InputError as `shapes_text`."""
    text = "" if geometry is None else geometry_text(geometry)
    path.write_text(text + shapes_text(table, str(path)), encoding="ascii", newline="\n")


def shapes_text(table: ModalTable, where: str) -> str:
    """Shapes (complex, dataset 55 with analysis type 3); values keep 6 digits.

    Modal A is 2j omega_d times the modal mass of the shape as it stands, so that a residue is the product of
    two components over it; 0 where no modal mass is known.

    InputError where the table has no shapes or unknown damping, which the format cannot say.
    """
    if table.shapes is None or not np.isfinite(table.shapes).all():
        raise InputError(
            where, "a modal table without shapes, or with unknown components", "shapes at all channels"
        )
    if not np.isfinite(table.damping_ratio).all():
        raise InputError(
            where,
            "a mode with unknown damping",
            "a damping ratio for every mode",
            "complete the modal table",
        )
    return "".join(_dataset55(table, r) for r in range(len(table)))


def _dataset55(table: ModalTable, r: int) -> str:
    frequency, damping = float(table.frequency_hz[r]), float(table.damping_ratio[r])
    size = 2 * np.pi * frequency
    pole = size * complex(-damping, np.sqrt(1 - damping**2))
    mass = 0.0 if table.modal_mass_kg is None else float(np.nan_to_num(table.modal_mass_kg[r]))
    modal_a = 2j * pole.imag * mass
    numbers = np.array([pole, modal_a, -pole * modal_a])
    eigenvalue = np.stack([numbers.real, numbers.imag], axis=1).ravel() + 0.0
    per_node = _per_node(table)
    characteristic = next(key[0] for key, count in _VALUES.items() if count == per_node)
    head = ["MODE SHAPE", f"{frequency:.6g} Hz, damping ratio {damping:.6g}", "NONE", "NONE", "NONE"]
    text = "    -1\n    55\n" + "".join(f"{line}\n" for line in head)
    text += "".join(f"{value:10d}" for value in (1, 3, characteristic, 8, 5, per_node)) + "\n"
    text += "".join(f"{value:10d}" for value in (2, 6, 1, r + 1)) + "\n" + reals_text(eigenvalue)
    for node, values in _by_node(table, r, per_node).items():
        text += f"{node:10d}\n" + reals_text(np.stack([values.real, values.imag], axis=1).ravel())
    return text + "    -1\n"


def _per_node(table: ModalTable) -> int:
    largest = max(abs(channel.direction) for channel in table.channels if channel.motor is None)
    return 1 if largest == 0 else 3 if largest <= 3 else 6


def _by_node(table: ModalTable, r: int, per_node: int) -> dict[int, Complex]:
    """Values of each node along its positive axes, 0 where not measured; motors have none."""
    assert table.shapes is not None
    values: dict[int, Complex] = {}
    for channel, value in zip(table.channels, table.shapes[r], strict=True):
        if channel.motor is not None:
            continue
        place = 0 if per_node == 1 else channel.axis
        values.setdefault(channel.node, np.zeros(per_node, dtype=complex))[place] = channel.sign * value
    return dict(sorted(values.items()))

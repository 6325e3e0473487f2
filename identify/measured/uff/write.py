"""FRF sets written as universal files: ASCII double precision (58) or binary (58b), each FRF followed by its
coherence.

What the format has no place for (averages, window decay) goes into the ID lines as text and is not read back.

Geometry written as programs of today read it: datasets 164 (SI), 2420, 2411 and 2412.

Formats: SDRC universal datasets 2411 (1987), 2412 and 2420 (1994).  Positions stand in the common frame,
channels in the displacement system of their node; lines between nodes are rods (element type 11).
"""

from __future__ import annotations

from itertools import pairwise, product
from pathlib import Path

import numpy as np

from identify.core.arrays import Array, Complex
from identify.measured.channel import Channel
from identify.measured.frf_set import POWER, FrfSet
from identify.measured.geometry import MeasuredGeometry

_CODES = (8, 11, 12)
_LABELS = ("Displacement", "Velocity", "Acceleration")
_ROD = 11


def write_uff58(path: Path, frf_set: FrfSet, binary: bool = False) -> None:
    """Write all measured pairs in SI units, but those of motors, which the format has no place for.

    Binary files keep every bit.  ASCII keeps 13 digits of the values (E20.12), and about 10 of the
    frequencies, as 13 columns allow.
    """
    parts: list[bytes] = []
    for i, j in product(range(len(frf_set.outputs)), range(len(frf_set.inputs))):
        if frf_set.outputs[i].motor or frf_set.inputs[j].motor:
            continue
        if not np.isnan(frf_set.frf[:, i, j]).all():
            parts.append(_dataset(frf_set, (i, j), frf_set.frf[:, i, j], binary))
            if frf_set.coherence is not None and not np.isnan(frf_set.coherence[:, i, j]).all():
                parts.append(_dataset(frf_set, (i, j), frf_set.coherence[:, i, j], binary))
    path.write_bytes(b"".join(parts))


def _dataset(frf_set: FrfSet, pair: tuple[int, int], values: Array | Complex, binary: bool) -> bytes:
    """One dataset with its opening and closing -1."""
    frequency_hz, is_frf = frf_set.frequency_hz, np.iscomplexobj(values)
    step = float(frequency_hz[1] - frequency_hz[0]) if len(frequency_hz) > 1 else 1.0
    start_text, step_text = _thirteen(float(frequency_hz[0])), _thirteen(step)
    rebuilt = float(start_text) + float(step_text) * np.arange(len(frequency_hz))
    even = (
        np.array_equal(rebuilt, frequency_hz)
        if binary
        else np.allclose(rebuilt, frequency_hz, rtol=1e-9, atol=0)
    )
    if not even:
        start_text = step_text = _thirteen(0.0)
    columns = ([] if even else [frequency_hz]) + ([values.real, values.imag] if is_frf else [values.real])
    table = np.stack(columns, axis=1)
    spacing = (
        f"{6 if is_frf else 4:10d}{len(values):10d}{int(even):10d}{start_text}{step_text}{_thirteen(0.0)}"
    )
    ids = [line.ljust(80) for line in _ids(frf_set, pair, is_frf)]
    header = "\n".join([*ids, _dofs(frf_set, pair, is_frf), spacing, *_axes(frf_set, pair, is_frf)]) + "\n"
    if binary:
        data = table.astype("<f8").tobytes()
        head = f"    -1\n    58b     1     2          11{len(data):12d}     0     0           0           0\n"
        return (head + header).encode() + data + b"    -1\n"
    return f"    -1\n    58\n{header}{_ascii(table, even)}    -1\n".encode()


def _ids(frf_set: FrfSet, pair: tuple[int, int], is_frf: bool) -> list[str]:
    """The five ID lines; none may be blank."""
    name = f"{'FRF' if is_frf else 'Coherence'} {frf_set.outputs[pair[0]]} / {frf_set.inputs[pair[1]]}"
    averages = f"averages {frf_set.averages}" if frf_set.averages is not None else "averages not known"
    return [name, f"{averages}, window decay {frf_set.window_decay_per_s:.9g} 1/s", "NONE", "NONE", "NONE"]


def _dofs(frf_set: FrfSet, pair: tuple[int, int], is_frf: bool) -> str:
    """Record 6, 2(I5,I10),2(1X,10A1,I10,I4)."""
    ends = "".join(
        f" {'NONE':10s}{c.node:10d}{c.direction:4d}"
        for c in (frf_set.outputs[pair[0]], frf_set.inputs[pair[1]])
    )
    return f"{4 if is_frf else 6:5d}{0:10d}{0:5d}{0:10d}{ends}"


def _axes(frf_set: FrfSet, pair: tuple[int, int], is_frf: bool) -> list[str]:
    """Records 8 to 11, I10,3I5,2(1X,20A1)."""
    power = POWER[frf_set.quantity]
    motion = ("rad" if _turns(frf_set.outputs[pair[0]]) else "m") + ("", "/s", "/s^2")[power]
    force = "N m" if _turns(frf_set.inputs[pair[1]]) else "N"
    axes = [(18, "Frequency", "Hz"), (0, "NONE", "NONE"), (0, "NONE", "NONE"), (0, "NONE", "NONE")]
    if is_frf:
        axes[1:3] = [(_CODES[power], _LABELS[power], motion), (13, "Force", force)]
    return [f"{code:10d}{0:5d}{0:5d}{0:5d} {label:20s} {unit:20s}" for code, label, unit in axes]


def _turns(channel: Channel) -> bool:
    """Whether the channel is a rotation or a moment."""
    return abs(channel.direction) > 3


def _ascii(table: Array, even: bool) -> str:
    """Record 12 in double precision: 4E20.12, 2(E13.5,E20.12) or E13.5,2E20.12."""
    if even:
        numbers = [f"{value:20.12E}" for value in table.ravel().tolist()]
        per_line = 4
    else:
        numbers = [
            _thirteen(row[0]) + "".join(f"{value:20.12E}" for value in row[1:]) for row in table.tolist()
        ]
        per_line = 2 if table.shape[1] == 2 else 1
    return "".join("".join(numbers[i : i + per_line]) + "\n" for i in range(0, len(numbers), per_line))


def _thirteen(value: float) -> str:
    """A number of at least 0 in 13 columns: E13.5 where that is exact, else as many digits as leave a blank
    before it.
    """
    text = f"{value:13.5E}"
    digits = 12
    while float(text) != value and digits > 6:
        longer = f"{value:#.{digits}G}"
        if len(longer) <= 12:
            return longer.rjust(13)
        digits -= 1
    return text


def new_geometry_text(geometry: MeasuredGeometry) -> str:
    """The datasets, one after the other."""
    local = [n for n, axes in enumerate(geometry.axes) if not np.allclose(axes, np.eye(3), atol=1e-12)]
    systems = {n: 2 + k for k, n in enumerate(local)}
    units = _long(np.array([1.0, 1.0, 1.0, 273.15]))
    text = _block(164, f"{1:10d}{'SI: Meter (newton)':20s}{2:10d}\n{units}")
    if systems:
        rows = [
            f"{number:10d}{0:10d}{8:10d}\nSYS{number}\n"
            + "".join(_long(row) for row in (*geometry.axes[n], np.zeros(3)))
            for n, number in systems.items()
        ]
        text += _block(2420, f"{1:10d}\nPART\n" + "".join(rows))
    nodes = [
        f"{node:10d}{0:10d}{systems.get(n, 0):10d}{11:10d}\n" + _long(geometry.position_m[n])
        for n, node in enumerate(geometry.nodes)
    ]
    text += _block(2411, "".join(nodes))
    rods = [pair for line in geometry.lines for pair in pairwise(line)]
    elements = [
        f"{number:10d}{_ROD:10d}{1:10d}{1:10d}{7:10d}{2:10d}\n{0:10d}{1:10d}{1:10d}\n{a:10d}{b:10d}\n"
        for number, (a, b) in enumerate(rods, start=1)
    ]
    return text + (_block(2412, "".join(elements)) if elements else "")


def _block(number: int, text: str) -> str:
    return f"    -1\n{number:6d}\n{text}    -1\n"


def _long(values: Array) -> str:
    """Numbers 1P3D25.16, three a line."""
    numbers = [f"{value:25.16E}".replace("E", "D") for value in values.tolist()]
    return "".join("".join(numbers[i : i + 3]) + "\n" for i in range(0, len(numbers), 3))

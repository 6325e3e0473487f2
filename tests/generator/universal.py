"""Universal files of type 58 as analysers write them: FRFs and coherences, ASCII or binary (58b), single
precision.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tests.generator.arm import Point
from tests.generator.rigid import Array


@dataclass(frozen=True)
class Function:
    """One function of an evenly spaced frequency: complex values are an FRF (m/s^2/N), real ones a coherence;
    axes are 0, 1, 2.
    """

    frequency_hz: Array
    values: NDArray[np.complex128] | Array
    response: Point
    response_axis: int
    reference: Point
    reference_axis: int


def dataset(function: Function, binary: bool = False) -> bytes:
    """One dataset 58 from its opening to its closing -1."""
    is_frf = np.iscomplexobj(function.values)
    values = (
        np.column_stack([function.values.real, function.values.imag]).ravel()
        if is_frf
        else np.asarray(function.values)
    )
    header = (
        "\n".join(
            [
                *_names(function, is_frf),
                _record6(function, is_frf),
                _record7(function, is_frf),
                *_axes(is_frf),
            ]
        )
        + "\n"
    )
    if binary:
        data = values.astype("<f4").tobytes()
        opening = (
            f"    -1\n    58b     1     2          11{len(data):12d}     0     0           0           0\n"
        )
        return opening.encode() + header.encode() + data + b"    -1\n"
    texts = [f"{value:13.5e}" for value in values]
    rows = "\n".join("".join(texts[n : n + 6]) for n in range(0, len(texts), 6))
    return f"    -1\n    58{'':74s}\n{header}{rows}\n    -1\n".encode()


def _names(function: Function, is_frf: bool) -> list[str]:
    response = f"{function.response.name}:+{'XYZ'[function.response_axis]}"
    reference = f"{function.reference.name}:+{'XYZ'[function.reference_axis]}"
    first = f"{'H1' if is_frf else 'COH'} {response} / {reference}"
    return [first.ljust(80), *[" " * 80] * 4]


def _record6(function: Function, is_frf: bool) -> str:
    ends = ((function.response, function.response_axis), (function.reference, function.reference_axis))
    channels = "".join(f" {point.name[:10]:>10s}{point.node:10d}{axis + 1:4d}" for point, axis in ends)
    return f"{4 if is_frf else 6:5d}{0:10d}{0:5d}{0:10d}{channels}"


def _record7(function: Function, is_frf: bool) -> str:
    first, step = function.frequency_hz[0], function.frequency_hz[1] - function.frequency_hz[0]
    return (
        f"{5 if is_frf else 2:10d}{len(function.frequency_hz):10d}{1:10d}{first:13.5e}{step:13.5e}{0:13.5e}"
    )


def _axes(is_frf: bool) -> list[str]:
    ordinates = (
        [(12, "Acceleration", "m/s2"), (13, "Force", "N")]
        if is_frf
        else [(0, "Coherence", "NONE"), (0, "NONE", "NONE")]
    )
    axes = [(18, "Frequency", "Hz"), *ordinates, (0, "", "NONE")]
    return [f"{code:10d}{0:5d}{0:5d}{0:5d} {label:<20s} {unit:<20s}" for code, label, unit in axes]


@dataclass(frozen=True)
class Record:
    """One time record: node and direction (1 to 6) of the channel, its unit, values (n,)."""

    node: int
    direction: int
    unit: str
    values: Array


_KINDS = {"m/s^2": (12, "Acceleration"), "N": (13, "Force"), "rad": (8, "Displacement")}


def time_dataset(record: Record, rate: float) -> bytes:
    """One dataset 58b of a time response sampled at `rate` (Hz) from time 0, single precision."""
    data = record.values.astype("<f4").tobytes()
    opening = f"    -1\n    58b     1     2          11{len(data):12d}     0     0           0           0\n"
    code, label = _KINDS[record.unit]
    axes = [(17, "Time", "s"), (code, label, record.unit), (0, "NONE", "NONE"), (0, "", "NONE")]
    header = [
        *[" " * 80] * 5,
        (
            f"{1:5d}{0:10d}{0:5d}{0:10d} {'NONE':>10s}{record.node:10d}{record.direction:4d}"
            f" {'NONE':>10s}{0:10d}{0:4d}"
        ),
        f"{2:10d}{len(record.values):10d}{1:10d}{0.0:13.5e}{1 / rate:13.5e}{0.0:13.5e}",
        *[f"{code:10d}{0:5d}{0:5d}{0:5d} {label:<20s} {unit:<20s}" for code, label, unit in axes],
    ]
    return opening.encode() + "\n".join(header).encode() + b"\n" + data + b"\n    -1\n"

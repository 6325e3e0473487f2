"""Geometry written as programs of today read it: datasets 164 (SI), 2420, 2411 and 2412.

Formats: SDRC universal datasets 2411 (1987), 2412 and 2420 (1994).  Positions stand in the common frame,
channels in the displacement system of their node; lines between nodes are rods (element type 11).
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from identify.core.arrays import Array
from identify.measured.geometry import MeasuredGeometry

_ROD = 11


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

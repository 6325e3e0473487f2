"""Where the sensors of a file stand, for pictures of shapes."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np

from identify.core.errors import InputError
from identify.measured.geometry import MeasuredGeometry
from identify.measured.uff.geometry import has_geometry, read_geometry
from identify.results import tables


def geometry_of(
    data: Path, geometry: Path | None, length_unit: str | None, form: str | None = None
) -> tuple[MeasuredGeometry | None, list[str]]:
    """Where the sensors are, from a file of its own or the data file, and what is to be said about it.

    form: of the data file; without it the suffix decides.
    """
    if geometry is not None:
        return read_geometry(geometry, length_unit), []
    if has_geometry(data, form):
        try:
            return read_geometry(data, length_unit), []
        except InputError as error:
            if length_unit is not None:
                raise
            return None, [
                "the geometry in the data file was left out, so shapes are not drawn (`--length-unit` would"
                f" say it): {error}"
            ]
    if length_unit is not None:
        raise InputError(
            "length_unit", f"{length_unit!r} without a geometry", fix="name one with `--geometry`"
        )
    return None, [
        "no geometry was given, so shapes are not drawn: `--geometry` takes a universal file with datasets 15"
        " or 2411"
    ]


def drawn(sensors: MeasuredGeometry) -> tables.Geometry:
    """Sensors as a picture has them."""
    row = {node: n for n, node in enumerate(sensors.nodes)}
    segments = [(row[a], row[b]) for line in sensors.lines for a, b in pairwise(line)]
    return tables.Geometry(
        nodes=np.array(sensors.nodes, dtype=int),
        point_names=("",) * len(row),
        point_links=("",) * len(row),
        points=sensors.position_m,
        skeleton=np.zeros((0, 3)),
        segments=np.array(segments, dtype=int).reshape(-1, 2),
        axes=sensors.axes,
    )

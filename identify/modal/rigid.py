"""Rigid motion in shapes: how much of a mode moves the points as one body, and rigid modes of two files.

A free structure has up to six modes at 0 Hz, and on soft ropes as many a little above.  Any mixture of them
is as good a set, so single ones compare at random: what compares is the space that they span.
"""

from __future__ import annotations

import numpy as np

from identify.core.arrays import Array, Complex, Index
from identify.measured.geometry import MeasuredGeometry
from identify.measured.modal_table import ModalTable

RIGID = 0.99
"""Part of the squared motion that is rigid from which on a mode above 0 Hz stands for rigid motion: what else
it does is less than a tenth of its amplitude.  The first bending of a beam, seen across it, has 0.98."""


def rigid_part(table: ModalTable, geometry: MeasuredGeometry | None) -> Array:
    """Part of each mode's squared motion that is rigid, (m,); NaN where points are not known, or too few are
    measured to tell (no more channels than rigid motions).
    """
    unknown = np.full(len(table), np.nan)
    if table.shapes is None or geometry is None:
        return unknown
    where = {node: n for n, node in enumerate(geometry.nodes)}
    columns = [k for k, c in enumerate(table.channels) if c.node in where and 1 <= abs(c.direction) <= 3]
    columns = [k for k in columns if np.isfinite(table.shapes[:, k]).all()]
    ways = [
        table.channels[k].sign * geometry.axes[where[table.channels[k].node], table.channels[k].axis]
        for k in columns
    ]
    places = np.array([geometry.position_m[where[table.channels[k].node]] for k in columns]).reshape(-1, 3)
    motions = np.array(
        [[*way, *np.cross(at, way)] for at, way in zip(places - places.mean(axis=0), ways, strict=True)]
    )
    if not columns:
        return unknown
    left, size, _ = np.linalg.svd(
        motions / np.maximum(np.linalg.norm(motions, axis=0), 1e-300), full_matrices=False
    )
    basis = left[:, size > 1e-6 * size[0]]
    if len(columns) <= basis.shape[1]:
        return unknown
    return contained(table.shapes[:, columns], basis.T)


def contained(shapes: Complex, basis: Array | Complex) -> Array:
    """Part of the squared motion of each shape (m, channels) within the space of others (k, channels)."""
    left, size, _ = np.linalg.svd(np.asarray(basis).T, full_matrices=False)
    inside = shapes @ left[:, size > 1e-6 * size[0]].conj()
    whole = np.sum(np.abs(shapes) ** 2, axis=1)
    return np.asarray(np.sum(np.abs(inside) ** 2, axis=1) / np.maximum(whole, np.finfo(float).tiny))


def rigid_rows(table: ModalTable, part: Array) -> Index:
    """Rows of modes that stand for rigid motion: at 0 Hz, or nearly rigid."""
    return np.flatnonzero((table.frequency_hz == 0) | (part > RIGID))

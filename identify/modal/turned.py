"""Shapes of two files at nodes whose channels look in other directions, one of them turned to the other's;
and how much of a mode moves the points as one body.

What a node moves is one vector; a file tells it along the axes of the node's displacement system (datasets
15 and 18 or 2420 of a universal file), and files differ in these.

A free structure has up to six modes at 0 Hz, and on soft ropes as many a little above.  Any mixture of
them is as good a set, so single ones compare at random: what compares is the space that they span.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from identify.core.arrays import Array, Complex, Index
from identify.measured.channel import Channel
from identify.measured.geometry import MeasuredGeometry
from identify.measured.modal_tables import ModalTable

Axes = Mapping[int, Array]
"""Node -> directions of its channels X, Y and Z in the common frame, rows of (3, 3)."""
_NONE = 1e-6
"""Cosine below which an axis has no part in another; files keep six digits."""
RIGID = 0.99
"""Part of the squared motion that is rigid from which on a mode above 0 Hz stands for rigid motion: what else
it does is less than a tenth of its amplitude.  The first bending of a beam, seen across it, has 0.98."""


def in_one_frame(
    a: ModalTable, axes_a: Axes, b: ModalTable, axes_b: Axes
) -> tuple[ModalTable, ModalTable, list[int]]:
    """Both tables with their channels along the same directions at every node that both place, and the nodes
    where one was turned.

    A channel of one is made from those of the other that have a part in it; at each node that one is turned
    of which more channels come out, and what does not come out of it is left out.
    """
    turned = []
    for node in sorted(set(axes_a) & set(axes_b)):
        turn = axes_a[node] @ axes_b[node].T
        if np.allclose(turn, np.eye(3), atol=_NONE):
            continue
        of_b, of_a = _turned(b, node, turn), _turned(a, node, turn.T)
        if len(of_b.channels) - len(b.channels) >= len(of_a.channels) - len(a.channels):
            b = of_b
        else:
            a = of_a
        turned.append(node)
    return a, b, turned


def _turned(table: ModalTable, node: int, turn: Array) -> ModalTable:
    """The table with the channels of a node along new axes: turn (3, 3) has the old components of each."""
    if table.shapes is None:
        return table
    at = {abs(c.direction): k for k, c in enumerate(table.channels) if c.node == node and c.direction}
    found = {}
    for direction in range(1, 7):
        first = 1 if direction <= 3 else 4
        parts = {first + k: part for k, part in enumerate(turn[(direction - 1) % 3]) if abs(part) > _NONE}
        if parts.keys() <= at.keys():
            found[Channel(node, direction)] = sum(
                (part * table.channels[at[d]].sign * table.shapes[:, at[d]] for d, part in parts.items()),
                np.zeros(len(table), dtype=complex),
            )
    kept = [k for k in range(len(table.channels)) if k not in at.values()]
    return replace(
        table,
        channels=(*(table.channels[k] for k in kept), *found),
        shapes=np.column_stack([table.shapes[:, kept], *found.values()]),
    )


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

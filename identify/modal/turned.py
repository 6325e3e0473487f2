"""Shapes of two files at nodes whose channels look in other directions: one of them turned to the other's.

What a node moves is one vector; a file tells it along the axes of the node's displacement system (datasets
15 and 18 or 2420 of a universal file), and files differ in these.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from identify.core.arrays import Array
from identify.measured.channel import Channel
from identify.measured.modal_table import ModalTable

Axes = Mapping[int, Array]
"""Node -> directions of its channels X, Y and Z in the common frame, rows of (3, 3)."""
_NONE = 1e-6
"""Cosine below which an axis has no part in another; files keep six digits."""


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

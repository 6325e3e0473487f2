"""Where the measurement points are and which way their channels look: what shapes are drawn on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identify.core.arrays import Array, Complex
from identify.measured.modal_tables import ModalTable


@dataclass(frozen=True)
class MeasuredGeometry:
    """nodes: their numbers (n); position_m (n, 3), in the common frame; axes (n, 3, 3): rows are the
    directions of the channels X, Y and Z of each node in the common frame; lines: runs of node numbers to be
    joined.
    """

    nodes: tuple[int, ...]
    position_m: Array
    axes: Array
    lines: tuple[tuple[int, ...], ...] = ()

    def __post_init__(self) -> None:
        count = len(self.nodes)
        if self.position_m.shape != (count, 3) or self.axes.shape != (count, 3, 3):
            raise ValueError(
                f"position_m {self.position_m.shape} and axes {self.axes.shape} do not fit {count} nodes"
            )
        if len(set(self.nodes)) != count:
            raise ValueError("a node has two positions")


def displacements(geometry: MeasuredGeometry, table: ModalTable) -> Complex:
    """Shapes as vectors in the common frame, (modes, nodes, 3): the translations that were measured, others
    0; NaN at nodes without any.

    A channel against an axis counts negative; rotations are left out, and channels of nodes the geometry does
    not have.
    """
    if table.shapes is None:
        raise ValueError("the modal table has no shapes")
    where = {node: n for n, node in enumerate(geometry.nodes)}
    measured = {channel.node for channel in table.channels if 1 <= abs(channel.direction) <= 3}
    local = np.zeros((len(table), len(geometry.nodes), 3), dtype=complex)
    local[:, [node not in measured for node in geometry.nodes]] = np.nan
    for column, channel in enumerate(table.channels):
        if channel.node in where and 1 <= abs(channel.direction) <= 3:
            local[:, where[channel.node], channel.axis] = channel.sign * table.shapes[:, column]
    return np.asarray(np.einsum("mna,nac->mnc", local, geometry.axes))

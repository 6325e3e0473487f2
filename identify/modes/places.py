"""Points of two files paired by where they stand in space, for shapes of files whose nodes have other
numbers."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy

from identify.core.arrays import Array
from identify.core.errors import InputError
from identify.core.text import count
from identify.measured.channel import Channel
from identify.measured.geometry import MeasuredGeometry
from identify.measured.modal_tables import ModalTable
from identify.modal.turned import Axes


@dataclass(frozen=True)
class Placed:
    """Modes of a file, where its points are, None where it does not say, and which way channels look."""

    table: ModalTable
    geometry: MeasuredGeometry | None
    axes: Axes

    @property
    def nodes(self) -> list[int]:
        """Nodes of channels that have a place, rising."""
        known = set() if self.geometry is None else set(self.geometry.nodes)
        return sorted({c.node for c in self.table.channels} & known)

    def positions(self, nodes: list[int]) -> Array:
        """Where nodes are, (n, 3), m."""
        assert self.geometry is not None
        row = {node: n for n, node in enumerate(self.geometry.nodes)}
        return np.asarray(self.geometry.position_m[[row[node] for node in nodes]]).reshape(-1, 3)


def by_place(a: Placed, b: Placed, within_m: float | None) -> tuple[Placed, str]:
    """The second file with the numbers of the first file's points, each of them the nearest to one of its
    own, and a sentence on it; points that are no one's nearest keep numbers that the first does not have.

    within_m: how far apart two points may be that are one; by default half the least distance of neighbours.
    InputError where a file has no geometry, or no points are so near.
    """
    for one in (a, b):
        if not one.nodes:
            found, fix = "no places of its points", "give shapes with their geometry (datasets 15 or 2411)"
            raise InputError(one.table.source, found, "where both files' points are", fix)
    at_a, at_b = a.positions(a.nodes), b.positions(b.nodes)
    reach = within_m if within_m is not None else min(spacing(at_a), spacing(at_b)) / 2
    far, of_a = scipy.spatial.cKDTree(at_a).query(at_b)
    _, of_b = scipy.spatial.cKDTree(at_b).query(at_a)
    pairs = {b.nodes[n]: a.nodes[k] for n, k in enumerate(of_a) if far[n] <= reach and of_b[k] == n}
    if not pairs:
        found = (
            f"no point within {reach:.3g} m of one of {a.table.source}, the nearest {np.min(far):.3g} m off"
        )
        fix = "bring both into one coordinate system and unit, or say a larger distance: `--within`"
        raise InputError(b.table.source, found, "points at the same places", fix)
    free = max([*a.nodes, *b.nodes, *(c.node for c in b.table.channels)]) + 1
    number = {node: pairs.get(node, free + k) for k, node in enumerate({c.node: 0 for c in b.table.channels})}
    channels = tuple(Channel(number[c.node], c.direction) for c in b.table.channels)
    geometry = b.geometry
    assert geometry is not None
    kept = [n for n, node in enumerate(geometry.nodes) if node in number]
    geometry = MeasuredGeometry(
        tuple(number[geometry.nodes[n]] for n in kept), geometry.position_m[kept], geometry.axes[kept]
    )
    apart = max(far[b.nodes.index(node)] for node in pairs)
    said = f"{count(len(pairs), 'point')} of {len(b.nodes)} were paired by place, at most {apart:.2g} m apart"
    axes = {number[node]: way for node, way in b.axes.items() if node in number}
    return Placed(replace(b.table, channels=channels), geometry, axes), said


def spacing(places: Array) -> float:
    """The least distance of two points that are not at the same place; of a single one, any."""
    if len(places) < 2:
        return np.inf
    far = scipy.spatial.distance.pdist(places)
    return float(np.min(far[far > 0], initial=np.inf))


def elsewhere(a: Placed, b: Placed) -> str:
    """A sentence where nodes of the same number stand further apart than half the least distance of
    neighbours.
    """
    common = sorted(set(a.nodes) & set(b.nodes))
    if not common:
        return ""
    apart = np.linalg.norm(a.positions(common) - b.positions(common), axis=1)
    reach = min(spacing(a.positions(a.nodes)), spacing(b.positions(b.nodes))) / 2
    off = [node for node, far in zip(common, apart, strict=True) if far > reach]
    if not off:
        return ""
    worst = common[int(np.argmax(apart))]
    return (
        f"{count(len(off), 'node')} of the same number stand at other places, such as {worst},"
        f" {np.max(apart):.3g} m apart: `--by place` pairs points by where they are"
    )

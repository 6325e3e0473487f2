"""Modes of responses in several setups that have reference sensors in common, put together by their shapes
there.

Each setup is analysed by itself, and its shapes are of any size.  All sizes are fitted at once (least squares
of a matrix of rank one with gaps, sensors by setups), which is PoSER merging with the references of all
setups (Reynders, Magalhaes, De Roeck and Cunha, IMAC 27 (2009); Doehler, Reynders, Magalhaes, Mevel, De Roeck
and Cunha, IMAC 28 (2010)).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from identify.core.arrays import Array, Complex, Index
from identify.core.errors import InputError
from identify.measured.channel import Channel
from identify.modal.operational.analysis import OperationalModes
from identify.modal.setups.analysis import Merged, poles_of, real, roved_rows, together
from identify.modal.setups.residues import Grid, is_joined, side

_REFERENCES = 2
"""Sensors in common that tell two shapes apart."""


def merged_responses(found: Sequence[OperationalModes], names: Sequence[str]) -> Merged:
    """One set of modes from those of several setups: those that all show, for a mode that one of them misses
    has no shape there.  InputError where setups have fewer than two sensors in common.
    """
    grid = _grid(found)
    count = [np.sum([n in rows for rows in grid.rows]) for n in range(len(grid.outputs))]
    shared = np.array(count) == len(found)
    mask = np.zeros((len(grid.outputs), len(found)), dtype=bool)
    for k, rows in enumerate(grid.rows):
        mask[rows, k] = True
    if shared.sum() < _REFERENCES or not is_joined(mask):
        expected = "two or more reference sensors that stay where they are in all setups"
        found_ = f"{shared.sum()} sensors in common to {', '.join(names)}"
        raise InputError("--output-only", found_, expected, "record them beside those that are moved")
    roved = roved_rows(grid, {grid.outputs[n].node for n in np.flatnonzero(shared)})

    def of(member: Index) -> Merged:
        poles = poles_of([(one.verified.model.poles, one.table) for one in found], member)
        product = np.array([_on_grid(one, grid, k, member[:, k]) for k, one in enumerate(found)])
        return together(grid, member, poles, product, roved, forced=False)

    return real(of, [one.table for one in found], 1.0)


def _grid(found: Sequence[OperationalModes]) -> Grid:
    """Sensors of all setups, and a column for each setup in place of a force."""
    outputs, rows, turned = side([one.records.channels for one in found])
    inputs = tuple(Channel(k, 0) for k in range(len(found)))
    columns = tuple(np.array([k]) for k in range(len(found)))
    return Grid(outputs, inputs, rows, columns, tuple(one[:, None] for one in turned))


def _on_grid(one: OperationalModes, grid: Grid, k: int, rows: Index) -> Complex:
    """Shapes of a setup on all sensors, (m, sensors, setups), NaN where it has none."""
    shapes = np.full((len(rows), len(one.records.channels)), complex(np.nan, np.nan))
    shapes[rows >= 0] = one.shapes[rows[rows >= 0]]
    return grid.spread(k, shapes[:, :, None])


def unit_shapes(merged: Merged, found: Sequence[OperationalModes]) -> tuple[Complex, Array]:
    """Merged shapes (m, sensors), the largest component 1, and their standard deviations by those of the
    setup that knows each component best.
    """
    shapes = merged.shapes
    largest = shapes[np.arange(len(shapes)), np.argmax(np.abs(shapes), axis=1)][:, None]
    std = np.full(shapes.shape, np.inf)
    for k, one in enumerate(found):
        rows = merged.grid.rows[k]
        # A setup's shape is the merged one times its column: what it may be off by goes with that.
        size = _size(shapes[:, rows], one.shapes[merged.member[:, k]])
        std[:, rows] = np.minimum(std[:, rows], size[:, None] * one.scatter.shapes[merged.member[:, k]])
    return np.asarray(shapes / largest), np.asarray(std / np.abs(largest))


def _size(merged: Complex, own: Complex) -> Array:
    """How much larger merged shapes are than a setup's own, (m,)."""
    return np.asarray(np.linalg.norm(merged, axis=1) / np.maximum(np.linalg.norm(own, axis=1), 1e-300))

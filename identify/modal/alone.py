"""Whether FRFs share their poles: some of them analysed alone, beside the modes of all together.

A modal model has one set of poles.  Where the structure changed between FRFs, as by an accelerometer that was
moved with its mass, or by a temperature, every FRF has its own, and a common model splits modes.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from identify.core.arrays import Array
from identify.core.thresholds import SIGMAS_95
from identify.measured.modal_tables import ModalTable
from identify.modal.analysis import ModalAnalysis
from identify.modal.bands import Identified, identified
from identify.modal.layout import Layout
from identify.modal.pairing import PairSettings, pair
from identify.modal.settings import ModalSettings
from identify.modal.window import frequency_and_damping

_MOST = 8
"""FRFs that are analysed alone, of responses spread over all to the reference with most energy."""
_BETTER = 0.5
"""Error of FRFs alone over that together below which they tell more than the common model."""
_NEAR = PairSettings(max_frequency_error=0.1)


@dataclass(frozen=True)
class Disagreement:
    """modes: how many an FRF alone shows (median); low_hz, high_hz (d,): the least and the largest
    frequency that FRFs alone give to a mode, each to about std_hz (d,).
    """

    modes: int
    low_hz: Array
    high_hz: Array
    std_hz: Array


def disagreement(found: ModalAnalysis) -> Disagreement | None:
    """Modes that FRFs alone put further apart than a resonance is half as wide, and than they are
    uncertain; None where there are none, where noise is all that the common model leaves, and where the
    FRFs alone are not rebuilt much better than by it.
    """
    layout = found.layout
    rows = np.flatnonzero(layout.complete & (layout.frf != 0).any(axis=(0, 2)))  # some may stand still
    rows = rows[np.unique(np.linspace(0, len(rows) - 1, min(len(rows), _MOST)).astype(int))]
    if len(rows) < 2 or (len(found.by_noise) and found.by_noise.all()):
        return None
    by_hand = {"modes_hz": None, "keep_hz": (), "drop_hz": ()}
    settings = found.settings.model_copy(update={"refine": False, **by_hand})
    measured = layout.frf[:, rows]
    column = int(np.argmax(np.sum(np.abs(measured) ** 2, axis=(0, 1))))
    alone = [_alone(layout, int(row), column, settings) for row in rows]
    rebuilt = np.concatenate([one.rebuilt for one in alone], axis=1)[:, :, 0]
    left = [
        np.sum(np.abs(measured[:, :, column] - frf) ** 2)
        for frf in (rebuilt, found.synthesised[:, rows, column])
    ]
    if left[0] > _BETTER**2 * left[1]:
        return None
    return _apart([_table(one) for one in alone])


def _alone(layout: Layout, row: int, column: int, settings: ModalSettings) -> Identified:
    """One FRF: of a response and a reference."""
    one = replace(
        layout,
        frf=layout.frf[:, [row]][:, :, [column]],
        responses=(layout.responses[row],),
        references=(layout.references[column],),
    )
    return identified(one, settings)


def _table(found: Identified) -> ModalTable:
    order = np.argsort(np.abs(found.verified.model.poles))
    frequency, damping = frequency_and_damping(found.verified.model.poles[order])
    std = np.array([mode.frequency_std_hz for mode in found.verified.modes])
    return ModalTable(frequency, damping, frequency_std_hz=std[order])


def _apart(tables: list[ModalTable]) -> Disagreement | None:
    """The modes of the table with the most, where the others put them elsewhere."""
    first = max(tables, key=len)
    members: list[list[Array]] = [[] for _ in range(len(first))]
    for table in tables:
        pairs = pair(first, table, _NEAR)
        for a, b in zip(pairs.a, pairs.b, strict=True):
            assert table.frequency_std_hz is not None
            row = (table.frequency_hz[b], table.damping_ratio[b], table.frequency_std_hz[b])
            members[a].append(np.array(row))
    apart = []
    for rows in members:
        frequency, damping, std = np.array(rows).T
        own = float(np.sqrt(np.mean(std**2)))
        reach = max(np.mean(damping * frequency), 2 * SIGMAS_95 * own)
        # Most must see a mode for them to disagree about it.
        if 2 * len(rows) > len(tables) and np.ptp(frequency) > reach:
            apart.append((frequency.min(), frequency.max(), own))
    if not apart:
        return None
    return Disagreement(int(np.median([len(table) for table in tables])), *np.array(apart).T)

"""One long record of many hits, cut into a block per hit where the force rises; the sensor may have moved on
to the next point after every few (Kobe: 48 points, five hits each, 240 in all).

What time records of impacts tell before they become FRFs: double hits, and signals that were clipped.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from pydantic import Field, model_validator

from identify.core.arrays import Array, Mask
from identify.core.config import Settings
from identify.core.errors import InputError
from identify.core.text import count, listed
from identify.measured.channel import Channel
from identify.measured.finding import Finding
from identify.measured.frf_set import FrfSet
from identify.measured.time_history import TimeHistory


class Hits(Settings):
    """How a long record is cut."""

    block_s: float = Field(gt=0, description="length of the block of each hit, s")
    before_s: float = Field(0.01, ge=0, description="how much of it is before the hit, s")
    level: float = Field(
        0.1, gt=0, lt=1, description="a hit is where the force exceeds this share of the largest"
    )
    each: int | None = Field(None, ge=1, description="hits at each point, after which the sensor moved on")
    nodes: list[int] | None = Field(
        None, min_length=1, description="points of the sensor that moved on, in the order they were measured"
    )
    moves: int | None = Field(
        None, description="node that its channels have in `signals`, in place of those of `nodes`"
    )

    @model_validator(mode="after")
    def _together(self) -> Hits:
        told = [value is not None for value in (self.each, self.nodes, self.moves)]
        if any(told) and not all(told):
            raise ValueError("`each`, `nodes` and `moves` go together: of a sensor that moved on")
        return self


def cut(history: TimeHistory, hits: Hits) -> list[TimeHistory]:
    """A history per point of the sensor that moved on, or one, with a block per hit.

    A hit too near to either end of the record for a whole block is left out. InputError where blocks overlap
    the next hit, or there are not as many hits as were told.
    """
    where = history.source or "time history"
    if len(history.data) > 1:
        raise InputError(
            f"{where}, hits", f"{len(history.data)} blocks", "one long record", "leave `hits` out"
        )
    if not history.forces:
        raise InputError(where, "no force", "the force of the hammer, which tells the hits")
    starts = _starts(history, hits, where)
    size = round(hits.block_s * history.sample_rate_hz)
    blocks = np.stack([history.data[0, start : start + size] for start in starts])
    if hits.nodes is None or hits.each is None or hits.moves is None:
        return [replace(history, data=blocks)]
    wanted = hits.each * len(hits.nodes)
    if len(blocks) != wanted:
        found = f"{count(len(blocks), 'hit')} above {hits.level:g} of the largest force"
        expected = f"{wanted}, {hits.each} at each of {count(len(hits.nodes), 'point')}"
        raise InputError(f"{where}, hits", found, expected, "change `level`, or cut the record")
    if hits.moves not in [channel.node for channel in history.channels]:
        raise InputError(
            f"{where}, hits.moves", f"no signal of node {hits.moves}", "the sensor that moved on"
        )
    return [
        replace(
            history, data=blocks[n * hits.each : (n + 1) * hits.each], channels=_at(history, hits.moves, node)
        )
        for n, node in enumerate(hits.nodes)
    ]


def _starts(history: TimeHistory, hits: Hits, where: str) -> list[int]:
    """First samples of the blocks."""
    rate, force = history.sample_rate_hz, np.abs(history.data[0][:, history.forces]).max(axis=1)
    before, size = round(hits.before_s * rate), round(hits.block_s * rate)
    if size <= before + 1:
        raise InputError(
            f"{where}, hits", f"{hits.before_s:g} s before the hit", f"less than {hits.block_s:g} s"
        )
    above = np.flatnonzero(force > hits.level * force.max())
    found, end = list[int](), -1
    for sample in above:
        start = int(sample) - before
        if sample >= end:
            if start < end:
                at, fix = f"{sample / rate:.3f} s", "shorter blocks, or a smaller `before_s`"
                raise InputError(
                    f"{where}, hits", f"a hit at {at} within {hits.before_s:g} s of the block before it", fix
                )
            end = start + size
            if start >= 0 and end <= len(force):
                found.append(start)
    if not found:
        raise InputError(f"{where}, hits", "no hit with a whole block", f"blocks of {hits.block_s:g} s")
    return found


def _at(history: TimeHistory, moves: int, node: int) -> tuple[Channel, ...]:
    return tuple(
        replace(one, node=node) if one.node == moves and n in history.responses else one
        for n, one in enumerate(history.channels)
    )


def beside(sets: list[FrfSet]) -> FrfSet:
    """FRFs of several points as one set; of fixed sensors, which all have, the first estimate."""
    first, known = sets[0], dict[Channel, tuple[FrfSet, int]]()
    for one in sets:
        for row, channel in enumerate(one.outputs):
            known.setdefault(channel, (one, row))
    rows = list(known.values())
    averages = [one.averages for one in sets if one.averages is not None]
    return replace(
        first,
        outputs=tuple(known),
        frf=np.stack([one.frf[:, row] for one, row in rows], axis=1),
        coherence=np.stack([one.coherence[:, row] for one, row in rows if one.coherence is not None], axis=1),
        averages=min(averages) if averages else None,
    )


_SECOND = 0.1
"""Force of a second hit, over that of the first, that can be distinguished from the ringing of a filter."""
_ALIKE = 1e-6
"""Part of its largest value below which a signal does not change."""
_FLAT, _STEP = 3, 0.01
"""Samples in a row at the largest value that were clipped, where the signal comes there by more than this
part of it, and more than one step of the converter, in one sample, as no peak does."""


def hit_findings(history: TimeHistory) -> Iterator[Finding]:
    """The findings on records of one impact a block, the worst of a kind first."""
    yield from sorted(_doubles(history), key=lambda found: -(found.value or 0.0))
    yield from sorted(_clipped(history), key=lambda found: -(found.value or 0.0))


def _doubles(history: TimeHistory) -> Iterator[Finding]:
    for column in history.forces:
        for block, force in enumerate(history.data[:, :, column]):
            share, apart = second_hit(force)
            if share > _SECOND:
                sentence = (
                    f"Hit {block + 1} at {history.channels[column]} is a double hit: {share:.0%} of its force"
                    f" comes again {1e3 * apart / history.sample_rate_hz:.3g} ms later; repeat it or leave it"
                    " out."
                )
                yield Finding("warn", "double-hit", (history.channels[column],), sentence, share)


def second_hit(force: Array) -> tuple[float, int]:
    """Of the force (samples,) of an impact: the largest one away from its main pulse, over the peak, and how
    many samples it is from it.
    """
    peak = int(np.argmax(np.abs(force)))
    size = float(force[peak])
    if not size:
        return 0.0, 0
    relative = force / size
    low = np.flatnonzero(relative < _SECOND / 2)
    first = int(low[low < peak].max(initial=-1))
    last = int(low[low > peak].min(initial=len(force)))
    others = relative.copy()
    others[first + 1 : last] = 0.0
    at = int(np.argmax(others))
    return float(others[at]), abs(at - peak)


def _clipped(history: TimeHistory) -> Iterator[Finding]:
    for column, channel in enumerate(history.channels):
        hits = [n + 1 for n, signal in enumerate(history.data[:, :, column]) if clipped(signal).any()]
        if hits:
            some = f"hit{'s' * (len(hits) > 1)} {listed(list(map(str, hits[:6])))}"
            more = f" and {len(hits) - 6} more" * (len(hits) > 6)
            sentence = (
                f"{channel} [{history.units[column]}] is clipped in {some}{more}: it stays at its largest"
                f" value, {np.abs(history.data[:, :, column]).max():.4g}; use a larger range, or softer hits."
            )
            yield Finding("warn", "clipped", (channel,), sentence, len(hits))


def clipped(signal: Array) -> Mask:
    """Which samples (samples,) are in a row of three or more at the largest or the least value, entered by a
    step.
    """
    size = float(np.abs(signal).max(initial=0.0))
    found = np.zeros(len(signal), bool)
    if not size:
        return found
    steps = np.abs(np.diff(signal))
    least = max(_STEP * size, 1.5 * float(steps[steps > _ALIKE * size].min(initial=size)))
    for side in (signal, -signal):
        top = np.abs(side - side.max()) <= _ALIKE * size
        edges = np.flatnonzero(np.diff(np.concatenate([[False], top, [False]]).astype(int)))
        for start, end in edges.reshape(-1, 2).tolist():
            entered = start > 0 and side[start] - side[start - 1] > least
            found[start:end] |= end - start >= _FLAT and entered
    return found

"""What time records of impacts tell before they become FRFs: double hits, and signals that were clipped."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from identify.core.arrays import Array, Mask
from identify.core.text import listed
from identify.measured.finding import Finding
from identify.measured.time_history import TimeHistory

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

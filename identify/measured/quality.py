"""`check` looks at an FRF set before a fit and says what an engineer would say: the
bookkeeping here (points, pairs, doubled, dead and copied channels, frequency axis), noise and physics beside.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from identify.core.text import count
from identify.measured import quality_noise as noise
from identify.measured import quality_physics as physics
from identify.measured import silent
from identify.measured.finding import Finding, listing, worst_first
from identify.measured.frf_set import FrfSet


def check(
    frf_set: FrfSet, points: Mapping[int, str], band_hz: tuple[float, float] | None = None
) -> list[Finding]:
    """What is wrong (fail), doubtful (warn) or worth knowing (info) about a set, in this order.

    points maps node numbers to names of points on the robot; band_hz (Hz) limits what is looked at.  Bad data
    make findings, not errors.
    """
    chosen = frf_set if band_hz is None else frf_set.band(*band_hz)
    if len(chosen.frequency_hz) == 0:
        low, high = band_hz or (0.0, 0.0)
        span = (
            f"{frf_set.frequency_hz[0]:.4g} to {frf_set.frequency_hz[-1]:.4g} Hz"
            if len(frf_set.frequency_hz)
            else "no line at all"
        )
        sentence = f"No line lies in the band from {low:.4g} to {high:.4g} Hz: the data have {span}."
        return [Finding("fail", "no-data-in-band", (), sentence, 0)]
    findings = [
        *(Finding("warn", "not-read", (), f"In the file, {note}.") for note in frf_set.notes),
        *points_explain(chosen, points),
        *frequency_axis(chosen),
        *pairs_complete(chosen),
    ]
    usable = _whole(chosen)
    if usable.measured.any():
        for one in (
            doubled,
            dead,
            noise.coherence,
            noise.noisy_channels,
            noise.poor_forces,
            noise.quiet_channels,
            physics.drive_points,
            physics.reciprocity,
            physics.size,
        ):
            findings.extend(one(usable))
    else:
        findings.append(Finding("fail", "no-data", (), "No FRF has a number at every line of the band.", 0))
    return worst_first(findings)


def _whole(frf_set: FrfSet) -> FrfSet:
    """The FRFs that are numbers at every line, with the outputs and inputs that have any; the others have
    findings of their own.
    """
    broken: NDArray[np.bool_] = np.asarray(np.isnan(frf_set.frf).any(axis=0))
    whole = replace(frf_set, frf=np.where(broken, np.nan, frf_set.frf))
    return whole.pairs(
        np.flatnonzero(~broken.all(axis=1)).tolist(), np.flatnonzero(~broken.all(axis=0)).tolist()
    )


def points_explain(frf_set: FrfSet, points: Mapping[int, str]) -> Iterator[Finding]:
    """Channels at nodes that are no points, and points without channel."""
    channels = [*dict.fromkeys((*frf_set.outputs, *frf_set.inputs))]
    strange = [channel for channel in channels if channel.motor is None and channel.node not in points]
    if strange:
        known = f"points {min(points)} to {max(points)}" if points else "no points"
        sentence = (
            f"No point explains {listing(strange)}: the list of points has {known}; add the points or rename"
            " the channels."
        )
        yield Finding("fail", "unknown-point", tuple(strange), sentence, len(strange))
    silent = [node for node in points if node not in {channel.node for channel in channels}]
    if silent:
        yield Finding(
            "info", "unused-point", (), f"Nothing was measured at point {listing(silent)}.", len(silent)
        )


def pairs_complete(frf_set: FrfSet) -> Iterator[Finding]:
    """Pairs that lack, are NaN in part, and points measured in fewer directions than most."""
    for i, j in np.argwhere(np.isnan(frf_set.frf).any(axis=0)).tolist():
        pair = (frf_set.outputs[i], frf_set.inputs[j])
        if frf_set.measured[i, j]:
            yield Finding(
                "fail",
                "not-a-number",
                pair,
                f"FRF {pair[0]}/{pair[1]} has values that are not numbers; export it again.",
            )
        else:
            yield Finding(
                "warn",
                "missing-pair",
                pair,
                f"FRF {pair[0]}/{pair[1]} was not measured, though both channels were.",
            )
    axes = defaultdict(set)
    for output in frf_set.outputs:
        if output.motor is None:
            axes[output.node].add(abs(output.direction))
    usual = int(np.median([len(directions) for directions in axes.values()])) if axes else 0
    poor = [node for node, directions in axes.items() if len(directions) < usual]
    if poor:
        channels = tuple(output for output in frf_set.outputs if output.node in poor)
        sentence = (
            f"Most points were measured in {usual} directions, point {listing(poor)} in fewer: is a channel"
            " missing?"
        )
        yield Finding("warn", "missing-direction", channels, sentence, len(poor))


def doubled(frf_set: FrfSet) -> Iterator[Finding]:
    """One place and axis under two signs, and channels that are copies of each other."""
    for kind, channels in (("output", frf_set.outputs), ("input", frf_set.inputs)):
        for a, b in combinations(channels, 2):
            if a.place == b.place:
                yield Finding(
                    "warn",
                    "doubled-channel",
                    (a, b),
                    f"{a} and {b} are the same {kind} with opposite signs: keep one of them.",
                )
    for (i, a), (k, b) in combinations(enumerate(frf_set.outputs), 2):
        both = frf_set.measured[i] & frf_set.measured[k]
        if both.any() and _same(frf_set, i, k, both):
            sentence = (
                f"{a} and {b} have the same values at every line: one of the two channels is a copy of the"
                " other."
            )
            yield Finding("fail", "identical-channels", (a, b), sentence)


def _same(frf_set: FrfSet, i: int, k: int, inputs: np.ndarray[tuple[int], np.dtype[np.bool_]]) -> bool:
    """Whether outputs i and k agree but for their sign; two dead channels do not count."""
    first, second = frf_set.frf[:, i, inputs], frf_set.frf[:, k, inputs]
    size = np.abs(first).max()
    return bool(size > 0 and min(np.abs(first - second).max(), np.abs(first + second).max()) <= 1e-9 * size)


def dead(frf_set: FrfSet) -> Iterator[Finding]:
    """Channels that are zero or constant."""
    for kind, found in zip(("Output", "Input"), silent.dead(frf_set), strict=True):
        if found:
            sentence = (
                f"{kind} {listing(list(found))} is zero or constant at every line: a dead channel or an open"
                " cable."
            )
            yield Finding("fail", "dead-channel", found, sentence, len(found))


def frequency_axis(frf_set: FrfSet) -> Iterator[Finding]:
    """Uneven steps and few lines."""
    steps = np.diff(frf_set.frequency_hz)
    if len(steps) and np.ptp(steps) > 1e-3 * np.median(steps):
        gap = float(frf_set.frequency_hz[int(np.argmax(steps))])
        span = f"{steps.min():.4g} to {steps.max():.4g} Hz"
        sentence = f"The frequency steps vary from {span}, the widest above {gap:.4g} Hz: are lines missing?"
        yield Finding("warn", "uneven-frequency", (), sentence, float(steps.max() / steps.min()))
    lines = len(frf_set.frequency_hz)
    if lines < 20:
        sentence = f"Only {count(lines, 'frequency line')} {'lies' if lines == 1 else 'lie'} in the band."
        yield Finding("warn", "few-lines", (), sentence, lines)

"""Checks by physics: drive points, reciprocity, size."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

import numpy as np
import scipy
from numpy.typing import NDArray

from identify.core.arrays import Array, Complex, Mask
from identify.core.errors import InputError
from identify.measured.channel import Channel
from identify.measured.finding import Finding
from identify.measured.frf_set import POWER, FrfSet
from identify.measured.noise import noise_std
from identify.measured.quality_noise import LOW_COHERENCE

ASKEW = np.radians(6.0)
"""Two standard deviations of the directions of sensors and impacts in a usual laboratory (`typical`)."""
APPARENT_MASS_KG = (0.05, 1e5)
STATIC_STIFFNESS_N_PER_M = (1e3, 1e10)
"""What a robot's drive point may look like; outside, the unit is likely to be wrong."""
_BY_CHANCE = 1e-3
"""Probability below which negative real parts are more than noise."""


def drive_points(frf_set: FrfSet) -> Iterator[Finding]:
    """A passive structure takes power in at its drive points: the real part of each drive-point mobility is
    not negative.

    That holds at any s with Re s >= 0, so with exponential windows too.  Measured by the share of negative
    real parts in sum |Re Y|^2, lines of larger response counting more.  The imaginary part of a drive-point
    receptance is then negative, of an accelerance positive.  Nothing is said where noise alone may do that,
    as in a band without a resonance.
    """
    found = False
    mobility, noise = _mobility(frf_set), _noise_of_mobility(frf_set)
    for i, j, sign in _same_place(frf_set):
        found = True
        real = sign * mobility[:, i, j].real
        if noise is not None and _by_noise(np.minimum(real, 0.0) / noise[:, i, j]):
            continue
        negative = float(np.sum(np.minimum(real, 0) ** 2) / np.sum(real**2)) if np.any(real) else 0.0
        pair = (frf_set.outputs[i], frf_set.inputs[j])
        name = f"Drive point {pair[0]}/{pair[1]}"
        share = f"({100 * negative:.0f} % of its real part squared)"
        if negative > 0.9:
            sentence = (
                f"{name} gives power back at nearly all lines: sensor or hammer has the wrong sign there."
            )
            yield Finding("fail", "drive-point", pair, sentence, negative)
        elif negative > 0.2:
            sentence = f"{name} gives power back {share}: wrong channel, direction, quantity or time delay."
            yield Finding("fail", "drive-point", pair, sentence, negative)
        elif negative > 0.05:
            sentence = f"{name} has a phase that a passive structure cannot have at some lines {share}."
            yield Finding("warn", "drive-point", pair, sentence, negative)
    if not found:
        sentence = (
            "There is no drive point (response and force at one place and axis): signs and sizes cannot be"
            " checked."
        )
        yield Finding("info", "no-drive-point", (), sentence)


def reciprocity(frf_set: FrfSet) -> Iterator[Finding]:
    """H_ij against H_ji (Maxwell, Betti) wherever both were measured, as the norm of the difference over the
    mean norm.
    """
    place = {channel.place: i for i, channel in enumerate(frf_set.outputs)}
    at_inputs = [
        (j, place[channel.place]) for j, channel in enumerate(frf_set.inputs) if channel.place in place
    ]
    for (a, at_a), (b, at_b) in combinations(at_inputs, 2):
        pairs = (frf_set.outputs[at_a], frf_set.inputs[b]), (frf_set.outputs[at_b], frf_set.inputs[a])
        good = _good(frf_set, at_a, b) & _good(frf_set, at_b, a)
        if good.sum() < 5:
            continue
        first = frf_set.frf[good, at_a, b] * pairs[0][0].sign * pairs[0][1].sign
        second = frf_set.frf[good, at_b, a] * pairs[1][0].sign * pairs[1][1].sign
        mean = (np.linalg.norm(first) + np.linalg.norm(second)) / 2
        same, opposite = (float(np.linalg.norm(first - sign * second) / mean) for sign in (1, -1))
        names = f"{pairs[0][0]}/{pairs[0][1]} and {pairs[1][0]}/{pairs[1][1]}"
        channels = (*pairs[0], *pairs[1])
        askew = _askew(frf_set, good, (at_a, b), (at_b, a), float(np.linalg.norm(first - second)))
        if same > 0.2 and askew <= ASKEW:
            sentence = (
                f"{names} differ by {100 * same:.0f} %: sensors or a hammer turned by"
                f" {np.degrees(askew):.1f}°, as is usual, would do that."
            )
            yield Finding("info", "reciprocity", channels, sentence, same)
        elif opposite < 0.5 < same:
            sentence = f"{names} are equal with opposite signs: one channel has the wrong polarity."
            yield Finding("fail", "reciprocity", channels, sentence, same)
        elif same > 0.7:
            sentence = (
                f"{names} differ by {100 * same:.0f} % and should be equal: wrong channel, direction or gain,"
                " or nonlinear."
            )
            yield Finding("fail", "reciprocity", channels, sentence, same)
        elif same > 0.2:
            yield Finding(
                "warn",
                "reciprocity",
                channels,
                f"{names} differ by {100 * same:.0f} %, though they should be equal.",
                same,
            )


def _askew(frf_set: FrfSet, good: Mask, one: tuple[int, int], other: tuple[int, int], apart: float) -> float:
    """By which angle, rad, about, sensors and hammer are held askew if that alone sets two FRFs (output,
    input) apart, by a norm: they then read, and excite, a part of the other axes at their nodes.
    """
    squares = 0.0
    for i, j in (one, other):
        (output, entry), lines = (frf_set.outputs[i], frf_set.inputs[j]), frf_set.frf[good]
        rows = [n for n, c in enumerate(frf_set.outputs) if n != i and _turns_into(output, c)]
        columns = [n for n, c in enumerate(frf_set.inputs) if n != j and _turns_into(entry, c)]
        squares += float(np.nansum(np.abs(lines[:, rows, j]) ** 2))
        squares += float(np.nansum(np.abs(lines[:, i, columns]) ** 2))
    return float(np.arctan2(apart, np.sqrt(squares)))


def _turns_into(channel: Channel, other: Channel) -> bool:
    """Whether a sensor that is turned reads another channel of its node."""
    return channel.node == other.node and all(1 <= abs(c.direction) <= 3 for c in (channel, other))


def size(frf_set: FrfSet) -> Iterator[Finding]:
    """Apparent mass at the top of the band and stiffness at its bottom, at the drive points: units off by a
    thousand show here.
    """
    s = frf_set.s[:, None, None]
    receptance = frf_set.frf / s ** POWER[frf_set.quantity]
    quarter = max(1, len(frf_set.frequency_hz) // 4)
    for i, j, _ in _same_place(frf_set):
        pair = (frf_set.outputs[i], frf_set.inputs[j])
        if max(abs(channel.direction) for channel in pair) > 3:
            continue
        inertance = float(np.median(np.abs(receptance[-quarter:, i, j] * s[-quarter:, 0, 0] ** 2)))
        compliance = float(np.median(np.abs(receptance[:quarter, i, j])))
        for what, inverse, unit, limits in (
            ("an apparent mass", inertance, "kg", APPARENT_MASS_KG),
            ("a dynamic stiffness", compliance, "N/m", STATIC_STIFFNESS_N_PER_M),
        ):
            value = 1 / inverse if inverse > 0 else np.nan  # dead channels have a finding of their own
            if value < limits[0] or value > limits[1]:
                sentence = (
                    f"Drive point {pair[0]}/{pair[1]} has {what} of {value:.2g} {unit}: is the unit of the"
                    " FRFs right?"
                )
                yield Finding("warn", "size", pair, sentence, value)


def _mobility(frf_set: FrfSet) -> Complex:
    """The set as velocity over force."""
    return np.asarray(frf_set.frf * frf_set.s[:, None, None] ** (1 - POWER[frf_set.quantity]))


def _noise_of_mobility(frf_set: FrfSet) -> Array | None:
    """Standard deviation (lines, outputs, inputs) of its real part; None where it is not known."""
    try:
        noise = noise_std(frf_set) if frf_set.noise is None else frf_set.noise
    except InputError:
        return None
    return np.asarray(noise * np.abs(frf_set.s[:, None, None]) ** (1 - POWER[frf_set.quantity]))


def _by_noise(negative: Array) -> bool:
    """Whether real parts (lines,) that are negative by so many standard deviations, or zero, may be noise
    around those of a passive structure.
    """
    return bool(scipy.special.chdtrc(len(negative), np.sum(negative**2)) > _BY_CHANCE)


def _same_place(frf_set: FrfSet) -> Iterator[tuple[int, int, int]]:
    """Output, input and sign of every measured drive point."""
    for i, output in enumerate(frf_set.outputs):
        for j, input_ in enumerate(frf_set.inputs):
            if output.place == input_.place and output.direction != 0 and frf_set.measured[i, j]:
                yield i, j, output.sign * input_.sign


def _good(frf_set: FrfSet, i: int, j: int) -> NDArray[np.bool_]:
    """The lines where a pair was measured with a coherence that is not low."""
    good = ~np.isnan(frf_set.frf[:, i, j])
    if frf_set.coherence is not None:
        good &= ~(frf_set.coherence[:, i, j] < LOW_COHERENCE)
    return good

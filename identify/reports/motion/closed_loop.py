"""FRFs of joints in their closed loop: where they dip and peak, how far model and record are apart, and
curves.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.signal import find_peaks, peak_prominences

from identify.core.arrays import Array
from identify.reports.kit.banded import Line, Panel, Plot
from identify.reports.kit.cells import Column, Table, angles, digits, words
from identify.reports.motion.pick import RECORDED, SIMULATED
from identify.results.motion import ClosedLoopFrfs


def extremes_table(frfs: dict[str, ClosedLoopFrfs]) -> Table:
    """A row per posture and joint: dip and peak of the motor's acceleration per torque, and how far the gains
    of its velocity are apart.
    """
    heads = [
        words("Records"),
        words("Posture", unit="°"),
        words("Joint"),
        *(
            Column(f"{what}{of}", "Hz", form=digits(3))
            for what in ("Dip", "Peak")
            for of in (", measured", ", model")
        ),
        Column("Gains apart, median", "dB", form=digits(2)),
        Column("Most", "dB", form=digits(2)),
    ]
    note = (
        "Dip and peak: of the motor's acceleration per its torque, those that stand out most, between lines"
        " by a parabola. Gains: of the motor's velocity, over the excited band."
    )
    rows = [row for name, one in frfs.items() for row in _rows(name, one)]
    return Table.of("FRFs in the closed loop", heads, rows, note)


def _rows(name: str, one: ClosedLoopFrfs) -> Iterator[tuple[str | float, ...]]:
    for k, joint in enumerate(one.joint):
        model = np.abs(one.velocity[:, k, k])
        own, seen, apart = extremes(one.frequency_hz, model), (np.nan, np.nan), np.full(1, np.nan)
        if one.velocity_measured is not None:
            measured = np.abs(one.velocity_measured[:, k, k])
            seen = extremes(one.frequency_hz, measured)
            apart = np.abs(_db(measured) - _db(model))
        both = [value for pair in zip(seen, own, strict=True) for value in pair]
        yield (
            name,
            angles(one.start_deg, "g"),
            f"{joint:.0f}",
            *both,
            float(np.median(apart)),
            float(apart.max()),
        )


def extremes(frequency_hz: Array, gain: Array) -> tuple[float, float]:
    """Hz of the dip and of the peak that stand out most in gain times frequency (lines,), NaN where none
    does.
    """
    level = _db(gain * frequency_hz)
    return _outstanding(frequency_hz, -level), _outstanding(frequency_hz, level)


def _outstanding(f: Array, level: Array) -> float:
    peaks, _ = find_peaks(level)
    if not len(peaks):
        return float("nan")
    at = int(peaks[np.argmax(peak_prominences(level, peaks)[0])])
    before, here, after = level[at - 1 : at + 2]
    return float(f[at] + (f[1] - f[0]) * (before - after) / 2 / (before - 2 * here + after))


def frf_plots(frfs: dict[str, ClosedLoopFrfs], joints: tuple[str, ...]) -> Iterator[Plot]:
    """A plot per posture: gain and phase of the motor's velocity, gain of the link's acceleration (Nagoya,
    Figs. 9 and 10), a column per joint.
    """
    for number, (name, one) in enumerate(frfs.items()):
        rows = [
            [_panel(one, k, row, joints[joint - 1]) for k, joint in enumerate(one.joint)]
            for row in range(2 if one.acceleration is None else 3)
        ]
        yield Plot(
            f"closed-loop-{number}",
            Column("Frequency", "Hz"),
            [panel for row in rows for panel in row],
            f"{name}: FRFs in the closed loop, from the motor's torque.",
            log_x=True,
            height=1.5,
            columns=len(one.joint),
        )


def _panel(one: ClosedLoopFrfs, k: int, row: int, joint: str) -> Panel:
    y = (
        Column("Motor velocity", "dB of 1 rad/s/(N m)"),
        Column("Its phase", "°"),
        Column("Link acceleration", "dB of 1 rad/s²/(N m)"),
    )[row]
    both = (
        (RECORDED, one.velocity_measured if row < 2 else one.acceleration_measured),
        (SIMULATED, one.velocity if row < 2 else one.acceleration),
    )
    lines = []
    for name, h in both:
        if h is not None:
            own = h[:, k, k]
            values = np.degrees(np.unwrap(np.angle(own))) if row == 1 else _db(np.abs(own))
            lines.append(Line(name, one.frequency_hz, values, look="noisy" if name == RECORDED else ""))
    return Panel(y, lines, title=joint if row == 0 else "")


def _db(gain: Array) -> Array:
    return np.asarray(20 * np.log10(np.maximum(gain, np.finfo(float).tiny)))

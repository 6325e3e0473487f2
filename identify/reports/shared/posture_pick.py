"""What batches and maps have in common for their pictures: quantities at many postures, and the angles over
which they are shown.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from identify.core.arrays import Array, Mask
from identify.reports.kit.cells import unit
from identify.results.batch import BatchResult
from identify.results.map import CorrectionRows, LimitRows, MapResult

_LEAST_SPAN_DEG = 1.0


@dataclass(frozen=True)
class Quantity:
    """A number at every posture (n,), NaN where there is none, with its 95 % limits or None; kind: what it is
    one of.

    level: value and 95 % limits that hold for all postures, and what it is; joint: the joint over which it
    changes most, 0: not known. faint (n,): not counted in the level.
    """

    kind: str
    name: str
    unit: str
    value: Array
    low: Array | None = None
    high: Array | None = None
    level: tuple[float, float, float] | None = None
    level_name: str = ""
    joint: int = 0
    faint: Mask | None = None

    @property
    def label(self) -> str:
        """Name and unit, for an axis."""
        return f"{self.name} ({self.unit})" if self.unit else f"{self.name} (\N{EN DASH})"


@dataclass(frozen=True)
class Postures:
    """n postures: names, angles (n, joints), deg, and the place of the tool (n, 3), m, NaN where a posture
    failed; and their quantities.
    """

    names: tuple[str, ...]
    angles_deg: Array
    tool_m: Array
    quantities: tuple[Quantity, ...]

    @property
    def varied(self) -> list[int]:
        """The joints (from 0) whose angle changes over the postures, the one that changes most first."""
        if not self.angles_deg.size or np.isnan(self.angles_deg).all():
            return []
        known = self.angles_deg[~np.isnan(self.angles_deg).any(axis=1)]
        span = np.ptp(known, axis=0) if len(known) else np.zeros(self.angles_deg.shape[1])
        return [int(joint) for joint in np.argsort(-span, kind="stable") if span[joint] > _LEAST_SPAN_DEG]

    @property
    def telling(self) -> list[int]:
        """The joints that vary, the one that explains the first frequency best first: what a map is drawn
        over.
        """
        first = self.of("frequency")
        return (
            sorted(self.varied, key=lambda joint: -_explained(self.angles_deg[:, joint], first[0].value))
            if first
            else self.varied
        )

    def joint_of(self, one: Quantity) -> int:
        """The joint (from 0) over which a quantity is shown: the one it changes with, or else the one that
        explains it best; -1: none.
        """
        if 0 < one.joint <= self.angles_deg.shape[1]:
            return one.joint - 1
        return max(
            self.varied, key=lambda joint: _explained(self.angles_deg[:, joint], one.value), default=-1
        )

    def of(self, kind: str) -> list[Quantity]:
        """The quantities of a kind."""
        return [one for one in self.quantities if one.kind == kind]


def _explained(angle: Array, value: Array) -> float:
    """The share of a quantity's variance that a parabola over an angle explains."""
    known = np.isfinite(angle) & np.isfinite(value)
    if known.sum() < 4 or not np.ptp(value[known]):
        return 0.0
    x, y = angle[known] / 90.0, value[known] - value[known].mean()
    basis = np.stack([np.ones_like(x), x, x**2], axis=1)
    left = y - basis @ np.linalg.lstsq(basis, y)[0]
    return float(1 - np.sum(left**2) / np.sum(y**2))


def batch_postures(result: BatchResult) -> Postures:
    """Parameters, modes and errors of a batch."""
    return Postures(result.jobs.name, result.jobs.posture_deg, result.jobs.tool_m, tuple(_of_batch(result)))


def _of_batch(result: BatchResult) -> Iterator[Quantity]:
    p, d, modes = result.parameters, result.dependence, result.modes
    for k in np.flatnonzero(np.isfinite(p.std).any(axis=0)):
        level = tuple(float(one[k]) for one in (d.mean, d.mean_low_95, d.mean_high_95))
        yield Quantity(
            "parameter",
            p.name[k],
            unit(p.unit[k]),
            p.value[:, k],
            p.low_95[:, k],
            p.high_95[:, k],
            (level[0], level[1], level[2]) if np.isfinite(level[0]) else None,
            "weighted mean",
            int(d.trend_joint[k]),
            ~p.usable[:, k],
        )
    yield from _several("frequency", "frequency of mode {}", "Hz", modes.frequency_hz)
    yield from _several("damping", "damping of mode {}", "%", 100 * modes.damping_ratio)
    measured = modes.measured_frequency_hz
    known = np.isfinite(measured).any(axis=0)
    error = np.where(known, 100 * (modes.frequency_hz / measured - 1), np.nan)
    ratio = np.where(known, 100 * (modes.damping_ratio - modes.measured_damping_ratio), np.nan)
    for mode in np.flatnonzero(known):
        yield Quantity("error", f"frequency error of mode {mode + 1}", "%", error[:, mode])
    for mode in np.flatnonzero(known):
        yield Quantity("error", f"damping error of mode {mode + 1}", "points of %", ratio[:, mode])
    jobs = result.jobs
    yield from _several("error", "gap", "", jobs.gap[:, None])
    yield from _several("error", "relative FRF error", "%", 100 * jobs.relative_error[:, None])
    yield from _several("error", "time", "s", jobs.seconds[:, None])


def _several(
    kind: str, name: str, of: str, values: Array, limits: Sequence[Array] = (), items: str = ""
) -> Iterator[Quantity]:
    """A quantity for each column of values (n, k) in which one is known, and of their limits, each (n, k);
    name: with a place for its item, by default its number.
    """
    for column in np.flatnonzero(np.isfinite(values).any(axis=0)):
        item = items[int(column)] if items else column + 1
        low, high = (one[:, column] for one in limits) if limits else (None, None)
        yield Quantity(kind, name.format(item), of, values[:, column], low, high)


def map_postures_of(result: MapResult) -> Postures:
    """Modes and compliance of a map."""
    rows = result.rows
    hz, ratio = (rows.frequency_low_95, rows.frequency_high_95), (rows.damping_low_95, rows.damping_high_95)
    static = np.diagonal(rows.compliance_m_per_n, axis1=1, axis2=2)
    found = (
        *_of_limit(result.limit),
        *_several("frequency", "frequency of mode {}", "Hz", rows.frequency_hz, hz),
        *_several(
            "damping", "damping of mode {}", "%", 100 * rows.damping_ratio, [100 * one for one in ratio]
        ),
        *_of_correction(result.correction),
        *_several("compliance", "largest receptance along {}", "µm/N", 1e6 * rows.peak_m_per_n, (), "xyz"),
        *_several("compliance", "static compliance along {}", "µm/N", 1e6 * static, (), "xyz"),
    )
    return Postures(rows.name, rows.posture_deg, rows.tool_m, found)


_LIMITS = {"depth": ("depth limit", "mm", 1e3), "deflection": ("static deflection", "µm", 1e6)}


def _of_limit(limit: LimitRows | None) -> Iterator[Quantity]:
    """Depths, of the worst feed and of the best where there are several, and deflections; the frequency of
    the first mode is among the modes.
    """
    if limit is None or limit.kind not in _LIMITS:
        return
    name, of, scale = _LIMITS[limit.kind]
    values = [scale * np.minimum(one, limit.most) for one in (limit.value, limit.low_95, limit.high_95)]
    rows = np.arange(len(values[0]))
    worst, best = np.argmin(values[0], axis=1), np.argmax(values[0], axis=1)
    sides = ((worst, " of the worst feed"), (best, " of the best feed"))
    for feed, said in sides if values[0].shape[1] > 1 else ((worst, ""),):
        value, low, high = (one[rows, feed] for one in values)
        yield Quantity("limit", f"{name}{said}", of, value, low, high)


def _of_correction(c: CorrectionRows | None) -> Iterator[Quantity]:
    """Corrected values with what is known of them, of the first mode first; not those that nothing is known
    of.
    """
    if c is None:
        return
    hz, ratio = (c.frequency_low_95, c.frequency_high_95), (100 * c.damping_low_95, 100 * c.damping_high_95)
    kinds = (
        ("frequency", "Hz", c.frequency_hz, hz, c.frequency_known),
        ("damping", "%", 100 * c.damping_ratio, ratio, c.damping_known),
    )
    for mode in range(c.frequency_hz.shape[1]):
        for name, of, value, limits, known in kinds:
            said = f"corrected {name} of mode {mode + 1}"
            one = [values[:, [mode]] for values in (value, *limits)]
            for found in _several("corrected", said, of, one[0], one[1:]):
                yield found
                yield Quantity("known", f"known of the {said}", "%", 100 * known[:, mode])
    peaks = [1e6 * one for one in (c.peak_m_per_n, c.peak_low_95, c.peak_high_95)]
    yield from _several("corrected", "corrected peak along {}", "µm/N", peaks[0], peaks[1:], "xyz")

"""What batches and maps have in common for their pictures: quantities at many postures, and the angles over
which they are shown.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.core.arrays import Array
from identify.reports.kit.cells import unit
from identify.results.batch import BatchResult
from identify.results.map import CorrectionRows, LimitRows, MapResult

_LEAST_SPAN_DEG = 1.0
_AXES = ("x", "y", "z")


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
    faint: NDArray[np.bool_] | None = None

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
    p, d, jobs, modes = result.parameters, result.dependence, result.jobs, result.modes
    for k, name in enumerate(p.name):
        free = np.isfinite(p.std[:, k])
        if free.any():
            level = (
                (float(d.mean[k]), float(d.mean_low_95[k]), float(d.mean_high_95[k]))
                if np.isfinite(d.mean[k])
                else None
            )
            limits = p.low_95[:, k], p.high_95[:, k]
            said, joint = "weighted mean", int(d.trend_joint[k])
            yield Quantity(
                "parameter",
                name,
                unit(p.unit[k]),
                p.value[:, k],
                *limits,
                level,
                said,
                joint,
                ~p.usable[:, k],
            )
    yield from _modes(modes.frequency_hz, modes.damping_ratio)
    frequency = modes.measured_frequency_hz
    shown = np.flatnonzero(np.isfinite(frequency).any(axis=0))
    for mode in shown:
        error = 100 * (modes.frequency_hz[:, mode] / frequency[:, mode] - 1)
        yield Quantity("error", f"frequency error of mode {mode + 1}", "%", error)
    for mode in shown:
        ratio = 100 * (modes.damping_ratio[:, mode] - modes.measured_damping_ratio[:, mode])
        yield Quantity("error", f"damping error of mode {mode + 1}", "points of %", ratio)
    for name, of, values in (
        ("gap", "", jobs.gap),
        ("relative FRF error", "%", 100 * jobs.relative_error),
        ("time", "s", jobs.seconds),
    ):
        if np.isfinite(values).any():
            yield Quantity("error", name, of, values)


def _modes(frequency_hz: Array, ratio: Array, limits: tuple[Array, ...] | None = None) -> Iterator[Quantity]:
    """Frequencies, then damping ratios in per cent; limits: low and high of both."""
    for kind, of, values, sides in (
        ("frequency", "Hz", frequency_hz, (0, 1)),
        ("damping", "%", 100 * ratio, (2, 3)),
    ):
        for mode in range(values.shape[1]):
            scale = 1 if kind == "frequency" else 100
            low, high = (
                (scale * limits[side][:, mode] for side in sides) if limits is not None else (None, None)
            )
            if np.isfinite(values[:, mode]).any():
                yield Quantity(kind, f"{kind} of mode {mode + 1}", of, values[:, mode], low, high)


def map_postures_of(result: MapResult) -> Postures:
    """Modes and compliance of a map."""
    rows = result.rows
    limits = (rows.frequency_low_95, rows.frequency_high_95, rows.damping_low_95, rows.damping_high_95)
    return Postures(
        rows.name,
        rows.posture_deg,
        rows.tool_m,
        (
            *_of_limit(result.limit),
            *_modes(rows.frequency_hz, rows.damping_ratio, limits),
            *_of_correction(result.correction),
            *_of_tool(result),
        ),
    )


_LIMITS = {"depth": ("depth limit", "mm", 1e3), "deflection": ("static deflection", "µm", 1e6)}


def _of_limit(limit: LimitRows | None) -> Iterator[Quantity]:
    """Depths, of the worst feed and of the best where there are several, and deflections; the frequency of
    the first mode is among the modes.
    """
    if limit is None or limit.kind not in _LIMITS:
        return
    name, of, scale = _LIMITS[limit.kind]
    value, low, high = (
        scale * np.minimum(one, limit.most) for one in (limit.value, limit.low_95, limit.high_95)
    )
    rows = np.arange(len(value))
    worst, best = np.argmin(value, axis=1), np.argmax(value, axis=1)
    sides = ((worst, " of the worst feed"), (best, " of the best feed"))
    for feed, said in sides if value.shape[1] > 1 else ((worst, ""),):
        at = rows, feed
        yield Quantity("limit", f"{name}{said}", of, value[at], low[at], high[at])


def _of_correction(c: CorrectionRows | None) -> Iterator[Quantity]:
    """Corrected values with what is known of them, of the first mode first; not those that nothing is known
    of.
    """
    if c is None:
        return
    for mode in range(c.frequency_hz.shape[1]):
        for name, of, scale, values, known in (
            (
                "frequency",
                "Hz",
                1.0,
                (c.frequency_hz, c.frequency_low_95, c.frequency_high_95),
                c.frequency_known,
            ),
            ("damping", "%", 100.0, (c.damping_ratio, c.damping_low_95, c.damping_high_95), c.damping_known),
        ):
            if np.isfinite(values[0][:, mode]).any():
                value, low, high = (scale * one[:, mode] for one in values)
                yield Quantity("corrected", f"corrected {name} of mode {mode + 1}", of, value, low, high)
                share = 100 * known[:, mode]
                yield Quantity("known", f"known of the corrected {name} of mode {mode + 1}", "%", share)
    for k, axis in enumerate(_AXES):
        if np.isfinite(c.peak_m_per_n[:, k]).any():
            value, low, high = (1e6 * one[:, k] for one in (c.peak_m_per_n, c.peak_low_95, c.peak_high_95))
            yield Quantity("corrected", f"corrected peak along {axis}", "µm/N", value, low, high)


def _of_tool(result: MapResult) -> Iterable[Quantity]:
    rows = result.rows
    for k, axis in enumerate(_AXES):
        yield Quantity(
            "compliance", f"largest receptance along {axis}", "µm/N", 1e6 * rows.peak_m_per_n[:, k]
        )
    for k, axis in enumerate(_AXES):
        yield Quantity(
            "compliance", f"static compliance along {axis}", "µm/N", 1e6 * rows.compliance_m_per_n[:, k, k]
        )

"""Which parts of a result a report shows, and what is worked out for showing only: modes, FRFs, the gap by
band and channel.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from identify.core.arrays import Array, Index
from identify.measured.channel import Channel
from identify.results.fit import FrfComparison, MeasurementResult, ModePairs
from identify.results.tables import Geometry

_FEW_MODES = 12
_BANDS = 40
_DRIVE_POINTS, _WORST = 6, 3
_AXES = ("X", "Y", "Z")


@dataclass(frozen=True)
class GapMap:
    """RMS residual per band and FRF: edges_hz (bands + 1,), values (bands, pairs).

    in_noise: values are in units of the noise (1 is perfect); otherwise relative to the RMS of the
    measurement in the band.
    """

    edges_hz: Array
    values: Array
    in_noise: bool


def gap_map(frf: FrfComparison) -> GapMap:
    """The gap of every FRF in at most 40 bands of (nearly) the same number of lines."""
    lines = len(frf.frequency_hz)
    parts = np.array_split(np.arange(lines), min(_BANDS, lines))
    starts = np.array([part[0] for part in parts])
    squares = np.abs(frf.fitted - frf.measured) ** 2
    sizes = np.array([len(part) for part in parts])[:, None]
    if frf.noise is None:
        below = np.add.reduceat(np.abs(frf.measured) ** 2, starts, axis=0)
        values = np.sqrt(np.add.reduceat(squares, starts, axis=0) / np.maximum(below, np.finfo(float).tiny))
    else:
        values = np.sqrt(np.add.reduceat(squares / frf.noise**2, starts, axis=0) / (2 * sizes))
    inner = (frf.frequency_hz[starts[1:]] + frf.frequency_hz[starts[1:] - 1]) / 2
    edges = np.concatenate([frf.frequency_hz[:1], inner, frf.frequency_hz[-1:]])
    return GapMap(edges, values, frf.noise is not None)


def map_order(frf: FrfComparison) -> Index:
    """FRFs by input, then output, numbers as numbers: the rows of the gap map."""
    keys = [(_key(i), _key(o)) for o, i in zip(frf.output, frf.input, strict=True)]
    return np.array(sorted(range(len(keys)), key=keys.__getitem__), dtype=np.intp)


def errors(frf: FrfComparison) -> Array:
    """What FRFs are ranked by, (pairs,): the gap, or the relative error where the noise is not known."""
    return frf.relative_error if frf.gap is None else frf.gap


def worst_first(frf: FrfComparison) -> Index:
    """FRFs by falling error."""
    return np.argsort(-np.nan_to_num(errors(frf), nan=-1.0), kind="stable")


def is_drive_point(frf: FrfComparison, pair: int) -> bool:
    """Whether output and input are the same point and axis."""
    return _key(frf.output[pair])[:2] == _key(frf.input[pair])[:2]


def shown_frfs(frf: FrfComparison) -> list[int]:
    """The FRFs a page has room for: at most six drive points, then the three with the largest error among the
    others.
    """
    drive = [pair for pair in range(len(frf.output)) if is_drive_point(frf, pair)][:_DRIVE_POINTS]
    return drive + [int(pair) for pair in worst_first(frf) if pair not in drive][:_WORST]


def shown_modes(measurement: MeasurementResult) -> int:
    """How many modes are listed: all of a few, otherwise those up to 1.5 times the measured band, the next,
    and all that are paired.
    """
    total, top = len(measurement.modes.frequency_hz), _band_top(measurement)
    if total <= _FEW_MODES:
        return total
    paired = 0 if measurement.pairs is None else int(measurement.pairs.model.max(initial=-1)) + 1
    return min(total, max(int(np.sum(measurement.modes.frequency_hz <= 1.5 * top)) + 1, paired))


def partner(pairs: ModePairs, row: int) -> int | None:
    """The measured mode paired with a mode of the model, or None."""
    found = np.flatnonzero(pairs.model == row)
    return int(pairs.measured[found[0]]) if len(found) else None


def mac_of(pairs: ModePairs, row: int) -> float:
    """MAC of the pair a mode of the model is in, NaN where it is in none or there are no shapes."""
    return float(np.mean(pairs.mac[pairs.model == row])) if np.any(pairs.model == row) else float("nan")


def modes_in_band(measurement: MeasurementResult) -> int:
    """How many modes lie in the measured band, a tenth above it at most; at least one."""
    return max(1, int(np.sum(measurement.modes.frequency_hz <= 1.1 * _band_top(measurement))))


def _band_top(measurement: MeasurementResult) -> float:
    """The highest measured frequency, Hz."""
    tops = [] if measurement.frf is None else [measurement.frf.frequency_hz[-1]]
    tops += [] if measurement.pairs is None else [measurement.pairs.measured_frequency_hz.max(initial=0.0)]
    return float(max(tops, default=np.inf))


def nodes(channels: Sequence[str]) -> list[int]:
    """The nodes of channels such as `12:+Z`, each once."""
    return sorted({_key(channel)[0] for channel in channels})


def ways(g: Geometry, channels: Sequence[str]) -> dict[str, tuple[int, Array]]:
    """The direction of every translational channel in the base's axes as (row of its point, unit vector
    (3,)).

    Empty where the axes of the points were not kept; channels of nodes without a place are left out.
    """
    if g.axes is None:
        return {}
    rows, found = {int(node): row for row, node in enumerate(g.nodes)}, {}
    for channel in channels:
        node, axis, sign = _key(channel)
        if node in rows and axis in _AXES:
            found[channel] = (
                rows[node],
                (-1.0 if sign == "-" else 1.0) * g.axes[rows[node], _AXES.index(axis)],
            )
    return found


def _key(channel: str) -> tuple[int, str, str]:
    """Node, axis and sign of `12:+Z` or `joint2:motor`, for ordering and comparing."""
    axis = channel.partition(":")[2]
    return Channel.parse(channel).node, axis.lstrip("+-"), axis[:1]

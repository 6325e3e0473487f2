"""What the map does not know: its model corrected by what was measured, as far as that reaches."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from identify.core.arrays import Array, Complex
from identify.core.errors import InputError
from identify.map.posture_map import Looked, peak_lines
from identify.map.process import Learned, Seen, learn
from identify.map.residuals import (
    Observed,
    Source,
    by_steps,
    coordinates_of,
    mode_slopes,
    observed,
    shapes_of,
)
from identify.model.system import System
from identify.results.discovery import fit_of
from identify.results.map import CorrectionRows, Learnt, LeftOutTable, PostureRows, ProcessTable
from identify.robot.points import Point
from identify.vibration.fitted_model import FittedModel, fitted_model

Four = tuple[Array, Array, Array, Array]
OWN = 0
"""The number of the robot that is mapped; others of its type follow."""


@dataclass(frozen=True)
class Unknown:
    """What was observed of the models of some robots, and learned of it, by quantity; names: of the
    coordinates that shapes are compared by.
    """

    seen: Mapping[str, Observed]
    learned: Mapping[str, Learned]
    names: Sequence[str]


def hit_node(model: FittedModel, point: Point) -> int | None:
    """The node of a point, if it is one of those that were measured."""
    own = model.points.get(point.node)
    same = own is not None and own.link == point.link and np.array_equal(own.position, point.position)
    return point.node if same else None


def unknown(files: Sequence[str], node: int | None) -> Unknown | None:
    """From the measurements of results, of the robot first, then of others of its type; node: of the point
    that is looked at.  None where nothing has modes or direct FRFs of the point.

    Raises InputError for a file that is no fit or named twice, or of a robot with another number of joints.
    """
    twice = next((file for n, file in enumerate(files) if file in files[:n]), None)
    if twice is not None:
        raise InputError(twice, "named twice", "another robot of the type", "leave one out")
    fits = [fit_of(Path(file)) for file in files]
    models = [fitted_model(fit, file) for fit, file in zip(fits, files, strict=True)]
    joints = [len(model.posture) for model in models]
    for file, own in zip(files, joints, strict=True):
        if own != joints[OWN]:
            raise InputError(file, f"a robot of {own} joints", f"one of {joints[OWN]}, as the robot has")
    points = [None if node is None else model.points.get(node) for model in models]
    sources = [Source(*one) for one in zip(fits, models, points, range(len(files)), strict=True)]
    return learned_of(sources)


def learned_of(sources: Sequence[Source]) -> Unknown | None:
    """The same from results and their models."""
    names = coordinates_of([source.model for source in sources])
    seen = observed(sources, names)
    if not seen:
        return None
    return Unknown(seen, {one: learn(some.seen, some.error) for one, some in seen.items()}, names)


def corrected(
    what: Unknown, model: FittedModel, systems: Sequence[System], looked: Sequence[Looked], rows: PostureRows
) -> CorrectionRows:
    """The map of a point corrected; rows: what it has of its postures, at which systems are and were looked
    at.
    """
    count, shown = rows.frequency_hz.shape
    shapes = np.zeros((count, shown, len(what.names)), dtype=complex)
    slopes = np.zeros((2, count, shown, len(model.values)))
    for row, (system, at) in enumerate(zip(systems, looked, strict=True)):
        stiffness = system.matrices(model.values)[2]
        own = shapes_of(system, stiffness, at.modes, what.names)[:shown]
        shapes[row, : len(own)] = own
        slopes[:, row, : len(own)] = [slope[:shown] for slope in mode_slopes(model, system, at.modes)]
    peaks = by_steps(model, np.array([at.peak_slope for at in looked]))
    return CorrectionRows(
        *_moved(what, "frequency", rows, (rows.frequency_hz, rows.frequency_high_95), shapes, slopes[0]),
        *_moved(what, "damping", rows, (rows.damping_ratio, rows.damping_high_95), shapes, slopes[1]),
        *_peaks(what, rows, peaks),
    )


def _peaks(what: Unknown, rows: PostureRows, slopes: Array) -> Four:
    """Of the direct receptances along the axes of the base, with slopes (n, 3, p)."""
    diagonal = range(3)
    line = peak_lines(rows.receptance_m_per_n)
    half = np.take_along_axis(rows.band_95[:, :, diagonal, diagonal], line[:, None], axis=1)[:, 0]
    axes = np.broadcast_to(np.eye(3, dtype=complex), (len(rows.name), 3, 3))
    return _moved(what, "peak", rows, (rows.peak_m_per_n, rows.peak_m_per_n + half), axes, slopes)


def _moved(
    what: Unknown,
    quantity: str,
    rows: PostureRows,
    sides: tuple[Array, Array],
    shapes: Complex,
    slopes: Array,
) -> Four:
    """Corrected values (n, k), their 95 % limits, and what share of the variance before any data is gone;
    sides: values and upper limits that the fit leaves, (n, k) each; slopes (n, k, p).
    """
    value, upper = sides
    found = np.full((4, *value.shape), np.nan)
    learned = what.learned.get(quantity)
    there = np.isfinite(value) & (value > 0)
    if learned is not None and there.any():
        row, _ = np.nonzero(there)
        moves, own = slopes[there] @ what.seen[quantity].moves, np.log(upper[there] / value[there])
        absorbed = np.zeros((len(row), learned.seen.absorbed.shape[1]))
        absorbed[:, : moves.shape[1]] = moves
        postures = np.deg2rad(rows.posture_deg[row])
        places = Seen(postures, shapes[there], np.full(len(row), OWN), absorbed)
        mean, low, high, known = learned.at(places)
        below, above = (np.hypot(own, np.abs(side - mean)) for side in (low, high))
        found[:, there] = [*(value[there] * np.exp([mean, mean - below, mean + above])), known]
    return found[0], found[1], found[2], found[3]


def learnt_of(what: Unknown, like: Sequence[Path]) -> Learnt:
    """What a map says of what it learned."""
    return Learnt(process_table(what), left_out(what), tuple(one.name for one in like))


def process_table(what: Unknown) -> ProcessTable:
    """What was learned of each quantity, and of how much."""
    learned = what.learned.values()
    return ProcessTable(
        quantity=tuple(what.learned),
        numbers=np.array([len(one.y) for one in learned]),
        postures=np.array([len(np.unique(one.seen.posture, axis=0)) for one in learned]),
        log_odds=np.array([one.log_odds for one in learned]),
        amplitude=np.array([one.mean_of("amplitude") for one in learned]),
        length_deg=np.rad2deg([one.mean_of("length") for one in learned]),
        shared=np.array([one.mean_of("shared") for one in learned]),
        scatter=np.array([one.mean_of("scatter") for one in learned]),
    )


def left_out(what: Unknown) -> LeftOutTable:
    """What was measured on the robot itself, each posture predicted from all others alone."""
    columns: list[tuple[str, str, int, float, float, float, float, float]] = []
    for quantity, one in what.seen.items():
        own = one.seen.robot == OWN
        places = one.seen.posture
        for posture in map(np.array, dict.fromkeys(map(tuple, places[own].tolist()))):
            gone = own & np.all(places == posture, axis=1)
            if gone.all():
                continue
            learned = learn(one.seen.rows(~gone), one.error[~gone])
            mean, low, high, _ = learned.at(one.seen.rows(gone))
            for row, moved in zip(np.flatnonzero(gone), np.exp([mean, low, high]).T, strict=True):
                told = one.measurement[row], quantity, one.item[row]
                columns.append(
                    (*told, float(one.measured[row]), float(one.model[row]), *(one.model[row] * moved))
                )
    table = list(zip(*columns, strict=True)) or [()] * 8
    numbers = (np.array(column, dtype=float) for column in table[3:])
    return LeftOutTable(tuple(table[0]), tuple(table[1]), np.array(table[2], dtype=int), *numbers)
